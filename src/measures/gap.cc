#include "measures/gap.h"

#include <algorithm>
#include <cassert>

namespace assay {

Track track_of(const std::vector<State>& states) {
  Track track;
  for (const State& state : states) {
    track.bodies = state.bodies.size();
    for (const BodyState& body : state.bodies) track.positions.push_back(body.p_WBcm);
  }
  return track;
}

std::vector<double> gap_curve(const Track& a, const Track& b, size_t samples) {
  std::vector<double> curve(samples, kFarMetres);
  const size_t common = std::min({samples, a.samples(), b.samples()});
  assert(common == 0 || a.bodies == b.bodies);
  for (size_t i = 0; i < common; ++i) {
    double sum = 0;
    for (size_t body = i * a.bodies; body < (i + 1) * a.bodies; ++body) {
      sum += (a.positions[body] - b.positions[body]).norm();
    }
    curve[i] = std::min(kFarMetres, sum / static_cast<double>(a.bodies));
  }
  return curve;
}

size_t gap_window(std::span<const double> curve) {
  const auto parted = std::ranges::find_if(curve, [](double distance) { return distance >= kFarMetres; });
  const auto until = static_cast<size_t>(parted - curve.begin()) + (parted == curve.end() ? 0 : 1);
  return std::min(curve.size(), std::max<size_t>(until, 2));
}

double gap_of(std::span<const double> curve, size_t window) {
  assert(window >= 2 && window <= curve.size());
  return mean(curve.subspan(1, window - 1));
}

Interval share_closed(std::span<const double> before, std::span<const double> after, std::uint64_t seed) {
  assert(!before.empty() && before.size() == after.size());
  const double whole = mean(before);
  if (whole <= 0) return {};
  const std::vector<double> of_before = resampled_means(before, seed), of_after = resampled_means(after, seed);
  std::vector<double> shares;
  shares.reserve(of_before.size());
  for (size_t i = 0; i < of_before.size(); ++i) {
    if (of_before[i] > 0) shares.push_back(1 - (of_after[i] / of_before[i]));
  }
  return {1 - (mean(after) / whole), quantile(shares, 0.025), quantile(shares, 0.975)};
}

}  // namespace assay
