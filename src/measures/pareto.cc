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

}  // namespace assay
