#include "results/export/values.h"

#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "base/console.h"
#include "base/json.h"
#include "base/text.h"
#include "results/results.h"
#include "results/soundness.h"
#include "results/store/facts.h"
#include "results/withdrawn.h"

namespace assay {
namespace {

// One value of a cell, or a cell that failed before it had one.
struct ExportRow {
  const Cell* cell;
  std::string outcome, reason;      // reason: of what is not ok
  std::optional<Value> value = {};  // absent: the cell has none
};

// How a cell ended, or that it does not count any more; its values are exported all the same.
class Outcomes {
 public:
  explicit Outcomes(const Store& store) {
    for (const SystemRow& row : store.systems()) facts_[row.name] = facts_of(row.json);
  }
  ExportRow of(const Cell& cell) const {
    const auto facts = facts_.find(cell.system);
    const std::string why =
        why_withdrawn(withdrawals(), cell, facts == facts_.end() ? nlohmann::json() : facts->second);
    if (!why.empty()) return {&cell, "withdrawn", why};
    return {&cell, std::string(outcome_text(cell.outcome)), cell.reason};
  }

 private:
  std::map<std::string, nlohmann::json> facts_;
};

// Numbers that are missing or not finite are empty in CSV and null in JSON.
std::string csv_number(const std::optional<double>& number) {
  return number && std::isfinite(*number) ? shortest(*number) : "";
}
Json number_or_null(const std::optional<double>& number) {
  return number && std::isfinite(*number) ? Json(*number) : Json(nullptr);
}

std::string as_csv(const std::vector<ExportRow>& rows, const TextField& field) {
  std::string text = "system,contender,timestep_ms,measure,value,unit,outcome,low,high\n";
  for (const auto& [cell, outcome, reason, value] : rows) {
    const Value none{cell->measure, "", {}, {}, {}};
    const Value& shown = value ? *value : none;
    text += fmt::format("{},{},{},{},{},{},{},{},{}\n", field(cell->system), field(cell->contender),
                        shortest(cell->timestep_ms), field(shown.name), csv_number(shown.value), field(shown.unit),
                        outcome, csv_number(shown.low), csv_number(shown.high));
  }
  return text;
}

std::string as_json(const std::vector<ExportRow>& rows) {
  Json values = Json::array();
  for (const auto& [cell, outcome, reason, value] : rows) {
    const Value none{cell->measure, "", {}, {}, {}};
    const Value& shown = value ? *value : none;
    values.push_back({{"system", cell->system},
                      {"contender", cell->contender},
                      {"timestep_ms", cell->timestep_ms},
                      {"measure", shown.name},
                      {"value", number_or_null(shown.value)},
                      {"unit", shown.unit.empty() ? Json(nullptr) : Json(shown.unit)},
                      {"outcome", outcome},
                      {"reason", reason},
                      {"low", number_or_null(shown.low)},
                      {"high", number_or_null(shown.high)}});
  }
  return dump_json(values, 1) + "\n";
}

}  // namespace

std::string exported_values(const Store& store, ValuesFormat format, const TextField& field) {
  const std::vector<Cell> cells = judged_cells(store).cells;
  const Outcomes outcomes(store);
  std::vector<ExportRow> rows;
  for (const Cell& cell : cells) {
    ExportRow row = outcomes.of(cell);
    for (const Value& value : cell.values) {
      // a bound has no value: it lies between 0 and the upper end
      const auto bound = bound_of(cell, value.name);
      row.value = bound ? Value{value.name, value.unit, {}, 0, bound} : value;
      rows.push_back(row);
    }
    // a reference run has no value of its own: it is listed only if it failed
    if (cell.values.empty() && cell.outcome != Outcome::kOk) rows.push_back(row);
  }
  return format == ValuesFormat::kCsv ? as_csv(rows, field) : as_json(rows);
}

}  // namespace assay
