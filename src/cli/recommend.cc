// `assay recommend`: for an error that is good enough, who is the fastest, at which timestep.
#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <set>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "claims/results.h"
#include "cli/cli.h"
#include "measures/pareto.h"
#include "measures/statistics.h"
#include "store/store.h"

namespace assay::cli {
namespace {

struct Options {
  std::vector<std::string> where;  // SYSTEM, or DIR SYSTEM
  std::string error, measure = "consistency";
  bool json = false;
};

// ---- an error with its unit -------------------------------------------------------------------------------------------

struct Unit {
  const char *written, *base;
  double scale;
};
constexpr std::array kUnits = {
    Unit{"m", "m", 1},     Unit{"cm", "m", 1e-2},      Unit{"mm", "m", 1e-3},
    Unit{"um", "m", 1e-6}, Unit{"\u00b5m", "m", 1e-6}, Unit{"nm", "m", 1e-9},
    Unit{"rad", "rad", 1}, Unit{"mrad", "rad", 1e-3},  Unit{"deg", "rad", 0.017453292519943295},
    Unit{"J", "J", 1},     Unit{"mJ", "J", 1e-3},      Unit{"uJ", "J", 1e-6},
    Unit{"%", "1", 1e-2},
};

std::string units_of(const std::string& base) {
  std::vector<std::string> names;
  for (const Unit& unit : kUnits) {
    if (unit.base == base) names.emplace_back(unit.written);
  }
  return names.empty() ? fmt::format("a plain number (of {})", base) : join(names, ", ");
}

// "1mm", "0.5 deg", "1e-3" in the unit of the value.
double parse_error(const std::string& text, const std::string& base) {
  size_t end = text.find_last_of("0123456789.");
  end = end == std::string::npos ? 0 : end + 1;
  const auto number = parse_number(text.substr(0, end));
  std::string unit = text.substr(end);
  unit.erase(0, unit.find_first_not_of(' ') == std::string::npos ? unit.size() : unit.find_first_not_of(' '));
  double scale = 1;
  if (!unit.empty() && unit != base) {
    const auto* found =
        std::ranges::find_if(kUnits, [&](const Unit& each) { return each.written == unit && each.base == base; });
    if (found == kUnits.end()) {
      throw InputError(
          fmt::format("--error is '{}', whose unit is none of this measure: use {}", text, units_of(base)));
    }
    scale = found->scale;
  }
  if (!number || !(*number > 0)) {
    throw InputError(fmt::format("--error is '{}': give a positive number with a unit, as in 1mm", text));
  }
  return *number * scale;
}

// ---- what was measured ------------------------------------------------------------------------------------------------

std::string results_dir(const std::vector<std::string>& where) {
  if (where.size() == 2) return where.front();
  return std::filesystem::exists("assay.sqlite") ? "." : "results";
}

// The value that a measure's cells are known by.
std::string value_name(const std::string& measure) {
  if (measure == "truth") return "truth_error";
  if (measure == "drift") return "energy_drift";
  if (measure == "violation") return "joint_dislocation_max";
  return measure;
}

struct Choice {
  std::string contender;
  double timestep_ms = 0;
  Interval speed;  // realtime factor
  Interval error;
};

struct Measured {
  std::vector<Choice> choices;
  std::string unit;
};

Measured measured(const Store& store, const std::string& dir, const std::string& system, const std::string& name) {
  const std::vector<Cell> cells = store.cells();
  std::set<std::string> systems, names;
  std::map<std::string, SpeedCurve> speeds;
  for (const Cell& cell : cells) {
    systems.insert(cell.system);
    if (cell.system != system) continue;
    if (cell.measure != "raw_speed" && cell.measure != "scaling") {
      for (const Value& value : cell.values) names.insert(value.name);
    }
    const Value* factor = find_value(cell, "realtime_factor");
    if (factor != nullptr && cell.outcome == Outcome::kOk) {
      speeds[cell.contender][cell.timestep_ms] = interval_of(*factor);
    }
  }
  if (!systems.contains(system)) {
    throw InputError(
        fmt::format("'{}' has no system '{}'{}", dir, system, did_you_mean(system, {systems.begin(), systems.end()})));
  }
  if (!names.contains(name)) {
    throw InputError(fmt::format("system '{}' was not measured by '{}'{}", system, name,
                                 did_you_mean(name, {names.begin(), names.end()})));
  }
  Measured found;
  for (const Cell& cell : cells) {
    if (cell.system != system || cell.outcome != Outcome::kOk || cell.contender == kHarness) continue;
    const Value* error = find_value(cell, name);
    // At the reference's own timestep the error says nothing of integration.
    if (error == nullptr || find_value(cell, "restart_floor") != nullptr) continue;
    found.unit = error->unit;
    if (const auto speed = speed_at(speeds[cell.contender], cell.timestep_ms)) {
      found.choices.push_back({cell.contender, cell.timestep_ms, *speed, interval_of(*error)});
    }
  }
  if (found.choices.empty()) {
    throw InputError(
        fmt::format("no contender has both a speed and '{}' on system '{}': measure raw_speed too", name, system));
  }
  return found;
}

// ---- the answer -------------------------------------------------------------------------------------------------------

std::string with_interval(const Interval& interval) {
  if (interval.low == interval.high) return fmt::format("{:.4g}", interval.value);
  return fmt::format("{:.4g} ({:.4g} to {:.4g})", interval.value, interval.low, interval.high);
}

std::string choices_table(const std::vector<Choice>& choices, const std::string& unit) {
  std::vector<std::vector<std::string>> rows;
  rows.reserve(choices.size());
  for (const Choice& choice : choices) {
    rows.push_back({choice.contender, timestep_label(choice.timestep_ms), with_interval(choice.speed),
                    with_interval(choice.error)});
  }
  return table(
      {"contender", "timestep (ms)", "times realtime", unit == "1" ? "error" : fmt::format("error ({})", unit)}, rows);
}

Json choice_json(const Choice& choice) {
  const auto interval = [](const Interval& of) {
    return Json{{"value", of.value}, {"low", of.low}, {"high", of.high}};
  };
  return {{"contender", choice.contender},
          {"timestep_ms", choice.timestep_ms},
          {"realtime_factor", interval(choice.speed)},
          {"error", interval(choice.error)}};
}

Json choices_json(const std::vector<Choice>& choices) {
  Json list = Json::array();
  for (const Choice& choice : choices) list.push_back(choice_json(choice));
  return list;
}

std::vector<SpeedAndError> points_of(const std::vector<Choice>& choices) {
  std::vector<SpeedAndError> points;
  points.reserve(choices.size());
  for (const Choice& choice : choices) points.push_back({choice.speed.value, choice.error.value});
  return points;
}

// Each contender at its fastest within the limit, the fastest first.
std::vector<Choice> fastest_of_each(const std::vector<Choice>& choices, double limit) {
  std::map<std::string, std::vector<Choice>> by_contender;
  for (const Choice& choice : choices) by_contender[choice.contender].push_back(choice);
  std::vector<Choice> fastest;
  for (const auto& [contender, own] : by_contender) {
    if (const auto best = fastest_within(points_of(own), limit)) fastest.push_back(own[*best]);
  }
  std::ranges::stable_sort(fastest, std::ranges::greater(), [](const Choice& choice) { return choice.speed.value; });
  return fastest;
}

int recommend(const Options& options) {
  const std::string& system = options.where.back();
  const std::string dir = results_dir(options.where), name = value_name(options.measure);
  const auto [choices, unit] = measured(Store::open(dir), dir, system, name);
  const double limit = parse_error(options.error, unit);
  const std::vector<Choice> fastest = fastest_of_each(choices, limit);
  std::vector<Choice> front;
  for (const size_t i : pareto_front(points_of(choices))) front.push_back(choices[i]);
  // Whose speed the measurement cannot tell from the fastest one's.
  std::vector<Choice> alike;
  for (size_t i = 1; i < fastest.size(); ++i) {
    if (fastest[i].speed.high >= fastest.front().speed.low) alike.push_back(fastest[i]);
  }
  if (options.json) {
    print_json({{"system", system},
                {"measure", name},
                {"unit", unit},
                {"error", limit},
                {"recommended", fastest.empty() ? Json(nullptr) : choice_json(fastest.front())},
                {"not_told_apart", choices_json(alike)},
                {"contenders", choices_json(fastest)},
                {"front", choices_json(front)}});
    return fastest.empty() ? kFailed : kDone;
  }
  if (fastest.empty()) {
    const Choice& best =
        *std::ranges::min_element(choices, {}, [](const Choice& choice) { return choice.error.value; });
    message(fmt::format("no contender's {} on {} is within {}: the smallest is {:.3g} {}, of {} at {} ms", name, system,
                        options.error, best.error.value, unit == "1" ? "" : unit, best.contender,
                        timestep_label(best.timestep_ms)));
    return kFailed;
  }
  const Choice& best = fastest.front();
  print(fmt::format("{}, {} within {}: {} at {} ms\n", system, name, options.error, best.contender,
                    timestep_label(best.timestep_ms)));
  if (best.error.high > limit) print("its error's interval goes beyond that\n");
  for (const Choice& choice : alike) {
    print(fmt::format("as fast, as far as was measured: {} at {} ms\n", choice.contender,
                      timestep_label(choice.timestep_ms)));
  }
  print("\nEach contender at its fastest within the limit:\n" + choices_table(fastest, unit));
  print("\nWhat nothing beats in both speed and error:\n" + choices_table(front, unit));
  return kDone;
}

}  // namespace

void add_recommend(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "recommend", "Say who is the fastest for an error that is good enough, and at which timestep",
      {{"assay recommend results humanoid --error 1mm", "by consistency"},
       {"assay recommend results planar-chain --error 1e-3 --measure energy_drift_relative", "by any measured value"}});
  const auto options = std::make_shared<Options>();
  command->add_option("SYSTEM", options->where, "System, after the results directory (default: results, or here)")
      ->required()
      ->expected(1, 2)
      ->type_name("[DIR] SYSTEM");
  command->add_option("--error", options->error, "The largest error that will do, with its unit: 1mm, 0.5deg, 2%")
      ->required()
      ->type_name("E");
  command->add_option("--measure", options->measure, "Measure, or the name of a value (default: consistency)")
      ->type_name("NAME");
  command->add_flag("--json", options->json, "Print JSON")->disable_flag_override();
  command->callback([&action, options] { action = [options] { return recommend(*options); }; });
}

}  // namespace assay::cli
