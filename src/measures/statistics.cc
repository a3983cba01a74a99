#include "measures/statistics.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

namespace assay {
namespace {

double quantile_of_sorted(std::span<const double> sorted, double q) {
  const double position = q * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<size_t>(position);
  const size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (position - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

std::vector<double> sorted_copy(std::span<const double> samples) {
  assert(!samples.empty());
  std::vector<double> sorted(samples.begin(), samples.end());
  std::ranges::sort(sorted);
  return sorted;
}

// A random number below `count`. Distributions of the standard library differ between implementations; this one is the
// same everywhere.
size_t below(std::mt19937_64& random, size_t count) { return (random() >> 32) * count >> 32; }

template <typename Statistic>
std::vector<double> resampled(std::span<const double> samples, std::uint64_t seed, int resamples, Statistic statistic) {
  assert(!samples.empty() && resamples > 0);
  std::mt19937_64 random(seed);
  std::vector<double> resample(samples.size());
  std::vector<double> estimates(static_cast<size_t>(resamples));
  for (double& estimate : estimates) {
    for (double& value : resample) value = samples[below(random, samples.size())];
    estimate = statistic(resample);
  }
  return estimates;
}

template <typename Statistic>
Interval bootstrap(std::span<const double> samples, std::uint64_t seed, int resamples, Statistic statistic) {
  std::vector<double> estimates = resampled(samples, seed, resamples, statistic);
  std::ranges::sort(estimates);
  return {statistic(samples), quantile_of_sorted(estimates, 0.025), quantile_of_sorted(estimates, 0.975)};
}

}  // namespace

double median(std::span<const double> samples) { return quantile(samples, 0.5); }

double mean(std::span<const double> samples) {
  assert(!samples.empty());
  return std::accumulate(samples.begin(), samples.end(), 0.0) / static_cast<double>(samples.size());
}

double quantile(std::span<const double> samples, double q) {
  assert(q >= 0 && q <= 1);
  return quantile_of_sorted(sorted_copy(samples), q);
}

Interval bootstrap_median(std::span<const double> samples, std::uint64_t seed, int resamples) {
  return bootstrap(samples, seed, resamples, [](std::span<const double> values) { return median(values); });
}

Interval bootstrap_mean(std::span<const double> samples, std::uint64_t seed, int resamples) {
  return bootstrap(samples, seed, resamples, [](std::span<const double> values) { return mean(values); });
}

std::vector<double> resampled_means(std::span<const double> samples, std::uint64_t seed, int resamples) {
  return resampled(samples, seed, resamples, [](std::span<const double> values) { return mean(values); });
}

Interval bootstrap_median_of_rounds(const std::vector<std::vector<double>>& rounds, std::uint64_t seed, int resamples) {
  assert(!rounds.empty() && resamples > 0);
  std::mt19937_64 random(seed);
  std::vector<double> pooled;
  // Selection instead of sorting: this is called thousands of times on thousands of samples.
  const auto middle = [&] {
    const auto half = static_cast<std::ptrdiff_t>(pooled.size() / 2);
    std::ranges::nth_element(pooled, pooled.begin() + half);
    const double upper = pooled[static_cast<size_t>(half)];
    if (pooled.size() % 2 == 1) return upper;
    return 0.5 * (upper + *std::max_element(pooled.begin(), pooled.begin() + half));
  };
  for (const std::vector<double>& round : rounds) pooled.insert(pooled.end(), round.begin(), round.end());
  const double value = middle();
  std::vector<double> estimates(static_cast<size_t>(resamples));
  for (double& estimate : estimates) {
    pooled.clear();
    for (size_t i = 0; i < rounds.size(); ++i) {
      const std::vector<double>& round = rounds[below(random, rounds.size())];
      assert(!round.empty());
      pooled.insert(pooled.end(), round.begin(), round.end());
    }
    estimate = middle();
  }
  std::ranges::sort(estimates);
  return {value, quantile_of_sorted(estimates, 0.025), quantile_of_sorted(estimates, 0.975)};
}

Interval bootstrap_rms_of_series(std::span<const double> series, std::uint64_t seed, int resamples) {
  assert(!series.empty() && resamples > 0);
  constexpr size_t kFewest = 8;
  const size_t count = series.size();
  const auto block = static_cast<size_t>(std::ceil(std::sqrt(static_cast<double>(count))));
  std::vector<double> squares(count);
  for (size_t i = 0; i < count; ++i) squares[i] = series[i] * series[i];
  const double value = std::sqrt(mean(squares));
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (count < kFewest) return {value, kNone, kNone};
  // sums of blocks, each of which is drawn many times
  std::vector<double> until = {0};
  until.reserve(count + block + 1);
  for (size_t i = 0; i < count + block; ++i) until.push_back(until.back() + squares[i % count]);
  std::mt19937_64 random(seed);
  std::vector<double> estimates(static_cast<size_t>(resamples));
  for (double& estimate : estimates) {
    double sum = 0;
    for (size_t i = 0; i < count; i += block) {
      const size_t from = below(random, count);
      sum += until[from + std::min(block, count - i)] - until[from];
    }
    estimate = std::sqrt(std::max(0.0, sum) / static_cast<double>(count));
  }
  std::ranges::sort(estimates);
  return {value, quantile_of_sorted(estimates, 0.025), quantile_of_sorted(estimates, 0.975)};
}

double relative_spread(std::span<const double> samples) {
  const std::vector<double> sorted = sorted_copy(samples);
  const double middle = quantile_of_sorted(sorted, 0.5);
  const double width = quantile_of_sorted(sorted, 0.75) - quantile_of_sorted(sorted, 0.25);
  return middle == 0 ? 0 : width / std::abs(middle);
}

std::vector<int> outliers(std::span<const double> samples) {
  const std::vector<double> sorted = sorted_copy(samples);
  const double low = quantile_of_sorted(sorted, 0.25), high = quantile_of_sorted(sorted, 0.75);
  const double margin = 3 * (high - low);
  std::vector<int> found;
  for (size_t i = 0; i < samples.size(); ++i) {
    if (samples[i] < low - margin || samples[i] > high + margin) found.push_back(static_cast<int>(i));
  }
  return found;
}

}  // namespace assay
