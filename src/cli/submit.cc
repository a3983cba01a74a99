// `assay submit`: a campaign as jobs of a cluster's scheduler.
#include <algorithm>
#include <filesystem>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/external_files.h"
#include "base/paths.h"
#include "base/text.h"
#include "campaign/campaign.h"
#include "campaign/shards.h"
#include "cli/campaign_run.h"
#include "cli/cli.h"
#include "results/store/merge.h"
#include "run/cluster/parts.h"
#include "run/cluster/slurm.h"
#include "run/coordinator/run.h"

namespace assay::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kPartsPerNode = 12;  // so that nodes of unequal speed end together, and wrong estimates even out
// Of a part, so that its start (half a second and a contender's conformance suite) is little of it.
constexpr double kLeastPartSeconds = 10;
constexpr int kUsualArray = 1000;  // jobs of an array that Slurm takes by default (MaxArraySize 1001)

struct SubmitOptions {
  std::string campaign, out, partition, account, time;
  std::vector<std::string> sbatch;
  std::optional<std::string> nodes, shards, cpus, attempt;
  bool slurm = false, dry_run = false, resume = false, allow_external_files = false;
};

// What is divided unless the user says into how many parts.
int usual_parts(const Campaign& campaign, ShardCells cells, int nodes) {
  const Plan plan = make_plan(campaign, 1, cells);
  const auto seconds = shard_seconds(campaign, plan);
  const double all = seconds.empty() ? 0 : seconds.begin()->second;
  // as many on each node, or some would take one more than the others
  const double most = std::clamp(kUsualArray / nodes, 1, kPartsPerNode);
  return nodes * static_cast<int>(std::clamp(all / nodes / kLeastPartSeconds, 1.0, most));
}

// Each of at most `wanted` parts, as many as there are with work in them: a part without cells would wait for a node to
// do nothing, and fewer of them may again leave one without.
std::vector<PartPlan> plan_of_parts(const Campaign& campaign, ShardCells cells, int wanted) {
  for (;;) {
    const Plan plan = make_plan(campaign, wanted, cells);
    std::map<int, PartPlan> parts;
    for (const PlannedCell& cell : plan.cells) {
      if (cell.shard == 0) continue;
      PartPlan& part = parts[cell.shard];
      if (part.cells++ == 0) part.waits = false;
      part.waits = part.waits || !stands_alone(cell);
    }
    for (const PlannedRun& run : plan.runs) ++parts[run.shard].cells;
    if (!parts.empty() && std::cmp_less(parts.size(), wanted)) {
      wanted = static_cast<int>(parts.size());
      continue;
    }
    for (const auto& [shard, seconds] : shard_seconds(campaign, plan)) parts[shard].seconds = seconds;
    std::vector<PartPlan> planned;
    planned.reserve(parts.size());
    for (const auto& [shard, part] : parts) planned.push_back(part);
    return planned;
  }
}

std::string absolute(const std::string& path) { return fs::absolute(path).lexically_normal().string(); }

SlurmRequest request_of(const SubmitOptions& options) {
  require_one_line("--partition", options.partition);
  require_one_line("--account", options.account);
  require_one_line("--time", options.time);
  require_one_line("--out", options.out);
  require_one_line("CAMPAIGN", options.campaign);
  std::vector<std::string> more;
  more.reserve(options.sbatch.size());
  for (const std::string& option : options.sbatch) more.push_back(parse_sbatch_option(option));
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
  request.nodes = options.nodes ? parse_count("--nodes", *options.nodes, 1, kMostParts) : 1;
  request.cpus = options.cpus ? parse_count("--cpus", *options.cpus, 1, kMostParts) : 1;
  const auto wanted = [&](ShardCells cells) {
    return options.shards ? parse_count("--shards", *options.shards, 1, kMostParts)
                          : usual_parts(campaign, cells, request.nodes);
  };
  const auto plan = [&](ShardCells cells, int parts, std::vector<PartPlan>& planned) {
    planned = plan_of_parts(campaign, cells, parts);
    return static_cast<int>(planned.size());
  };
  request.runs_parts = plan(ShardCells::kRuns, wanted(ShardCells::kRuns), request.runs_plan);
  const ShardCells accuracy = parse_shard_cells(request.accuracy_cells());
  request.accuracy_parts = plan(accuracy, wanted(accuracy), request.accuracy_plan);
  request.timing_parts = plan(ShardCells::kTiming, request.nodes, request.timing_plan);
  request.options = std::move(more);
  return request;
}

std::string jobs_text(const SlurmRequest& request, const Parts& parts, const SlurmJobs& jobs) {
  std::vector<std::string> texts;
  if (!jobs.runs.empty()) {
    texts.push_back(fmt::format("job {}: {} of runs that others read", jobs.runs, counted(parts.runs.size(), "part")));
  }
  if (!jobs.accuracy.empty()) {
    texts.push_back(fmt::format("{} {}: {}", jobs.accuracy.size() > 1 ? "jobs" : "job", join(jobs.accuracy, " and "),
                                counted(parts.accuracy.size(), "accuracy part")));
  }
  if (!jobs.timing.empty()) {
    texts.push_back(
        fmt::format("job {}: {}, each alone on a node", jobs.timing, counted(parts.timing.size(), "timing part")));
  }
  texts.push_back(fmt::format("job {}: the union, and parts that were lost again", jobs.finish));
  return fmt::format("{}; 'assay status {}' tells how far they are", join(texts, ", "), request.out);
}

