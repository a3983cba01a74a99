// Values that follow from several cells.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/text.h"
#include "measures/accuracy.h"
#include "measures/grasp.h"
#include "measures/measure.h"
#include "measures/scaling.h"
#include "measures/statistics.h"
#include "measures/step_time.h"
#include "results/store/facts.h"
#include "results/store/timing_samples.h"
#include "run/coordinator/ratios.h"
#include "run/coordinator/run.h"

namespace assay {
namespace {

// Errors below this many floors come from the floor as much as from the timestep.
constexpr double kNearFloor = 3;

// Timings whose middle half is wider than this are noisy.
constexpr double kWideSpread = 0.15;

using Curve = std::vector<const Cell*>;  // of one system, contender and measure, ascending in timestep

std::optional<double> value_of(const Cell& cell, std::string_view name) {
  const Value* found = find_value(cell, name);
  return found == nullptr ? std::nullopt : found->value;
}

std::map<std::pair<std::string, std::string>, Curve> curves(const std::vector<Cell>& cells, Reads read) {
  std::map<std::pair<std::string, std::string>, Curve> found;
  for (const Cell& cell : cells) {
    if (reads(cell.measure, read) && cell.outcome == Outcome::kOk)
      found[{cell.system, cell.contender}].push_back(&cell);
  }
  for (auto& [name, curve] : found) std::ranges::sort(curve, {}, [](const Cell* cell) { return cell->timestep_ms; });
  return found;
}

// An error of runs against their solution, with the values that follow from its curve.
struct ErrorOfTruth {
  std::string name, unit, order, floor;
  double rounding;  // where the cells do not say it
};

const std::vector<ErrorOfTruth>& errors_of_truth() {
  // In ms or of an impulse: below it nothing is an order, up to ten times it no floor.
  constexpr double kRounding = 1e-5;
  static const std::vector<ErrorOfTruth> list = {
      {"truth_error_max", "m", "truth_order", "truth_floor", 0},
      {"event_time_error", "ms", "event_time_order", "event_time_floor", kRounding},
      {"normal_impulse_error", "1", "normal_impulse_order", "normal_impulse_floor", kRounding},
      {"tangential_impulse_error", "1", "tangential_impulse_order", "tangential_impulse_floor", kRounding}};
  return list;
}

std::optional<double> derive_order_and_floor(const Curve& curve, const ErrorOfTruth& of,
                                             std::vector<Store::Derived>& derived) {
  std::vector<ErrorAt> errors;
  for (size_t i = 0; i < curve.size(); ++i) {
    const auto error = value_of(*curve[i], of.name);
    if (!error) continue;
    errors.push_back({curve[i]->timestep_ms, *error, value_of(*curve[i], "truth_rounding").value_or(0)});
    if (of.rounding > 0) errors.back().rounding = of.rounding;
    const auto finer = i > 0 ? value_of(*curve[i - 1], of.name) : std::nullopt;
    if (!finer || std::min(*error, *finer) <= of.rounding) continue;
    if (const auto order = observed_order(curve[i - 1]->timestep_ms, *finer, curve[i]->timestep_ms, *error)) {
      derived.push_back({curve[i]->id, {of.order, "1", order, {}, {}}});
    }
  }
  const auto floor = error_floor(errors);
  if (floor) derived.push_back({curve.front()->id, {of.floor, of.unit, floor, {}, {}}});
  return floor;
}

void derive_truth(const std::vector<Cell>& cells, std::vector<Store::Derived>& derived,
                  std::vector<std::string>& warnings) {
  for (const auto& [name, curve] : curves(cells, Reads::kSolution)) {
    for (ErrorOfTruth of : errors_of_truth()) {
      const bool distance = of.unit == "m";
      // Over the whole run; results of an earlier version have only the run's end.
      const bool whole =
          std::ranges::all_of(curve, [&](const Cell* cell) { return value_of(*cell, of.name).has_value(); });
      if (distance && !whole) of.name = "truth_error";
      const auto floor = derive_order_and_floor(curve, of, derived);
      if (!distance || !floor) continue;
      warnings.push_back(
          fmt::format("{} on {}: an error of {:.2g} m that does not depend on the timestep: a set-up error or "
                      "a property of the engine, not integration",
                      name.second, name.first, *floor));
    }
  }
}

// The floor of a curve: the error of a restart at the fine-step run's own timestep (nothing where the reference starts
// anew, too), or where the curve stops falling, whichever is larger. Errors near it are bounds of what the timestep
// costs: by the triangle inequality at most the measured distance and the floor.
void derive_floor(const Curve& curve, const std::string& value, std::optional<double> restart,
                  std::vector<Store::Derived>& derived) {
  std::vector<ErrorAt> errors;
  for (const Cell* cell : curve) {
    const auto error = value_of(*cell, value);
    if (error && !value_of(*cell, "restart_floor")) errors.push_back({cell->timestep_ms, *error, 0});
  }
  const auto flat = plateau(errors);
  if (!restart && !flat) return;
  const double floor = std::max(restart.value_or(0), flat.value_or(0));
  for (const Cell* cell : curve) {
    const Value* error = find_value(*cell, value);
    if (error == nullptr || !error->value || value_of(*cell, "restart_floor")) continue;
    if (*error->value > kNearFloor * floor) continue;
    derived.push_back({cell->id, {value + "_floor", "m", floor, {}, {}}});
    derived.push_back({cell->id, {value + "_bound", "m", error->high.value_or(*error->value) + floor, {}, {}}});
  }
}

void derive_consistency(const std::vector<Cell>& cells, std::vector<Store::Derived>& derived) {
  for (const auto& [name, curve] : curves(cells, Reads::kPieces)) {
    derive_floor(curve, "consistency", value_of(*curve.front(), "restart_floor"), derived);
    derive_floor(curve, "consistency_cold", std::nullopt, derived);
  }
}

// Up to which timesteps runs hold, of measures that say so. A run that failed did not, nor did one that failed to from
// some initial state. An unsupported one is left out.
void derive_held(const std::vector<Cell>& cells, std::vector<Store::Derived>& derived) {
  std::map<std::tuple<std::string, std::string, const Measure*>, Curve> tried;
  for (const Cell& cell : cells) {
    const Measure* measure = measure_of(cell.measure);
    if (measure != nullptr && !measure->held.empty() && cell.outcome != Outcome::kUnsupported) {
      tried[{cell.system, cell.contender, measure}].push_back(&cell);
    }
  }
  for (auto& [name, curve] : tried) {
    const std::string_view value = std::get<const Measure*>(name)->held;
    std::ranges::sort(curve, {}, [](const Cell* cell) { return cell->timestep_ms; });
    std::vector<HeldAt> timesteps;
    for (const Cell* cell : curve) {
      const bool held = cell->outcome == Outcome::kOk && value_of(*cell, value).value_or(0) == 1;
      timesteps.push_back({cell->timestep_ms, held});
    }
    const LargestHeld largest = largest_held(timesteps);
    for (const Cell* cell : curve) {
      if (largest.any && cell->timestep_ms == *largest.any) {
        derived.push_back({cell->id, {"largest_stable_timestep", "ms", largest.any, {}, {}}});
      }
      if (largest.without_hole && cell->timestep_ms == *largest.without_hole) {
        derived.push_back({cell->id, {"stable_up_to_timestep", "ms", largest.without_hole, {}, {}}});
      }
    }
  }
}

// On the cell of the family's largest system.
void derive_scaling(const Store& store, const std::vector<Cell>& cells, std::uint64_t seed,
                    std::vector<Store::Derived>& derived) {
  std::map<std::string, std::pair<std::string, double>> sizes;  // of a system: its family, its bodies
  for (const SystemRow& row : store.systems()) {
    const nlohmann::json facts = facts_of(row.json);
    const std::string family = text_fact(facts, "family");
    const double bodies = number_fact(facts, "bodies");
    if (!family.empty() && bodies > 0) sizes[row.name] = {family, bodies};
  }
  struct Group {
    std::vector<TimeAtSize> points;
    const Cell* largest = nullptr;
    double size = 0;
  };
  std::map<std::tuple<std::string, std::string, double>, Group> groups;
  for (const Cell& cell : cells) {
    const auto found = sizes.find(cell.system);
    if (!reads(cell.measure, Reads::kWholeRuns) || cell.outcome != Outcome::kOk || found == sizes.end()) continue;
    const auto& [family, size] = found->second;
    Group& group = groups[{family, cell.contender, cell.timestep_ms}];
    for (const SampleSeries& series : store.samples(cell.id)) {
      if (series.name != "run_time_s") continue;
      // Systems of one size differ in their seed: more runs of that size.
      auto same = std::ranges::find(group.points, size, &TimeAtSize::size);
      if (same == group.points.end()) same = group.points.insert(same, {size, {}});
      same->seconds.insert(same->seconds.end(), series.values.begin(), series.values.end());
    }
    if (size <= group.size) continue;
    group.size = size;
    group.largest = &cell;
  }
  for (const auto& [name, group] : groups) {
    if (const auto exponent = scaling_exponent(group.points, seed)) {
      derived.push_back({group.largest->id, {"scaling_exponent", "1", exponent->value, exponent->low, exponent->high}});
    }
  }
}

void warn_of_noise(const Store& store, const std::vector<Cell>& cells, std::vector<std::string>& warnings) {
  int noisy = 0, timed = 0;
  double widest = 0;
  std::string where;
  for (const Cell& cell : cells) {
    if (!reads(cell.measure, Reads::kSteps)) continue;
    for (const SampleSeries& series : store.samples(cell.id)) {
      if (series.name != "round_step_time_us") continue;
      const double spread = relative_spread(series.values);
      ++timed;
      if (spread > kWideSpread) ++noisy;
      if (spread > widest) {
        widest = spread;
        where = fmt::format("{} on {} at {} ms", cell.contender, cell.system, timestep_label(cell.timestep_ms));
      }
    }
  }
  if (noisy == 0) return;
  warnings.push_back(
      fmt::format("noisy timing: in {} of {} cells the middle half of the rounds spreads over more than {:.0f} "
                  "% of the median (most: {:.0f} %, {}); measure on a quieter machine",
                  noisy, timed, 100 * kWideSpread, 100 * widest, where));
}

// Step time of `cell` over that of `first`. Nothing for samples of version 0.1.
std::optional<Interval> time_ratio(const Store& store, const Cell& cell, const Cell& first) {
  const auto of = timed_rounds(store.samples(cell.id)), to = timed_rounds(store.samples(first.id));
  return of && to ? step_time_ratio(*of, *to) : std::nullopt;
}

// Contenders that are the same engine with the same settings: their ratio shows the error of the timing. And the pairs
// that the campaign asks for.
void derive_ratios(const Store& store, const std::vector<Cell>& cells, std::vector<Store::Derived>& derived) {
  std::map<std::tuple<std::string, std::string, std::string>, std::vector<std::string>> alike;
  for (const ContenderRow& row : store.contenders()) {
    if (!row.version.empty()) alike[{row.engine, row.settings, row.build_json}].push_back(row.name);
  }
  std::vector<std::array<std::string, 3>> pairs;  // value's name, of, to
  for (const auto& [key, names] : alike) {
    for (size_t i = 1; i < names.size(); ++i) pairs.push_back({"aa_ratio", names[i], names.front()});
  }
  for (const auto& [of, to] : asked_ratios(store)) pairs.push_back({"time_ratio", of, to});

  std::map<std::tuple<std::string, std::string, double>, const Cell*> timed;
  for (const Cell& cell : cells) {
    if (reads(cell.measure, Reads::kSteps) && cell.outcome == Outcome::kOk) {
      timed[{cell.system, cell.contender, cell.timestep_ms}] = &cell;
    }
  }
  for (const auto& [name, of, to] : pairs) {
    for (const auto& [at, cell] : timed) {
      if (std::get<1>(at) != of) continue;
      const auto first = timed.find({std::get<0>(at), to, std::get<2>(at)});
      if (first == timed.end()) continue;
      const auto ratio = time_ratio(store, *cell, *first->second);
      if (!ratio) continue;
      Value value = {name, "1", ratio->value, {}, {}};
      if (std::isfinite(ratio->low)) std::tie(value.low, value.high) = std::pair(ratio->low, ratio->high);
      derived.push_back({cell->id, std::move(value)});
    }
  }
}

}  // namespace

std::vector<std::pair<std::string, std::string>> asked_ratios(const Store& store) {
  const std::string text = store.manifest("ratios").value_or("{}");
  const auto asked = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  std::vector<std::pair<std::string, std::string>> pairs;
  bool sound = asked.is_object();
  if (sound) {
    for (const auto& [of, to] : asked.items()) {
      sound = sound && to.is_string();
      if (to.is_string()) pairs.emplace_back(of, to.get<std::string>());
    }
  }
  if (sound) return pairs;
  constexpr size_t kShownLetters = 80;
  throw InputError(fmt::format(
      "the manifest of '{}' has '{}' for 'ratios', which is no object that gives each contender another: it "
      "was written by another program; measure again into another directory",
      store.dir(), text.substr(0, kShownLetters)));
}

const std::vector<std::string>& derived_values() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all = {
        "consistency_floor", "consistency_bound",       "consistency_cold_floor", "consistency_cold_bound", "aa_ratio",
        "time_ratio",        "largest_stable_timestep", "stable_up_to_timestep",  "scaling_exponent"};
    for (const ErrorOfTruth& of : errors_of_truth()) all.insert(all.end(), {of.order, of.floor});
    return all;
  }();
  return names;
}

std::vector<std::string> derive_values(Store& store) {
  const std::vector<Cell> cells = store.cells();
  std::vector<Store::Derived> derived;
  std::vector<std::string> warnings;
  derive_truth(cells, derived, warnings);
  derive_consistency(cells, derived);
  derive_held(cells, derived);
  derive_scaling(store, cells, 1, derived);
  derive_ratios(store, cells, derived);
  warn_of_noise(store, cells, warnings);
  store.set_derived(derived_values(), derived);
  return warnings;
}

}  // namespace assay
