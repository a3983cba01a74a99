// `assay merge`: results of shards, or of the same campaign on several machines, as one results directory.
#include "results/store/merge.h"

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "cli/commands.h"
#include "results/store/store.h"
#include "run/cluster/parts.h"
#include "run/coordinator/ratios.h"
#include "run/coordinator/run.h"

namespace assay::cli {
namespace {

struct MergeOptions {
  std::vector<std::string> dirs;
  std::string out;
};

int merge(const MergeOptions& options) {
  const std::vector<std::string> sources = parts_of(options.dirs);
  ProgressLine progress;
  size_t begun = 0;
  std::vector<std::string> warnings, missing;
  size_t planned = 0, done = 0, stored = 0;  // cells of the union
  const auto begin = [&](const std::string& source) {
    ++begun;
    if (progress.due()) progress.show(fmt::format("{} of {}: {}", begun, sources.size(), source));
  };
  const auto finish = [&](Store& merged) {
    warnings = derive_values(merged);
    missing = missing_parts(merged);
    for (const Store::PartDone& part : merged.plan_done()) {
      planned += part.cells;
      done += part.done;
    }
    stored = merged.cell_keys().size();
  };
  // What finishes a union reads them: a source whose own cannot be read is refused before anything is written.
  const auto check = [](const Store& source) { static_cast<void>(asked_ratios(source)); };
  const MergeSummary summary = merge_results(sources, options.out, derived_values(), begin, finish, check);
  progress.clear();
  print(
      paragraph(fmt::format("{} from {} ({} were there already), {}; results: {}", counted(summary.cells, "cell"),
                            counted(summary.sources, "directory", "directories"), summary.cells_before,
                            counted(summary.trajectories, "trajectory", "trajectories"), options.out + "/assay.sqlite"),
                2));
  if (planned > 0) {  // what `assay status` counts
    const std::string more =
        stored > done ? fmt::format(", and {} that no plan counts, as times of the harness itself", stored - done) : "";
    print(paragraph(fmt::format("the union has {} of {} planned cells{}", done, planned, more), 2));
  }
  for (const std::string& each : missing) print(paragraph("missing: " + each, 2));
  for (const std::string& warning : warnings) print(paragraph("warning: " + warning, 2));
  return kDone;
}

}  // namespace

void add_merge(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "merge", "Unite the results of shards of one campaign",
      {{"assay merge part1 part2 part3 --out results", "shards that three machines measured"},
       {"assay merge out/shards --out results", "all results directories in a folder, also while they are measured"}});
  const auto options = std::make_shared<MergeOptions>();
  command->add_option("DIR", options->dirs, "Results directories, or folders of them")->required()->type_name("");
  command->add_option("--out", options->out, "Results directory of the union; created if missing, else added to")
      ->required()
      ->type_name("DIR");
  command->callback([&action, options] { action = [options] { return merge(*options); }; });
}

}  // namespace assay::cli