// "accuracy parts 1-3, timing parts none"
std::string parts_text(const Parts& parts) {
  const auto numbers = [](const std::vector<int>& of_kind) { return of_kind.empty() ? "none" : array_text(of_kind); };
  return fmt::format("accuracy parts {}, timing parts {}{}", numbers(parts.accuracy), numbers(parts.timing),
                     parts.runs.empty() ? "" : fmt::format(", parts of runs {}", numbers(parts.runs)));
}

std::string busy_text(const Parts& busy, const LiveJobs& live) {
  const bool named = live.known() && !live.jobs.empty();
  return fmt::format("{} wait or run{} and are left alone", parts_text(busy),
                     named ? fmt::format(" (Slurm's jobs {})", join(live.ids(), ", ")) : "");
}

void tell_unknown(const LiveJobs& live) {
  if (live.known()) return;
  message(fmt::format(
      "whether jobs {} still wait or run is not known ({}): only parts that a process writes to are left alone",
      join(live.ids(), ", "), live.unknown));
}

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

// Jobs that were submitted to the same directory and still wait or run would measure the same parts.
void refuse_second(const SlurmRequest& request) {
  const auto before = find_request(request.out);
  if (!before) return;
  const LiveJobs live = live_jobs(*before);
  if (live.known() && !live.jobs.empty()) {
    throw InputError(fmt::format(
        "'{}' has jobs of Slurm that wait or run: 'assay submit --resume --out {}' goes on with them and submits what "
        "was lost, 'scancel {}' ends them",
        request.out, request.out, join(live.ids(), " ")));
  }
  const Parts busy = busy_parts(*before, live);
  if (!busy.empty()) {
    throw InputError(fmt::format(
        "{} of '{}' are being measured: 'assay submit --resume --out {}' submits only what was lost, or end them first",
        parts_text(busy), request.out, request.out));
  }
  tell_unknown(live);
  const auto refuse_other_count = [&](const char* kind, int there, int wanted, const char* option) {
    std::error_code error;
    if (there == wanted) return;
    for (int part = 1; part <= there; ++part) {
      if (!fs::exists(part_dir(*before, kind, part) + "/assay.sqlite", error)) continue;
      throw InputError(fmt::format("'{}' has results of {} and not of {}: give {} {}, or another --out", request.out,
                                   counted(static_cast<size_t>(there), fmt::format("{} part", kind)), wanted, option,
                                   there));
    }
  };
  refuse_other_count("accuracy", before->accuracy_parts, request.accuracy_parts, "--shards");
  refuse_other_count("runs", before->runs_parts, request.runs_parts, "--shards");
  if (std::string_view(before->accuracy_cells()) != request.accuracy_cells()) {
    throw InputError(
        fmt::format("'{}' was submitted by an assay that divides accuracy cells in another way: give another --out, or "
                    "'assay submit --resume --out {}' goes on with it",
                    request.out, request.out));
  }
  refuse_other_count("timing", before->timing_parts, request.timing_parts, "--nodes");
}

int submit(const SubmitOptions& options) {
  if (options.out.empty()) throw InputError("--out is required, and it is empty: give a directory that all nodes see");
  if (options.allow_external_files) agree_to_external_files();
  if (options.resume) return resume(options);
  if (!options.slurm)
    throw InputError("give --slurm: the scheduler that the campaign is submitted to (docs/clusters.md has others)");
  const SlurmRequest request = request_of(options);
  if (options.dry_run) {
    for (const auto& [name, text] : slurm_scripts(request))
      print(fmt::format("# {}/jobs/{}\n{}\n", request.out, name, text));
    const Parts all = all_parts(request);
    std::string after;
    const auto array = [&](const std::vector<int>& parts, const char* kind, const char* name, const std::string& more,
                           const std::string& waits_for) {
      if (parts.empty()) return;
      print(fmt::format("sbatch --parsable --array={}{}{} jobs/{}.sh\n", array_text(parts), more,
                        waits_for.empty() ? "" : " --dependency=afterany" + waits_for, kind));
      after += fmt::format(":{}", name);
    };
    const auto [free, waiting] = apart(request, all.accuracy);
    array(all.runs, "runs", "RUNS", "", "");
    const std::string after_runs = after;
    array(free, "accuracy", "ALONE", "", "");
    array(waiting, "accuracy", "ACCURACY", "", after_runs);
    array(all.timing, "timing", "TIMING", fmt::format("%{}", request.nodes), after);
    print(fmt::format("sbatch --parsable --dependency=afterany{} jobs/finish.sh\n", after));
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
  command
      ->add_option("--sbatch", options->sbatch,
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
