#include "measures/statistics.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include <boost/math/distributions/students_t.hpp>

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

double student_t_975(int freedom) {
  assert(freedom >= 1);
  constexpr std::array<double, 10> kFew = {12.7062, 4.3027, 3.1824, 2.7764, 2.5706,
                                           2.4469,  2.3646, 2.3060, 2.2622, 2.2281};
  if (freedom <= std::ssize(kFew)) return kFew[static_cast<size_t>(freedom) - 1];
  // Cornish and Fisher's expansion around the normal quantile: right to 1e-4 from here on
  constexpr double z = 1.959964;
  const double n = freedom;
  return z + (std::pow(z, 3) + z) / (4 * n) + (5 * std::pow(z, 5) + 16 * std::pow(z, 3) + 3 * z) / (96 * n * n) +
         (3 * std::pow(z, 7) + 19 * std::pow(z, 5) + 17 * std::pow(z, 3) - 15 * z) / (384 * n * n * n);
}

double student_t_p(double t, double freedom) {
  if (std::isinf(t)) return 0;
  return 2 * boost::math::cdf(boost::math::complement(boost::math::students_t(freedom), std::abs(t)));
}

Interval t_interval(std::span<const double> samples) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const double value = mean(samples);
  if (samples.size() < 2) return {value, kNone, kNone};
  double squares = 0, products = 0;
  for (size_t i = 0; i < samples.size(); ++i) {
    squares += (samples[i] - value) * (samples[i] - value);
    if (i > 0) products += (samples[i] - value) * (samples[i - 1] - value);
  }
  const auto count = static_cast<double>(samples.size());
  constexpr double kMostAlike = 0.9;
  const double alike = squares > 0 ? std::clamp(products / squares + 1 / count, 0.0, kMostAlike) : 0;
  const double error = std::sqrt(squares / (count - 1) / count * (1 + 2 * alike * (count - 1) / count));
  const double reach = student_t_975(static_cast<int>(samples.size()) - 1) * error;
  return {value, value - reach, value + reach};
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
