#include "claims/results.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/text.h"
#include "measures/pareto.h"

namespace assay {
namespace {

// What measures the harness, and is no contender.
constexpr const char* kHarness = "null";

// In logarithms errors below this are this: they say more of rounding than of an engine.
constexpr double kRounding = 1e-16;

const Value* value_of(const Cell& cell, const std::string& name) {
  const auto found = std::ranges::find(cell.values, name, &Value::name);
  return found == cell.values.end() || !found->value ? nullptr : &*found;
}

Interval interval_of(const Value& value) {
  const double middle = value.value.value_or(0);
  return {middle, value.low.value_or(middle), value.high.value_or(middle)};
}

bool same_timestep(double a, double b) { return std::abs(a - b) <= 1e-9 * std::max(a, b); }

bool failed(Outcome outcome) { return outcome == Outcome::kUnstable || outcome == Outcome::kDiverged; }

Figure figure_of(const Cell& cell, const Value* value) {
  Figure figure;
  figure.timestep_ms = cell.timestep_ms;
  if (cell.outcome == Outcome::kOk && value != nullptr) {
    figure.found = Found::kThere;
    figure.value = interval_of(*value);
    figure.has_interval = value->low && value->high;
    figure.unit = value->unit;
    return figure;
  }
  figure.found = failed(cell.outcome) ? Found::kFailed : Found::kMissing;
  figure.why = fmt::format("{} on {} at {} ms: {}{}", cell.contender, cell.system, timestep_label(cell.timestep_ms),
                           cell.outcome == Outcome::kOk ? "no such value" : outcome_text(cell.outcome),
                           cell.reason.empty() ? "" : fmt::format(" ({})", cell.reason));
  return figure;
}

// The interval of a ratio of two independent figures: its ends are those of the worst cases, which is wider than 95 %
// demand.
Interval ratio_of(const Interval& over, const Interval& under) {
  const auto positive = [](double value) { return std::max(value, kRounding); };
  return {positive(over.value) / positive(under.value), positive(over.low) / positive(under.high),
          positive(over.high) / positive(under.low)};
}

double interpolated(double x, double x0, double x1, double y0, double y1) {
  const double span = std::log(x1 / x0);
  const double weight = span > 0 ? std::log(x / x0) / span : 0;
  return std::pow(std::max(y0, kRounding), 1 - weight) * std::pow(std::max(y1, kRounding), weight);
}

}  // namespace

Results::Results(const Store& store) {
  for (const SystemRow& row : store.systems()) {
    systems_.insert(row.name);
    const auto facts = nlohmann::json::parse(row.json, nullptr, false);
    if (facts.is_object() && facts.contains("family") && facts["family"].is_string()) {
      families_.emplace_back(row.name, facts["family"].get<std::string>());
    }
  }
  for (const ContenderRow& row : store.contenders()) {
    if (row.name == kHarness) continue;
    contenders_.push_back(row.name);
    if (row.version.empty()) absent_.insert(row.name);
  }
  for (Cell& cell : store.cells()) {
    for (const Value& value : cell.values) measures_[value.name].insert(cell.measure);
    if (cell.outcome == Outcome::kOk && cell.contender != kHarness && value_of(cell, "realtime_factor") != nullptr) {
      timed_.insert(cell.system);
    }
    cells_[{cell.system, cell.contender}].push_back(std::move(cell));
  }
  for (auto& [name, cells] : cells_) std::ranges::stable_sort(cells, {}, &Cell::timestep_ms);
}

std::vector<std::string> Results::family(const std::string& name) const {
  std::vector<std::string> systems;
  for (const auto& [system, family] : families_) {
    if (family == name) systems.push_back(system);
  }
  return systems;
}

std::string Results::why_missing(const std::string& system, const std::string& contender,
                                 const std::string& value) const {
  if (!systems_.contains(system)) return fmt::format("the results have no system '{}'", system);
  if (std::ranges::find(contenders_, contender) == contenders_.end()) {
    return fmt::format("the results have no contender '{}'", contender);
  }
  if (absent_.contains(contender)) return fmt::format("the engine of '{}' is absent", contender);
  return fmt::format("'{}' of {} on {} was not measured", value, contender, system);
}

std::vector<Figure> Results::figures(const std::string& system, const std::string& contender, const std::string& value,
                                     bool no_references) const {
  std::vector<Figure> found;
  const auto measures = measures_.find(value);
  const auto cells = cells_.find({system, contender});
  if (measures == measures_.end() || cells == cells_.end()) return found;
  for (const Cell& cell : cells->second) {
    if (!measures->second.contains(cell.measure)) continue;
    if (no_references && value_of(cell, "restart_floor") != nullptr) continue;
    found.push_back(figure_of(cell, value_of(cell, value)));
  }
  return found;
}

std::vector<Figure> Results::outcomes(const std::string& system, const std::string& contender,
                                      const std::string& measure) const {
  std::vector<Figure> found;
  const auto cells = cells_.find({system, contender});
  if (cells == cells_.end()) return found;
  const Value none;
  for (const Cell& cell : cells->second) {
    if (cell.measure == measure) found.push_back(figure_of(cell, &none));
  }
  return found;
}

Figure Results::figure(const std::string& system, const std::string& contender, const std::string& value,
                       std::optional<double> timestep_ms) const {
  for (const Figure& figure : figures(system, contender, value)) {
    if (!timestep_ms || same_timestep(figure.timestep_ms, *timestep_ms)) return figure;
  }
  Figure missing;
  missing.why = why_missing(system, contender, value);
  if (timestep_ms && missing.why.ends_with("measured")) {
    missing.why += fmt::format(" at {} ms", timestep_label(*timestep_ms));
  }
  return missing;
}

Ratio Results::at_timestep(const std::string& system, const std::string& first, const std::string& second,
                           const std::string& value, double timestep_ms) const {
  Ratio ratio;
  const Figure under = figure(system, first, value, timestep_ms), over = figure(system, second, value, timestep_ms);
  ratio.figures = {under, over};
  for (const Figure& figure : ratio.figures) {
    if (figure.found == Found::kMissing) {
      ratio.why = figure.why;
      return ratio;
    }
  }
  if (under.found == Found::kFailed || over.found == Found::kFailed) {
    const bool is_first = under.found == Found::kFailed;
    ratio.state = is_first ? Ratio::State::kFirstFailed : Ratio::State::kSecondFailed;
    ratio.why = is_first ? under.why : over.why;
    return ratio;
  }
  ratio.state = Ratio::State::kThere;
  ratio.value = ratio_of(over.value, under.value);
  ratio.least = ratio.most = ratio.value.value;
  return ratio;
}

Results::Curve Results::curve(const std::string& system, const std::string& contender, const std::string& value) const {
  Curve curve;
  curve.by_speed = timed_.contains(system);
  SpeedCurve speeds;
  for (const Figure& figure : figures(system, contender, "realtime_factor")) {
    if (figure.found == Found::kThere) speeds[figure.timestep_ms] = figure.value;
  }
  for (const Figure& figure : figures(system, contender, value, true)) {
    if (figure.found != Found::kThere) {
      if (curve.found == Found::kMissing) curve.why = figure.why;
      if (figure.found == Found::kFailed && curve.points.empty()) curve.found = Found::kFailed;
      continue;
    }
    std::optional<Interval> speed = Interval{figure.timestep_ms, figure.timestep_ms, figure.timestep_ms};
    if (curve.by_speed) speed = speed_at(speeds, figure.timestep_ms);
    if (!speed) {
      curve.why = why_missing(system, contender, "realtime_factor");
      continue;
    }
    curve.found = Found::kThere;
    curve.points.push_back({*speed, figure.value});
  }
  if (curve.why.empty()) curve.why = why_missing(system, contender, value);
  std::ranges::stable_sort(curve.points, {}, [](const Point& point) { return point.speed.value; });
  return curve;
}

Ratio Results::at_equal_speed(const std::string& system, const std::string& first, const std::string& second,
                              const std::string& value) const {
  Ratio ratio;
  const Curve under = curve(system, first, value), over = curve(system, second, value);
  ratio.by_speed = under.by_speed;
  for (const Curve* each : {&under, &over}) {
    if (each->found == Found::kMissing) {
      ratio.why = each->why;
      return ratio;
    }
  }
  if (under.found == Found::kFailed || over.found == Found::kFailed) {
    const bool is_first = under.found == Found::kFailed;
    ratio.state = is_first ? Ratio::State::kFirstFailed : Ratio::State::kSecondFailed;
    ratio.why = is_first ? under.why : over.why;
    return ratio;
  }
  // One end of the first's error at a speed.
  const auto error_at = [&](double speed, double Interval::* end) -> std::optional<double> {
    const std::vector<Point>& points = under.points;
    if (speed <= points.front().speed.value) return points.front().error.*end;
    for (size_t i = 1; i < points.size(); ++i) {
      const Point &a = points[i - 1], &b = points[i];
      if (speed <= b.speed.value * (1 + 1e-9)) {
        return interpolated(speed, a.speed.value, b.speed.value, a.error.*end, b.error.*end);
      }
    }
    return std::nullopt;
  };
  // How far the first's own speeds may be off.
  double fastest = 1, slowest = 1;
  for (const Point& point : under.points) {
    fastest = std::max(fastest, point.speed.high / point.speed.value);
    slowest = std::min(slowest, point.speed.low / point.speed.value);
  }
  double value_sum = 0, low_sum = 0, high_sum = 0;
  int count = 0;
  for (const Point& point : over.points) {
    const auto error = error_at(point.speed.value, &Interval::value);
    if (!error) continue;
    double least = error_at(point.speed.value, &Interval::low).value_or(*error),
           most = error_at(point.speed.value, &Interval::high).value_or(*error);
    for (const double speed : {point.speed.low / fastest, point.speed.high / slowest}) {
      least = std::min(least, error_at(speed, &Interval::low).value_or(least));
      most = std::max(most, error_at(speed, &Interval::high).value_or(most));
    }
    const Interval here = ratio_of(point.error, {*error, least, most});
    value_sum += std::log(here.value);
    low_sum += std::log(here.low);
    high_sum += std::log(here.high);
    ratio.least = count == 0 ? here.value : std::min(ratio.least, here.value);
    ratio.most = count == 0 ? here.value : std::max(ratio.most, here.value);
    ++count;
  }
  if (count == 0) {
    ratio.why = fmt::format("on {} {} is faster at every timestep than {} at any: no common {}", system, second, first,
                            ratio.by_speed ? "speed" : "timestep");
    return ratio;
  }
  ratio.state = Ratio::State::kThere;
  ratio.value = {std::exp(value_sum / count), std::exp(low_sum / count), std::exp(high_sum / count)};
  return ratio;
}

}  // namespace assay
