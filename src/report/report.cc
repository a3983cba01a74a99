#include "report/report.h"

#include <algorithm>
#include <array>
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

// How much of cells the page has. To six digits where it has to be small: it shows three, and what it computes from
// them follows views, which are whole.
struct Detail {
  bool samples, whole;
  const char* left_out;
};
constexpr std::array<Detail, 3> kDetails = {
    {{true, true, ""}, {true, false, ""}, {false, false, "distributions of samples"}}};

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

// What the page shows of cells, and the systems that are left.
struct Shown {
  std::set<std::string> systems;
  std::vector<const Cell*> cells;
  json rows = json::array(), views = json::array();  // rows: of `cells`
  size_t without_room = 0;                           // systems
  std::string left_out;
};

constexpr const char* kLeftOut = "left_out";

// JSON as it stands in the page. A reason may hold whatever an engine printed: bytes that are not UTF-8 become U+FFFD.
std::string page_text(const json& part) { return script_safe(dump_json(part)); }

// The element with the cells of the page's system of that number.
std::string cells_element(size_t system, const json& rows) {
  return fmt::format("</script>\n    <script type=\"application/json\" data-cells=\"{}\">{}", system, page_text(rows));
}

std::vector<std::string> chosen_systems(const Results& results, const ReportOptions& options) {
  std::vector<std::string> chosen = results.systems();
  std::erase_if(chosen, [&](const std::string& system) {
    return !options.systems.empty() && std::ranges::find(options.systems, system) == options.systems.end();
  });
  return chosen;
}

std::string without_room_text(size_t of, const std::vector<std::string>& systems) {
  return fmt::format("; of {} systems {}: {}", of, systems.size(), join(systems, ", "));
}

// All chosen systems and their cells, with no rows and views, and the longest words about what is left out: what else
// the page holds has at the most as much to say.
Shown most_beside_rows(const Results& results, const ReportOptions& options) {
  Shown all;
  const std::vector<std::string> chosen = chosen_systems(results, options);
  all.systems = {chosen.begin(), chosen.end()};
  for (const Cell& cell : results.cells()) {
    if (all.systems.contains(cell.system)) all.cells.push_back(&cell);
  }
  all.left_out = kDetails.back().left_out + without_room_text(results.systems().size(), chosen);
  return all;
}

// System by system in their order, where there is room beside the `other_bytes` of the page: in as much detail as lets
// all fit. Makes the views that `views` lacks: a later call with other room finds them there.
Shown what_fits(const Results& results, const ReportOptions& options, size_t other_bytes,
                std::map<std::string, json>& views) {
  const std::vector<std::string> viewed = viewed_systems(results);
  const std::vector<std::string> chosen = chosen_systems(results, options);
  std::map<std::string, std::vector<const Cell*>> cells;
  for (const Cell& cell : results.cells()) cells[cell.system].push_back(&cell);
  const size_t room = options.most_bytes > other_bytes ? options.most_bytes - other_bytes : 0;
  Shown shown;
  std::vector<std::string> without_room;
  for (const Detail& detail : kDetails) {
    const bool last = &detail == &kDetails.back();
    shown = {};
    shown.left_out = detail.left_out;
    without_room.clear();
    size_t bytes = 0;
    for (const std::string& system : chosen) {
      json rows = json::array();
      for (const Cell* cell : cells[system]) {
        rows.push_back(cell_json(
            *cell, detail.samples ? results.store().samples(cell->id) : std::vector<SampleSeries>{}, detail.whole));
      }
      if (!views.contains(system) && std::ranges::find(viewed, system) != viewed.end()) {
        views[system] = view_of(results, system);
      }
      const auto view = views.find(system);
      const size_t with_it = bytes + cells_element(chosen.size(), rows).size() +
                             (view == views.end() ? 0 : page_text(view->second).size() + std::string_view(",").size());
      if (with_it > room && (!last || !shown.systems.empty())) {
        without_room.push_back(system);
        if (!last) break;
        continue;
      }
      bytes = with_it;
      shown.systems.insert(system);
      shown.cells.insert(shown.cells.end(), cells[system].begin(), cells[system].end());
      for (json& row : rows) shown.rows.push_back(std::move(row));
      if (view != views.end()) shown.views.push_back(view->second);
    }
    if (without_room.empty()) return shown;
  }
  shown.without_room = without_room.size();
  shown.left_out += without_room_text(results.systems().size(), without_room);
  return shown;
}

