// Why two contenders part on one robot: swaps of conventions, ranked by the share of the gap that they close, and the
// advice that follows, checked by the gap that it leaves. docs/guide.md has the definitions.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "controls/changes/swaps.h"
#include "measures/gap.h"

namespace assay {

// One side's runs from the pair's starts.
struct RunSet {
  std::vector<Track> tracks;        // by start; shorter than the others where the run ended early
  std::optional<double> fall_rate;  // under a policy that says when the robot has fallen
  // Under a policy with commands, means over the runs while the robot is up (measures/transfer.h).
  std::optional<double> velocity_error, turning_error;  // m/s, rad/s
  std::string failure;                                  // why there is no run at all; "" where there are
  std::string early;                                    // how runs ended before their time; "" where none did
};

// Makes runs of several sides, each from the starts 0 to `starts` - 1, of which equal numbers mean equal states.
using MakeRuns = std::function<std::vector<RunSet>(const std::vector<Side>& sides, int starts)>;

struct ExplainOptions {
  int starts = 10;
  size_t samples = 0;    // of a whole run, the initial one among them; at least 2
  double tolerance = 0;  // m: gaps up to this are rounding
  std::vector<KnownDeviation> known = {};
  std::uint64_t seed = 1;  // of the bootstrap
};

// What one swap does to the pair.
struct SwapResult {
  Swap swap;
  Interval gap;    // m, of the changed pair
  Interval share;  // of the gap that it closes; negative: it widens the gap
  int starts = 0;  // from which it was measured: fewer for one of many that shows nothing
  std::optional<double> fall_rate_a, fall_rate_b;
  std::string failure;  // why it could not be measured, "" otherwise

  bool closes() const { return failure.empty() && share.low > 0 && share.value >= kLeastShare; }
  static constexpr double kLeastShare = 0.02;
};

// A swap that is part of the advice.
struct AdviceStep {
  size_t result = 0;  // index into Explanation::causes
  Interval share;     // of the whole gap, that is closed with this and the steps before it
};

enum class GapVerdict {
  kNoDifference,   // the gap is rounding
  kTimestepAlone,  // the gap is within the timestep's own error and shrinks with it
  kExplained,      // the advice leaves at most a tenth of it
  kPartlyExplained,
  kUnexplained,
};
// "no difference", "no difference beyond the timestep", "explained", "partly explained", "unexplained".
std::string gap_verdict_text(GapVerdict verdict);

struct Explanation {
  GapVerdict verdict = GapVerdict::kNoDifference;
  std::vector<double> gaps;  // m, by start
  Interval gap;              // m, their mean
  int parted = 0;            // of the starts: whose runs part (kFarMetres)
  double timestep_gap = 0;   // m: mean gap of a side to itself at half the timestep, the larger of the two
  std::optional<double> fall_rate_a, fall_rate_b;
  std::string early_a, early_b;    // how runs of the pair ended before their time; "" where none did
  std::vector<SwapResult> causes;  // swaps with advice, the largest share first
  std::vector<SwapResult> where;   // swaps without
  // Of the known deviations those of what the gap comes from: a swap of their cause closes most of it.
  std::vector<KnownDeviation> concerned;
  std::optional<bool> wrong_is_b;  // where one side has such and the other has none
  std::vector<AdviceStep> advice;  // in the order in which they were added
  Interval remaining;              // m, with all of the advice
};

// `swaps` is asked where there is a gap. No advice changes the side that is right towards one that is known to be
// wrong. Throws EngineError when one of the two cannot run at all.
Explanation explain(const Pairing& pairing, const std::function<std::vector<Swap>()>& swaps, const MakeRuns& run,
                    const ExplainOptions& options);

}  // namespace assay
