#include "results/recommend.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "base/quantity.h"
#include "base/text.h"
#include "measures/measure.h"
#include "results/store/facts.h"

namespace assay {
namespace {

// Why a cell is not sound; "" when it is.
std::string fault(const Cell& cell) {
  if (cell.outcome != Outcome::kOk) {
    return fmt::format("{}: {}{}{}", cell.measure, outcome_text(cell.outcome), cell.reason.empty() ? "" : ", ",
                       cell.reason);
  }
  const Value* held = find_value(cell, "grasp_held");
  if (held == nullptr || held->value == 1) return "";
  const Value* dropped = find_value(cell, "drop_time");
  if (held->low && held->high) {
    return fmt::format("{}: held from {:.0f} % of the initial states only ({:.0f} to {:.0f} %)", cell.measure,
                       100 * held->value.value_or(0), 100 * *held->low, 100 * *held->high);
  }
  return fmt::format("{}: the object was dropped{}", cell.measure,
                     dropped == nullptr ? "" : " at " + quantity_text(dropped->value.value_or(0), "s"));
}

// A failure of a whole run says more than one of its pieces, and that more than one while it was timed.
int rank_of(const std::string& measure) {
  if (reads(measure, Reads::kSteps)) return 2;
  return reads(measure, Reads::kPieces) ? 1 : 0;
}

// What the cells of one contender at one timestep say together.
struct Step {
  double timestep_ms = 0;
  std::vector<const Cell*> cells;
  std::string why;  // not sound
};

std::vector<Step> steps_of(const std::vector<const Cell*>& cells) {
  std::vector<Step> steps;
  for (const Cell* cell : cells) {
    if (steps.empty() || !same_timestep(steps.back().timestep_ms, cell->timestep_ms)) {
      steps.push_back({cell->timestep_ms, {}, ""});
    }
    steps.back().cells.push_back(cell);
  }
  for (Step& step : steps) {
    int best = 0;
    for (const Cell* cell : step.cells) {
      const std::string why = fault(*cell);
      if (why.empty() || (!step.why.empty() && rank_of(cell->measure) >= best)) continue;
      step.why = why;
      best = rank_of(cell->measure);
    }
  }
  return steps;
}

// Figures of one step's values that can be limited.
std::map<std::string, Worst> errors_at(const Step& step) {
  std::map<std::string, Worst> errors;
  for (const Cell* cell : step.cells) {
    for (const Value& value : cell->values) {
      if (!value.value || !can_limit(value.name)) continue;
      if (is_reference(*cell)) continue;
      errors.emplace(value.name, Worst{interval_of(*cell, value.name).value_or(Interval{}), step.timestep_ms,
                                       bound_of(*cell, value.name).has_value()});
    }
  }
  return errors;
}

// Up to where it goes on being sound above `at`.
std::string margin_above(const std::vector<Step>& steps, size_t at) {
  for (size_t i = at + 1; i < steps.size(); ++i) {
    if (steps[i].why.empty()) continue;
    const double factor = steps[i].timestep_ms / steps[at].timestep_ms;
    return fmt::format("fails at {} times this step ({} ms): {}", shortest(std::round(100 * factor) / 100),
                       timestep_label(steps[i].timestep_ms), steps[i].why);
  }
  if (at + 1 == steps.size()) return "this is the largest timestep measured: a larger one may do, and be faster";
  return fmt::format("sound up to {} ms, the largest measured", timestep_label(steps.back().timestep_ms));
}

std::string end_of_grid(const std::vector<Step>& steps, size_t at) {
  if (at + 1 == steps.size()) return "largest";
  return at == 0 ? "smallest" : "";
}

constexpr const char* kSmallest = "; this is the smallest timestep measured";

std::string margin_of(const std::vector<Step>& steps, size_t at) {
  return margin_above(steps, at) + (end_of_grid(steps, at) == "smallest" ? kSmallest : "");
}

// Whether it is another name of a contender, timed to test the timing, without an error of its own.
bool is_twin(const std::vector<Step>& steps) {
  const auto compared = [](const Cell* cell) { return find_value(*cell, "aa_ratio") != nullptr; };
  return std::ranges::any_of(steps, [&](const Step& step) { return std::ranges::any_of(step.cells, compared); }) &&
         std::ranges::all_of(steps, [](const Step& step) { return errors_at(step).empty(); });
}

void add_contender(const Results& results, const std::string& contender, SystemAnswers& answers) {
  const std::vector<Step> steps = steps_of(results.cells(answers.system, contender));
  if (is_twin(steps)) return;
  std::map<std::string, Worst> worst;
  std::optional<Interval> held;
  double fails_ms = 0;
  std::string why;
  for (size_t i = 0; i < steps.size(); ++i) {
    const Step& step = steps[i];
    if (fails_ms == 0 && !step.why.empty()) fails_ms = step.timestep_ms, why = step.why;
    const std::map<std::string, Worst> errors = errors_at(step);
    for (const auto& [name, error] : errors) {
      const auto [at, fresh] = worst.emplace(name, error);
      if (fresh) continue;
      const double high = std::max(at->second.value.high, error.value.high);
      if (error.value.value >= at->second.value.value) at->second = error;
      at->second.value.high = high;
    }
    // Whole runs of growing systems alone are no point of a plot.
    if (std::ranges::all_of(step.cells, [](const Cell* cell) { return reads(cell->measure, Reads::kWholeRuns); }))
      continue;
    Point point{contender, step.timestep_ms, results.speed(answers.system, contender, step.timestep_ms), fails_ms == 0,
                "",        fails_ms};
    if (!point.sound) {
      point.why = step.why.empty() || fails_ms < step.timestep_ms
                      ? fmt::format("at {} ms, {}", timestep_label(fails_ms), why)
                      : step.why;
    }
    point.varies = results.varied(contender);
    for (const auto& [name, error] : errors) point.worst.emplace(name, worst.at(name));
    for (const Cell* cell : step.cells) {
      const Value* own = find_value(*cell, "grasp_held");
      if (own != nullptr && own->low && (!held || *own->low < held->low)) held = interval_of(*own);
    }
    point.held = held;
    std::string out = point.why;
    if (point.sound && errors.empty()) out = "no error was measured at this timestep";
    if (point.sound && !point.speed) {
      out = results.timed(answers.system) ? "the speed was not timed here, nor on both sides of this timestep"
                                          : "the system was not timed";
    }
    if (out.empty() && point.speed) {
      Candidate candidate{answers.points.size(), *point.speed, point.worst, margin_of(steps, i), end_of_grid(steps, i)};
      answers.candidates.push_back(std::move(candidate));
    } else {
      answers.excluded.push_back({answers.points.size(), out});
    }
    answers.points.push_back(std::move(point));
  }
}

// Values that cells have, and of a measure that failed everywhere the first that a plot could have had.
void find_values(const Results& results, SystemAnswers& answers) {
  std::map<std::string, std::pair<std::string, std::string>> found;  // unit, measure by name
  std::set<std::string> measured, tried;
  for (const Cell& cell : results.cells()) {
    if (cell.system != answers.system ||
        std::ranges::find(results.contenders(), cell.contender) == results.contenders().end()) {
      continue;
    }
    tried.insert(cell.measure);
    for (const Value& value : cell.values) {
      found.emplace(value.name, std::pair(value.unit, cell.measure));
      measured.insert(cell.measure);
    }
  }
  for (const ValueInfo& row : value_catalogue()) {
    const auto own = found.find(row.name);
    if (own != found.end()) {
      answers.values.push_back(row);
      answers.values.back().unit = own->second.first;
      if (row.limit) answers.errors.push_back(row.name);
      found.erase(own);
    } else if (row.plot && tried.contains(row.measure) && measured.insert(row.measure).second) {
      answers.values.push_back(row);
    }
  }
  for (const auto& [name, own] : found) {
    answers.values.push_back(value_info(name));
    answers.values.back().unit = own.first;
    answers.values.back().measure = own.second;
    if (answers.values.back().limit) answers.errors.push_back(name);
  }
  // A figure that two contenders at least can be compared by.
  for (const std::string_view error : kJudgedErrors) {
    const std::string name(error);
    const auto has = [&](const std::string& contender) {
      return std::ranges::any_of(results.figures(answers.system, contender, name, true),
                                 [](const Figure& figure) { return figure.found == Found::kThere; });
    };
    if (answers.main.empty() && std::ranges::count_if(results.contenders(), has) >= 2) answers.main = name;
  }
  if (answers.main.empty() && !answers.errors.empty()) answers.main = answers.errors.front();
  if (!answers.main.empty()) answers.mains = {answers.main};
}

// Where a floor decides the self-consistency error it ranks nobody.
bool near_floor(const Results& results, const std::string& system, const Point& point, const std::string& value) {
  const std::string measure = value_info(value).measure;
  if (!reads(measure, Reads::kPieces)) return false;
  const auto cells = results.cells(system, point.contender, measure);
  const auto at = cells.find(point.timestep_ms);
  return at != cells.end() && find_value(*at->second, value + "_floor") != nullptr;
}

constexpr const char* kAdded = "penetration_added_max";
constexpr const char* kDepth = "penetration_max";
constexpr const char* kCold = "consistency_cold";

// The start's depth in results that lack the penetration beyond it: the least depth, where engines without common code
// agree on it, else 0. All runs begin with the same state, so none is less deep, and such engines never move alike.
double common_depth(const Results& results, const std::map<std::string, double>& depths) {
  constexpr double kAlike = 1e-6;  // of the depth
  double least = HUGE_VAL;
  for (const auto& [contender, depth] : depths) least = std::min(least, depth);
  std::set<std::string> kinds;  // engines in joint coordinates are one, for several have MuJoCo's solver
  for (const ContenderRow& row : results.rows()) {
    const auto own = depths.find(row.name);
    if (own == depths.end() || own->second > least * (1 + kAlike)) continue;
    const bool joint = text_fact(facts_of(row.capabilities_json), "coordinates") == "joint";
    kinds.insert(joint ? "joint" : row.engine.substr(0, row.engine.find_first_of("-0123456789")));
  }
  return kinds.size() > 1 ? least : 0;
}

// What questions limit of contacts, and what stands for values of today's measures that these results lack.
void find_usual(const Results& results, SystemAnswers& answers) {
  const auto has = [&](const std::string& value) {
    return std::ranges::find(answers.errors, value) != answers.errors.end();
  };
  std::optional<double> stored;
  std::map<std::string, double> depths;  // by contender, the least of its timesteps
  for (const Cell& cell : results.cells()) {
    if (cell.system != answers.system || !reads(cell.measure, Reads::kRun)) continue;
    const auto of = [&](const char* name) {
      const Value* value = find_value(cell, name);
      return value == nullptr ? std::nullopt : value->value;
    };
    if (const auto limit = of("penetration_limit")) stored = std::min(stored.value_or(HUGE_VAL), *limit);
    // the deepest pair overlaps at the start by what is not added to any
    if (const auto depth = of(kDepth), added = of(kAdded); depth && added) {
      answers.start_overlap = std::max(answers.start_overlap, *depth - *added);
    } else if (depth) {
      double& least = depths.try_emplace(cell.contender, *depth).first->second;
      least = std::min(least, *depth);
    }
  }
  if (!has(kAdded)) answers.start_overlap = common_depth(results, depths);
  if (has(kAdded)) {
    answers.usual.push_back({"penetration", kAdded, stored.value_or(kUsualPenetration)});
  } else if (has(kDepth)) {
    answers.usual.push_back({"penetration", kDepth, kUsualPenetration});
    answers.stand_ins[kDepth] =
        "these results are of a version that did not store the penetration beyond the start's overlap: the whole depth "
        "counts, and the default limit is 5 mm for every system";
    if (answers.start_overlap > 0) {
      answers.stand_ins[kDepth] +=
          fmt::format("; shapes overlap by {} when they start", quantity_text(answers.start_overlap, "m"));
    }
  }
  if (has("grasp_slip")) answers.usual.push_back({"slip", "grasp_slip", kUsualSlip});
  if (has("consistency") && !has(kCold)) {
    answers.stand_ins["consistency"] =
        "these results have only the paper's self-consistency error: its pieces start without what the engine keeps "
        "between steps, and the fine-step run that they are compared with has it";
  }
}

void find_fronts(const Results& results, SystemAnswers& answers) {
  std::map<std::string, std::set<std::string>> families;  // contenders by what they are settings of
  for (const Point& point : answers.points) families[point.varies].insert(point.contender);
  std::erase_if(families, [](const auto& family) { return family.second.size() < 2; });
  for (const ValueInfo& value : answers.values) {
    std::vector<FrontPoint> points;
    std::vector<size_t> indices;
    for (const Candidate& candidate : answers.candidates) {
      const auto worst = candidate.worst.find(value.name);
      const Point& point = answers.at(candidate);
      if (worst == candidate.worst.end() || near_floor(results, answers.system, point, value.name)) continue;
      points.push_back({point.contender, point.timestep_ms, candidate.speed.factor, worst->second.value.value});
      indices.push_back(candidate.point);
    }
    if (points.empty()) continue;
    const auto front_of = [&](const std::vector<FrontPoint>& some, const std::vector<size_t>& their) {
      std::vector<FrontMember> front = pareto_front(some, error_resolution(value.unit));
      for (FrontMember& member : front) member.point = their[member.point];
      return front;
    };
    answers.fronts.emplace(value.name, front_of(points, indices));
    for (const auto& [own, names] : families) {
      std::vector<FrontPoint> some;
      std::vector<size_t> their;
      for (size_t i = 0; i < points.size(); ++i) {
        if (!names.contains(points[i].contender)) continue;
        some.push_back(points[i]);
        their.push_back(indices[i]);
      }
      if (!some.empty()) answers.swept[value.name].emplace(own, front_of(some, their));
    }
  }
}

void add_changes(const Results& results, SystemAnswers& answers) {
  for (const std::string& contender : results.contenders()) answers.changes[contender] = results.changes(contender);
}

// By speed; what is equally fast by its error, then as listed.
void sort_candidates(SystemAnswers& answers) {
  const auto main_error = [&](const Candidate& candidate) {
    const auto found = candidate.worst.find(answers.main);
    return found == candidate.worst.end() ? HUGE_VAL : found->second.value.value;
  };
  std::ranges::stable_sort(answers.candidates, [&](const Candidate& a, const Candidate& b) {
    return std::tuple(-a.speed.factor.value, main_error(a)) < std::tuple(-b.speed.factor.value, main_error(b));
  });
}

// The larger of each value, and the larger upper end.
void merge_worst(std::map<std::string, Worst>& into, const std::map<std::string, Worst>& from) {
  for (const auto& [name, worst] : from) {
    const auto [at, fresh] = into.emplace(name, worst);
    if (fresh) continue;
    const double high = std::max(at->second.value.high, worst.value.high);
    if (worst.value.value > at->second.value.value) at->second = worst;
    at->second.value.high = high;
  }
}

// What one contender's point is on all systems together. `margin` and `out` are of the candidate and of the excluded.
struct Joined {
  Point point;
  std::string margin, out;
  std::string end_of_grid = {};  // of all of its systems
};

Joined joined_point(const Results& results, const std::vector<SystemAnswers>& each, const std::string& contender,
                    double timestep_ms) {
  Joined joined{{contender, timestep_ms, {}, true, "", 0, {}, {}, results.varied(contender)}, "", ""};
  Point& point = joined.point;
  double margin_ms = 0;
  for (const SystemAnswers& answers : each) {
    const auto own = std::ranges::find_if(answers.points, [&](const Point& other) {
      return other.contender == contender && same_timestep(other.timestep_ms, timestep_ms);
    });
    if (own == answers.points.end()) {
      if (joined.out.empty()) joined.out = fmt::format("not measured on {}", answers.system);
      continue;
    }
    merge_worst(point.worst, own->worst);
    if (!own->sound) {
      point.sound = false;
      point.fails_ms = point.fails_ms == 0 ? own->fails_ms : std::min(point.fails_ms, own->fails_ms);
      if (point.why.empty()) point.why = fmt::format("on {}: {}", answers.system, own->why);
    } else if (joined.out.empty() && own->worst.empty()) {
      joined.out = fmt::format("no error was measured on {} at this timestep", answers.system);
    }
    if (results.timed(answers.system)) {
      if (!own->speed && joined.out.empty()) {
        joined.out =
            fmt::format("its speed on {} was not timed here, nor on both sides of this timestep", answers.system);
      }
      if (own->speed && (!point.speed || own->speed->factor.value < point.speed->factor.value)) {
        point.speed = own->speed;
      }
    }
    // the system on which it fails first above this timestep
    for (const Point& larger : answers.points) {
      if (larger.contender != contender || larger.timestep_ms <= timestep_ms || larger.sound) continue;
      if (margin_ms != 0 && larger.timestep_ms >= margin_ms) continue;
      margin_ms = larger.timestep_ms;
      joined.margin = fmt::format("fails at {} times this step ({} ms) on {}: {}",
                                  shortest(std::round(100 * larger.timestep_ms / timestep_ms) / 100),
                                  timestep_label(larger.timestep_ms), answers.system, larger.why);
    }
  }
  std::set<double> tried;
  for (const SystemAnswers& answers : each) {
    for (const Point& other : answers.points) {
      if (other.contender == contender) tried.insert(other.timestep_ms);
    }
  }
  if (same_timestep(*tried.rbegin(), timestep_ms)) {
    joined.end_of_grid = "largest";
  } else if (same_timestep(*tried.begin(), timestep_ms)) {
    joined.end_of_grid = "smallest";
  }
  if (!point.sound) joined.out = point.why;
  if (joined.out.empty() && !point.speed) joined.out = "the speed was not timed";
  if (joined.margin.empty()) joined.margin = "no larger timestep that was measured fails";
  if (joined.end_of_grid == "smallest") joined.margin += kSmallest;
  return joined;
}

}  // namespace

SystemAnswers answers_together(const Results& results, const std::vector<std::string>& systems,
                               const std::string& name) {
  std::vector<SystemAnswers> each;
  each.reserve(systems.size());
  SystemAnswers together;
  together.system = name;
  std::set<std::string> values;
  for (const std::string& system : systems) {
    const SystemAnswers& answers = each.emplace_back(answers_of(results, system));
    for (const ValueInfo& value : answers.values) {
      if (values.insert(value.name).second) together.values.push_back(value);
    }
    for (const std::string& error : answers.errors) {
      if (std::ranges::find(together.errors, error) == together.errors.end()) together.errors.push_back(error);
    }
    for (const std::string& main : answers.mains) {
      if (std::ranges::find(together.mains, main) == together.mains.end()) together.mains.push_back(main);
    }
    for (const UsualLimit& own : answers.usual) {
      const auto same = std::ranges::find(together.usual, own.value, &UsualLimit::value);
      if (same == together.usual.end()) {
        together.usual.push_back(own);
      } else {
        same->largest = std::min(same->largest, own.largest);
      }
    }
    together.start_overlap = std::max(together.start_overlap, answers.start_overlap);
    together.stand_ins.insert(answers.stand_ins.begin(), answers.stand_ins.end());
  }
  add_changes(results, together);
  if (!together.mains.empty()) together.main = together.mains.front();
  for (const std::string& contender : results.contenders()) {
    std::set<double> timesteps;
    for (const SystemAnswers& answers : each) {
      for (const Point& point : answers.points) {
        if (point.contender == contender) timesteps.insert(point.timestep_ms);
      }
    }
    for (const double timestep : timesteps) {
      Joined joined = joined_point(results, each, contender, timestep);
      if (joined.out.empty() && joined.point.speed) {  // the first tells of the second
        together.candidates.push_back({together.points.size(), *joined.point.speed, joined.point.worst,
                                       std::move(joined.margin), std::move(joined.end_of_grid)});
      } else {
        together.excluded.push_back({together.points.size(), std::move(joined.out)});
      }
      together.points.push_back(std::move(joined.point));
    }
  }
  sort_candidates(together);
  find_fronts(results, together);
  return together;
}

SystemAnswers answers_of(const Results& results, const std::string& system) {
  SystemAnswers answers;
  answers.system = system;
  add_changes(results, answers);
  find_values(results, answers);
  find_usual(results, answers);
  for (const std::string& contender : results.contenders()) add_contender(results, contender, answers);
  sort_candidates(answers);
  find_fronts(results, answers);
  return answers;
}

std::string_view usual_option(std::string_view value) {
  if (value.starts_with("penetration")) return "penetration";
  return value == "grasp_slip" ? "slip" : "";
}

std::optional<Exceeded> first_exceeded(const SystemAnswers& answers, const Candidate& candidate, const Limits& limits) {
  const Point& own = answers.at(candidate);
  std::optional<Exceeded> first;
  for (const Candidate& other : answers.candidates) {
    const Point& point = answers.at(other);
    if (point.contender != own.contender || point.timestep_ms <= own.timestep_ms) continue;
    if (first && point.timestep_ms >= first->timestep_ms) continue;
    for (const auto& [name, limit] : limits.largest) {
      const auto found = other.worst.find(name);
      if (found == other.worst.end() || !exceeds(found->second.value.value, limit)) continue;
      first = Exceeded{point.timestep_ms, name, found->second};
      break;
    }
  }
  return first;
}

namespace {

// Of a contender, with ascending timesteps.
std::vector<const Point*> points_of(const SystemAnswers& answers, const std::string& contender) {
  std::vector<const Point*> points;
  for (const Point& point : answers.points) {
    if (point.contender == contender) points.push_back(&point);
  }
  return points;
}

// kNone where the point tells that nothing better lies there; else what it lacks for that.
End unknown_at(const Point& point, const Limits& limits) {
  if (!point.sound) return End::kNone;
  bool whole = !point.worst.empty();
  for (const auto& [name, limit] : limits.largest) {
    const auto own = point.worst.find(name);
    if (own != point.worst.end() && exceeds(own->second.value.value, limit)) return End::kNone;
    whole = whole && own != point.worst.end();
  }
  if (!point.speed) return End::kTimed;
  return whole ? End::kNone : End::kMeasured;
}

}  // namespace

Edge edge_of(const SystemAnswers& answers, const Candidate& candidate, const Limits& limits) {
  const std::vector<const Point*> points = points_of(answers, answers.at(candidate).contender);
  const auto own = std::ranges::find(points, &answers.at(candidate));
  Edge edge;
  edge.larger = own + 1 == points.end() ? End::kTried : End::kNone;
  for (auto at = own + 1; at != points.end(); ++at) {
    const End unknown = unknown_at(**at, limits);
    if (unknown == End::kNone) {
      if (edge.larger != End::kNone) edge.larger = End::kBetween;
      break;
    }
    if (edge.larger == End::kNone) edge.larger = unknown;
    edge.between_ms.push_back((*at)->timestep_ms);
  }
  if (edge.larger != End::kBetween) edge.between_ms.clear();
  edge.smaller = own == points.begin() ? End::kTried : End::kNone;
  for (auto at = own; at != points.begin();) {
    const End unknown = unknown_at(**--at, limits);
    if (unknown == End::kNone) {
      edge.smaller = End::kNone;
      break;
    }
    if (edge.smaller == End::kNone) edge.smaller = unknown;
  }
  return edge;
}

namespace {

// A number of three digits in the largest unit in which it is at least 1; not in cm, as the page.
struct Written {
  double number = 0;
  InputUnit unit;

