// `assay status`: how far a campaign is, in one directory or in the parts of several machines.
#include <memory>

#include <fmt/format.h>

#include "base/text.h"
#include "cli/commands.h"
#include "run/cluster/progress.h"

namespace assay::cli {
namespace {

struct StatusOptions {
  std::vector<std::string> dirs;
  bool json = false;
};

int run_status(const StatusOptions& options) {
  const CampaignStatus found = campaign_status(options.dirs);
  if (options.json) {
    Json rows = Json::array();
    for (const PartStatus& part : found.parts) {
      rows.push_back({{"dir", part.dir},
                      {"shard", part.shard},
                      {"cells", part.cells},
                      {"node", part.node},
                      {"planned", part.planned},
                      {"done", part.done},
                      {"left_s", part.left_s},
                      {"state", part.state()}});
    }
    Json ahead = Json::array();
    for (const RunsStatus& each : found.runs) {
      ahead.push_back({{"parts", each.parts},
                       {"parts_ended", each.ended},
                       {"parts_running", each.under_way},
                       {"runs", each.runs},
                       {"runs_ended", each.runs_ended},
                       {"left_s", each.left_s}});
    }
    print_json({{"parts", rows},
                {"runs", ahead},
                {"missing", found.missing},
                {"planned", found.planned},
                {"done", found.done},
                {"left_s", found.left_s}});
    return kDone;
  }
  std::vector<std::vector<std::string>> rows;
  rows.reserve(found.parts.size());
  for (const PartStatus& part : found.parts) {
    rows.push_back({part.dir, part.shard, part.node, fmt::format("{}/{}", part.done, part.planned),
                    part.done == part.planned ? "" : duration_label(part.left_s), std::string(part.state())});
  }
  print(table({"directory", "part", "node", "cells", "left", "state"}, rows, {3}));
  print(paragraph(
      fmt::format("{} of {} cells{}", found.done, found.planned,
                  found.done < found.planned
                      ? fmt::format("; about {} left where all parts run side by side", duration_label(found.left_s))
                      : "")));
  for (const RunsStatus& each : found.runs) {
    if (each.parts == 0) continue;
    print(
        paragraph(fmt::format("first the runs that these read: {} of {} in {}, of which {} ended and {} are under way",
                              each.runs_ended, counted(each.runs, "run"),
                              counted(static_cast<size_t>(each.parts), "part"), each.ended, each.under_way),
                  2));
  }
  for (const std::string& each : found.missing) print(paragraph("missing: " + each, 2));
  return kDone;
}

}  // namespace

void add_status(CLI::App& app, Action& action) {
  CLI::App* command = add_command(app, "status", "Tell how far a campaign is and how long the rest takes",
                                  {{"assay status results", "also while it is measured"},
                                   {"assay status part1 part2 part3", "shards on three machines"}});
  const auto options = std::make_shared<StatusOptions>();
  command->add_option("DIR", options->dirs, "Results directories, or folders of them")->required()->type_name("");
  command->add_flag("--json", options->json, "Print JSON")->disable_flag_override();
  command->callback([&action, options] { action = [options] { return run_status(*options); }; });
}

}  // namespace assay::cli
