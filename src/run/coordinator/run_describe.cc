// What the store says about a run besides its cells: systems, contenders, scenes, the manifest, and the summary at the
// end.
#include <cmath>
#include <ctime>
#include <optional>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/hash.h"
#include "base/json.h"
#include "campaign/shards.h"
#include "isolate/machine_lack.h"
#include "load/drawing.h"
#include "measures/measure.h"
#include "measures/plausible.h"
#include "results/store/facts.h"
#include "run/coordinator/machine.h"
#include "run/coordinator/rows.h"
#include "run/coordinator/runner.h"

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

}  // namespace

TwinSummary summarised(const std::vector<TimePair>& twins) {
  constexpr double kNear = 0.01;
  TwinSummary summary;
  for (const TimePair& pair : twins) {
    ++summary.cells;
    if (std::abs(pair.ratio - 1) <= kNear) ++summary.within_1_percent;
    if (pair.low > 1 || (pair.high > 0 && pair.high < 1)) ++summary.told_apart;
  }
  return summary;
}

// This machine and what it has done here so far; times of earlier runs on it are counted on.
void Runner::describe_node(bool finished, double wall_s, double cpu_s) {
  json facts = json::object();
  for (const NodeRow& row : store_.nodes()) {
    if (row.id == node_.id) facts = json::parse(row.json, nullptr, false);
  }
  if (!facts.is_object()) facts = json::object();
  if (!finished || !facts.contains("name")) {
    for (const ManifestEntry& fact : machine_facts()) facts[fact.key] = fact.value;
    facts["name"] = node_name();
    facts["shard"] = shard_text(options_.shard);
    facts["cells"] = shard_cells_text(options_.shard.cells);
    facts["jobs"] = jobs_;
    if (!facts.contains("started")) facts["started"] = date_text(unix_time());
  }
  const auto sum = [&](const char* key, double more) {
    const double before = parse_number(text_fact(facts, key)).value_or(0);
    facts[key] = fmt::format("{:.1f}", before + more);
  };
  const bool makes_runs = options_.shard.cells == ShardCells::kRuns;
  if (makes_runs) {
    facts["runs"] = runs_.size();
    facts["runs_ended"] = runs_made_ + runs_failed_;
  }
  if (finished && (done_now_ > 0 || makes_runs)) {
    sum("wall_s", wall_s);
    sum("cpu_s", cpu_s);
    sum("engine_s", engine_now_s_);
    facts["finished"] = date_text(unix_time());
  }
  if (timing_facts_.core >= 0) facts["timing_core"] = std::to_string(timing_facts_.core);
  if (timing_facts_.clock_s > 0) facts["clock_cost_ns"] = fmt::format("{:.0f}", 1e9 * timing_facts_.clock_s);
  node_.json = dump_json(facts);
  store_.set_node(node_);
}

// The owners of the stored states and how they are drawn: pictures of results need no model's file.
void Runner::describe_scenes() {
  std::vector<SceneRow> scenes;
  scenes.reserve(campaign_.systems.size());
  // several systems in a row show one robot
  const CampaignSystem* drawn = nullptr;
  Drawing drawing;
  for (const CampaignSystem& each : campaign_.systems) {
    if (drawn == nullptr || drawn->model_path != each.model_path || drawn->load != each.load) {
      drawing = read_drawing(each.model_path, each.load);
      for (const std::string& note : drawing.notes) progress_.message(fmt::format("note: {}", note));
      drawn = &each;
    }
    scenes.push_back(scene_row(each, drawing));
  }
  store_.set_scenes(scenes);
}

