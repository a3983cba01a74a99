// The raw samples of a timing cell: what the store calls them, and back.
#pragma once

#include <optional>
#include <vector>

#include "measures/step_time.h"
#include "measures/windows.h"
#include "results/store/store.h"

namespace assay {

// One round that counts.
struct RoundFacts {
  double process = 0;
  double steal = 0;      // share of the pinned core's time that the host took
  double cpu_share = 0;  // processor time over wall time of the turn
  double switches = 0;   // involuntary context switches in the turn
};

// Series: "window_step_time_us" (round by round, in each the windows), "window_begin_s", "window_steps",
// "window_weight" (one a window), "round_step_time_us" (the weighted mean over the windows), "process", "steal",
// "cpu_share", "switches" (one a round).
std::vector<SampleSeries> timing_samples(const std::vector<TimingWindow>& windows,
                                         const std::vector<std::vector<double>>& rounds,
                                         const std::vector<RoundFacts>& facts);

// Empty for samples of version 0.1, which do not say from which part of the run they are.
std::optional<TimedRounds> timed_rounds(const std::vector<SampleSeries>& samples);

}  // namespace assay