// Contenders of cells that the store does not describe are shown all the same.
void add_unknown_contenders(json& contenders, const std::vector<const Cell*>& cells) {
  std::set<std::string> known;
  for (const json& contender : contenders) known.insert(contender["name"].get<std::string>());
  for (const Cell* cell : cells) {
    const std::string& name = cell->contender;
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
json measured_data(const Store& store, const std::vector<const Cell*>& cells, const std::vector<Cell>& batch_cells) {
  std::set<std::string> harness = {kHarness}, contenders;
  for (const ContenderRow& row : store.contenders()) {
    if (row.engine == kHarness) harness.insert(row.name);
  }
  int count = 0, ok = 0;
  const auto add = [&](const Cell& cell) {
    if (harness.contains(cell.contender)) return;
    contenders.insert(cell.contender);
    ++count;
    if (cell.outcome == Outcome::kOk) ++ok;
  };
  for (const Cell* cell : cells) add(*cell);
  for (const Cell& cell : batch_cells) add(cell);
  return {{"cells", count}, {"ok", ok}, {"contenders", contenders}};
}

// The systems that are shown, in the page's order: robots, which have actuators, before what moves by itself. Systems
// of cells that the store does not describe come last, without facts.
json systems_data(const Store& store, const Results& results, const Shown& shown) {
  std::set<std::string> scaled, other, batched;
  for (const Cell& cell : results.batch_cells()) batched.insert(cell.system);
  for (const Cell* cell : shown.cells) {
    (reads(cell->measure, Reads::kWholeRuns) ? scaled : other).insert(cell->system);
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

  const auto finished = [&](const Shown& shown) {
    json page = data;
    for (const char* part : {"pictures", "agreement", "replays", "transfer", "batches"}) {
      std::erase_if(page[part].get_ref<json::array_t&>(),
                    [&](const json& each) { return !shown.systems.contains(each["system"].get<std::string>()); });
    }
    page["manifest"] = manifest;
    if (!shown.left_out.empty()) page["manifest"].push_back({{"key", kLeftOut}, {"value", shown.left_out}});
    page["systems"] = systems_data(store, results, shown);
    add_unknown_contenders(page["contenders"], shown.cells);
    page["measured"] = measured_data(store, shown.cells, results.batch_cells());
    page["cells"] = shown.rows;
    page["views"] = shown.views;
    return page;
  };

  std::map<std::string, json> views;
  const Shown most = most_beside_rows(results, options);
  Shown shown = what_fits(results, options, report_html(finished(most)).size(), views);
  // A system's figures before replays.
  ReplayOptions fewer;
  constexpr size_t kLeastReplayBytes = 1'000'000;
  while (shown.without_room > 0 && fewer.most_bytes > kLeastReplayBytes && !data["replays"].empty()) {
    fewer.most_bytes /= 2;
    data["replays"] = replays_data(store, fewer);
    shown = what_fits(results, options, report_html(finished(most)).size(), views);
  }
  return finished(shown);
}

std::string report_html(const json& data) {
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
    place += cells_element(i, found->second);
  }
  return fmt::format("{}{}{}{}{}{}{}", report_page_before(), page_text(rest), first, report_page_between(),
                     page_text(data.value("replays", json::array())), others, report_page_after());
}

void write_report(const std::string& results_dir, const std::string& out_file) {
  write_report(results_dir, out_file, json::object());
}

std::string write_report(const std::string& results_dir, const std::string& out_file, const json& more,
                         const ReportOptions& options) {
  const Store store = Store::open(results_dir);
  ReportOptions within = options;
  within.most_bytes -= std::min(within.most_bytes, page_text(more).size());
  json data = report_data(store, within);
  data.update(more);
  const std::string html = report_html(data);
  write_file(out_file, html);
  const auto entry = std::ranges::find_if(data["manifest"], [](const json& each) { return each["key"] == kLeftOut; });
  std::string left_out = entry == data["manifest"].end() ? "" : (*entry)["value"].get<std::string>();
  if (html.size() > options.most_bytes) {
    left_out += fmt::format("{}it has {:.1f} MB all the same, because one system alone takes more than --size",
                            left_out.empty() ? "nothing; " : "; ", static_cast<double>(html.size()) / 1e6);
  }
  return left_out;
}

}  // namespace assay
