#include "measures/accuracy.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace assay {

std::vector<double> sample_times(double start, double duration_s, double sample_ms) {
  const long long samples = std::llround(1000 * duration_s / sample_ms);
  std::vector<double> times;
  times.reserve(static_cast<size_t>(samples));
  for (long long i = 1; i <= samples; ++i) {
    times.push_back(start + duration_s * static_cast<double>(i) / static_cast<double>(samples));
  }
  return times;
}

double position_error(const State& a, const State& b) {
  assert(!a.bodies.empty() && a.bodies.size() == b.bodies.size());
  double sum = 0;
  for (size_t i = 0; i < a.bodies.size(); ++i) sum += (a.bodies[i].p_WBcm - b.bodies[i].p_WBcm).norm();
  return sum / static_cast<double>(a.bodies.size());
}

ErrorOverTime error_over_time(const std::vector<State>& run, const std::vector<State>& reference) {
  assert(run.size() >= 2 && run.size() == reference.size());
  ErrorOverTime error;
  double squares = 0;
  for (size_t i = 1; i < run.size(); ++i) {
    error.at_end = position_error(run[i], reference[i]);
    error.largest = std::max(error.largest, error.at_end);
    squares += error.at_end * error.at_end;
  }
  error.rms = std::sqrt(squares / static_cast<double>(run.size() - 1));
  return error;
}

std::optional<double> observed_order(double h1, double error1, double h2, double error2) {
  assert(h1 > 0 && h2 > 0 && h1 != h2);
  if (!std::isfinite(error1) || !std::isfinite(error2) || error1 <= 0 || error2 <= 0) return std::nullopt;
  return std::log(error2 / error1) / std::log(h2 / h1);
}

double rounding_error(bool single_precision, double extent, double steps) {
  const double unit = single_precision ? std::numeric_limits<float>::epsilon() : std::numeric_limits<double>::epsilon();
  return unit * extent * steps;
}

namespace {

std::vector<ErrorAt> usable_points(const std::vector<ErrorAt>& curve) {
  std::vector<ErrorAt> points;
  std::ranges::copy_if(curve, std::back_inserter(points),
                       [](const ErrorAt& at) { return std::isfinite(at.error) && at.error > 0; });
  return points;
}

}  // namespace

std::optional<double> plateau(const std::vector<ErrorAt>& curve) {
  constexpr double kShrinks = 1.3;      // a first-order method shrinks 4 times over the range below
  constexpr double kRange = 4 * 0.999;  // of timesteps
  const std::vector<ErrorAt> points = usable_points(curve);
  if (points.size() < 3) return std::nullopt;
  // The range of timesteps, from the smallest, over which the error stays the same in either direction.
  double low = points.front().error, high = low, flat_high = high;
  size_t flat = 0;
  for (size_t i = 1; i < points.size(); ++i) {
    low = std::min(low, points[i].error);
    high = std::max(high, points[i].error);
    if (high > kShrinks * low) break;
    flat = i;
    flat_high = high;
  }
  if (points[flat].timestep_ms < kRange * points.front().timestep_ms) return std::nullopt;
  return flat_high;
}

std::optional<double> error_floor(const std::vector<ErrorAt>& curve) {
  constexpr double kAboveRounding = 10;
  const std::vector<ErrorAt> points = usable_points(curve);
  if (!plateau(points) || points.front().error <= kAboveRounding * points.front().rounding) return std::nullopt;
  return points.front().error;
}

std::vector<long long> piece_starts(long long total, long long length, int pieces) {
  assert(pieces > 0 && length > 0 && length <= total);
  std::vector<long long> starts(static_cast<size_t>(pieces));
  for (int k = 0; k < pieces; ++k) {
    starts[static_cast<size_t>(k)] = pieces == 1 ? 0 : (total - length) * k / (pieces - 1);
  }
  return starts;
}

}  // namespace assay
