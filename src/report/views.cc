#include "report/views.h"

#include <algorithm>
#include <iterator>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/quantity.h"
#include "base/text.h"
#include "measures/measure.h"
#include "report/cards.h"
#include "results/line_up.h"
#include "results/recommend.h"
#include "results/values.h"

namespace assay {
namespace {

using nlohmann::json;

json row(const ValueInfo& info) {
  return {{"name", info.name},
          {"unit", info.unit},
          {"label", info.label},
          {"short", info.brief},
          {"better", better_text(info.better)},
          {"measure", info.measure},
          {"plot", info.plot},
          {"limit", info.limit},
          {"meaning", info.meaning}};
}

json point_data(const Point& point) {
  json speed = nullptr;
  if (point.speed) {
    speed = {{"value", point.speed->factor.value},
             {"low", point.speed->factor.low},
             {"high", point.speed->factor.high},
             {"timed", point.speed->timed},
             {"between", {point.speed->below_ms, point.speed->above_ms}}};
  }
  return {{"contender", point.contender},
          {"timestep_ms", point.timestep_ms},
          {"speed", std::move(speed)},
          {"sound", point.sound},
          {"why", point.why}};
}

json candidate_data(const Candidate& candidate) {
  json worst = json::object();
  for (const auto& [name, of] : candidate.worst) {
    worst[name] = {{"value", of.value.value}, {"at_ms", of.at_ms}};
    if (of.is_bound) worst[name]["bound"] = true;
    if (of.value.low == of.value.high || of.is_bound) continue;
    worst[name]["low"] = of.value.low;
    worst[name]["high"] = of.value.high;
  }
  return {{"point", candidate.point}, {"worst", std::move(worst)}, {"margin", candidate.margin}};
}

json view_data(const Results& results, const std::string& system) {
  const SystemAnswers answers = answers_of(results, system);
  json values = json::array(), points = json::array(), candidates = json::array(), excluded = json::array();
  for (const ValueInfo& value : answers.values) values.push_back(value.name);
  for (const Point& point : answers.points) points.push_back(point_data(point));
  for (const Candidate& candidate : answers.candidates) candidates.push_back(candidate_data(candidate));
  for (const Excluded& each : answers.excluded) {
    const Point& point = answers.points[each.point];
    excluded.push_back({{"contender", point.contender}, {"timestep_ms", point.timestep_ms}, {"why", each.why}});
  }
  json fronts = json::object();
  for (const auto& [name, members] : answers.fronts) {
    json front = json::array();
    for (const FrontMember& member : members) front.push_back({{"point", member.point}, {"equals", member.equals}});
    fronts[name] = std::move(front);
  }
  json swept = json::object();
  for (const auto& [name, lines] : answers.swept) {
    for (const auto& [own, members] : lines) {
      for (const FrontMember& member : members) swept[name][own].push_back(member.point);
    }
  }
  return {{"system", system},
          {"main", answers.main.empty() ? json(nullptr) : json(answers.main)},
          {"values", std::move(values)},
          {"errors", answers.errors},
          {"points", std::move(points)},
          {"fronts", std::move(fronts)},
          {"swept", std::move(swept)},
          {"candidates", std::move(candidates)},
          {"excluded", std::move(excluded)},
          {"card", card_data(results, answers)}};
}

}  // namespace

json view_of(const Results& results, const std::string& system) { return view_data(results, system); }

json catalogue_data(const Results& results) {
  json rows = json::array();
  for (const ValueInfo& info : value_catalogue()) rows.push_back(row(info));
  std::map<std::string, ValueInfo> others;
  for (const Cell& cell : results.cells()) {
    for (const Value& value : cell.values) {
      if (find_value_info(value.name) != nullptr) continue;
      ValueInfo info = value_info(value.name);
      info.unit = value.unit;
      info.measure = cell.measure;
      others.emplace(value.name, std::move(info));
    }
  }
  for (const auto& [name, info] : others) rows.push_back(row(info));
  return rows;
}

json units_data(const Results& results) {
  std::set<std::string> units;
  for (const ValueInfo& info : value_catalogue()) {
    if (info.limit) units.insert(info.unit);
  }
  for (const Cell& cell : results.cells()) {
    for (const Value& value : cell.values) {
      if (can_limit(value.name)) units.insert(value.unit);
    }
  }
  json all = json::object();
  for (const std::string& unit : units) {
    std::set<double> scales;  // of two spellings of a unit the first
    for (const InputUnit& each : input_units(unit)) {
      if (scales.insert(each.scale).second) all[unit].push_back({{"text", each.text}, {"scale", each.scale}});
    }
  }
  return all;
}

json looks_data(const Results& results) {
  json all = json::object();
  for (const auto& [name, look] : results.looks()) {
    std::vector<std::string> dash;
    dash.reserve(look.dash.size());
    for (const double part : look.dash) dash.push_back(fmt::format("{:g}", part));
    all[name] = {{"family", look.family},   {"light", look.light},          {"dark", look.dark},
                 {"dash", join(dash, " ")}, {"mark", mark_text(look.mark)}, {"first", look.first}};
  }
  return all;
}

json paper_figures_data() {
  json comparisons = json::array(), drifts = json::array(), solvers = json::array();
  for (const auto& [system, title] : paper_figures().comparisons) {
    comparisons.push_back({{"system", system}, {"title", title}});
  }
  for (const auto& [systems, value, title, axis] : paper_figures().drifts) {
    drifts.push_back({{"systems", systems}, {"value", value}, {"title", title}, {"axis", axis}});
  }
  for (const auto& [title, contenders] : paper_figures().solvers) {
    solvers.push_back({{"title", title}, {"contenders", contenders}});
  }
  return {{"figure3", std::move(comparisons)}, {"figure4", std::move(drifts)}, {"figure5", std::move(solvers)}};
}

json glossary_data() {
  json terms = json::array();
  for (const auto& [term, meaning] : glossary()) terms.push_back({{"term", term}, {"meaning", meaning}});
  return terms;
}

std::vector<std::string> viewed_systems(const Results& results) {
  std::set<std::string> shown;
  for (const Cell& cell : results.cells()) {
    if (!reads(cell.measure, Reads::kWholeRuns) || results.family(cell.system).empty()) shown.insert(cell.system);
  }
  std::vector<std::string> systems;
  std::ranges::copy_if(results.systems(), std::back_inserter(systems),
                       [&](const std::string& system) { return shown.contains(system); });
  return systems;
}

json views_data(const Results& results) {
  json views = json::array();
  for (const std::string& system : viewed_systems(results)) views.push_back(view_data(results, system));
  return views;
}

}  // namespace assay
