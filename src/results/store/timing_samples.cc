#include "results/store/timing_samples.h"

#include <algorithm>
#include <numeric>

namespace assay {
namespace {

const std::vector<double>* series_of(const std::vector<SampleSeries>& samples, std::string_view name) {
  const auto found = std::ranges::find(samples, name, &SampleSeries::name);
  return found == samples.end() ? nullptr : &found->values;
}

}  // namespace

std::vector<SampleSeries> timing_samples(const std::vector<TimingWindow>& windows,
                                         const std::vector<std::vector<double>>& rounds,
                                         const std::vector<RoundFacts>& facts) {
  SampleSeries times = {"window_step_time_us", {}}, begins = {"window_begin_s", {}}, steps = {"window_steps", {}},
               weights = {"window_weight", {}}, means = {"round_step_time_us", {}}, processes = {"process", {}},
               steal = {"steal", {}}, cpu = {"cpu_share", {}}, switches = {"switches", {}};
  for (const TimingWindow& window : windows) {
    begins.values.push_back(window.begin_s);
    steps.values.push_back(static_cast<double>(window.steps));
    weights.values.push_back(window.weight);
  }
  for (const std::vector<double>& round : rounds) {
    times.values.insert(times.values.end(), round.begin(), round.end());
    means.values.push_back(std::inner_product(round.begin(), round.end(), weights.values.begin(), 0.0));
  }
  for (const RoundFacts& round : facts) {
    processes.values.push_back(round.process);
    steal.values.push_back(round.steal);
    cpu.values.push_back(round.cpu_share);
    switches.values.push_back(round.switches);
  }
  return {times, begins, steps, weights, means, processes, steal, cpu, switches};
}

std::optional<TimedRounds> timed_rounds(const std::vector<SampleSeries>& samples) {
  const std::vector<double>*times = series_of(samples, "window_step_time_us"),
        *weights = series_of(samples, "window_weight"), *processes = series_of(samples, "process");
  if (times == nullptr || weights == nullptr || processes == nullptr || weights->empty() || processes->empty() ||
      times->size() != weights->size() * processes->size()) {
    return std::nullopt;
  }
  TimedRounds found = {*weights, {}, *processes};
  for (auto at = times->begin(); at != times->end(); at += std::ssize(*weights)) {
    found.rounds.emplace_back(at, at + std::ssize(*weights));
  }
  return found;
}

}  // namespace assay
