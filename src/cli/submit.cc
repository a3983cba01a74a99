// `assay submit`: a campaign as jobs of a cluster's scheduler.
#include <algorithm>
#include <filesystem>
#include <set>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/paths.h"
#include "base/text.h"
#include "campaign/campaign.h"
#include "campaign/shards.h"
#include "cli/campaign_run.h"
#include "cli/cli.h"
#include "cli/parts.h"
#include "cluster/slurm.h"
#include "coordinator/run.h"
#include "store/merge.h"

namespace assay::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kMostNodes = 10000;
constexpr int kPartsPerNode = 12;  // so that nodes of unequal speed end together, and wrong estimates even out
constexpr int kUsualArray = 1000;  // jobs of an array that Slurm takes by default (MaxArraySize 1001)

struct SubmitOptions {
  std::string campaign, out, partition, account, time;
  std::optional<std::string> nodes, shards, cpus, attempt;
  bool slurm = false, dry_run = false, resume = false;
};

// At most as many parts as there are with work in them.
int parts_with_work(const Campaign& campaign, ShardCells cells, int wanted) {
  std::set<int> used;
  for (const PlannedCell& cell : make_plan(campaign, wanted, cells).cells) {
    if (cell.shard > 0) used.insert(cell.shard);
  }
  return static_cast<int>(used.size());
}

std::string absolute(const std::string& path) { return fs::absolute(path).lexically_normal().string(); }

SlurmRequest request_of(const SubmitOptions& options) {
  if (options.campaign.empty()) throw InputError("CAMPAIGN is missing: give a campaign's file, or --resume");
  rehearse_campaign(options.campaign);
  const Campaign campaign = load_campaign(find_campaign(options.campaign));
  SlurmRequest request;
  request.program = program_path();
  request.campaign = absolute(find_campaign(options.campaign));
  request.out = absolute(options.out);
  while (request.out.size() > 1 && request.out.ends_with('/')) request.out.pop_back();
  request.partition = options.partition;
  request.account = options.account;
  request.time_limit = options.time;
  request.nodes = options.nodes ? parse_count("--nodes", *options.nodes, 1, kMostNodes) : 1;
  request.cpus = options.cpus ? parse_count("--cpus", *options.cpus, 1, kMostNodes) : 1;
  const int usual = std::max(request.nodes, std::min(kPartsPerNode * request.nodes, kUsualArray));
  const int wanted = options.shards ? parse_count("--shards", *options.shards, 1, kMostNodes) : usual;
  // A part without cells would wait for a node to do nothing.
  request.accuracy_parts = parts_with_work(campaign, ShardCells::kAccuracy, wanted);
  request.timing_parts = parts_with_work(campaign, ShardCells::kTiming, request.nodes);
  return request;
}

std::string jobs_text(const SlurmRequest& request, const Parts& parts, const SlurmJobs& jobs) {
  std::vector<std::string> texts;
  if (!jobs.accuracy.empty()) {
    texts.push_back(fmt::format("job {}: {}", jobs.accuracy, counted(parts.accuracy.size(), "accuracy part")));
  }
  if (!jobs.timing.empty()) {
    texts.push_back(
        fmt::format("job {}: {}, each alone on a node", jobs.timing, counted(parts.timing.size(), "timing part")));
  }
  texts.push_back(fmt::format("job {}: the union, and parts that were lost again", jobs.finish));
  return fmt::format("{}; 'assay status {}' tells how far they are", join(texts, ", "), request.out);
}

