#include "report/match_page.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/json.h"
#include "base/write_file.h"
#include "match/folder.h"
#include "report/replays.h"
#include "report/report.h"
#include "report/views.h"
#include "results/looks.h"

namespace assay {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// What is drawn of a fit's untuned run, and of the measured motion.
constexpr const char* kUntuned = " untuned";
constexpr double kPale = 0.4;  // of the ground in the colour of what is untuned
constexpr const char *kLightGround = "#fbfaf7", *kDarkGround = "#14171a", *kLightMeasured = "#6b727a",
                     *kDarkMeasured = "#a9b0b8";
constexpr double kLeastFrameMs = 5;  // replays of motions with impacts are looked at slowly

// Null where there is none, or none that can be read.
json read_json(const std::string& dir, const char* name) {
  std::ifstream file(fs::path(dir) / name);
  return file ? json::parse(file, nullptr, /*allow_exceptions=*/false) : json();
}

json four_digits(const json& number) {
  if (!number.is_number()) return nullptr;
  const auto value = number.get<double>();
  if (value == 0 || !std::isfinite(value)) return std::isfinite(value) ? json(0) : json();
  const double digit = std::pow(10, 3 - std::floor(std::log10(std::abs(value))));
  return std::round(value * digit) / digit;
}

// The members of an object that the page has types for.
json only(const json& object, std::initializer_list<const char*> members) {
  json kept = json::object();
  for (const char* member : members) {
    if (const auto found = object.find(member); found != object.end()) kept[member] = *found;
  }
  return kept;
}

// The same of each object of a list.
json each_only(const json& list, std::initializer_list<const char*> members) {
  json kept = json::array();
  for (const json& object : list) kept.push_back(only(object, members));
  return kept;
}

// A contender's figures but for those of single logs.
json contender_of_page(const json& contender) {
  json kept =
      only(contender, {"contender", "failure", "warnings", "score", "untuned_score", "worse_than_untuned",
                       "floor_score", "as_good_as_best", "behind_best", "held_out", "untuned", "floor", "phases"});
  if (contender.contains("timesteps")) {
    kept["timesteps"] = each_only(contender.at("timesteps"), {"timestep_ms", "held_out", "windows", "failed"});
  }
  if (contender.contains("parameters")) {
    kept["parameters"] =
        each_only(contender.at("parameters"), {"name", "unit", "status", "value", "low", "high", "model", "with"});
  }
  if (contender.contains("not_identified")) {
    kept["not_identified"] = each_only(contender.at("not_identified"), {"members", "relative_interval", "frozen"});
  }
  return kept;
}

// The errors of all held-out logs, by contender and figure, in the order of `names`.
json log_errors(const json& contenders, const std::vector<std::string>& names) {
  std::map<std::string, size_t> place;
  for (size_t i = 0; i < names.size(); ++i) place[names[i]] = i;
  json errors = json::array();
  for (const json& contender : contenders) {
    json& own = errors.emplace_back(json::object());
    own["contender"] = contender.at("contender");
    for (const json& log : contender.value("logs", json::array())) {
      const auto found = place.find(log.at("log").get<std::string>());
      if (found == place.end()) continue;
      for (const auto& [kind, figures] :
           {std::pair("fitted", log.at("held_out")), std::pair("untuned", log.at("untuned"))}) {
        for (const auto& [figure, value] : figures.items()) {
          json& list = own[kind][figure];
          if (list.is_null()) list = json(std::vector<json>(names.size()));
          list[found->second] = four_digits(value);
        }
      }
    }
  }
  return errors;
}

// A look for each run that can be shown: those of contenders, paler ones of their untuned runs, and one of what was
// measured.
json looks_json(const std::vector<ContenderRow>& rows) {
  json looks = json::object();
  for (const auto& [name, look] : looks_of(rows)) {
    looks[name] = look_json(look);
    Look pale = look;
    pale.light = color_text(mix(parse_color(look.light), parse_color(kLightGround), kPale));
    pale.dark = color_text(mix(parse_color(look.dark), parse_color(kDarkGround), kPale));
    pale.dash = {5, 3};
    looks[name + kUntuned] = look_json(pale);
  }
  looks[match::kMeasured] = look_json({match::kMeasured, kLightMeasured, kDarkMeasured, {}, Mark::kCircle, true});
  return looks;
}

std::vector<ContenderRow> contender_rows(const json& manifest, const json& answer) {
  std::vector<ContenderRow> rows;
  const auto add = [&](const std::string& name, const json& row) {
    if (std::ranges::find(rows, name, &ContenderRow::name) != rows.end()) return;
    const auto text = [&](const char* key, const std::string& otherwise) {
      return row.is_object() && row.contains(key) && row[key].is_string() ? row[key].get<std::string>() : otherwise;
    };
    rows.push_back({name, text("engine", name.substr(0, name.find('-'))), text("version", ""), text("base", name),
                    text("settings", ""), row.is_object() ? dump_json(row.value("capabilities", json::object())) : "{}",
                    row.is_object() ? dump_json(row.value("build", json::object())) : "{}"});
  };
  for (const json& row : manifest.value("contenders", json::array())) add(row.value("name", ""), row);
  for (const json& contender : answer.at("contenders")) add(contender.at("contender").get<std::string>(), json());
  for (const json& name : answer.value("to_do", json::array())) add(name.get<std::string>(), json());
  return rows;
}

std::string run_name(const json& run) {
  return run.at("contender").get<std::string>() + (run.at("fitted").get<bool>() ? "" : kUntuned);
}

std::vector<ReplaySource> replay_sources(const std::string& dir, const json& motion) {
  std::vector<ReplaySource> sources;
  const std::string scene = dump_json(motion.at("scene"));
  for (const json& log : motion.at("logs")) {
    ReplaySource source{log.at("log").get<std::string>(), scene, {}};
    for (const json& run : log.at("runs")) {
      std::vector<State> states = match::motion_states(dir, motion, run);
      // without the measured motion there is nothing to compare with
      if (states.size() < 2 && source.runs.empty()) break;
      if (states.size() < 2) continue;
      source.runs.push_back({run_name(run), motion.at("timestep_ms").get<double>(), std::move(states)});
    }
    sources.push_back(std::move(source));
  }
  return sources;
}

json page_data(const std::string& dir, const json& answer) {
  json manifest = read_json(dir, match::kManifestFile);
  if (!manifest.is_object()) manifest = json::object();
  const json found = read_json(dir, match::kLogsFile);
  const std::vector<ContenderRow> rows = contender_rows(manifest, answer);
  const bool complete = answer.value("to_do", json::array()).empty();
  json motion = complete ? match::read_motion(dir) : json();

  json entries = json::array();
  const json facts = manifest.value("facts", json::object());
  for (const auto& [key, value] : facts.items()) {
    if (value.is_string()) entries.push_back({{"key", key}, {"value", value}});
  }
  json contenders = json::array();
  const auto add_contender = [&](const std::string& name, const std::string& engine, const ContenderRow& row) {
    contenders.push_back({{"name", name},
                          {"engine", engine},
                          {"version", row.version},
                          {"base", row.base},
                          {"settings", row.settings},
                          {"capabilities", json::object()},
                          {"build", json::object()}});
  };
  for (const ContenderRow& row : rows) {
    add_contender(row.name, row.engine, row);
    add_contender(row.name + kUntuned, row.engine, row);
  }
  add_contender(match::kMeasured, match::kMeasured, {});

  json match = only(answer, {"model", "like", "timestep_ms", "windows", "held_out_by", "training", "held_out", "answer",
                             "to_do", "unpredictable", "odd_names", "warnings"});
  match["logs"] = log_errors(answer.at("contenders"), answer.at("held_out").get<std::vector<std::string>>());
  match["contenders"] = json::array();
  for (const json& contender : answer.at("contenders")) match["contenders"].push_back(contender_of_page(contender));
  match["findings"] = each_only(found.is_object() ? found.value("findings", json::array()) : json::array(),
                                {"severity", "kind", "log", "quantity", "message", "fix"});
  json data = {{"format", kReportFormat},
               {"manifest", std::move(entries)},
               {"systems", json::array()},
               {"contenders", std::move(contenders)},
               {"measured", {{"cells", 0}, {"ok", 0}, {"contenders", json::array()}}},
               {"conformance", json::array()},
               {"looks", looks_json(rows)},
               {"replays", json::array()}};
  if (motion.is_object()) {
    data["replays"] =
        replays_data(replay_sources(dir, motion), {.most_contenders = SIZE_MAX, .least_frame_ms = kLeastFrameMs});
    motion.erase("scene");
    for (json& log : motion["logs"]) {
      for (json& run : log["runs"]) run.erase("states");
    }
    match["motion"] = std::move(motion["logs"]);
  }
  data["match"] = std::move(match);
  return data;
}

}  // namespace

json match_report_data(const std::string& dir) {
  const json answer = read_json(dir, match::kAnswerFile);
  const std::string wrong = fmt::format("'{}' is not what `assay match` writes: run the match again",
                                        (fs::path(dir) / match::kAnswerFile).string());
  if (!answer.is_object()) throw InputError(wrong);
  try {
    for (const char* needed : {"contenders", "answer", "to_do"}) answer.at(needed);  // older programs wrote fewer
    return page_data(dir, answer);
  } catch (const json::exception&) {
    throw InputError(wrong);
  }
}

std::string write_match_report(const std::string& dir) {
  const std::string file = (fs::path(dir) / "report.html").string();
  write_file(file, report_html(match_report_data(dir)));
  return file;
}

}  // namespace assay