  double value() const { return number * unit.scale; }
  std::string text() const { return shortest(number) + (unit.text.empty() ? "" : " " + unit.text); }
};

// `up`: -1 rounds down, 1 up, 0 to the nearest.
Written written(double value, const std::string& unit, int up) {
  std::vector<InputUnit> units = input_units(unit);
  std::ranges::stable_sort(units, std::greater(), &InputUnit::scale);
  auto own = std::ranges::find_if(
      units, [&](const InputUnit& each) { return each.text != "cm" && each.scale <= value * (1 + 1e-9); });
  if (own == units.end()) own = std::ranges::find(units, units.back().scale, &InputUnit::scale);
  const std::string digits = fmt::format("{:.2e}", value / own->scale);  // "2.41e+00"
  const auto number = [](const std::string& text) { return std::strtod(text.c_str(), nullptr); };
  Written best{number(digits), *own};
  if ((up > 0 && exceeds(value, best.value())) || (up < 0 && best.value() > value)) {
    int hundredths = 100 * (digits[0] - '0') + 10 * (digits[2] - '0') + (digits[3] - '0') + up;
    int power = std::atoi(digits.c_str() + 5);
    if (hundredths < 100) hundredths = 999, --power;
    best.number = number(fmt::format("{}.{:02}e{}", hundredths / 100, hundredths % 100, power));
  }
  return best;
}

const std::string& unit_of(const SystemAnswers& answers, const std::string& value) {
  return std::ranges::find(answers.values, value, &ValueInfo::name)->unit;
}

// Each limit in turn: the least that some candidate within all others has of it.
std::vector<Relaxation> relaxations(const SystemAnswers& answers, const Limits& limits) {
  std::vector<Relaxation> relaxed;
  const auto within = [&](const Limits& others, const std::string& value) {
    std::vector<size_t> found;
    for (size_t i = 0; i < answers.candidates.size(); ++i) {
      const Candidate& candidate = answers.candidates[i];
      if (excess(candidate, others) == 0 && (value.empty() || candidate.worst.contains(value))) found.push_back(i);
    }
    return found;
  };
  for (size_t at = 0; at < limits.largest.size(); ++at) {
    const std::string& value = limits.largest[at].first;
    Limits others = limits;
    others.largest.erase(others.largest.begin() + static_cast<std::ptrdiff_t>(at));
    const std::vector<size_t> found = within(others, value);
    if (found.empty()) continue;
    const auto own = [&](size_t i) { return answers.candidates[i].worst.at(value).value.value; };
    const Written least = written(own(*std::ranges::min_element(found, {}, own)), unit_of(answers, value), 1);
    const auto fastest = std::ranges::find_if(found, [&](size_t i) { return !exceeds(own(i), least.value()); });
    if (fastest == found.end()) continue;  // no number is above it
    relaxed.push_back({value, least.value(), least.text(), *fastest});
  }
  if (limits.realtime && !answers.candidates.empty()) {
    Limits others = limits;
    others.realtime.reset();
    const std::vector<size_t> found = within(others, "");
    if (!found.empty()) {
      const Written most = written(answers.candidates[found.front()].speed.factor.value, "times", -1);
      relaxed.push_back({"", most.number, shortest(most.number), found.front()});
    }
  }
  return relaxed;
}

}  // namespace

std::string limit_text(double largest, const std::string& unit) { return written(largest, unit, 0).text(); }

bool exceeds(double figure, double limit) { return figure > limit * (1 + 1e-12); }

std::optional<double> excess(const Candidate& candidate, const Limits& limits, bool whole) {
  double most = 0;
  for (const auto& [name, limit] : limits.largest) {
    const auto found = candidate.worst.find(name);
    if (found == candidate.worst.end()) return std::nullopt;
    const double error = whole ? found->second.value.high : found->second.value.value;
    if (exceeds(error, limit)) most = std::max(most, limit > 0 ? error / limit : HUGE_VAL);
  }
  const Interval& speed = candidate.speed.factor;
  const double least = limits.realtime.value_or(0), own = whole ? speed.low : speed.value;
  if (own < least) most = std::max(most, least / own);
  return most;
}

Recommendation recommend(const SystemAnswers& answers, const Limits& limits) {
  Recommendation found;
  std::set<std::string> seen;
  std::map<std::string, std::pair<double, size_t>> missing;  // of each contender the least factor, and where
  for (size_t i = 0; i < answers.candidates.size(); ++i) {
    const Candidate& candidate = answers.candidates[i];
    const auto out = excess(candidate, limits);
    if (!out) continue;
    if (*out > 0) {
      const auto [at, fresh] = missing.try_emplace(answers.at(candidate).varies, *out, i);
      if (!fresh && *out < at->second.first) at->second = {*out, i};
      continue;
    }
    if (!found.certain && excess(candidate, limits, true) == 0) found.certain = i;
    if (!seen.insert(answers.at(candidate).varies).second) continue;
    found.contenders.push_back(i);
  }
  std::vector<std::pair<double, size_t>> beyond;
  for (const auto& [varies, miss] : missing) {
    if (!seen.contains(varies)) beyond.push_back(miss);
  }
  std::ranges::sort(beyond);
  for (const auto& [factor, i] : beyond) found.beyond.push_back(i);
  if (found.contenders.empty()) {
    if (!found.beyond.empty()) found.nearest = found.beyond.front();
    found.relaxed = relaxations(answers, limits);
    return found;
  }
  const size_t best = found.contenders.front();
  found.best = best;
  const double slowest = answers.candidates[best].speed.factor.low;
  for (const size_t i : found.contenders) {
    if (i != best && answers.candidates[i].speed.factor.high >= slowest) found.alike.push_back(i);
  }
  return found;
}

}  // namespace assay
