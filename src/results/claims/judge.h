// Between the files of judge(): what a test of a claim finds.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "results/claims/claims.h"
#include "results/claims/ratios.h"
#include "results/results.h"

namespace assay {

// In this order `and` is the least and `or` the largest of several. Unsettled: the interval spans the threshold.
enum class Truth { kNo, kUnsettled, kUnknown, kYes };

// "before: part; part after", so that tests that ask the same of several systems make one sentence.
struct Sentence {
  std::string before, after;
  std::vector<std::string> parts;
};

// What a part of a claim found, as a reader would say it.
struct Now {
  Truth truth = Truth::kUnknown;
  double margin = 1;      // how far the figure is from its threshold, as a factor: the least one is told
  std::string text;       // "PhysX is 2.31 times faster than ODE on capsules-27"
  std::string threshold;  // "above 1"
};

struct Tested {
  Truth truth = Truth::kUnknown;
  std::vector<Sentence> summary, today;
  std::vector<std::string> keys, reasons;
  std::vector<ClaimFigure> figures;
  std::vector<Now> now;
};

// Whether a figure is as a bound demands: never unknown.
Truth judged(const ClaimBound& bound, const Interval& value);

// How far a figure is from the nearest end of a bound, as a factor of at least 1.
double margin_to(const ClaimBound& bound, double value);

// What is judged by.
struct Evidence {
  const ClaimsFile& file;
  const Results& results;
  const Ratios& ratios;

  // Today's contenders of an engine of the paper; the file has it (assert).
  const std::vector<std::string>& stand_ins(const std::string& engine) const;
};

// Two engines compared: tests at one timestep and at equal speed.
Tested test_pairs(const Evidence& evidence, const ClaimTest& test);
// Engines by themselves: a value, or its slope over the timestep.
Tested test_values(const Evidence& evidence, const ClaimTest& test);
// At which timesteps engines run well: who goes unstable, and the largest that holds.
Tested test_unstable(const Evidence& evidence, const ClaimTest& test);
Tested test_largest_step(const Evidence& evidence, const ClaimTest& test);
Tested test_order(const Evidence& evidence, const ClaimTest& test);

// The first that no other is better than; there has to be one.
template <typename T, typename Better>
T best_of(std::vector<T> all, const Better& better) {
  size_t best = 0;
  for (size_t i = 1; i < all.size(); ++i) {
    if (better(all[i], all[best])) best = i;
  }
  return std::move(all[best]);
}

}  // namespace assay
