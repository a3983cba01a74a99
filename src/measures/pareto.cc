#include "measures/pareto.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace assay {
namespace {

std::vector<size_t> by_speed(const std::vector<SpeedAndError>& points) {
  std::vector<size_t> order;
  for (size_t i = 0; i < points.size(); ++i) {
    if (std::isfinite(points[i].speed) && std::isfinite(points[i].error)) order.push_back(i);
  }
  std::ranges::stable_sort(order, [&](size_t a, size_t b) {
    return std::tuple(-points[a].speed, points[a].error) < std::tuple(-points[b].speed, points[b].error);
  });
  return order;
}

}  // namespace

std::vector<size_t> pareto_front(const std::vector<SpeedAndError>& points) {
  std::vector<size_t> front;
  SpeedAndError best{0, std::numeric_limits<double>::infinity()};
  for (const size_t i : by_speed(points)) {
    const bool equal = points[i].error == best.error && points[i].speed == best.speed;
    if (!equal && points[i].error >= best.error) continue;
    front.push_back(i);
    best = points[i];
  }
  return front;
}

std::optional<size_t> fastest_within(const std::vector<SpeedAndError>& points, double limit) {
  for (const size_t i : by_speed(points)) {
    if (points[i].error <= limit) return i;
  }
  return std::nullopt;
}

std::optional<Interval> speed_at(const SpeedCurve& speeds, double timestep_ms) {
  if (speeds.empty()) return std::nullopt;
  auto above = speeds.lower_bound(timestep_ms * (1 - 1e-9));
  auto below = above;
  if (above == speeds.end()) {
    above = below = std::prev(speeds.end());
  } else if (above->first > timestep_ms * (1 + 1e-9) && above != speeds.begin()) {
    below = std::prev(above);
  }
  const double span = std::log(above->first / below->first);
  const double weight = span > 0 ? std::log(timestep_ms / below->first) / span : 0;
  // per timestep the factor is the inverse of the step's time
  const auto blend = [&](double Interval::* bound) {
    return timestep_ms * std::pow(below->second.*bound / below->first, 1 - weight) *
           std::pow(above->second.*bound / above->first, weight);
  };
  return Interval{blend(&Interval::value), blend(&Interval::low), blend(&Interval::high)};
}

}  // namespace assay
