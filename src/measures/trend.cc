#include "measures/trend.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <random>
#include <vector>

namespace assay {
namespace {

constexpr size_t kFewestSamples = 8;
constexpr size_t kMostSamples = 256;  // all pairs of them are compared
constexpr int kTrendResamples = 400;

// The middle of slopes between all pairs. `slopes` is a buffer.
double slope_of_pairs(std::span<const double> time, std::span<const double> values, std::vector<double>& slopes) {
  slopes.clear();
  for (size_t i = 0; i < time.size(); ++i) {
    for (size_t j = i + 1; j < time.size(); ++j) slopes.push_back((values[j] - values[i]) / (time[j] - time[i]));
  }
  const auto half = slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() / 2);
  std::ranges::nth_element(slopes, half);
  if (slopes.size() % 2 == 1) return *half;
  return 0.5 * (*half + *std::max_element(slopes.begin(), half));
}

}  // namespace

std::optional<Interval> robust_slope(std::span<const double> time_s, std::span<const double> values,
                                     std::uint64_t seed) {
  assert(time_s.size() == values.size());
  if (values.size() < kFewestSamples) return std::nullopt;
  const size_t count = std::min(values.size(), kMostSamples);
  std::vector<double> time(count), series(count);
  for (size_t i = 0; i < count; ++i) {
    const size_t at = i * (values.size() - 1) / (count - 1);
    time[i] = time_s[at];
    series[i] = values[at];
    if (!std::isfinite(time[i]) || !std::isfinite(series[i]) || (i > 0 && time[i] <= time[i - 1])) return std::nullopt;
  }
  std::vector<double> buffer;
  buffer.reserve(count * (count - 1) / 2);
  const double slope = slope_of_pairs(time, series, buffer);
  std::vector<double> residual(count);
  for (size_t i = 0; i < count; ++i) residual[i] = series[i] - slope * time[i];
  const auto block = static_cast<size_t>(std::ceil(std::sqrt(static_cast<double>(count))));
  std::mt19937_64 random(seed);
  std::vector<double> resample(count), slopes(kTrendResamples);
  for (double& each : slopes) {
    for (size_t i = 0; i < count; i += block) {
      const size_t from = (random() >> 32) * count >> 32;
      for (size_t k = i; k < std::min(i + block, count); ++k) {
        resample[k] = slope * time[k] + residual[(from + k - i) % count];
      }
    }
    each = slope_of_pairs(time, resample, buffer);
  }
  return Interval{slope, quantile(slopes, 0.025), quantile(slopes, 0.975)};
}

}  // namespace assay
