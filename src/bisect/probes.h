// Small scenes of one mechanism each, compared between two releases: what of the engine changed, whatever the robot. An
// engine can bring a program of its own that speaks to the release directly (src/engines/NAME/probes.cc); for others
// the figures of the conformance suite say it, through the ordinary adapter.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "controls/changes/swaps.h"

namespace assay {

struct ProbeValue {
  std::string probe, condition, quantity, unit;  // "contact pairs", "box and mesh", "contacts", "1"
  double value = 0;
  double least = 0;  // a smaller change says nothing, in `unit`; 0: all beyond rounding do
};

struct ProbeRun {
  std::vector<ProbeValue> values;
  std::string failure;  // in words; "" where there is none
};

// Whether the release whose plugin is given has a program of probes.
bool has_probe_program(const std::string& plugin);

// Runs that program in a process of its own, for at most `limit_s`.
ProbeRun run_probes(const std::string& plugin, double limit_s);

// The tests of the conformance suite (conformance/conformance.h) that stand for one mechanism each and take a moment.
std::span<const char* const> suite_probes();

// Runs these with the contender and the settings of `side`, `jobs` processes at a time, and calls `progress` after
// each. A value for each figure, of which a hundredth of the test's tolerance counts, and one that says whether the
// test passed, if only within a declared deviation. A contender without the capability has none.
ProbeRun run_suite_probes(const Side& side, int jobs, const std::function<void(size_t done, size_t of)>& progress);

struct ProbeChange {
  ProbeValue before;
  double after = 0;
};

// Values that differ by more than ProbeValue::least and by more than rounding: 1e-9 of the larger one, or 1e-12 where
// both are small.
std::vector<ProbeChange> probe_changes(const std::vector<ProbeValue>& before, const std::vector<ProbeValue>& after);

// "contact pairs (box and mesh): contacts 4 to 5", "free flight (implicitfast): ... 0.485 to 2e-13".
std::string probe_change_text(const ProbeChange& change);

}  // namespace assay
