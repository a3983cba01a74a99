#include "measures/scaling.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "measures/measure.h"

namespace assay {
namespace {

struct Point {
  double x = 0, y = 0;
};

// Empty when all x are the same.
std::optional<double> slope(const std::vector<Point>& points) {
  const auto count = static_cast<double>(points.size());
  double mean_x = 0, mean_y = 0, xx = 0, xy = 0;
  for (const Point& point : points) {
    mean_x += point.x / count;
    mean_y += point.y / count;
  }
  for (const Point& point : points) {
    xx += (point.x - mean_x) * (point.x - mean_x);
    xy += (point.x - mean_x) * (point.y - mean_y);
  }
  if (!(xx > 1e-12)) return std::nullopt;
  return xy / xx;
}

}  // namespace

std::optional<Interval> scaling_exponent(const std::vector<TimeAtSize>& points, std::uint64_t seed) {
  constexpr size_t kFewest = 3;
  std::vector<Point> medians;
  for (const TimeAtSize& at : points) {
    const auto usable = [](double seconds) { return std::isfinite(seconds) && seconds > 0; };
    if (!(at.size > 0) || at.seconds.empty() || !std::ranges::all_of(at.seconds, usable)) return std::nullopt;
    medians.push_back({std::log(at.size), std::log(median(at.seconds))});
  }
  if (medians.size() < kFewest) return std::nullopt;
  const auto value = slope(medians);
  if (!value) return std::nullopt;

  std::mt19937_64 random(seed);
  const auto below = [&](size_t count) { return (random() >> 32) * count >> 32; };
  std::vector<double> slopes;
  std::vector<Point> resample(medians.size());
  while (slopes.size() < kBootstrapResamples) {
    for (Point& point : resample) {
      const TimeAtSize& at = points[below(points.size())];
      point = {std::log(at.size), std::log(at.seconds[below(at.seconds.size())])};
    }
    // A resample of one size only has no slope: draw again.
    if (const auto found = slope(resample)) slopes.push_back(*found);
  }
  return Interval{*value, quantile(slopes, 0.025), quantile(slopes, 0.975)};
}

namespace {

std::string scaling_obstacle(const MeasuredSystem& system) {
  return system.has_family
             ? ""
             : "does not say which systems it is compared with in size: give each of them the same family "
               "= \"...\"";
}

}  // namespace

Measure scaling_measure() {
  using namespace rows;
  return {
      .name = "scaling",
      .reads = Reads::kWholeRuns,
      .values = {{"run_time", "s", "Run time", "run time", kLow, kNo, kNo, "processor time of all steps of the run", 8},
                 {"steps_per_second", "1/s", "Steps per second", "steps per second", kHigh, kNo, kNo,
                  "steps of the whole run over their processor time", 8},
                 {"scaling_exponent", "1", "Scaling exponent", "scaling exponent", kLow, kNo, kNo,
                  "power of the number of bodies with which the run time grows", 8}},
      .obstacle = scaling_obstacle,
      .time = "run_time"};
}

}  // namespace assay
