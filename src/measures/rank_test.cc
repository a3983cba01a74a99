#include "measures/rank_test.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

namespace assay {
namespace {

constexpr size_t kMostExactPairs = 400;

// The number of orders of n + m samples in which U is at most `u`, over that of all orders.
double exact_tail(size_t n, size_t m, size_t u) {
  // counts of (i samples of a among the first, U so far), sample by sample: f(i, j, u) = f(i - 1, j, u - j) + f(i, j -
  // 1, u)
  const size_t values = n * m + 1;
  std::vector<std::vector<double>> share(n + 1, std::vector<double>(values, 0));
  for (size_t i = 0; i <= n; ++i) share[i][0] = 1;  // without samples of b
  for (size_t j = 1; j <= m; ++j) {
    std::vector<std::vector<double>> next(n + 1, std::vector<double>(values, 0));
    next[0][0] = 1;
    for (size_t i = 1; i <= n; ++i) {
      // the largest of i + j samples is one of a with chance i / (i + j), and then lies above j samples of b
      const double of_a = static_cast<double>(i) / static_cast<double>(i + j);
      for (size_t at = 0; at < values; ++at) {
        next[i][at] = (at >= j ? of_a * next[i - 1][at - j] : 0) + (1 - of_a) * share[i][at];
      }
    }
    share = std::move(next);
  }
  return std::accumulate(share[n].begin(), share[n].begin() + static_cast<std::ptrdiff_t>(u) + 1, 0.0);
}

}  // namespace

double rank_test(std::span<const double> a, std::span<const double> b) {
  if (a.empty() || b.empty()) return 1;
  // ranks of a among all, equal samples sharing theirs
  std::vector<std::pair<double, bool>> all;
  all.reserve(a.size() + b.size());
  for (const double sample : a) all.emplace_back(sample, true);
  for (const double sample : b) all.emplace_back(sample, false);
  std::ranges::sort(all);
  double rank_sum = 0, tie_sum = 0;
  for (size_t i = 0; i < all.size();) {
    size_t end = i;
    while (end < all.size() && all[end].first == all[i].first) ++end;
    const double rank = 0.5 * static_cast<double>(i + 1 + end), ties = static_cast<double>(end - i);
    for (size_t k = i; k < end; ++k) rank_sum += all[k].second ? rank : 0;
    tie_sum += ties * ties * ties - ties;
    i = end;
  }
  const auto n = static_cast<double>(a.size()), m = static_cast<double>(b.size()), total = n + m;
  const double u = rank_sum - 0.5 * n * (n + 1), lower = std::min(u, n * m - u);
  if (tie_sum == 0 && a.size() * b.size() <= kMostExactPairs) {
    return std::min(1.0, 2 * exact_tail(a.size(), b.size(), static_cast<size_t>(std::llround(lower))));
  }
  const double variance = n * m / 12 * (total + 1 - tie_sum / (total * (total - 1)));
  if (variance <= 0) return 1;  // all samples are equal
  const double z = std::max(0.0, std::abs(u - 0.5 * n * m) - 0.5) / std::sqrt(variance);
  return std::erfc(z / std::numbers::sqrt2);
}

double smallest_rank_p(size_t a, size_t b) {
  if (a == 0 || b == 0) return 1;
  double orders = 1;  // a + b over a
  for (size_t i = 1; i <= a; ++i) orders *= static_cast<double>(b + i) / static_cast<double>(i);
  return std::min(1.0, 2 / orders);
}

std::vector<double> corrected_for_number(const std::vector<double>& p) {
  std::vector<size_t> order(p.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, [&](size_t a, size_t b) { return p[a] > p[b]; });
  std::vector<double> corrected(p.size());
  double least = 1;
  for (size_t i = 0; i < order.size(); ++i) {
    const auto rank = static_cast<double>(order.size() - i);
    least = std::min(least, p[order[i]] * static_cast<double>(p.size()) / rank);
    corrected[order[i]] = least;
  }
  return corrected;
}

std::vector<double> corrected_by_family(const std::vector<double>& p, const std::vector<std::string>& family) {
  assert(p.size() == family.size());
  std::map<std::string, std::vector<size_t>> members;
  for (size_t i = 0; i < p.size(); ++i) members[family[i]].push_back(i);
  std::vector<double> corrected(p.size());
  std::vector<std::pair<double, const std::vector<size_t>*>> families;  // Simes' p-value
  for (const auto& [name, own] : members) {
    std::vector<double> of_own;
    of_own.reserve(own.size());
    for (const size_t i : own) of_own.push_back(p[i]);
    const std::vector<double> within = corrected_for_number(of_own);
    for (size_t k = 0; k < own.size(); ++k) corrected[own[k]] = within[k];
    families.emplace_back(std::ranges::min(within), &own);
  }
  std::ranges::sort(families, {}, [](const auto& each) { return each.first; });
  double largest = 0;
  for (size_t k = 0; k < families.size(); ++k) {
    largest = std::max(largest, std::min(1.0, families[k].first * static_cast<double>(families.size() - k)));
    for (const size_t i : *families[k].second) corrected[i] = std::max(corrected[i], largest);
  }
  return corrected;
}

}  // namespace assay
