// `assay export`: a results directory as tidy values, or its kept states.
#include <cmath>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "base/csv.h"
#include "base/errors.h"
#include "base/json.h"
#include "base/output_file.h"
#include "base/text.h"
#include "cli/cli.h"
#include "results/export/trajectories.h"
#include "results/results.h"
#include "results/soundness.h"
#include "results/store/facts.h"
#include "results/store/store.h"
#include "results/withdrawn.h"

namespace assay::cli {
namespace {

struct ExportOptions {
  std::string dir;
  std::optional<std::string> format, trajectories, out;
};

// One value of a cell, or a cell that failed before it had one.
struct Row {
  const Cell* cell;
  std::string outcome;
  std::optional<Value> value = {};  // absent: the cell has none
};

// How a cell ended, or that it does not count any more; its values are exported all the same.
class Outcomes {
 public:
  explicit Outcomes(const Store& store) {
    for (const SystemRow& row : store.systems()) facts_[row.name] = facts_of(row.json);
  }
  std::string of(const Cell& cell) const {
    const auto facts = facts_.find(cell.system);
    const bool counts =
        why_withdrawn(withdrawals(), cell, facts == facts_.end() ? nlohmann::json() : facts->second).empty();
    return counts ? std::string(outcome_text(cell.outcome)) : "withdrawn";
  }

 private:
  std::map<std::string, nlohmann::json> facts_;
};

// Numbers that are missing or not finite are empty in CSV and null in JSON.
std::string csv_number(const std::optional<double>& number) {
  return number && std::isfinite(*number) ? shortest(*number) : "";
}
Json json_number(const std::optional<double>& number) {
  return number && std::isfinite(*number) ? Json(*number) : Json(nullptr);
}

template <typename Field>
std::string as_csv(const std::vector<Row>& rows, const Field& field) {
  std::string text = "system,contender,timestep_ms,measure,value,unit,outcome,low,high\n";
  for (const auto& [cell, outcome, value] : rows) {
    const Value none{cell->measure, "", {}, {}, {}};
    const Value& shown = value ? *value : none;
    text += fmt::format("{},{},{},{},{},{},{},{},{}\n", field(cell->system), field(cell->contender),
                        shortest(cell->timestep_ms), field(shown.name), csv_number(shown.value), field(shown.unit),
                        outcome, csv_number(shown.low), csv_number(shown.high));
  }
  return text;
}

std::string as_json(const std::vector<Row>& rows) {
  Json json = Json::array();
  for (const auto& [cell, outcome, value] : rows) {
    const Value none{cell->measure, "", {}, {}, {}};
    const Value& shown = value ? *value : none;
    json.push_back({{"system", cell->system},
                    {"contender", cell->contender},
                    {"timestep_ms", cell->timestep_ms},
                    {"measure", shown.name},
                    {"value", json_number(shown.value)},
                    {"unit", shown.unit.empty() ? Json(nullptr) : Json(shown.unit)},
                    {"outcome", outcome},
                    {"low", json_number(shown.low)},
                    {"high", json_number(shown.high)}});
  }
  return dump_json(json, 1) + "\n";
}

int export_values(const ExportOptions& options, const std::string& format) {
  if (format != "csv" && format != "json") {
    throw InputError(fmt::format("--format is '{}': use csv or json", format));
  }
  const Store store = Store::open(options.dir);
  const std::vector<Cell> cells = judged_cells(store).cells;
  const Outcomes outcomes(store);
  std::vector<Row> rows;
  for (const Cell& cell : cells) {
    const std::string outcome = outcomes.of(cell);
    for (const Value& value : cell.values) {
      // a bound has no value: it lies between 0 and the upper end
      const auto bound = bound_of(cell, value.name);
      rows.push_back({&cell, outcome, bound ? Value{value.name, value.unit, {}, 0, bound} : value});
    }
    // a reference run has no value of its own: it is listed only if it failed
    if (cell.values.empty() && cell.outcome != Outcome::kOk) rows.push_back({&cell, outcome});
  }
  OutputFile file(options.out.value_or("-"));
  const bool shown = is_terminal(file.path());
  const auto field = [&](const std::string& text) { return csv_field(shown ? printable(text) : text); };
  file.write(format == "csv" ? as_csv(rows, field) : as_json(rows));
  file.finish();
  return kDone;
}

int export_what_is_asked(const ExportOptions& options) {
  if (options.format && options.trajectories) {
    throw InputError("--format and --trajectories were both given: choose one");
  }
  if (options.format) return export_values(options, *options.format);
  if (!options.trajectories) throw InputError("give --format for the values or --trajectories for the states");
  if (!options.out) throw InputError("--trajectories needs --out: give the folder for its files");
  return export_trajectories(options.dir, *options.trajectories, *options.out);
}

}  // namespace

void add_export(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "export", "Print measured values as CSV or JSON, or write the kept states",
      {{"assay export results --format csv > values.csv", "one row for each value"},
       {"assay export results --format json --out values.json", "the same as an array of objects"},
       {"assay export results --trajectories npz --out states", "one NumPy file for each system and contender"}});
  const auto options = std::make_shared<ExportOptions>();
  command->add_option("DIR", options->dir, "Results directory")->required()->type_name("");
  command->add_option("--format", options->format, "Writes the values, as csv or json")->type_name("csv|json");
  command
      ->add_option("--trajectories", options->trajectories,
                   "Writes the states of the kept runs, as npz or csv (docs/trajectories.md)")
      ->type_name("npz|csv");
  command
      ->add_option("--out", options->out,
                   "File to write (default: standard output); with --trajectories the folder for its files")
      ->type_name("PATH");
  command->callback([&action, options] { action = [options] { return export_what_is_asked(*options); }; });
}

}  // namespace assay::cli