// What the last job does, and what a user may do by hand at any time: parts that were lost are submitted again as long
// as tries are left, then what there is becomes the union.
int resume(const SubmitOptions& options) {
  const SlurmRequest request = read_request(options.out);
  const bool by_hand = !options.attempt;
  const int attempt = by_hand ? 0 : parse_count("--attempt", *options.attempt, 1, kMostNodes);
  const Parts lost = lost_parts(request);
  if (options.dry_run) {
    print(paragraph(fmt::format("lost: accuracy parts {}, timing parts {}",
                                lost.accuracy.empty() ? "none" : array_text(lost.accuracy),
                                lost.timing.empty() ? "none" : array_text(lost.timing))));
    return kDone;
  }
  if (!lost.empty() && attempt < request.tries) {
    print(paragraph(jobs_text(request, lost, submit_to_slurm(request, lost, attempt + 1))));
    return kDone;
  }
  const std::vector<std::string> parts = parts_of({request.out + "/shards"});
  const MergeSummary summary =
      merge_results(parts, request.out, derived_values(), {}, [](Store& merged) { derive_values(merged); });
  print(paragraph(fmt::format("{} from {}", counted(summary.cells + summary.cells_before, "cell"),
                              counted(summary.sources, "part"))));
  write_report_of(request.out);
  if (lost.empty()) return kDone;
  message(fmt::format(
      "lost after {}: accuracy parts {}, timing parts {}; 'assay submit --resume --out {}' tries them again",
      counted(static_cast<size_t>(request.tries), "try", "tries"),
      lost.accuracy.empty() ? "none" : array_text(lost.accuracy),
      lost.timing.empty() ? "none" : array_text(lost.timing), request.out));
  return kFailed;
}

int submit(const SubmitOptions& options) {
  if (options.out.empty()) throw InputError("--out is required, and it is empty: give a directory that all nodes see");
  if (options.resume) return resume(options);
  if (!options.slurm)
    throw InputError("give --slurm: the scheduler that the campaign is submitted to (docs/clusters.md has others)");
  const SlurmRequest request = request_of(options);
  if (options.dry_run) {
    for (const auto& [name, text] : slurm_scripts(request))
      print(fmt::format("# {}/jobs/{}\n{}\n", request.out, name, text));
    const Parts all = all_parts(request);
    if (!all.accuracy.empty())
      print(fmt::format("sbatch --parsable --array={} jobs/accuracy.sh\n", array_text(all.accuracy)));
    if (!all.timing.empty()) {
      print(fmt::format("sbatch --parsable --array={}%{} --dependency=afterany:ACCURACY jobs/timing.sh\n",
                        array_text(all.timing), request.nodes));
    }
    print("sbatch --parsable --dependency=afterany:ACCURACY:TIMING jobs/finish.sh\n");
    return kDone;
  }
  const Parts parts = all_parts(request);
  print(paragraph(jobs_text(request, parts, submit_to_slurm(request, parts, 1))));
  return kDone;
}

}  // namespace

void add_submit(CLI::App& app, Action& action) {
  CLI::App* command = add_command(
      app, "submit", "Measure a campaign on a cluster: shards as jobs, their union at the end",
      {{"assay submit --slurm paper --out results --nodes 8", "accuracy on shared nodes, timings alone on theirs"},
       {"assay submit --slurm paper --out results --dry-run", "only prints the scripts"},
       {"assay submit --resume --out results", "submits parts that were lost again, or unites what there is"}});
  const auto options = std::make_shared<SubmitOptions>();
  command->add_option("CAMPAIGN", options->campaign, "A campaign's TOML file, or the name of one in campaigns/")
      ->type_name("");
  command->add_option("--out", options->out, "Results directory, on a file system that all nodes share")
      ->required()
      ->type_name("DIR");
  command->add_flag("--slurm", options->slurm, "The scheduler is Slurm")->disable_flag_override();
  command->add_option("--partition", options->partition, "Slurm's partition (default: its own default)")
      ->type_name("P");
  command->add_option("--account", options->account, "Slurm's account")->type_name("NAME");
  command->add_option("--time", options->time, "Time limit of each job, as Slurm writes it")->type_name("TIME");
  command->add_option("--nodes", options->nodes, "Nodes that measure times side by side (default: 1)")->type_name("N");
  command->add_option("--shards", options->shards, "Accuracy parts (default: 4 a node)")->type_name("K");
  command->add_option("--cpus", options->cpus, "Processors of an accuracy part (default: 1)")->type_name("N");
  command->add_flag("--resume", options->resume, "Goes on with what was submitted to --out")->disable_flag_override();
  command->add_option("--attempt", options->attempt, "Of the job that finishes: the try that has ended")
      ->type_name("N")
      ->group("");
  command->add_flag("--dry-run", options->dry_run, "Prints what would be submitted")->disable_flag_override();
  command->callback([&action, options] { action = [options] { return submit(*options); }; });
}

}  // namespace assay::cli
