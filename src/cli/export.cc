// `assay export`: a results directory as tidy values, or its kept states.
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "base/csv.h"
#include "base/errors.h"
#include "base/output_file.h"
#include "cli/commands.h"
#include "results/export/trajectories.h"
#include "results/export/values.h"
#include "results/store/store.h"

namespace assay::cli {
namespace {

struct ExportOptions {
  std::string dir;
  std::optional<std::string> format, trajectories, out;
};

int export_values(const ExportOptions& options, const std::string& format) {
  if (format != "csv" && format != "json") {
    throw InputError(fmt::format("--format is '{}': use csv or json", format));
  }
  const Store store = Store::open(options.dir);
  OutputFile file(options.out.value_or("-"));
  const bool shown = is_terminal(file.path());
  const auto field = [&](const std::string& text) { return csv_field(shown ? printable(text) : text); };
  file.write(exported_values(store, format == "csv" ? ValuesFormat::kCsv : ValuesFormat::kJson, field));
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
                   "Writes the states of the kept runs, as npz or csv (docs/files.md)")
      ->type_name("npz|csv");
  command
      ->add_option("--out", options->out,
                   "File to write (default: standard output); with --trajectories the folder for its files")
      ->type_name("PATH");
  command->callback([&action, options] { action = [options] { return export_what_is_asked(*options); }; });
}

}  // namespace assay::cli
