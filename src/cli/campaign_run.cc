#include "cli/campaign_run.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/option_values.h"
#include "base/paths.h"
#include "base/text.h"
#include "campaign/shards.h"
#include "report/figures.h"
#include "results/store/store.h"
#include "run/coordinator/campaign_run.h"
#include "run/coordinator/run.h"

namespace assay::cli {
namespace {

void choose_device(const std::string& device, Campaign& campaign) {
  const auto has_batches = [](const CampaignSystem& system) { return system.has(Reads::kWorlds); };
  if (std::ranges::none_of(campaign.systems, has_batches)) {
    throw InputError(fmt::format(
        "--device is for the measure 'batch', which no system of the campaign '{}' has: leave it out", campaign.name));
  }
  campaign.device = device;
}

}  // namespace

void add_references(CLI::App& command, RunRequest& request) {
  command
      .add_option("--references", request.references,
                  "Folder that keeps runs for later campaigns, at most 4 GiB; 'off' keeps none (default: references in "
                  "ASSAY_CACHE, else in the user's cache folder)")
      ->type_name("DIR");
}

void add_set_up(CLI::App& command, RunRequest& request) {
  command.add_flag_callback(
      "--no-set-up", [&request] { request.set_up = false; },
      "Do without engines that are not set up; else those that a campaign names are set up first");
}

void add_progress(CLI::App& command, RunRequest& request) {
  command
      .add_option("--progress", request.progress,
                  "How far it is, on standard error: text for people (default), json for programs, a line each event")
      ->type_name("text|json");
}

bool json_progress(const RunRequest& request) {
  const std::string how = request.progress.value_or("text");
  if (how != "text" && how != "json") throw InputError(fmt::format("--progress is '{}': use text or json", how));
  return how == "json";
}

RunOptions run_options(const RunRequest& request) {
  RunOptions options;
  options.out = request.out;
  options.command = request.command;
  options.references = references_dir(request.references);
  options.suites = verdicts_dir(request.references);
  if (request.jobs) options.jobs = parse_count("--jobs", *request.jobs, 1, kMostJobs);
  if (request.shard) options.shard = parse_shard(*request.shard);
  if (request.cells) options.shard.cells = parse_shard_cells(*request.cells);
  if (options.shard.cells == ShardCells::kRuns && options.references.empty()) {
    throw InputError("--cells runs leaves its runs in --references, which is 'off': give a folder that all parts see");
  }
  options.retry = request.retry;
  options.windows_of = request.windows_of;
  if (!options.windows_of.empty()) static_cast<void>(Store::open(options.windows_of));  // refused before anything runs
  return options;
}

bool run_and_summarize(const RunRequest& request) {
  RunOptions options = run_options(request);
  // else all cells, whatever the directory began with
  if (request.shard || request.cells) refuse_other_part(request.out, options.shard);
  Campaign campaign = load_campaign(find_campaign(request.campaign));
  if (request.device) choose_device(*request.device, campaign);
  const auto progress = json_progress(request) ? make_json_progress(stderr) : make_progress(stderr);
  options.progress = progress.get();
  const RunSummary summary = run_campaign(campaign, options);
  if (summary.interrupted) {
    message(stopped_text(summary, request.command, request.out, options.references));
    return false;
  }
  print(summary_text(summary, request.out));
  const std::string why = unmeasured_text(summary, request.command);
  if (!why.empty()) message(why);
  return why.empty();
}

void write_report_of(const std::string& dir, const nlohmann::json& more, const ReportOptions& options) {
  const std::string file = (std::filesystem::path(dir) / "report.html").string();
  const std::string left_out = write_report(dir, file, more, options);
  print(paragraph("report: " + file, 2));
  if (!left_out.empty()) {
    print(paragraph(fmt::format("left out of it, to keep it small: {}; --systems chooses, --size makes room", left_out),
                    2));
  }
  const std::string figures = (std::filesystem::path(dir) / "figures").string();
  if (!write_figures(Store::open(dir), figures).empty()) print(paragraph("figures: " + figures, 2));
}

}  // namespace assay::cli
