#include "run/cluster/submission.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "base/console.h"
#include "base/errors.h"
#include "base/paths.h"
#include "base/text.h"
#include "campaign/campaign.h"
#include "campaign/plan.h"
#include "campaign/shards.h"
#include "run/coordinator/campaign_run.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

constexpr int kUsualArray = 1000;  // jobs of an array that Slurm takes by default (MaxArraySize 1001)

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

}  // namespace

SlurmRequest slurm_request(const SubmitRequest& asked) {
  require_one_line("--partition", asked.partition);
  require_one_line("--account", asked.account);
  require_one_line("--time", asked.time_limit);
  require_one_line("--out", asked.out);
  require_one_line("CAMPAIGN", asked.campaign);
  std::vector<std::string> more;
  more.reserve(asked.sbatch.size());
  for (const std::string& option : asked.sbatch) more.push_back(parse_sbatch_option(option));
  if (asked.campaign.empty()) throw InputError("CAMPAIGN is missing: give a campaign's file, or --resume");
  rehearse_campaign(asked.campaign);
  const Campaign campaign = load_campaign(find_campaign(asked.campaign));
  SlurmRequest request;
  request.program = program_path();
  request.campaign = absolute(find_campaign(asked.campaign));
  request.out = absolute(asked.out);
  while (request.out.size() > 1 && request.out.ends_with('/')) request.out.pop_back();
  request.partition = asked.partition;
  request.account = asked.account;
  request.time_limit = asked.time_limit;
  request.nodes = asked.nodes;
  request.cpus = asked.cpus;
  const auto wanted = [&](ShardCells cells) {
    return asked.shards ? *asked.shards : usual_parts(campaign, cells, request.nodes);
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

std::string dry_run_text(const SlurmRequest& request) {
  std::string scripts;
  for (const auto& [name, text] : slurm_scripts(request))
    scripts += fmt::format("# {}/jobs/{}\n{}\n", request.out, name, text);
  const Parts all = all_parts(request);
  std::string after;
  const auto array = [&](const std::vector<int>& parts, const char* kind, const char* name, const std::string& more,
                         const std::string& waits_for) {
    if (parts.empty()) return;
    scripts += fmt::format("sbatch --parsable --array={}{}{} jobs/{}.sh\n", array_text(parts), more,
                           waits_for.empty() ? "" : " --dependency=afterany" + waits_for, kind);
    after += fmt::format(":{}", name);
  };
  const auto [free, waiting] = apart(request, all.accuracy);
  array(all.runs, "runs", "RUNS", "", "");
  const std::string after_runs = after;
  array(free, "accuracy", "ALONE", "", "");
  array(waiting, "accuracy", "ACCURACY", "", after_runs);
  array(all.timing, "timing", "TIMING", fmt::format("%{}", request.nodes), after);
  scripts += fmt::format("sbatch --parsable --dependency=afterany{} jobs/finish.sh\n", after);
  return scripts;
}

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

}  // namespace assay
