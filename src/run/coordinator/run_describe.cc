#include "run/coordinator/run_describe.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/hash.h"
#include "base/json.h"
#include "base/text.h"
#include "campaign/shards.h"
#include "engines/registry.h"
#include "isolate/machine_lack.h"
#include "load/drawing.h"
#include "measures/measure.h"
#include "measures/plausible.h"
#include "results/store/facts.h"
#include "run/coordinator/machine.h"
#include "run/coordinator/rows.h"

namespace assay {

using nlohmann::json;

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

void RunDescription::run_ended(bool made) {
  ++(made ? runs_made_ : runs_failed_);
  describe_node(nullptr);
}

// This machine and what it has done here so far; times of earlier runs on it are counted on.
void RunDescription::describe_node(const RunDone* done) {
  json facts = json::object();
  for (const NodeRow& row : run_.store.nodes()) {
    if (row.id == node_.id) facts = json::parse(row.json, nullptr, false);
  }
  if (!facts.is_object()) facts = json::object();
  if (done == nullptr || !facts.contains("name")) {
    for (const ManifestEntry& fact : machine_facts()) facts[fact.key] = fact.value;
    facts["name"] = node_name();
    facts["shard"] = shard_text(run_.options.shard);
    facts["cells"] = shard_cells_text(run_.options.shard.cells);
    facts["jobs"] = run_.jobs;
    if (!facts.contains("started")) facts["started"] = date_text(unix_time());
  }
  const auto sum = [&](const char* key, double more) {
    const double before = parse_number(text_fact(facts, key)).value_or(0);
    facts[key] = fmt::format("{:.1f}", before + more);
  };
  if (run_.makes_runs()) {
    facts["runs"] = work_.runs.size();
    facts["runs_ended"] = runs_ended();
  }
  if (done != nullptr && (done->cells > 0 || run_.makes_runs())) {
    sum("wall_s", done->wall_s);
    sum("cpu_s", done->cpu_s);
    sum("engine_s", done->engine_s);
    facts["finished"] = date_text(unix_time());
  }
  if (done != nullptr) {
    const auto& [core, clock_s] = done->timing.facts;
    if (core >= 0) facts["timing_core"] = std::to_string(core);
    if (clock_s > 0) facts["clock_cost_ns"] = fmt::format("{:.0f}", 1e9 * clock_s);
  }
  node_.json = dump_json(facts);
  run_.store.set_node(node_);
}

// The owners of the stored states and how they are drawn: pictures of results need no model's file.
void RunDescription::describe_scenes() {
  std::vector<SceneRow> scenes;
  scenes.reserve(run_.campaign.systems.size());
  // several systems in a row show one robot
  const CampaignSystem* drawn = nullptr;
  Drawing drawing;
  for (const CampaignSystem& each : run_.campaign.systems) {
    if (drawn == nullptr || drawn->model_path != each.model_path || drawn->load != each.load) {
      drawing = read_drawing(each.model_path, each.load);
      for (const std::string& note : drawing.notes) run_.progress.message(fmt::format("note: {}", note));
      drawn = &each;
    }
    scenes.push_back(scene_row(each, drawing));
  }
  run_.store.set_scenes(scenes);
}

void RunDescription::describe_runs() {
  std::vector<RunRow> runs;
  for (const PlannedCell& cell : work_.plan.cells) {
    const std::string& last = cell.keep.empty() ? cell.final_state : cell.keep;
    const std::string& address = cell.reads == Reads::kFineRun ? cell.trajectory : last;
    if (address.empty()) continue;
    runs.push_back({address, run_.system(cell).name, run_.contender(cell).resolved.name, cell.timestep_ms});
  }
  // Runs that were added for the report's replays stay.
  for (RunRow& row : run_.store.runs()) {
    const auto same = [&](const RunRow& other) {
      return other.system == row.system && other.contender == row.contender && other.timestep_ms == row.timestep_ms;
    };
    if (std::ranges::none_of(runs, same)) runs.push_back(std::move(row));
  }
  run_.store.set_runs(runs);
}

void RunDescription::describe_contenders() {
  std::vector<ContenderRow> contenders;
  bool has_harness = false;
  for (const CampaignContender& each : run_.campaign.contenders) {
    contenders.push_back(contender_row(each));
    has_harness |= each.resolved.name == kHarness;
  }
  const std::vector<std::string> known = Registry::instance().contender_names();
  if (!has_harness && std::ranges::find(known, kHarness) != known.end()) {
    CampaignContender harness;
    harness.resolved = Registry::instance().resolve(kHarness);
    contenders.push_back(contender_row(harness));
  }
  run_.store.set_contenders(contenders);
}

void RunDescription::describe_plan() {
  std::vector<PlanRow> planned;
  planned.reserve(work_.mine.size());
  const auto step_us = expected_step_us(run_.campaign);
  for (const PlannedCell* cell : work_.mine) {
    planned.push_back({cell->key, cell->shard, estimate_seconds(run_.campaign, {run_.ahead_of(*cell)}, step_us, 1),
                       !is_timed(*cell)});
  }
  run_.store.set_plan(planned);
}

void RunDescription::begin() {
  Store& store = run_.store;
  std::vector<SystemRow> systems;
  systems.reserve(run_.campaign.systems.size());
  for (const CampaignSystem& each : run_.campaign.systems) systems.push_back(system_row(each));
  store.set_systems(systems);
  // Reading and simplifying meshes takes seconds: the parts of a search share what the first has drawn.
  if (!run_.options.wanted || store.scenes().size() != run_.campaign.systems.size()) describe_scenes();
  describe_runs();
  describe_contenders();

  // What names this directory's share of the work, wherever the directory is moved.
  std::string part = store.manifest("part").value_or("");
  if (part.empty()) {
    part = content_hash(fmt::format("{} {} {} {}", node_name(), ::getpid(), unix_time(), run_.options.out));
    store.set_manifest({{"part", part}});
    if (store.cell_keys().empty()) store.set_manifest({{kSoundnessEntry, std::to_string(kSoundnessRules)}});
  }
  constexpr size_t kDigits = 16;
  node_.id = content_hash(fmt::format("{} {} {}", part, node_name(), machine_facts().front().value)).substr(0, kDigits);
  if (!run_.options.wanted) describe_plan();  // a search decides as it goes
  describe_node(nullptr);                     // after the plan: where there is a node, it is known what it was to do
  describe_campaign();
}

void RunDescription::describe_campaign() {
  const Campaign& campaign = run_.campaign;
  Store& store = run_.store;
  std::vector<ManifestEntry> entries = machine_facts();
  const auto before = store.manifest("cpu");
  if (before && *before != entries.front().value) {
    run_.progress.message(
        fmt::format("the results so far were measured on another machine ({}): speeds do not compare", *before));
  }
  entries.push_back({"campaign_title", campaign.title});
  entries.push_back({"seed", std::to_string(campaign.seed)});
  const TimingOptions& timing = campaign.timing;
  entries.push_back(
      {"timing",
       fmt::format(
           "{} rounds in {} processes, turns of {} ms in the mean over the contenders; {} windows of "
           "the run, the same for all, from states of {}, {} untimed steps first",
           timing.rounds, std::min(timing.processes, timing.rounds), shortest(timing.batch_ms), timing.windows,
           timing.common_states ? "one contender's fine-step run" : "each contender's own run at the timed timestep",
           timing.warmup)});
  if (!run_.options.command.empty()) entries.push_back({"command", run_.options.command});
  if (!store.manifest("started")) entries.push_back({"started", date_text(unix_time())});
  if (!campaign.ratios.empty()) entries.push_back({"ratios", dump_json(json(campaign.ratios))});
  store.set_manifest(entries);
}

RunSummary RunDescription::finish(const RunDone& done) {
  RunSummary summary;
  summary.warnings = derive_values(run_.store);
  summary.cells = static_cast<int>(work_.mine.size());
  summary.done_before = static_cast<int>(work_.done_before());
  summary.done_now = done.cells;
  summary.makes_runs = run_.makes_runs();
  summary.runs = static_cast<int>(work_.runs.size());
  summary.runs_made = runs_made_;
  summary.runs_failed = runs_failed_;
  summary.wall_s = done.wall_s;
  summary.cpu_s = done.cpu_s;
  summary.signal = run_.interrupts.signal();
  summary.interrupted = summary.signal != 0;
  summary.without_truth = done.without_truth;
  for (const auto& [name, failure] : work_.unscored) summary.failed_gate.push_back({name, failure.reason});
  for (const CampaignContender& each : run_.campaign.contenders) {
    if (!each.absent.empty() && !each.twin) summary.left_out.push_back(each.absent);
  }
  summary.lack = done.lack;
  if (const std::string limit = inherited_memory_limit(); summary.lack.empty() && !limit.empty()) {
    summary.lack = fmt::format("this shell allows {}", limit);
  }
  if (done.cpu_s > 0) summary.engine_share_cpu = std::min(1.0, done.engine_s / done.cpu_s);
  const Spent spent = sum_up_cells(summary);
  describe_end(done, summary, spent);
  describe_node(&done);
  return summary;
}

// Of all stored cells of this part, also those of earlier runs.
RunDescription::Spent RunDescription::sum_up_cells(RunSummary& summary) const {
  const Campaign& campaign = run_.campaign;
  std::set<std::string> keys;
  for (const PlannedCell* cell : work_.mine) keys.insert(cell->key);
  Spent spent;
  double timing_engine = 0, accuracy_engine = 0;
  int stored = 0;
  for (const Cell& cell : run_.store.cells()) {
    if (!keys.contains(cell.key)) continue;
    ++stored;
    ++summary.outcomes[std::string(outcome_text(cell.outcome))];
    // neither waits for a clock nor shares the machine; has all cores
    const bool steps = reads(cell.measure, Reads::kSteps);
    if (is_timed(cell.measure) && !steps) continue;
    (steps ? timing_engine : accuracy_engine) += cell.engine_s;
    (steps ? spent.timing_wall_s : spent.accuracy_cpu_s) += steps ? cell.wall_s : cell.cpu_s;
    for (const Value& value : cell.values) {
      if (!value.value) continue;
      const auto asked = campaign.ratios.find(cell.contender);
      if (value.name == "time_ratio" && asked != campaign.ratios.end()) {
        summary.ratios.push_back({cell.system, asked->second, cell.contender, cell.timestep_ms, *value.value,
                                  value.low.value_or(0), value.high.value_or(0)});
      }
      if (value.name != "aa_ratio") continue;
      summary.aa.push_back({cell.system, "", cell.contender, cell.timestep_ms, *value.value, value.low.value_or(0),
                            value.high.value_or(0)});
    }
  }
  if (!summary.interrupted && summary.without_truth.empty()) {
    summary.unmeasured = static_cast<int>(keys.size()) - stored;
  }
  for (TimePair& pair : summary.aa) {
    const auto content = [&](const std::string& name) {
      const auto found = std::ranges::find_if(
          campaign.contenders, [&](const CampaignContender& each) { return each.resolved.name == name; });
      return found->content();
    };
    for (const CampaignContender& each : campaign.contenders) {
      if (pair.a.empty() && each.absent.empty() && each.content() == content(pair.b)) pair.a = each.resolved.name;
    }
  }
  if (spent.timing_wall_s > 0) summary.engine_share_timing = timing_engine / spent.timing_wall_s;
  if (spent.accuracy_cpu_s > 0) summary.engine_share_accuracy = accuracy_engine / spent.accuracy_cpu_s;
  return spent;
}

void RunDescription::describe_end(const RunDone& done, const RunSummary& summary, const Spent& spent) {
  std::vector<ManifestEntry> entries;
  const auto sum = [&](const std::string& key, double more) {
    const double before = parse_number(run_.store.manifest(key).value_or("")).value_or(0);
    entries.push_back({key, fmt::format("{:.1f}", before + more)});
  };
  if (done.cells > 0) {
    sum("wall_s", done.wall_s);
    sum("cpu_s", done.cpu_s);
    sum("engine_s", done.engine_s);
    entries.push_back({"finished", date_text(unix_time())});
  }
  if (spent.timing_wall_s > 0) {
    entries.push_back({"engine_share_timing", fmt::format("{:.3f}", summary.engine_share_timing)});
  }
  if (spent.accuracy_cpu_s > 0) {
    entries.push_back({"engine_share_accuracy", fmt::format("{:.3f}", summary.engine_share_accuracy)});
  }
  if (!summary.aa.empty()) {
    const TwinSummary twins = summarised(summary.aa);
    entries.push_back({"twins", fmt::format("{} of {} cells of one contender under two names within 1 %, {} told apart",
                                            twins.within_1_percent, twins.cells, twins.told_apart)});
  }
  for (const auto& [device, what] : done.timing.devices) entries.push_back({fmt::format("device {}", device), what});
  const auto& [core, clock_s] = done.timing.facts;
  if (core >= 0) entries.push_back({"timing_core", std::to_string(core)});
  if (clock_s > 0) entries.push_back({"clock_cost_ns", fmt::format("{:.0f}", 1e9 * clock_s)});
  if (!entries.empty()) run_.store.set_manifest(entries);
}

}  // namespace assay
