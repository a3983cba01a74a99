#include "run/coordinator/run_time_left.h"

#include <algorithm>

#include <fmt/format.h>

#include "base/text.h"
#include "campaign/shards.h"

namespace assay {

TimeLeft::TimeLeft(const RunShared& run, const Work& work, Speeds speeds)
    : run_(run), work_(work), speeds_(std::move(speeds)) {
  ahead_.reserve(work.todo.size());
  for (const PlannedCell* cell : work.todo) {
    if (!work.is_scored(run.contender(*cell))) continue;
    ahead_.push_back(run.ahead_of(*cell));
    (is_timed(*cell) ? timing_ : accuracy_).all_s += cost(*cell);
  }
  for (const PlannedRun* each : work.runs) accuracy_.all_s += run_cost(*each);
  accuracy_.since = Clock::now();
}

std::vector<std::string> TimeLeft::outline() const {
  std::vector<std::string> lines;
  for (size_t s = 0; s < run_.campaign.systems.size(); ++s) {
    std::map<std::string, int> counts;
    std::vector<PlannedCell> cells;
    std::set<int> contenders;
    for (const PlannedCell& cell : ahead_) {
      if (std::cmp_not_equal(cell.system, s)) continue;
      ++counts[cell.measure];
      cells.push_back(cell);
      contenders.insert(cell.contender);
    }
    if (cells.empty()) continue;
    std::vector<std::string> parts;
    parts.reserve(counts.size());
    for (const auto& [measure, count] : counts) parts.push_back(fmt::format("{} {}", measure, count));
    const double all_s = estimate_seconds(run_.campaign, cells, speeds_.step_us, run_.jobs, speeds_.starts);
    lines.push_back(fmt::format("  {}: {} contenders; {}; about {}", run_.campaign.systems[s].name, contenders.size(),
                                join(parts, ", "), duration_label(std::max(1.0, all_s))));
  }
  return lines;
}

double TimeLeft::estimate_s() const {
  return estimate_seconds(run_.campaign, ahead_, speeds_.step_us, run_.jobs, speeds_.starts);
}

double TimeLeft::cost(const PlannedCell& cell) const {
  return estimate_seconds(run_.campaign, {run_.ahead_of(cell)}, speeds_.step_us, 1, speeds_.starts);
}

double TimeLeft::run_cost(const PlannedCell& cell) const { return cost(cell) / cell.runs; }

double TimeLeft::run_cost(const PlannedRun& planned) const { return run_seconds(work_.plan, planned, speeds_.step_us); }

double TimeLeft::left_s(const Share& share, double workers) const {
  const double done_s = share.done_s + share.under_way_s, expected_s = done_s / workers;
  const double elapsed_s = std::chrono::duration<double>(Clock::now() - share.since).count();
  constexpr double kEnough = 0.05;  // of the pass, to learn from
  const bool learned = done_s > kEnough * share.all_s && expected_s > 0;
  return (share.all_s - done_s) / workers * (learned ? elapsed_s / expected_s : 1);
}

double TimeLeft::seconds() const { return left_s(accuracy_, run_.jobs) + left_s(timing_, 1); }

void TimeLeft::begin_timing() {
  if (timing_.done_s == 0) timing_.since = Clock::now();
}

void TimeLeft::finished(const PlannedCell& cell) { (is_timed(cell) ? timing_ : accuracy_).done_s += run_cost(cell); }

void TimeLeft::spare_run(const PlannedCell& cell) { accuracy_.all_s -= run_cost(cell); }

}  // namespace assay
