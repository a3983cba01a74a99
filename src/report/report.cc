#include "report/report.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "claims/claims.h"
#include "report/details.h"
#include "report/page.h"
#include "report/parity.h"
#include "report/replays.h"
#include "report/views.h"
#include "report/write_file.h"
#include "results/values.h"
#include "store/store.h"

namespace assay {
namespace {

using nlohmann::json;

// Of this layout of the JSON; web/src/data.ts describes it.
constexpr int kReportFormat = 2;

json number(std::optional<double> value) { return value && std::isfinite(*value) ? json(*value) : json(nullptr); }

// An object that the store keeps as text. The page can do without what cannot be read.
json object(const std::string& text) {
  json parsed = json::parse(text, nullptr, /*allow_exceptions=*/false);
  return parsed.is_object() ? parsed : json::object();
}

// To the four digits that a reader needs of it: there are thousands.
json rounded(std::optional<double> value) {
  if (!value || !std::isfinite(*value) || *value == 0) return number(value);
  const double digit = std::pow(10, 3 - std::floor(std::log10(std::abs(*value))));
  return std::round(*value * digit) / digit;
}

json cell_json(const Cell& cell, const std::vector<SampleSeries>& samples) {
  json values = json::array();
  for (const Value& value : cell.values) {
    const auto bound = bound_of(cell, value.name);
    json& one = values.emplace_back(json{{"name", value.name}, {"value", number(bound ? bound : value.value)}});
    if (value.unit != value_info(value.name).unit) one["unit"] = value.unit;  // else the catalogue has it
    if (bound) {
      one["bound"] = true;  // the value is an upper bound
      continue;
    }
    if (value.low) one["low"] = number(value.low);
    if (value.high) one["high"] = number(value.high);
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

}  // namespace

json report_data(const Store& store) {
  json manifest = json::array();
  for (const ManifestEntry& entry : store.manifest()) manifest.push_back({{"key", entry.key}, {"value", entry.value}});

  json systems = json::array();
  for (const SystemRow& row : store.systems()) systems.push_back({{"name", row.name}, {"facts", object(row.json)}});

  json contenders = json::array();
  for (const ContenderRow& row : store.contenders()) {
    contenders.push_back({{"name", row.name},
                          {"engine", row.engine},
                          {"version", row.version},
                          {"base", row.base},
                          {"settings", row.settings},
                          {"capabilities", object(row.capabilities_json)},
                          {"build", object(row.build_json)}});
  }

  const Results results(store);
  json cells = json::array();
  for (const Cell& cell : results.cells()) cells.push_back(cell_json(cell, store.samples(cell.id)));

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

  return {{"format", kReportFormat},
          {"manifest", std::move(manifest)},
          {"systems", std::move(systems)},
          {"contenders", std::move(contenders)},
          {"cells", std::move(cells)},
          {"conformance", std::move(conformance)},
          {"pictures", picture_data(results)},
          {"agreement", agreement_data(results)},
          {"replays", replays_data(store)},
          {"claims", claims_data(results)},
          {"parity", parity_data(store.dir())},
          {"catalogue", catalogue_data(results)},
          {"units", units_data(results)},
          {"looks", looks_data(results)},
          {"glossary", glossary_data()},
          {"views", views_data(results)}};
}

std::string report_html(const json& data) {
  // A reason may hold whatever an engine printed: bytes that are not UTF-8 become U+FFFD.
  const auto text = [](const json& part) {
    return script_safe(part.dump(-1, ' ', false, json::error_handler_t::replace));
  };
  json rest = json::object();
  for (const auto& [key, value] : data.items()) {
    if (key != "replays") rest[key] = value;
  }
  const std::string replays = text(data.value("replays", json::array()));
  return fmt::format("{}{}{}{}{}", report_page_before(), text(rest), report_page_between(), replays,
                     report_page_after());
}

void write_report(const std::string& results_dir, const std::string& out_file) {
  write_report(results_dir, out_file, json::object());
}

void write_report(const std::string& results_dir, const std::string& out_file, const json& more) {
  const Store store = Store::open(results_dir);
  json data = report_data(store);
  data.update(more);
  write_file(out_file, report_html(data));
}

}  // namespace assay
