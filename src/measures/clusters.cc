#include "measures/clusters.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <random>

#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>

namespace assay {

double bootstrap_tail(size_t groups) {
  constexpr double kTail = 0.025;
  if (groups < 2) return kTail;
  const auto count = static_cast<double>(groups);
  const double t = quantile(boost::math::students_t(count - 1), kTail);
  return cdf(boost::math::normal(), std::sqrt(count / (count - 1)) * t);
}

std::vector<double> resampled_means_of_groups(const std::vector<std::vector<double>>& groups, std::uint64_t seed,
                                              int resamples) {
  assert(!groups.empty() && resamples > 0);
  if (groups.size() == 1) return resampled_means(groups.front(), seed, resamples);
  std::vector<double> sums;
  sums.reserve(groups.size());
  for (const std::vector<double>& group : groups) {
    assert(!group.empty());
    sums.push_back(mean(group) * static_cast<double>(group.size()));
  }
  std::mt19937_64 random(seed);
  std::vector<double> means(static_cast<size_t>(resamples));
  for (double& each : means) {
    double sum = 0, count = 0;
    for (size_t i = 0; i < groups.size(); ++i) {
      const size_t drawn = (random() >> 32U) * groups.size() >> 32U;
      sum += sums[drawn];
      count += static_cast<double>(groups[drawn].size());
    }
    each = sum / count;
  }
  return means;
}

Interval bootstrap_mean_of_groups(const std::vector<std::vector<double>>& groups, std::uint64_t seed, int resamples) {
  const std::vector<double> means = resampled_means_of_groups(groups, seed, resamples);
  double sum = 0, count = 0;
  for (const std::vector<double>& group : groups) {
    for (const double each : group) sum += each;
    count += static_cast<double>(group.size());
  }
  const double tail = bootstrap_tail(groups.size() == 1 ? groups.front().size() : groups.size());
  return {sum / count, quantile(means, tail), quantile(means, 1 - tail)};
}

Interval bootstrap_median_of_groups(const std::vector<std::vector<double>>& groups, std::uint64_t seed, int resamples) {
  assert(!groups.empty() && resamples > 0);
  std::vector<double> all;
  for (const std::vector<double>& group : groups) all.insert(all.end(), group.begin(), group.end());
  const std::vector<std::vector<double>> single = groups.size() == 1 ? grouped(all, {}) : groups;
  std::mt19937_64 random(seed);
  std::vector<double> medians(static_cast<size_t>(resamples)), drawn;
  for (double& each : medians) {
    drawn.clear();
    for (size_t i = 0; i < single.size(); ++i) {
      const std::vector<double>& group = single[(random() >> 32U) * single.size() >> 32U];
      drawn.insert(drawn.end(), group.begin(), group.end());
    }
    each = median(drawn);
  }
  const double tail = bootstrap_tail(single.size());
  return {median(all), quantile(medians, tail), quantile(medians, 1 - tail)};
}

Interval share_within_of_groups(const std::vector<std::vector<double>>& groups, double limit, std::uint64_t seed,
                                int resamples) {
  std::vector<std::vector<double>> within = groups;
  int hits = 0, count = 0;
  for (std::vector<double>& group : within) {
    for (double& each : group) {
      each = each <= limit ? 1 : 0;
      hits += each > 0 ? 1 : 0;
      ++count;
    }
  }
  if (hits > 0 && hits < count) return bootstrap_mean_of_groups(within, seed, resamples);
  const int trials = groups.size() == 1 ? count : static_cast<int>(groups.size());
  return probability(hits == 0 ? 0 : trials, trials);
}

std::vector<std::vector<double>> grouped(std::span<const double> samples, std::span<const double> group) {
  std::vector<std::vector<double>> groups;
  if (group.empty()) {
    for (const double each : samples) groups.push_back({each});
    return groups;
  }
  assert(samples.size() == group.size());
  std::map<double, std::vector<double>> by_number;
  for (size_t i = 0; i < samples.size(); ++i) by_number[group[i]].push_back(samples[i]);
  groups.reserve(by_number.size());
  for (auto& [number, members] : by_number) groups.push_back(std::move(members));
  return groups;
}

Interval probability(int hits, int trials) {
  assert(0 <= hits && hits <= trials && trials > 0);
  using Binomial = boost::math::binomial_distribution<>;
  constexpr double kTail = 0.025;
  const double value = static_cast<double>(hits) / trials;
  return {value, hits == 0 ? 0 : Binomial::find_lower_bound_on_p(trials, hits, kTail),
          hits == trials ? 1 : Binomial::find_upper_bound_on_p(trials, hits, kTail)};
}

}  // namespace assay
