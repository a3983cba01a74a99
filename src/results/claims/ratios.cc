#include "results/claims/ratios.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "measures/clusters.h"

namespace assay {
namespace {

// In logarithms errors below this are this: they say more of rounding than of an engine.
constexpr double kRounding = 1e-16;

// The interval of a ratio of two independent figures: its ends are those of the worst cases, which is wider than 95 %
// demand.
Interval ratio_of(const Interval& over, const Interval& under) {
  const auto positive = [](double value) { return std::max(value, kRounding); };
  return {positive(over.value) / positive(under.value), positive(over.low) / positive(under.high),
          positive(over.high) / positive(under.low)};
}

// Says in the ratio which of the two is not there.
template <typename Side>
bool both_there(const Side& first, const Side& second, Ratio& ratio) {
  for (const Side* each : {&first, &second}) {
    if (each->found != Found::kMissing) continue;
    ratio.why = each->why;
    return false;
  }
  const bool first_failed = first.found == Found::kFailed;
  if (!first_failed && second.found != Found::kFailed) return true;
  ratio.state = first_failed ? Ratio::State::kFirstFailed : Ratio::State::kSecondFailed;
  ratio.why = first_failed ? first.why : second.why;
  return false;
}

double log_of(double value) { return std::log(std::max(value, kRounding)); }

// Between which of a curve's points a speed lies: on the way from `before` to `after` by `weight`.
struct Place {
  size_t before = 0, after = 0;
  double weight = 0;
  double of(double at_before, double at_after) const { return (1 - weight) * at_before + weight * at_after; }
};

}  // namespace

Ratio Ratios::at_timestep(const std::string& system, const std::string& first, const std::string& second,
                          const std::string& value, double timestep_ms) const {
  Ratio ratio;
  const Figure under = results_->figure(system, first, value, timestep_ms),
               over = results_->figure(system, second, value, timestep_ms);
  ratio.figures = {under, over};
  if (!both_there(under, over, ratio)) return ratio;
  ratio.state = Ratio::State::kThere;
  ratio.value = ratio_of(over.value, under.value);
  ratio.least = ratio.most = ratio.value.value;
  return ratio;
}

// Errors of the pieces whose mean the figure is, by the initial state of their motion; one group if there is one state.
std::vector<std::vector<double>> Ratios::pieces_of(const Figure& figure, const std::string& value) const {
  const bool cold = value == "consistency_cold";
  if ((!cold && value != "consistency") || figure.cell == 0 || figure.is_bound) return {};
  std::vector<double> errors, states;
  for (SampleSeries& series : results_->store().samples(figure.cell)) {
    if (series.name == (cold ? "piece_cold_error_m" : "piece_error_m")) errors = std::move(series.values);
    if (series.name == "piece_state") states = std::move(series.values);
  }
  if (errors.empty()) return {};
  if (states.empty()) return {std::move(errors)};
  if (states.size() != errors.size()) return {};
  return grouped(errors, states);
}

const Ratios::Curve& Ratios::curve(const std::string& system, const std::string& contender,
                                   const std::string& value) const {
  const auto [place, is_new] = curves_.try_emplace({system, contender, value});
  Curve& curve = place->second;
  if (!is_new) return curve;
  curve.by_speed = results_->timed(system);
  for (const Figure& figure : results_->figures(system, contender, value, true)) {
    if (figure.found != Found::kThere) {
      if (curve.found == Found::kMissing) curve.why = figure.why;
      if (figure.found == Found::kFailed && curve.points.empty()) curve.found = Found::kFailed;
      continue;
    }
    Interval speed{figure.timestep_ms, figure.timestep_ms, figure.timestep_ms};
    if (curve.by_speed) {
      const auto timed = results_->speed(system, contender, figure.timestep_ms);
      if (!timed) {
        curve.why = results_->why_missing(system, contender, "realtime_factor");
        continue;
      }
      speed = timed->factor;
    }
    curve.found = Found::kThere;
    if (figure.is_bound) {
      curve.points.emplace_back(Point{speed, figure.value, {}, true});
      continue;
    }
    const std::vector<std::vector<double>> pieces = pieces_of(figure, value);
    std::vector<size_t> sizes(pieces.size());
    std::ranges::transform(pieces, sizes.begin(), &std::vector<double>::size);
    const bool is_first = std::ranges::all_of(curve.points, &Point::is_bound);
    if (is_first) curve.pieces = sizes;
    if (sizes != curve.pieces) curve.pieces.clear();
    Point& point = curve.points.emplace_back(Point{speed, figure.value, {}, false});
    if (pieces.empty()) continue;
    point.resampled = resampled_means_of_groups(pieces, kBootstrapSeed);
    for (double& mean : point.resampled) mean = log_of(mean);
  }
  if (curve.why.empty()) curve.why = results_->why_missing(system, contender, value);
  std::ranges::stable_sort(curve.points, {}, [](const Point& point) { return point.speed.value; });
  return curve;
}

Ratio Ratios::at_equal_speed(const std::string& system, const std::string& first, const std::string& second,
                             const std::string& value) const {
  Ratio ratio;
  const Curve &under = curve(system, first, value), &over = curve(system, second, value);
  ratio.by_speed = under.by_speed;
  if (!both_there(under, over, ratio)) return ratio;
  const auto place_at = [&](double speed) -> std::optional<Place> {
    const std::vector<Point>& points = under.points;
    if (speed <= points.front().speed.value) return Place{};
    for (size_t i = 1; i < points.size(); ++i) {
      const double slower = points[i - 1].speed.value, faster = points[i].speed.value;
      if (speed > faster * (1 + 1e-9)) continue;
      const double span = std::log(faster / slower);
      return Place{i - 1, i, span > 0 ? std::log(speed / slower) / span : 0};
    }
    return std::nullopt;
  };
  // The logarithm of one end of the first's error.
  const auto error_at = [&](const Place& place, double Interval::* end) {
    return place.of(log_of(under.points[place.before].error.*end), log_of(under.points[place.after].error.*end));
  };
  const auto near_floor = [&](const Place& place) {
    return under.points[place.before].is_bound || under.points[place.after].is_bound;
  };
  // How far the first's own speeds may be off.
  double fastest = 1, slowest = 1;
  for (const Point& point : under.points) {
    fastest = std::max(fastest, point.speed.high / point.speed.value);
    slowest = std::min(slowest, point.speed.low / point.speed.value);
  }
  const bool paired = !under.pieces.empty() && under.pieces == over.pieces;
  std::vector<double> resampled(paired ? static_cast<size_t>(kBootstrapResamples) : 0);
  // Sums of logarithms: of the ratio, of its ends, and how much of these is the speeds' own.
  double sum = 0, low = 0, high = 0, by_speed_low = 0, by_speed_high = 0;
  int count = 0, left_out = 0;
  for (const Point& point : over.points) {
    const auto place = place_at(point.speed.value);
    if (!place) continue;
    if (point.is_bound || near_floor(*place)) {
      ++left_out;
      continue;
    }
    const double error = error_at(*place, &Interval::value);
    double least = std::min(error, error_at(*place, &Interval::low)),
           most = std::max(error, error_at(*place, &Interval::high)), least_by_speed = error, most_by_speed = error;
    for (const double speed : {point.speed.low / fastest, point.speed.high / slowest}) {
      const auto moved = place_at(speed);
      if (!moved || near_floor(*moved)) continue;
      least = std::min(least, error_at(*moved, &Interval::low));
      most = std::max(most, error_at(*moved, &Interval::high));
      least_by_speed = std::min(least_by_speed, error_at(*moved, &Interval::value));
      most_by_speed = std::max(most_by_speed, error_at(*moved, &Interval::value));
    }
    const double here = log_of(point.error.value) - error;
    sum += here;
    low += log_of(point.error.low) - most;
    high += log_of(point.error.high) - least;
    by_speed_low += error - most_by_speed;
    by_speed_high += error - least_by_speed;
    for (size_t i = 0; i < resampled.size(); ++i) {
      resampled[i] += point.resampled[i] -
                      place->of(under.points[place->before].resampled[i], under.points[place->after].resampled[i]);
    }
    ratio.least = count == 0 ? std::exp(here) : std::min(ratio.least, std::exp(here));
    ratio.most = count == 0 ? std::exp(here) : std::max(ratio.most, std::exp(here));
    ++count;
  }
  if (count == 0 && left_out > 0) {
    ratio.why =
        fmt::format("on {} the errors of {} and {} are near the floors of their fine-step runs wherever both have a {}",
                    system, first, second, ratio.by_speed ? "speed" : "timestep");
    return ratio;
  }
  if (count == 0) {
    ratio.why = fmt::format("on {} {} is faster at every timestep than {} at any: no common {}", system, second, first,
                            ratio.by_speed ? "speed" : "timestep");
    return ratio;
  }
  if (paired) {
    const double tail = bootstrap_tail(under.pieces.size());
    low = quantile(resampled, tail) + by_speed_low;
    high = quantile(resampled, 1 - tail) + by_speed_high;
  }
  ratio.state = Ratio::State::kThere;
  ratio.points = count;
  ratio.value = {std::exp(sum / count), std::exp(low / count), std::exp(high / count)};
  if (ratio.is_range()) {
    ratio.value.low = std::min(ratio.value.low, ratio.least);
    ratio.value.high = std::max(ratio.value.high, ratio.most);
  }
  return ratio;
}

}  // namespace assay
