#include "measures/step_time.h"

#include <cassert>
#include <cmath>

namespace assay {
namespace {

// The mean over the windows of the median over `rounds`.
double run_mean(const std::vector<double>& weights, const std::vector<const std::vector<double>*>& rounds) {
  double sum = 0;
  std::vector<double> times(rounds.size());
  for (size_t window = 0; window < weights.size(); ++window) {
    for (size_t i = 0; i < rounds.size(); ++i) times[i] = rounds[i]->at(window);
    sum += weights[window] * median(times);
  }
  return sum;
}

}  // namespace

std::map<double, double> process_step_times(const TimedRounds& timed) {
  assert(timed.rounds.size() == timed.processes.size());
  std::map<double, std::vector<const std::vector<double>*>> rounds;
  for (size_t i = 0; i < timed.rounds.size(); ++i) rounds[timed.processes[i]].push_back(&timed.rounds[i]);
  std::map<double, double> found;
  for (const auto& [process, of] : rounds) found[process] = run_mean(timed.weights, of);
  return found;
}

std::map<double, double> independent_step_times(const TimedRounds& timed) {
  std::map<double, double> found = process_step_times(timed);
  if (found.size() > 1) return found;
  found.clear();
  for (size_t round = 0; round < timed.rounds.size(); ++round) {
    found[static_cast<double>(round)] = run_mean(timed.weights, {&timed.rounds[round]});
  }
  return found;
}

Interval step_time(const TimedRounds& timed) {
  assert(!timed.rounds.empty());
  std::vector<double> logs, times;
  for (const auto& [number, time] : independent_step_times(timed)) logs.push_back(std::log(time));
  for (const auto& [process, time] : process_step_times(timed)) times.push_back(time);
  const double value = mean(times);
  const Interval found = t_interval(logs);
  return {value, value * std::exp(found.low - found.value), value * std::exp(found.high - found.value)};
}

std::optional<Interval> step_time_ratio(const TimedRounds& of, const TimedRounds& to) {
  if (of.weights != to.weights) return std::nullopt;
  const std::map<double, double> times = independent_step_times(of), others = independent_step_times(to);
  std::vector<double> logs;
  for (const auto& [number, time] : times) {
    const auto other = others.find(number);
    if (other != others.end() && time > 0 && other->second > 0) logs.push_back(std::log(time / other->second));
  }
  if (logs.empty()) return std::nullopt;
  const Interval found = t_interval(logs);
  return Interval{std::exp(found.value), std::exp(found.low), std::exp(found.high)};
}

}  // namespace assay
