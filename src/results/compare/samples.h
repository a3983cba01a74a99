// Cells by name, and the independent samples of a time. Internal to src/compare.
#pragma once

#include <algorithm>
#include <initializer_list>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "measures/statistics.h"
#include "measures/step_time.h"
#include "results/store/store.h"
#include "results/store/timing_samples.h"

namespace assay {

using CellName = std::tuple<std::string, std::string, std::string, double>;  // system, contender, measure, timestep

inline CellName name_of(const Cell& cell) { return {cell.system, cell.contender, cell.measure, cell.timestep_ms}; }

struct TimeSamples {
  std::map<double, double> times;  // by process, or by round where there is one process
  bool rounds = false;
};

inline const std::vector<double>* series_named(const std::vector<SampleSeries>& samples, std::string_view name) {
  const auto found = std::ranges::find(samples, name, &SampleSeries::name);
  return found == samples.end() || found->values.empty() ? nullptr : &found->values;
}

// Samples of version 0.1, which do not say from which part of the run they are: each process's median over its rounds.
inline TimeSamples old_time_samples(const std::vector<SampleSeries>& samples) {
  TimeSamples found;
  const auto* rounds = series_named(samples, "round_step_time_us");
  const auto* processes = series_named(samples, "process");
  if (rounds == nullptr) return found;
  std::map<double, std::vector<double>> of_process;
  for (size_t i = 0; processes != nullptr && i < std::min(rounds->size(), processes->size()); ++i) {
    of_process[(*processes)[i]].push_back((*rounds)[i]);
  }
  found.rounds = of_process.size() < 2;
  for (const auto& [process, times] : of_process) found.times[process] = median(times);
  if (!found.rounds) return found;
  found.times.clear();
  for (size_t i = 0; i < rounds->size(); ++i) found.times[static_cast<double>(i)] = (*rounds)[i];
  return found;
}

// Of a timing cell: what its step time is the mean of (measures/step_time.h); of a cell of scaling: its runs; of
// many worlds: its rounds. Empty
// without samples.
inline TimeSamples time_samples(const std::vector<SampleSeries>& samples) {
  TimeSamples found;
  if (const auto* runs = series_named(samples, "run_time_s")) {
    found.rounds = true;
    for (size_t i = 0; i < runs->size(); ++i) found.times[static_cast<double>(i)] = (*runs)[i];
    return found;
  }
  if (const auto* rounds = series_named(samples, "batch_step_time_us")) {
    found.rounds = true;
    for (size_t i = 0; i < rounds->size(); ++i) found.times[static_cast<double>(i)] = (*rounds)[i];
    return found;
  }
  const auto timed = timed_rounds(samples);
  if (!timed) return old_time_samples(samples);
  found.times = independent_step_times(*timed);
  found.rounds = std::set<double>(timed->processes.begin(), timed->processes.end()).size() < 2;
  return found;
}

// Whether both time the same parts of the run; windows of different parts do not compare.
inline bool same_windows(const std::vector<SampleSeries>& a, const std::vector<SampleSeries>& b) {
  return std::ranges::all_of(std::initializer_list<std::string_view>{"window_begin_s", "window_steps", "window_weight"},
                             [&](std::string_view name) {
                               const auto *in_a = series_named(a, name), *in_b = series_named(b, name);
                               return in_a == nullptr || in_b == nullptr ? in_a == in_b : *in_a == *in_b;
                             });
}

}  // namespace assay
