// The independent samples of a time. Internal to src/compare.
#pragma once

#include <algorithm>
#include <map>
#include <string_view>
#include <vector>

#include "measures/statistics.h"
#include "store/store.h"

namespace assay {

struct TimeSamples {
  std::map<double, double> times;  // by process, or by round where there is one process
  bool rounds = false;
};

inline const std::vector<double>* series_named(const std::vector<SampleSeries>& samples, std::string_view name) {
  const auto found = std::ranges::find(samples, name, &SampleSeries::name);
  return found == samples.end() || found->values.empty() ? nullptr : &found->values;
}

// Of a timing cell: each process's median over its rounds; of a cell of scaling: its runs. Empty without samples.
inline TimeSamples time_samples(const std::vector<SampleSeries>& samples) {
  TimeSamples found;
  const auto add_all = [&](const std::vector<double>& times) {
    found.rounds = true;
    for (size_t i = 0; i < times.size(); ++i) found.times[static_cast<double>(i)] = times[i];
  };
  if (const auto* runs = series_named(samples, "run_time_s")) {
    add_all(*runs);
    return found;
  }
  const auto* rounds = series_named(samples, "round_step_time_us");
  const auto* processes = series_named(samples, "process");
  if (rounds == nullptr) return found;
  std::map<double, std::vector<double>> of_process;
  for (size_t i = 0; processes != nullptr && i < std::min(rounds->size(), processes->size()); ++i) {
    of_process[(*processes)[i]].push_back((*rounds)[i]);
  }
  if (of_process.size() < 2) {
    add_all(*rounds);
    return found;
  }
  for (const auto& [process, times] : of_process) found.times[process] = median(times);
  return found;
}

}  // namespace assay
