#include "results/front.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "base/quantity.h"
#include "base/text.h"

namespace assay {

double error_resolution(const std::string& unit) { return unit == "m" ? least_quantity(unit) : 0; }

std::vector<FrontMember> pareto_front(const std::vector<FrontPoint>& points, double resolution) {
  const auto error = [&](size_t i) { return std::max(points[i].error, resolution); };
  const auto equal = [&](size_t a, size_t b) {
    if (a == b) return true;  // also where a stranger's interval does not contain its value
    const auto [less, more] = std::minmax({error(a), error(b)});
    return same_timestep(points[a].timestep_ms, points[b].timestep_ms) && more - less <= kSameError * more &&
           points[b].speed.high >= points[a].speed.low && points[b].speed.low <= points[a].speed.high;
  };
  std::vector<size_t> order;
  for (size_t i = 0; i < points.size(); ++i) {
    if (std::isfinite(points[i].speed.value) && std::isfinite(points[i].error)) order.push_back(i);
  }
  const std::vector<size_t> finite = order;
  std::ranges::stable_sort(order, [&](size_t a, size_t b) {
    return std::tuple(-points[a].speed.value, error(a)) < std::tuple(-points[b].speed.value, error(b));
  });
  std::vector<FrontMember> front;
  double least = std::numeric_limits<double>::infinity();
  for (const size_t i : order) {
    if (!(error(i) < least * (1 - kSameError))) continue;
    least = error(i);
    FrontMember member{*std::ranges::find_if(finite, [&](size_t other) { return equal(i, other); }), {}};
    for (const size_t other : finite) {
      const std::string& name = points[other].contender;
      if (name != points[member.point].contender && equal(member.point, other)) member.equals.push_back(name);
    }
    front.push_back(std::move(member));
  }
  return front;
}

}  // namespace assay
