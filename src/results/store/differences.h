// In what two results directories differ besides their figures: what was measured, with which program, on which
// machine.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "results/store/store.h"

namespace assay {

enum class DifferenceKind {
  kProgram,   // assay itself: version, commit, compiler, flags
  kMachine,   // processor, cores, kernel, or which nodes measured
  kModel,     // a system's model
  kMethod,    // how it is measured: duration, pieces, timing, seed
  kSettings,  // a contender's settings
  kBuild,     // a contender's engine: version or plugin
  kCoverage,  // a system or contender that one of them lacks
};

struct Difference {
  DifferenceKind kind = DifferenceKind::kProgram;
  std::string subject;  // the system or contender; "" for the whole
  std::string what;     // "the model of 'humanoid'"
  std::string a, b;     // what each has, "" for nothing

  // "the model of 'humanoid' is 0123 in 'A' and 4567 in 'B'"
  std::string text(const std::string& dir_a, const std::string& dir_b) const;
};

// What tells two directories apart, read once: one may be compared with many.
struct Description {
  std::string dir;
  std::vector<ManifestEntry> manifest;
  std::vector<SystemRow> systems;
  std::vector<ContenderRow> contenders;

  std::string fact(std::string_view key) const;  // of the manifest, "" for none
};

Description describe(const Store& store);

// By kind in the order above, then as listed.
std::vector<Difference> differences(const Store& a, const Store& b);
std::vector<Difference> differences(const Description& a, const Description& b);

// The machine's facts as stored: those of its nodes ("name (cpu, 2 cores)"), else those of the manifest; sorted.
std::vector<std::string> machines(const Store& store);

}  // namespace assay
