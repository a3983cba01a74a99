// Values and samples as they are stored, and what may be said of a value and done with it.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace assay {

// One figure of a cell. `low` and `high` bound the 95 % interval where there is one. All are finite.
struct Value {
  std::string name;  // "consistency"
  std::string unit;  // "m"; "1" for ratios
  std::optional<double> value;
  std::optional<double> low = {}, high = {};
};

// Raw samples of one kind, in the order in which they were taken (round by round, piece by piece).
struct SampleSeries {
  std::string name;  // "step_time_us", "steal", "piece_error_m"
  std::vector<double> values;
};

enum class Better { kLow, kHigh, kNone };

// What runs from several initial states have together.
enum class OverStates {
  kMean,       // the mean; no value where a run diverged
  kMeanOfAll,  // the mean of the states that have one, whatever became of the others
  kShare,      // of values that are 0 or 1: the share of 1, as a probability
  kLeast
};

struct ValueInfo {
  std::string name;   // as stored: "truth_error"
  std::string unit;   // as stored: "m"; "1" for ratios
  std::string label;  // on axes and in tables: "Error against the reference solution"
  std::string brief;  // in a sentence, where room is short: "error"
  Better better = Better::kNone;
  bool plot = false;   // can be the error axis of a plot
  bool limit = false;  // an error: can be limited from above
  std::string meaning;
  int place = 100;  // in lists, the smaller first; rows of one place in the order of measures
  OverStates over_states = OverStates::kMean;
  std::string measure = {};  // whose cells hold it: filled in by measures()
};

// Short names for rows of measures.
namespace rows {
using enum Better;
using enum OverStates;
inline constexpr bool kPlot = true, kLimit = true, kNo = false;
}  // namespace rows

}  // namespace assay