void Runner::describe() {
  std::vector<SystemRow> systems;
  systems.reserve(campaign_.systems.size());
  for (const CampaignSystem& each : campaign_.systems) systems.push_back(system_row(each));
  store_.set_systems(systems);
  // Reading and simplifying meshes takes seconds: the parts of a search share what the first has drawn.
  if (!options_.wanted || store_.scenes().size() != campaign_.systems.size()) describe_scenes();
  std::vector<RunRow> runs;
  for (const PlannedCell& cell : plan_.cells) {
    const std::string& last = cell.keep.empty() ? cell.final_state : cell.keep;
    const std::string& address = cell.reads == Reads::kFineRun ? cell.trajectory : last;
    if (address.empty()) continue;
    runs.push_back({address, system(cell).name, contender(cell).resolved.name, cell.timestep_ms});
  }
  // Runs that were added for the report's replays stay.
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

  // What names this directory's share of the work, wherever the directory is moved.
  std::string part = store_.manifest("part").value_or("");
  if (part.empty()) {
    part = content_hash(fmt::format("{} {} {} {}", node_name(), ::getpid(), unix_time(), options_.out));
    store_.set_manifest({{"part", part}});
    if (store_.cell_keys().empty()) store_.set_manifest({{kSoundnessEntry, std::to_string(kSoundnessRules)}});
  }
  constexpr size_t kDigits = 16;
  node_.id = content_hash(fmt::format("{} {} {}", part, node_name(), machine_facts().front().value)).substr(0, kDigits);
  if (!options_.wanted) {  // a search decides as it goes
    std::vector<PlanRow> planned;
    planned.reserve(mine_.size());
    const auto step_us = expected_step_us(campaign_);
    for (const PlannedCell* cell : mine_) {
      planned.push_back(
          {cell->key, cell->shard, estimate_seconds(campaign_, {ahead_of(*cell)}, step_us, 1), !is_timed(*cell)});
    }
    store_.set_plan(planned);
  }
  describe_node(/*finished=*/false, 0, 0);  // after the plan: where there is a node, it is known what it was to do

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
      {"timing",
       fmt::format(
           "{} rounds in {} processes, turns of {} ms in the mean over the contenders; {} windows of "
           "the run, the same for all, from states of {}, {} untimed steps first",
           timing.rounds, std::min(timing.processes, timing.rounds), shortest(timing.batch_ms), timing.windows,
           timing.common_states ? "one contender's fine-step run" : "each contender's own run at the timed timestep",
           timing.warmup)});
  if (!options_.command.empty()) entries.push_back({"command", options_.command});
  if (!store_.manifest("started")) entries.push_back({"started", date_text(unix_time())});
  if (!campaign_.ratios.empty()) entries.push_back({"ratios", dump_json(json(campaign_.ratios))});
  store_.set_manifest(entries);
}

void Runner::finish(RunSummary& summary, double wall_s, double cpu_s) {
  summary.warnings = derive_values(store_);
  summary.cells = static_cast<int>(mine_.size());
  summary.done_before = static_cast<int>(mine_.size() - todo_.size());
  summary.done_now = done_now_;
  summary.makes_runs = options_.shard.cells == ShardCells::kRuns;
  summary.runs = static_cast<int>(runs_.size());
  summary.runs_made = runs_made_;
  summary.runs_failed = runs_failed_;
  summary.wall_s = wall_s;
  summary.cpu_s = cpu_s;
  summary.signal = interrupts_.signal();
  summary.interrupted = summary.signal != 0;
  summary.without_truth = without_truth_;
  for (const auto& [name, failure] : failed_gate_) summary.failed_gate.push_back({name, failure.reason});
  for (const CampaignContender& each : campaign_.contenders) {
    if (!each.absent.empty() && !each.twin) summary.left_out.push_back(each.absent);
  }
  std::set<std::string> keys;
  for (const PlannedCell* cell : mine_) keys.insert(cell->key);
  double timing_engine = 0, timing_wall = 0, accuracy_engine = 0, accuracy_cpu = 0;
  int stored = 0;
  for (const Cell& cell : store_.cells()) {
    if (!keys.contains(cell.key)) continue;
    ++stored;
    ++summary.outcomes[std::string(outcome_text(cell.outcome))];
    // neither waits for a clock nor shares the machine; has all cores
    const bool steps = reads(cell.measure, Reads::kSteps);
    if (is_timed(cell.measure) && !steps) continue;
    (steps ? timing_engine : accuracy_engine) += cell.engine_s;
    (steps ? timing_wall : accuracy_cpu) += steps ? cell.wall_s : cell.cpu_s;
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
  if (!summary.interrupted && without_truth_.empty()) summary.unmeasured = static_cast<int>(keys.size()) - stored;
  summary.lack = lack_;
  if (const std::string limit = inherited_memory_limit(); lack_.empty() && !limit.empty()) {
    summary.lack = fmt::format("this shell allows {}", limit);
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
  if (!summary.aa.empty()) {
    const TwinSummary twins = summarised(summary.aa);
    entries.push_back({"twins", fmt::format("{} of {} cells of one contender under two names within 1 %, {} told apart",
                                            twins.within_1_percent, twins.cells, twins.told_apart)});
  }
  for (const auto& [device, what] : devices_) entries.push_back({fmt::format("device {}", device), what});
  if (timing_facts_.core >= 0) entries.push_back({"timing_core", std::to_string(timing_facts_.core)});
  if (timing_facts_.clock_s > 0) {
    entries.push_back({"clock_cost_ns", fmt::format("{:.0f}", 1e9 * timing_facts_.clock_s)});
  }
  if (!entries.empty()) store_.set_manifest(entries);
  describe_node(/*finished=*/true, wall_s, cpu_s);
}

}  // namespace assay
