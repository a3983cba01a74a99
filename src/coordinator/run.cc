#include "coordinator/run.h"

#include <cmath>
#include <ctime>
#include <filesystem>
#include <memory>
#include <optional>
#include <sys/resource.h>

#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "coordinator/machine.h"
#include "coordinator/rows.h"
#include "coordinator/runner.h"

namespace assay {

using nlohmann::json;

namespace {

std::string date_text(double unix_seconds) {
  const auto seconds = static_cast<std::time_t>(unix_seconds);
  std::tm utc{};
  ::gmtime_r(&seconds, &utc);
  return fmt::format("{:04}-{:02}-{:02} {:02}:{:02}:{:02} UTC", utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday,
                     utc.tm_hour, utc.tm_min, utc.tm_sec);
}

double children_cpu_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

}  // namespace

Cell Runner::cell_of(const PlannedCell& planned, Outcome outcome, const std::string& reason) const {
  Cell cell;
  cell.key = planned.key;
  cell.system = system(planned).name;
  cell.contender = contender(planned).resolved.name;
  cell.timestep_ms = planned.timestep_ms;
  cell.measure = planned.measure;
  cell.outcome = outcome;
  cell.reason = reason;
  return cell;
}

void Runner::put(const Cell& cell, const std::vector<SampleSeries>& samples) {
  store_.put_cell(cell, samples);
  ++done_now_;
  engine_now_s_ += cell.engine_s;
  progress_.finished(cell, remaining_s());
}

void Runner::put_failed(const PlannedCell& planned, Outcome outcome, const std::string& reason) {
  Cell cell = cell_of(planned, outcome, reason);
  cell.started = cell.finished = unix_time();
  if (!failed_gate_.contains(cell.contender)) count(planned);
  put(cell);
}

// An answer has a cell for each measure; cells that are one under two contenders' names get the same.
void Runner::put_answer(const std::vector<const PlannedCell*>& cells, const JobEnd& end) {
  for (const PlannedCell* planned : cells) {
    Cell cell = cell_of(*planned, end.outcome, end.reason);
    std::vector<SampleSeries> samples;
    const double share = 1.0 / static_cast<double>(cells.size());
    cell.wall_s = share * end.wall_s;
    cell.steal = end.steal;
    cell.started = end.started;
    cell.finished = end.finished;
    if (end.answer) {
      cell.cpu_s = share * end.answer->at("cpu_s").get<double>();
      cell.engine_s = share * end.answer->at("engine_s").get<double>();
      for (const json& answered : end.answer->at("cells")) {
        if (answered.at("measure") != planned->measure) continue;
        cell.outcome = parse_outcome(answered.at("outcome").get<std::string>()).value_or(Outcome::kCrashed);
        cell.reason = answered.at("reason");
        const auto number = [](const json& value) {
          return value.is_null() ? std::nullopt : std::optional(value.get<double>());
        };
        for (const json& value : answered.at("values")) {
          cell.values.push_back({value.at("name"), value.at("unit"), number(value.at("value")), number(value.at("low")),
                                 number(value.at("high"))});
        }
        for (const auto& [name, values] : answered.at("samples").items()) {
          samples.push_back({name, values.get<std::vector<double>>()});
        }
      }
    }
    count(*planned);
    put(cell, samples);
  }
}

// Seconds of one worker.
double Runner::cost(const PlannedCell& cell) const { return estimate_seconds(campaign_, {cell}, step_us_, 1); }

// What is left of both passes, each corrected by how it fared so far.
double Runner::remaining_s() const {
  const auto now = Clock::now();
  const auto left = [&](const Share& share, double workers) {
    const double expected_s = share.done_s / workers;
    const double elapsed_s = std::chrono::duration<double>(now - share.since).count();
    constexpr double kEnough = 0.05;  // of the pass, to learn from
    const bool learned = share.done_s > kEnough * share.all_s && expected_s > 0;
    return (share.all_s - share.done_s) / workers * (learned ? elapsed_s / expected_s : 1);
  };
  return left(accuracy_, jobs_) + left(timing_, 1);
}

void Runner::count(const PlannedCell& cell) {
  Share& share = is_timed(cell) ? timing_ : accuracy_;
  share.done_s += cost(cell);
}

// ---- preparation ------------------------------------------------------------------------------------------------------

void Runner::describe() {
  std::vector<SystemRow> systems;
  systems.reserve(campaign_.systems.size());
  for (const CampaignSystem& each : campaign_.systems) systems.push_back(system_row(each));
  store_.set_systems(systems);
  // Whose the kept states are and how they are drawn: results need no model's file to be looked at.
  std::vector<SceneRow> scenes;
  scenes.reserve(campaign_.systems.size());
  for (const CampaignSystem& each : campaign_.systems) scenes.push_back(scene_row(each));
  store_.set_scenes(scenes);
  std::vector<RunRow> runs;
  for (const PlannedCell& cell : plan_.cells) {
    const std::string& address = cell.measure == "reference" ? cell.trajectory : cell.final_state;
    if (address.empty()) continue;
    runs.push_back({address, system(cell).name, contender(cell).resolved.name, cell.timestep_ms});
  }
  // What was kept for the report's replays meanwhile stays.
  for (RunRow& row : store_.runs()) {
    const auto same = [&](const RunRow& other) {
      return other.system == row.system && other.contender == row.contender && other.timestep_ms == row.timestep_ms;
    };
    if (std::ranges::none_of(runs, same)) runs.push_back(std::move(row));
  }
  store_.set_runs(runs);
  std::vector<ContenderRow> contenders;
  bool has_harness = false;
  for (const CampaignContender& each : campaign_.contenders) {
    contenders.push_back(contender_row(each));
    has_harness |= each.resolved.name == kHarness;
  }
  const std::vector<std::string> known = Registry::instance().contender_names();
  if (!has_harness && std::ranges::find(known, kHarness) != known.end()) {
    CampaignContender harness;
    harness.resolved = Registry::instance().resolve(kHarness);
    contenders.push_back(contender_row(harness));
  }
  store_.set_contenders(contenders);

  std::vector<ManifestEntry> entries = machine_facts();
  const auto before = store_.manifest("cpu");
  if (before && *before != entries.front().value) {
    progress_.message(
        fmt::format("the results so far were measured on another machine ({}): speeds do not compare", *before));
  }
  entries.push_back({"campaign_title", campaign_.title});
  entries.push_back({"seed", std::to_string(campaign_.seed)});
  const TimingOptions& timing = campaign_.timing;
  entries.push_back(
      {"timing", fmt::format("{} rounds of {} ms a contender in {} processes, from {} states of its reference "
                             "run, {} untimed steps first",
                             timing.rounds, shortest(timing.batch_ms), std::min(timing.processes, timing.rounds),
                             timing.states, timing.warmup)});
  if (!options_.command.empty()) entries.push_back({"command", options_.command});
  if (!store_.manifest("started")) entries.push_back({"started", date_text(unix_time())});
  if (!campaign_.ratios.empty()) entries.push_back({"ratios", json(campaign_.ratios).dump()});
  store_.set_manifest(entries);
}

// Which cells are ours, and which of them are still to do.
void Runner::choose() {
  plan_ = make_plan(campaign_, options_.shard.count);
  const std::vector<std::string> done = store_.cell_keys();
  std::set<std::pair<int, double>> timed_again;  // a cell of a round is missing: the round is repeated with all in it
  std::set<int> compared_again;                  // likewise where all are compared with all
  for (const PlannedCell& cell : plan_.cells) {
    if (cell.shard != options_.shard.index) continue;
    mine_.push_back(&cell);
    if (cell.measure == "raw_speed" && !std::ranges::binary_search(done, cell.key)) {
      timed_again.insert({cell.system, cell.timestep_ms});
    }
    if (cell.measure == "agreement" && !std::ranges::binary_search(done, cell.key)) compared_again.insert(cell.system);
  }
  for (const PlannedCell* cell : mine_) {
    const bool again = (cell->measure == "raw_speed" && timed_again.contains({cell->system, cell->timestep_ms})) ||
                       (cell->measure == "agreement" && compared_again.contains(cell->system));
    if (again || !std::ranges::binary_search(done, cell->key)) todo_.push_back(cell);
  }
  // A reference that failed fails what depends on it, this time too.
  std::map<std::string, const PlannedCell*> references;
  for (const PlannedCell& cell : plan_.cells) {
    if (cell.measure == "reference") references[cell.key] = &cell;
  }
  for (const Cell& cell : store_.cells()) {
    const auto found = references.find(cell.key);
    if (found == references.end() || cell.outcome == Outcome::kOk || cell.outcome == Outcome::kUnstable) continue;
    failed_trajectory_[found->second->trajectory] = {cell.outcome, cell.reason};
  }
}

// "capsules-27: reference 14, consistency 112, raw_speed 56 cells; about 3 min", a line for each system, the gate's
// failures left out.
std::vector<std::string> Runner::outline(const std::vector<PlannedCell>& ahead) const {
  std::vector<std::string> lines;
  for (size_t s = 0; s < campaign_.systems.size(); ++s) {
    std::map<std::string, int> counts;
    std::vector<PlannedCell> cells;
    std::set<int> contenders;
    for (const PlannedCell& cell : ahead) {
      if (std::cmp_not_equal(cell.system, s)) continue;
      ++counts[cell.measure];
      cells.push_back(cell);
      contenders.insert(cell.contender);
    }
    if (cells.empty()) continue;
    std::vector<std::string> parts;
    parts.reserve(counts.size());
    for (const auto& [measure, count] : counts) parts.push_back(fmt::format("{} {}", measure, count));
    lines.push_back(fmt::format("  {}: {} contenders; {}; about {}", campaign_.systems[s].name, contenders.size(),
                                join(parts, ", "),
                                duration_label(std::max(1.0, estimate_seconds(campaign_, cells, step_us_, jobs_)))));
  }
  return lines;
}

// ---- the whole ------------------------------------------------------------------------------------------------------------

void Runner::finish(RunSummary& summary, double wall_s, double cpu_s) {
  summary.warnings = derive_values(store_);
  summary.cells = static_cast<int>(mine_.size());
  summary.done_before = static_cast<int>(mine_.size() - todo_.size());
  summary.done_now = done_now_;
  summary.wall_s = wall_s;
  summary.cpu_s = cpu_s;
  summary.signal = interrupts_.signal();
  summary.interrupted = summary.signal != 0;
  for (const auto& [name, failure] : failed_gate_) {
    summary.failed_gate.push_back(fmt::format("{} ({})", name, failure.reason));
  }
  for (const CampaignContender& each : campaign_.contenders) {
    if (!each.absent.empty()) summary.left_out.push_back(each.absent);
  }
  std::set<std::string> keys;
  for (const PlannedCell* cell : mine_) keys.insert(cell->key);
  double timing_engine = 0, timing_wall = 0, accuracy_engine = 0, accuracy_cpu = 0;
  for (const Cell& cell : store_.cells()) {
    if (!keys.contains(cell.key)) continue;
    ++summary.outcomes[std::string(outcome_text(cell.outcome))];
    if (cell.measure == "scaling") continue;  // neither waits for a clock nor shares the machine
    (cell.measure == "raw_speed" ? timing_engine : accuracy_engine) += cell.engine_s;
    (cell.measure == "raw_speed" ? timing_wall : accuracy_cpu) +=
        cell.measure == "raw_speed" ? cell.wall_s : cell.cpu_s;
    for (const Value& value : cell.values) {
      if (!value.value) continue;
      const auto asked = campaign_.ratios.find(cell.contender);
      if (value.name == "time_ratio" && asked != campaign_.ratios.end()) {
        summary.ratios.push_back({cell.system, asked->second, cell.contender, cell.timestep_ms, *value.value,
                                  value.low.value_or(0), value.high.value_or(0)});
      }
      if (value.name != "aa_ratio") continue;
      summary.aa.push_back({cell.system, "", cell.contender, cell.timestep_ms, *value.value, value.low.value_or(0),
                            value.high.value_or(0)});
    }
  }
  for (TimePair& pair : summary.aa) {
    const auto content = [&](const std::string& name) {
      const auto found = std::ranges::find_if(
          campaign_.contenders, [&](const CampaignContender& each) { return each.resolved.name == name; });
      return found->content();
    };
    for (const CampaignContender& each : campaign_.contenders) {
      if (pair.a.empty() && each.absent.empty() && each.content() == content(pair.b)) pair.a = each.resolved.name;
    }
  }
  summary.engine_share_timing = timing_wall > 0 ? timing_engine / timing_wall : 0;
  summary.engine_share_accuracy = accuracy_cpu > 0 ? accuracy_engine / accuracy_cpu : 0;

  if (cpu_s > 0) summary.engine_share_cpu = std::min(1.0, engine_now_s_ / cpu_s);

  std::vector<ManifestEntry> entries;
  const auto sum = [&](const std::string& key, double more) {
    const double before = parse_number(store_.manifest(key).value_or("")).value_or(0);
    entries.push_back({key, fmt::format("{:.1f}", before + more)});
  };
  if (done_now_ > 0) {
    sum("wall_s", wall_s);
    sum("cpu_s", cpu_s);
    sum("engine_s", engine_now_s_);
    entries.push_back({"finished", date_text(unix_time())});
  }
  if (timing_wall > 0) entries.push_back({"engine_share_timing", fmt::format("{:.3f}", summary.engine_share_timing)});
  if (accuracy_cpu > 0) {
    entries.push_back({"engine_share_accuracy", fmt::format("{:.3f}", summary.engine_share_accuracy)});
  }
  if (timing_facts_.core >= 0) entries.push_back({"timing_core", std::to_string(timing_facts_.core)});
  if (timing_facts_.clock_s > 0) {
    entries.push_back({"clock_cost_ns", fmt::format("{:.0f}", 1e9 * timing_facts_.clock_s)});
  }
  if (!entries.empty()) store_.set_manifest(entries);
}

RunSummary Runner::run() {
  const double cpu_before = children_cpu_seconds();
  choose();
  describe();
  if (!todo_.empty() && !interrupted()) gate();
  if (!todo_.empty() && !interrupted()) probe();
  if (!interrupted()) {
    std::vector<PlannedCell> ahead;
    ahead.reserve(todo_.size());
    for (const PlannedCell* cell : todo_) {
      if (failed_gate_.contains(contender(*cell).resolved.name)) continue;
      ahead.push_back(*cell);
      (is_timed(*cell) ? timing_ : accuracy_).all_s += cost(*cell);
    }
    accuracy_.since = Clock::now();
    progress_.plan(outline(ahead));
    progress_.begin(static_cast<int>(todo_.size()), static_cast<int>(mine_.size() - todo_.size()),
                    estimate_seconds(campaign_, ahead, step_us_, jobs_));
    accuracy();
    if (!interrupted()) scaling();
    if (!interrupted()) timing();
    references_.prune();
  }
  progress_.end();
  RunSummary summary;
  finish(summary, std::chrono::duration<double>(Clock::now() - start_).count(), children_cpu_seconds() - cpu_before);
  return summary;
}

RunSummary run_campaign(const Campaign& campaign, const RunOptions& options) { return Runner(campaign, options).run(); }

}  // namespace assay
