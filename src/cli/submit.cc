// `assay submit`: a campaign as jobs of a cluster's scheduler.
#include <algorithm>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/external_files.h"
#include "base/option_values.h"
#include "base/text.h"
#include "cli/campaign_run.h"
#include "cli/commands.h"
#include "results/store/merge.h"
#include "run/cluster/parts.h"
#include "run/cluster/submission.h"
#include "run/coordinator/run.h"

namespace assay::cli {
namespace {

struct SubmitOptions {
  SubmitRequest request;
  std::string out;
  std::optional<std::string> nodes, shards, cpus, attempt;  // as given
  bool slurm = false, dry_run = false, resume = false, allow_external_files = false;
};

// What the last job does, and what a user may do by hand at any time: parts that were lost are submitted again as long
// as tries are left, then what there is becomes the union.
int resume(const SubmitOptions& options) {
  const SlurmRequest request = read_request(options.out);
  const bool by_hand = !options.attempt;
  const int attempt = by_hand ? 0 : parse_count("--attempt", *options.attempt, 1, kMostParts);
  const LiveJobs live = live_jobs(request);
  const Parts busy = busy_parts(request, live);
  const Parts lost = lost_parts(request, busy);
  tell_unknown(live);
  if (!busy.empty()) print(paragraph(busy_text(busy, live)));
  if (options.dry_run) {
    print(paragraph("lost: " + parts_text(lost)));
    return kDone;
  }
  if (!lost.empty() && attempt < request.tries) {
    print(paragraph(jobs_text(request, lost, submit_to_slurm(request, lost, attempt + 1, live))));
    return kDone;
  }
  const bool awaited = live.known() && !live.jobs.empty();
  if (awaited && std::ranges::find(live.jobs, JobKind::kFinish, &SubmittedJob::kind) == live.jobs.end()) {
    print(paragraph(jobs_text(request, {}, submit_to_slurm(request, {}, std::max(attempt, 1), live))));
  }
  if (awaited && lost.empty()) return kDone;
  const std::vector<std::string> parts = parts_of({request.out + "/shards"});
  const MergeSummary summary =
      merge_results(parts, request.out, derived_values(), {}, [](Store& merged) { derive_values(merged); });
  print(paragraph(fmt::format("{} from {}", counted(summary.cells + summary.cells_before, "cell"),
                              counted(summary.sources, "part"))));
  write_report_of(request.out);
  if (!lost.empty()) {
    message(fmt::format("lost after {}: {}; 'assay submit --resume --out {}' tries them again",
                        counted(static_cast<size_t>(request.tries), "try", "tries"), parts_text(lost), request.out));
  } else if (!busy.empty()) {
    message(fmt::format("{} were not complete: 'assay submit --resume --out {}' unites them when they are",
                        parts_text(busy), request.out));
  }
  return lost.empty() && busy.empty() ? kDone : kFailed;
}

int submit(const SubmitOptions& options) {
  if (options.out.empty()) throw InputError("--out is required, and it is empty: give a directory that all nodes see");
  if (options.allow_external_files) agree_to_external_files();
  if (options.resume) return resume(options);
  if (!options.slurm)
    throw InputError("give --slurm: the scheduler that the campaign is submitted to (docs/operations.md has others)");
  SubmitRequest asked = options.request;
  asked.out = options.out;
  if (options.nodes) asked.nodes = parse_count("--nodes", *options.nodes, 1, kMostParts);
  if (options.cpus) asked.cpus = parse_count("--cpus", *options.cpus, 1, kMostParts);
  if (options.shards) asked.shards = parse_count("--shards", *options.shards, 1, kMostParts);
  const SlurmRequest request = slurm_request(asked);
  if (options.dry_run) {
    print(dry_run_text(request));
    return kDone;
  }
  refuse_second(request);
  const Parts parts = all_parts(request);
  print(paragraph(jobs_text(request, parts, submit_to_slurm(request, parts, 1))));
  return kDone;
}

}  // namespace

void add_submit(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "submit", "Measure a campaign on a cluster, in parts",
      {{"assay submit --slurm paper --out results --nodes 8", "accuracy on shared nodes, timings alone on theirs"},
       {"assay submit --slurm paper --out results --dry-run", "only prints the scripts"},
       {"assay submit --resume --out results", "submits parts that were lost again, or unites what there is"}});
  const auto options = std::make_shared<SubmitOptions>();
  command->add_option("CAMPAIGN", options->request.campaign, "A campaign's TOML file, or the name of one in campaigns/")
      ->type_name("");
  command->add_option("--out", options->out, "Results directory, on a file system that all nodes share")
      ->required()
      ->type_name("DIR");
  command->add_flag("--slurm", options->slurm, "The scheduler is Slurm")->disable_flag_override();
  command->add_option("--partition", options->request.partition, "Slurm's partition (default: its own default)")
      ->type_name("P");
  command->add_option("--account", options->request.account, "Slurm's account")->type_name("NAME");
  command->add_option("--time", options->request.time_limit, "Time limit of each job, as Slurm writes it")
      ->type_name("TIME");
  command
      ->add_option("--sbatch", options->request.sbatch,
                   "One more option of sbatch for all jobs, as in --sbatch=--constraint=zen4; may be repeated")
      ->type_name("OPTION")
      ->allow_extra_args(false);
  command->add_option("--nodes", options->nodes, "Nodes to divide for; so many measure times side by side (default: 1)")
      ->type_name("N");
  command
      ->add_option("--shards", options->shards,
                   fmt::format("Parts of the runs and of the accuracy cells (default: of at least {:.0f} s, at least "
                               "one and at most {} a node)",
                               kLeastPartSeconds, kPartsPerNode))
      ->type_name("K");
  command->add_option("--cpus", options->cpus, "Processors of a part that measures no times (default: 1)")
      ->type_name("N");
  command
      ->add_flag("--allow-external-files", options->allow_external_files,
                 "The campaign's 'allow_external_files' may be obeyed: its models may name files outside their folders")
      ->disable_flag_override();
  command->add_flag("--resume", options->resume, "Goes on with what was submitted to --out")->disable_flag_override();
  command->add_option("--attempt", options->attempt, "Of the job that finishes: the try that has ended")
      ->type_name("N")
      ->group("");
  command->add_flag("--dry-run", options->dry_run, "Prints what would be submitted")->disable_flag_override();
  command->callback([&action, options] { action = [options] { return submit(*options); }; });
}

}  // namespace assay::cli
