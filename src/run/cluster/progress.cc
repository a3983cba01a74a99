#include "run/cluster/progress.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/text.h"
#include "results/store/facts.h"
#include "results/store/store.h"
#include "run/cluster/parts.h"
#include "run/cluster/slurm.h"

namespace assay {
namespace {

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

}  // namespace

CampaignStatus campaign_status(const std::vector<std::string>& dirs) {
  CampaignStatus status;
  std::vector<PartStatus>& parts = status.parts;
  std::vector<RunsStatus>& runs = status.runs;
  double& longest_s = status.left_s;
  Coverage coverage;
  size_t waiting_cells = 0;
  std::vector<std::pair<std::string, SlurmRequest>> submitted;
  for (const std::string& dir : dirs) {
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
  status.missing = coverage.missing();
  status.planned = coverage.planned() + waiting_cells;
  status.done = coverage.done();
  return status;
}

}  // namespace assay
