// `assay status`: how far a campaign is, in one directory or in the parts of several machines.
#include <algorithm>
#include <filesystem>
#include <iterator>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/text.h"
#include "cli/cli.h"
#include "results/store/facts.h"
#include "results/store/store.h"
#include "run/cluster/parts.h"
#include "run/cluster/slurm.h"

namespace assay::cli {
namespace {

struct StatusOptions {
  std::vector<std::string> dirs;
  bool json = false;
};

struct PartStatus {
  std::string dir, shard, cells, node;
  size_t planned = 0, done = 0;
  double left_s = 0;
  bool begun = true, running = false;
  bool known = true;  // what it is to measure

  std::string_view state() const {
    if (!begun) return "waiting";
    if (running) return "running";
    return known && done == planned ? "complete" : "stopped";
  }
};

// Seconds that are left of a part: its own pace so far corrects the plan's estimate.
double seconds_left(const std::vector<Store::PartDone>& parts, int jobs) {
  constexpr double kEnough = 0.02;  // of the plan's estimate, to learn from
  double left = 0;
  for (const Store::PartDone& part : parts) {
    const bool learned = part.cost_done_s > kEnough * part.cost_s;
    const double pace = learned ? part.wall_s / part.cost_done_s : 1;
    left += (part.cost_s - part.cost_done_s) * pace / (part.accuracy ? std::max(1, jobs) : 1);
  }
  return left;
}

PartStatus status_of(const std::string& dir, const Store& store) {
  PartStatus status;
  status.dir = dir;
  status.running = Store::is_written(dir);
  int jobs = 1;
  std::vector<std::string> names, shards;
  for (const NodeRow& row : store.nodes()) {
    const auto facts = facts_of(row.json);
    const auto add = [&](std::vector<std::string>& texts, const std::string& text) {
      if (!text.empty() && std::ranges::find(texts, text) == texts.end()) texts.push_back(text);
    };
    add(names, text_fact(facts, "name"));
    add(shards, text_fact(facts, "shard"));
    status.cells = text_fact(facts, "cells", "all");
    jobs = static_cast<int>(std::clamp(number_fact(facts, "jobs", 1), 1.0, 1e4));
  }
  status.node = names.size() > 3 ? fmt::format("{} nodes", names.size()) : join(names, ", ");
  status.shard = shards.size() > 3 ? fmt::format("{} parts", shards.size()) : join(shards, ", ");
  const std::vector<Store::PartDone> parts = store.plan_done();
  for (const Store::PartDone& part : parts) {
    status.planned += part.cells;
    status.done += part.done;
  }
  if (parts.empty()) status.planned = status.done = store.cell_keys().size();
  // a process that was killed at its start has left neither
  status.known = status.planned > 0 || !store.nodes().empty();
  status.left_s = seconds_left(parts, jobs);
  return status;
}

// Parts that were submitted to a scheduler and are not begun. Those of a union may have been removed.
std::vector<PartStatus> waiting_parts(const std::string& dir, const SlurmRequest& request, const Coverage& coverage) {
  std::vector<PartStatus> waiting;
  SlurmRequest here = request;
  here.out = dir.size() > 1 && dir.ends_with('/') ? dir.substr(0, dir.size() - 1) : dir;
  const auto add = [&](const char* kind, const char* cells, int count, const std::vector<PartPlan>& plan, int jobs) {
    for (int part = 1; part <= count; ++part) {
      PartStatus status;
      status.dir = part_dir(here, kind, part);
      if (has_parts(status.dir)) continue;
      if (coverage.has_part({cells, count}, part)) continue;
      status.begun = false;
      status.shard = fmt::format("{}/{}", part, count);
      status.cells = cells;
      if (std::cmp_less_equal(part, plan.size())) {
        const PartPlan& expected = plan[static_cast<size_t>(part) - 1];
        status.planned = expected.cells;
        status.left_s = expected.seconds / std::max(1, jobs);
      }
      waiting.push_back(std::move(status));
    }
  };
  add("accuracy", request.accuracy_cells(), request.accuracy_parts, request.accuracy_plan, request.cpus);
  add("timing", "timing", request.timing_parts, request.timing_plan, 1);
  return waiting;
}

// Of the parts that make the runs which others read. They have no cells.
struct RunsStatus {
  int parts = 0, ended = 0, under_way = 0;
  size_t runs = 0, runs_ended = 0;
  double left_s = 0;  // of the longest that has not ended
  bool are_over = false;
};

RunsStatus runs_status(const std::string& dir, const SlurmRequest& request) {
  RunsStatus status;
  SlurmRequest here = request;
  here.out = dir;
  for (int part = 1; part <= request.runs_parts; ++part) {
    const std::string folder = part_dir(here, "runs", part);
    PartPlan plan;
    if (std::cmp_less_equal(part, request.runs_plan.size())) plan = request.runs_plan[static_cast<size_t>(part) - 1];
    size_t ended = 0;
    bool has_ended = false;
    if (has_parts(folder)) {
      for (const NodeRow& row : Store::open(folder).nodes()) {
        const auto facts = facts_of(row.json);
        ended = static_cast<size_t>(std::clamp(number_fact(facts, "runs_ended", 0), 0.0, 1e9));
        has_ended |= facts.contains("finished");
      }
      if (Store::is_written(folder)) {
        ++status.under_way;
        has_ended = false;
      }
    }
    ++status.parts;
    status.ended += has_ended ? 1 : 0;
    status.runs += plan.cells;
    status.runs_ended += ended;
    if (has_ended) continue;
    const double share =
        plan.cells > 0 ? static_cast<double>(std::min(ended, plan.cells)) / static_cast<double>(plan.cells) : 0;
    status.left_s = std::max(status.left_s, (1 - share) * plan.seconds / std::max(1, request.cpus));
  }
  return status;
}

int run_status(const StatusOptions& options) {
  std::vector<PartStatus> parts;
  Coverage coverage;
  double longest_s = 0;
  size_t waiting_cells = 0;
  std::vector<std::pair<std::string, SlurmRequest>> submitted;
  std::vector<RunsStatus> runs;
  for (const std::string& dir : options.dirs) {
    const auto request = find_request(dir);
    if (request) {
      submitted.emplace_back(dir, *request);
      runs.push_back(runs_status(dir, *request));
      runs.back().are_over = has_parts(dir);
    }
    if (request && !has_parts(dir)) continue;  // only submitted
    for (const std::string& part : parts_ahead({dir})) {
      const Store store = Store::open(part);
      parts.push_back(status_of(part, store));
      coverage.add(store);
      longest_s = std::max(longest_s, parts.back().left_s);
    }
  }
  for (const auto& [dir, request] : submitted) {
    for (PartStatus& part : waiting_parts(dir, request, coverage)) {
      waiting_cells += part.planned;
      longest_s = std::max(longest_s, part.left_s);
      parts.push_back(std::move(part));
    }
  }
  // the accuracy parts begin when these have ended, however they did
  std::erase_if(runs, [](const RunsStatus& each) { return each.are_over; });
  for (const RunsStatus& each : runs) longest_s += each.left_s;
  const std::vector<std::string> missing = coverage.missing();
  const size_t planned = coverage.planned() + waiting_cells, done = coverage.done();
  if (options.json) {
    Json rows = Json::array();
    for (const PartStatus& part : parts) {
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
    for (const RunsStatus& each : runs) {
      ahead.push_back({{"parts", each.parts},
                       {"parts_ended", each.ended},
                       {"parts_running", each.under_way},
                       {"runs", each.runs},
                       {"runs_ended", each.runs_ended},
                       {"left_s", each.left_s}});
    }
    print_json({{"parts", rows},
                {"runs", ahead},
                {"missing", missing},
                {"planned", planned},
                {"done", done},
                {"left_s", longest_s}});
    return kDone;
  }
  std::vector<std::vector<std::string>> rows;
  rows.reserve(parts.size());
  for (const PartStatus& part : parts) {
    rows.push_back({part.dir, part.shard, part.node, fmt::format("{}/{}", part.done, part.planned),
                    part.done == part.planned ? "" : duration_label(part.left_s), std::string(part.state())});
  }
  print(table({"directory", "part", "node", "cells", "left", "state"}, rows, {3}));
  print(paragraph(fmt::format(
      "{} of {} cells{}", done, planned,
      done < planned ? fmt::format("; about {} left where all parts run side by side", duration_label(longest_s))
                     : "")));
  for (const RunsStatus& each : runs) {
    if (each.parts == 0) continue;
    print(
        paragraph(fmt::format("first the runs that these read: {} of {} in {}, of which {} ended and {} are under way",
                              each.runs_ended, counted(each.runs, "run"),
                              counted(static_cast<size_t>(each.parts), "part"), each.ended, each.under_way),
                  2));
  }
  for (const std::string& each : missing) print(paragraph("missing: " + each, 2));
  return kDone;
}

}  // namespace

void add_status(CLI::App& app, Action& action) {
  CLI::App* command =
      add_command(app, "status", "Tell how far a campaign is, with the time left, over all of its parts",
                  {{"assay status results", "also while it is measured"},
                   {"assay status part1 part2 part3", "shards on three machines"}});
  const auto options = std::make_shared<StatusOptions>();
  command->add_option("DIR", options->dirs, "Results directories, or folders of them")->required()->type_name("");
  command->add_flag("--json", options->json, "Print JSON")->disable_flag_override();
  command->callback([&action, options] { action = [options] { return run_status(*options); }; });
}

}  // namespace assay::cli
