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
#include "results/answer.h"
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

// What an error is up to a timestep; texts are those of the command.
json worst_data(const SystemAnswers& answers, const Point& point) {
  json worst = json::object();
  for (const auto& [name, of] : point.worst) {
    const std::string& unit = std::ranges::find(answers.values, name, &ValueInfo::name)->unit;
    const std::string text = worst_text(of, unit), line = worst_line(of, unit, point.timestep_ms);
    worst[name] = {{"value", of.value.value}, {"text", text}};
    if (of.value.high != of.value.value) worst[name]["high"] = of.value.high;
    if (line != text) worst[name]["line"] = line;
  }
  return worst;
}

json point_data(const SystemAnswers& answers, const Point& point) {
  json speed = nullptr;
  if (point.speed) {
    speed = {{"value", point.speed->factor.value},
             {"low", point.speed->factor.low},
             {"high", point.speed->factor.high},
             {"timed", point.speed->timed},
             {"between", {point.speed->below_ms, point.speed->above_ms}}};
  }
  json data = {{"contender", point.contender},
               {"timestep_ms", point.timestep_ms},
               {"speed", std::move(speed)},
               {"sound", point.sound},
               {"why", point.why}};
  if (point.sound && !point.worst.empty()) data["worst"] = worst_data(answers, point);
  return data;
}

json candidate_data(const SystemAnswers& answers, const Candidate& candidate) {
  json data = {{"point", candidate.point},
               {"realtime", realtime_text(candidate.speed.factor.value)},
               {"speed", speed_text(candidate)},
               {"margin", candidate.margin}};
  if (const std::string note = caveat(candidate.speed); !note.empty()) data["note"] = note;
  if (const auto& held = answers.at(candidate).held) data["held"] = held_text(*held);
  return data;
}

json view_data(const Results& results, const std::string& system) {
  const SystemAnswers answers = answers_of(results, system);
  json values = json::array(), points = json::array(), candidates = json::array(), left_out = json::array();
  for (const ValueInfo& value : answers.values) values.push_back(value.name);
  for (const Point& point : answers.points) points.push_back(point_data(answers, point));
  for (const Candidate& candidate : answers.candidates) candidates.push_back(candidate_data(answers, candidate));
  for (const LeftOutPoints& group : excluded_groups(answers)) {
    left_out.push_back(
        {{"contender", group.contender}, {"steps", group.timesteps_ms}, {"when", group.when()}, {"why", group.why}});
  }
  json besides = json::array();
  for (const ValueInfo& value : errors_besides(answers)) besides.push_back(value.name);
  json usual = json::array(), stand_ins = json::object();
  for (const UsualLimit& limit : answers.usual) {
    usual.push_back({{"option", limit.option}, {"value", limit.value}, {"largest", limit.largest}});
  }
  for (const auto& [value, what] : answers.stand_ins) stand_ins[value] = what;
  const NotAccuracy other = not_accuracy(answers);
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
          {"left_out", std::move(left_out)},
          {"columns", {{"most", kMostErrors}, {"besides", std::move(besides)}}},
          {"usual", std::move(usual)},
          {"overlap", overlap_text(answers)},
          {"stand_ins", std::move(stand_ins)},
          {"accuracy", {{"limited", other.limited}, {"open", other.open}}},
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

json look_json(const Look& look) {
  std::vector<std::string> dash;
  dash.reserve(look.dash.size());
  for (const double part : look.dash) dash.push_back(fmt::format("{:g}", part));
  return {{"family", look.family},   {"light", look.light},          {"dark", look.dark},
          {"dash", join(dash, " ")}, {"mark", mark_text(look.mark)}, {"first", look.first}};
}

json looks_data(const Results& results) {
  json all = json::object();
  for (const auto& [name, look] : results.looks()) all[name] = look_json(look);
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
