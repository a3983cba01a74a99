#include "measures/agreement.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "measures/accuracy.h"
#include "measures/measure.h"
#include "measures/statistics.h"

namespace assay {

std::vector<double> distances(const std::vector<State>& a, const std::vector<State>& b) {
  std::vector<double> found;
  const size_t count = std::min(a.size(), b.size());
  found.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    assert(std::abs(a[i].time - b[i].time) <= 1e-6 * std::max(1.0, std::abs(a[i].time)));
    found.push_back(position_error(a[i], b[i]));
  }
  return found;
}

std::optional<double> parting_time(const std::vector<double>& time_s, const std::vector<double>& distance_m,
                                   double parted_m) {
  assert(time_s.size() >= distance_m.size() && parted_m > 0);
  for (size_t i = 0; i < distance_m.size(); ++i) {
    if (distance_m[i] <= parted_m) continue;
    if (i == 0) return 0;
    const double before = distance_m[i - 1], after = distance_m[i];
    // Runs that are bit-equal until now have no logarithm: the separation is put at the end of this interval.
    const double share = before > 0 ? std::log(parted_m / before) / std::log(after / before) : 1;
    return time_s[i - 1] + share * (time_s[i] - time_s[i - 1]) - time_s[0];
  }
  return std::nullopt;
}

namespace {

// Medians over the other contenders, and the curves of all pairs, with enough samples for a plot.
Measured agreement_values(const ComparedRuns& runs) {
  std::vector<double> time;
  time.reserve(runs.own.size());
  for (const State& state : runs.own) time.push_back(state.time);
  const double duration_s = time.back() - time.front();
  constexpr size_t kMostSamples = 64;
  const size_t stride = (time.size() + kMostSamples - 1) / kMostSamples;
  const auto thinned = [&](const std::vector<double>& series) {
    std::vector<double> kept;
    kept.reserve(kMostSamples);
    for (size_t i = 0; i < series.size(); i += stride) kept.push_back(series[i]);
    return kept;
  };
  Measured measured;
  std::vector<double> at_end, parted;
  for (const ComparedRuns::Other& other : runs.others) {
    const std::vector<double> apart = distances(runs.own, other.states);
    at_end.push_back(apart.back());
    parted.push_back(parting_time(time, apart).value_or(duration_s));
    measured.samples.push_back({"distance_m " + other.contender, thinned(apart)});
    measured.samples.push_back({"parting_time_s " + other.contender, {parted.back()}});
  }
  if (!at_end.empty()) {
    measured.samples.push_back({"time_s", thinned(time)});
    measured.values = {{"agreement", "m", median(at_end)}, {"parting_time", "s", median(parted)}};
  }
  return measured;
}

}  // namespace

Measure agreement_measure() {
  using namespace rows;
  return {.name = "agreement",
          .reads = Reads::kFineRuns,
          .values = {{"agreement", "m", "Distance from the others", "distance from the others", kNone, kNo, kNo,
                      "median distance from the other contenders' fine-step runs at the end of the run", 6},
                     {"parting_time", "s", "Separation time", "separation time", kHigh, kNo, kNo,
                      "median time up to which the other contenders' fine-step runs stay within 1 mm", 6}},
          .of_fine_runs = agreement_values};
}

}  // namespace assay
