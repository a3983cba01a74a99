// The time of a contender's step: the mean over a run, from rounds in which it stepped the same windows of that run.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "measures/statistics.h"

namespace assay {

struct TimedRounds {
  std::vector<double> weights;              // of the windows; their sum is 1
  std::vector<std::vector<double>> rounds;  // of each round, the time of a step in each window, us
  std::vector<double> processes;            // of each round, the number of the process that measured it
};

// Of each process: the mean over the windows, by their weights, of the median over its rounds. The time of a run is a
// sum over its steps, so only a mean over the run is a throughput; the median removes disturbances of single rounds.
std::map<double, double> process_step_times(const TimedRounds& timed);

// The same by process; with one process its rounds take the place of processes.
std::map<double, double> independent_step_times(const TimedRounds& timed);

// The mean over processes, with a 95 % t-interval, of their logarithms so that it stays positive: a process keeps its
// place in memory, and with it its speed, for life, so rounds of one process are no independent samples. Fewer than
// two independent times give no interval: both ends are NaN.
Interval step_time(const TimedRounds& timed);

// The time of `of` over that of `to`: the geometric mean of the ratios of processes with the same number, which
// measured in the same rounds, with its t-interval. Empty when they have no process in common, or not the same windows.
std::optional<Interval> step_time_ratio(const TimedRounds& of, const TimedRounds& to);

}  // namespace assay
