#include "report/report.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/json.h"
#include "base/text.h"
#include "base/write_file.h"
#include "measures/measure.h"
#include "report/batches.h"
#include "report/details.h"
#include "report/page.h"
#include "report/parity.h"
#include "report/replays.h"
#include "report/transfer.h"
#include "report/views.h"
#include "results/answer.h"
#include "results/claims/claims.h"
#include "results/store/store.h"
#include "results/values.h"

namespace assay {
namespace {

using nlohmann::json;

json number(std::optional<double> value) { return value && std::isfinite(*value) ? json(*value) : json(nullptr); }

// An object that the store keeps as text. The page can do without what cannot be read.
json object(const std::string& text) {
  json parsed = json::parse(text, nullptr, /*allow_exceptions=*/false);
  return parsed.is_object() ? parsed : json::object();
}

// To the four digits that a reader needs of it, or to more: there are thousands.
json rounded(std::optional<double> value, int digits = 4) {
  if (!value || !std::isfinite(*value) || *value == 0) return number(value);
  const double digit = std::pow(10, digits - 1 - std::floor(std::log10(std::abs(*value))));
  return std::round(*value * digit) / digit;
}

// Values whole, or to six digits where the page has to be small: it shows three, and what it computes from them follows
// views, which are whole.
json cell_json(const Cell& cell, const std::vector<SampleSeries>& samples, bool whole) {
  json values = json::array();
  const auto number_of = [&](std::optional<double> value) { return whole ? number(value) : rounded(value, 6); };
  for (const Value& value : cell.values) {
    const auto bound = bound_of(cell, value.name);
    json& one = values.emplace_back(json{{"name", value.name}, {"value", number_of(bound ? bound : value.value)}});
    if (value.unit != value_info(value.name).unit) one["unit"] = value.unit;  // else the catalogue has it
    if (bound) {
      one["bound"] = true;  // the value is an upper bound
      continue;
    }
    if (value.low) one["low"] = number_of(value.low);
    if (value.high) one["high"] = number_of(value.high);
  }
  return {{"system", cell.system},
          {"contender", cell.contender},
          {"timestep_ms", number(cell.timestep_ms)},
          {"measure", cell.measure},
          {"outcome", outcome_text(cell.outcome)},
          {"reason", cell.reason},
          {"wall_s", rounded(cell.wall_s)},
          {"cpu_s", rounded(cell.cpu_s)},
          {"engine_s", rounded(cell.engine_s)},
          {"steal", rounded(cell.steal)},
          {"values", std::move(values)},
          {"samples", sample_data(samples)}};
}

// What the results say about the paper's claims; nothing where they are about none of them.
json claims_data(const Results& results) {
  const std::optional<std::string> file = paper_claims_file();
  if (!file) return json::array();
  const std::vector<Judgement> judgements = judge(load_claims(*file), results);
  const auto silent = [](const Judgement& each) { return each.summary.empty(); };
  return std::ranges::all_of(judgements, silent) ? json::array() : claims_json(judgements);
}

// What the page shows of cells, and the systems that are left.
struct Shown {
  std::set<std::string> systems;
  json cells = json::array(), views = json::array();
  size_t without_room = 0;  // systems
  std::string left_out;
};

constexpr const char* kLeftOut = "left_out";

size_t page_bytes(const json& data) {
  return report_page_before().size() + report_page_between().size() + report_page_after().size() +
         dump_json(data).size();
}

// System by system in their order, where there is room: with the samples' distributions if all fits so.
// Makes the views that `views` lacks: a later call with other room finds them there.
Shown what_fits(const Results& results, const ReportOptions& options, size_t other_bytes,
                std::map<std::string, json>& views) {
  const std::vector<std::string> viewed = viewed_systems(results);
  std::map<std::string, std::vector<const Cell*>> cells;
  for (const Cell& cell : results.cells()) cells[cell.system].push_back(&cell);
  const size_t room = options.most_bytes > other_bytes ? options.most_bytes - other_bytes : 0;
  Shown shown;
  std::vector<std::string> without_room;
  for (const bool with_samples : {true, false}) {
    shown = {};
    without_room.clear();
    size_t bytes = 0;
    for (const std::string& system : results.systems()) {
      if (!options.systems.empty() && std::ranges::find(options.systems, system) == options.systems.end()) continue;
      json of_system = json::array();
      for (const Cell* cell : cells[system]) {
        of_system.push_back(cell_json(
            *cell, with_samples ? results.store().samples(cell->id) : std::vector<SampleSeries>{}, with_samples));
      }
      if (!views.contains(system) && std::ranges::find(viewed, system) != viewed.end()) {
        views[system] = view_of(results, system);
      }
      const auto size = [](const json& part) { return dump_json(part).size(); };
      const auto view = views.find(system);
      const size_t with_it = bytes + size(of_system) + (view == views.end() ? 0 : size(view->second));
      if (with_it > room && (with_samples || !shown.systems.empty())) {
        without_room.push_back(system);
        if (with_samples) break;
        continue;
      }
      bytes = with_it;
      shown.systems.insert(system);
      for (json& cell : of_system) shown.cells.push_back(std::move(cell));
      if (view != views.end()) shown.views.push_back(view->second);
    }
    if (without_room.empty()) {
      if (!with_samples) shown.left_out = "distributions of samples";
      return shown;
    }
  }
  shown.left_out = "distributions of samples";
  shown.without_room = without_room.size();
  if (!without_room.empty()) {
    shown.left_out +=
        fmt::format("; of {} systems {}: {}", results.systems().size(), without_room.size(), join(without_room, ", "));
  }
  return shown;
}

// Contenders of cells that the store does not describe are shown all the same.
void add_unknown_contenders(json& contenders, const json& cells) {
  std::set<std::string> known;
  for (const json& contender : contenders) known.insert(contender["name"].get<std::string>());
  for (const json& cell : cells) {
    const auto name = cell["contender"].get<std::string>();
    if (!known.insert(name).second) continue;
    contenders.push_back({{"name", name},
                          {"engine", name.substr(0, name.find('-'))},
                          {"version", ""},
                          {"base", name},
                          {"settings", ""},
                          {"capabilities", json::object()},
                          {"build", json::object()}});
  }
}

// How much was measured, without the engine that does nothing.
json measured_data(const Store& store, const json& cells, const std::vector<Cell>& batch_cells) {
  std::set<std::string> harness = {kHarness}, contenders;
  for (const ContenderRow& row : store.contenders()) {
    if (row.engine == kHarness) harness.insert(row.name);
  }
  int count = 0, ok = 0;
  const auto add = [&](const std::string& contender, std::string_view outcome) {
    if (harness.contains(contender)) return;
    contenders.insert(contender);
    ++count;
    if (outcome == outcome_text(Outcome::kOk)) ++ok;
  };
  for (const json& cell : cells) add(cell["contender"].get<std::string>(), cell["outcome"].get<std::string>());
  for (const Cell& cell : batch_cells) add(cell.contender, outcome_text(cell.outcome));
  return {{"cells", count}, {"ok", ok}, {"contenders", contenders}};
}

// The systems that are shown, in the page's order: robots, which have actuators, before what moves by itself. Systems
// of cells that the store does not describe come last, without facts.
json systems_data(const Store& store, const Results& results, const Shown& shown) {
  std::set<std::string> scaled, other, batched;
  for (const Cell& cell : results.batch_cells()) batched.insert(cell.system);
  for (const json& cell : shown.cells) {
    (reads(cell["measure"].get<std::string>(), Reads::kWholeRuns) ? scaled : other)
        .insert(cell["system"].get<std::string>());
  }
  json driven = json::array(), rest = json::array();
  std::set<std::string> left = shown.systems;
  const auto add = [&](const std::string& name, json facts) {
    const bool family = !results.family(name).empty();
    const json& control = facts.value("control", json());
    const bool actuated = control.is_string() && control.get<std::string>().find("actuator") != std::string::npos;
    (actuated ? driven : rest)
        .push_back({{"name", name},
                    {"facts", std::move(facts)},
                    {"section", other.contains(name) || !(family || batched.contains(name))},
                    {"size", family && scaled.contains(name)}});
    left.erase(name);
  };
  for (const SystemRow& row : store.systems()) {
    if (shown.systems.contains(row.name)) add(row.name, object(row.json));
  }
  for (const std::string& name : std::set<std::string>(left)) add(name, json::object());
  driven.insert(driven.end(), rest.begin(), rest.end());
  return driven;
}

// JSON inside a script element. `<` would end it or open a comment; the two line separators end a line in old
// JavaScript. Both occur inside strings only, where an escape means the same.
std::string script_safe(const std::string& text) {
  std::string out;
  out.reserve(text.size() + text.size() / 64);
  for (size_t i = 0; i < text.size(); ++i) {
    const std::string_view rest = std::string_view(text).substr(i);
    if (text[i] == '<') {
      out += "\\u003c";
    } else if (rest.starts_with("\u2028")) {
      out += "\\u2028";
      i += 2;
    } else if (rest.starts_with("\u2029")) {
      out += "\\u2029";
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

}  // namespace

json report_data(const Store& store, const ReportOptions& options) {
  json manifest = json::array();
  for (const ManifestEntry& entry : store.manifest()) {
    if (entry.key != kAnswerEntry) manifest.push_back({{"key", entry.key}, {"value", entry.value}});
  }

  const Results results(store);
  for (const std::string& name : options.systems) {
    if (std::ranges::find(results.systems(), name) == results.systems().end()) {
      throw InputError(
          fmt::format("there is no system '{}' in '{}'{}", name, store.dir(), did_you_mean(name, results.systems())));
    }
  }
  json contenders = json::array();
  for (const ContenderRow& row : store.contenders()) {
    json changes = json::array();
    for (const SettingChange& change : results.changes(row.name)) changes.push_back(change_text(change));
    json capabilities = object(row.capabilities_json);
    capabilities.erase("contact_forces_given");  // the page has it as "not_given"
    contenders.push_back({{"name", row.name},
                          {"varies", results.varied(row.name)},
                          {"changes", std::move(changes)},
                          {"engine", row.engine},
                          {"version", row.version},
                          {"base", row.base},
                          {"settings", row.settings},
                          {"capabilities", std::move(capabilities)},
                          {"not_given", values_not_given(row.contact_forces)},
                          {"build", object(row.build_json)}});
  }

  if (results.timed_by_pooled_median()) {
    manifest.push_back(
        {{"key", "timing_estimate"},
         {"value", "version 0.1: a median over pooled slices of some states, not the mean over the run"}});
  }
  if (!results.judged_note().empty()) manifest.push_back({{"key", "soundness"}, {"value", results.judged_note()}});
  json conformance = json::array();
  for (const ConformanceRow& row : store.conformance()) {
    conformance.push_back({{"contender", row.contender},
                           {"test", row.test},
                           {"status", row.status},
                           {"figure", number(row.figure)},
                           {"tolerance", number(row.tolerance)},
                           {"unit", row.unit},
                           {"note", row.note}});
  }

  json data = {{"format", kReportFormat},
               {"contenders", std::move(contenders)},
               {"conformance", std::move(conformance)},
               {"pictures", picture_data(results)},
               {"agreement", agreement_data(results)},
               {"replays", replays_data(store)},
               {"transfer", transfer_data(results)},
               {"claims", claims_data(results)},
               {"parity", parity_data(store.dir())},
               {"batches", batch_data(results)},
               {"catalogue", catalogue_data(results)},
               {"units", units_data(results)},
               {"looks", looks_data(results)},
               {"glossary", glossary_data()},
               {"answer", stored_answer(store.manifest(kAnswerEntry).value_or(""))},
               {"phrases", phrases_json()}};

  std::map<std::string, json> views;
  Shown shown = what_fits(results, options, page_bytes(data), views);
  // A system's figures before replays.
  ReplayOptions fewer;
  constexpr size_t kLeastReplayBytes = 1'000'000;
  while (shown.without_room > 0 && fewer.most_bytes > kLeastReplayBytes && !data["replays"].empty()) {
    fewer.most_bytes /= 2;
    data["replays"] = replays_data(store, fewer);
    shown = what_fits(results, options, page_bytes(data), views);
  }
  for (const char* part : {"pictures", "agreement", "replays", "transfer", "batches"}) {
    json kept = json::array();
    for (json& each : data[part]) {
      if (shown.systems.contains(each["system"].get<std::string>())) kept.push_back(std::move(each));
    }
    data[part] = std::move(kept);
  }
  if (!shown.left_out.empty()) manifest.push_back({{"key", kLeftOut}, {"value", shown.left_out}});
  data["manifest"] = std::move(manifest);
  data["systems"] = systems_data(store, results, shown);
  add_unknown_contenders(data["contenders"], shown.cells);
  data["measured"] = measured_data(store, shown.cells, results.batch_cells());
  data["cells"] = std::move(shown.cells);
  data["views"] = std::move(shown.views);
  return data;
}

std::string report_html(const json& data) {
  // A reason may hold whatever an engine printed: bytes that are not UTF-8 become U+FFFD.
  const auto text = [](const json& part) { return script_safe(dump_json(part)); };
  json rest = json::object();
  for (const auto& [key, value] : data.items()) {
    if (key != "replays" && key != "cells") rest[key] = value;
  }
  // Each system's cells are an element of their own, those of the first section before the page's script, which draws
  // that section before the others have been read.
  std::map<std::string, json> cells;
  for (const json& cell : data.value("cells", json::array())) {
    cells.try_emplace(cell["system"].get<std::string>(), json::array()).first->second.push_back(cell);
  }
  std::string first, others;
  const json systems = data.value("systems", json::array());
  for (size_t i = 0; i < systems.size(); ++i) {
    const auto found = cells.find(systems[i]["name"].get<std::string>());
    if (found == cells.end()) continue;
    std::string& place = first.empty() && systems[i]["section"] == true ? first : others;
    place +=
        fmt::format("</script>\n    <script type=\"application/json\" data-cells=\"{}\">{}", i, text(found->second));
  }
  return fmt::format("{}{}{}{}{}{}{}", report_page_before(), text(rest), first, report_page_between(),
                     text(data.value("replays", json::array())), others, report_page_after());
}

void write_report(const std::string& results_dir, const std::string& out_file) {
  write_report(results_dir, out_file, json::object());
}

std::string write_report(const std::string& results_dir, const std::string& out_file, const json& more,
                         const ReportOptions& options) {
  const Store store = Store::open(results_dir);
  ReportOptions within = options;
  within.most_bytes -= std::min(within.most_bytes, dump_json(more).size());
  json data = report_data(store, within);
  data.update(more);
  write_file(out_file, report_html(data));
  const auto left_out =
      std::ranges::find_if(data["manifest"], [](const json& entry) { return entry["key"] == kLeftOut; });
  return left_out == data["manifest"].end() ? "" : (*left_out)["value"].get<std::string>();
}

}  // namespace assay
