#include "results/compare/change_points.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "measures/statistics.h"

namespace assay {

std::vector<size_t> change_points(std::span<const double> series, double noise, double penalty, size_t shortest) {
  const size_t count = series.size();
  shortest = std::max<size_t>(1, shortest);
  if (count < 2 * shortest || !(noise > 0)) return {};
  std::vector<double> sums = {0}, squares = {0};
  for (const double figure : series) {
    const double scaled = (figure - series.front()) / noise;
    sums.push_back(sums.back() + scaled);
    squares.push_back(squares.back() + scaled * scaled);
  }
  const auto cost = [&](size_t from, size_t to) {
    const double sum = sums[to] - sums[from];
    return squares[to] - squares[from] - sum * sum / static_cast<double>(to - from);
  };
  // best[t]: the least cost of the first t figures
  std::vector<double> best(count + 1, std::numeric_limits<double>::infinity());
  std::vector<size_t> last(count + 1, 0);
  best[0] = -penalty;
  for (size_t t = shortest; t <= count; ++t) {
    for (size_t from = 0; from + shortest <= t; ++from) {
      if (from > 0 && from < shortest) continue;
      const double total = best[from] + cost(from, t) + penalty;
      if (total >= best[t]) continue;
      best[t] = total;
      last[t] = from;
    }
  }
  std::vector<size_t> found;
  for (size_t t = last[count]; t > 0; t = last[t]) found.push_back(t);
  std::ranges::reverse(found);
  return found;
}

double noise_of(std::span<const double> series) {
  if (series.size() < 3) return 0;
  std::vector<double> steps;
  steps.reserve(series.size());
  for (size_t i = 1; i < series.size(); ++i) steps.push_back(std::abs(series[i] - series[i - 1]));
  constexpr double kNormal = 0.6744897501960817;  // the median of |x| for a standard normal x
  return median(steps) / (kNormal * std::numbers::sqrt2);
}

}  // namespace assay
