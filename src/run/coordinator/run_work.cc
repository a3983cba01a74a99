#include "run/coordinator/run_work.h"

#include <algorithm>
#include <iterator>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/text.h"
#include "conformance/conformance.h"
#include "measures/measure.h"
#include "results/store/facts.h"
#include "run/coordinator/machine.h"

namespace assay {
namespace {

// Keys of stored cells that are measured again although they are there. `suite_again` gets contenders.
std::vector<std::string> retried(RunShared& run, std::set<std::string>& suite_again) {
  std::vector<std::string> keys;
  if (!run.options.retry) return keys;
  const std::vector<std::string> damaged = run.store.remove_damaged_cells();
  if (!damaged.empty()) {
    run.progress.message(fmt::format("{} damaged cells are measured again: {}", damaged.size(), join(damaged, "; ")));
  }
  for (const ConformanceRow& row : run.store.conformance()) {
    if (row.status == status_text(ConformanceStatus::kFail)) suite_again.insert(row.contender);
  }
  for (const Cell& cell : run.store.cells()) {
    const bool failed = cell.outcome == Outcome::kCrashed || cell.outcome == Outcome::kTimeout;
    const bool unscored = cell.outcome == Outcome::kUnsupported && suite_again.contains(cell.contender);
    if (failed || unscored) keys.push_back(cell.key);
  }
  std::ranges::sort(keys);
  return keys;
}

// Cells that compare contenders are measured together: one that is missing repeats all of its group.
struct Repeated {
  std::set<std::pair<int, double>> timed;         // system and timestep, of a round
  std::set<std::tuple<int, double, int>> worlds;  // system, timestep and number, of a batch
  std::set<int> compared;                         // systems, of agreement
  std::set<int> scaled;                           // systems, of runs for scaling

  void add(const PlannedCell& cell) {
    if (cell.reads == Reads::kSteps) timed.insert({cell.system, cell.timestep_ms});
    if (cell.reads == Reads::kWorlds) worlds.insert({cell.system, cell.timestep_ms, cell.worlds});
    if (cell.reads == Reads::kFineRuns) compared.insert(cell.system);
    if (cell.reads == Reads::kWholeRuns) scaled.insert(cell.system);
  }
  bool holds(const PlannedCell& cell) const {
    return (cell.reads == Reads::kSteps && timed.contains({cell.system, cell.timestep_ms})) ||
           worlds.contains({cell.system, cell.timestep_ms, cell.worlds}) ||
           (cell.reads == Reads::kFineRuns && compared.contains(cell.system));
  }
};

// Times of one system compare only if one machine measured them: where some are missing and the others are another
// machine's, all of the system's (for scaling, of its family's) are measured again. Returns these others' keys.
std::set<std::string> time_again_elsewhere(RunShared& run, Repeated& repeated) {
  std::map<std::string, std::string> elsewhere;  // by node: its machine's name
  for (const NodeRow& row : run.store.nodes()) {
    const auto facts = facts_of(row.json);
    const std::string name = text_fact(facts, "name");
    if (name != node_name() || text_fact(facts, "cpu") != machine_facts().front().value) elsewhere[row.id] = name;
  }
  std::set<std::string> keys;
  if (elsewhere.empty() || (repeated.timed.empty() && repeated.scaled.empty())) return keys;
  const std::vector<CampaignSystem>& all = run.campaign.systems;
  std::set<std::string> systems, families;
  for (const auto& [index, timestep_ms] : repeated.timed) systems.insert(run.system(index).name);
  for (const int index : repeated.scaled) families.insert(run.system(index).family);
  std::map<std::string, std::string> moved;  // system: machine
  for (const Cell& cell : run.store.cells()) {
    const auto other = elsewhere.find(cell.node);
    if (other == elsewhere.end()) continue;
    const auto system = std::ranges::find(all, cell.system, &CampaignSystem::name);
    const bool again =
        ((reads(cell.measure, Reads::kSteps) || reads(cell.measure, Reads::kWorlds)) &&
         systems.contains(cell.system)) ||
        (reads(cell.measure, Reads::kWholeRuns) && system != all.end() && families.contains(system->family));
    if (!again) continue;
    keys.insert(cell.key);
    moved[cell.system] = other->second;
    if (reads(cell.measure, Reads::kSteps) && system != all.end()) {
      repeated.timed.insert({static_cast<int>(system - all.begin()), cell.timestep_ms});
    }
  }
  for (const auto& [system, machine] : moved) {
    run.progress.message(
        fmt::format("{} was timed on '{}', whose speeds do not compare with this machine's: its timings are "
                    "measured again",
                    system, machine));
  }
  return keys;
}

}  // namespace

Work::Work(RunShared& run) : plan(make_plan(run.campaign, run.options.shard.count, run.options.shard.cells)) {
  const RunOptions& options = run.options;
  for (const PlannedRun& each : plan.runs) {
    if (each.shard == options.shard.index) runs.push_back(&each);
  }
  const std::vector<std::string> again_keys = retried(run, suite_again);
  std::vector<std::string> done;
  std::ranges::set_difference(run.store.cell_keys(), again_keys, std::back_inserter(done));
  Repeated repeated;
  for (const PlannedCell& cell : plan.cells) {
    if (cell.shard != options.shard.index || (options.wanted && !options.wanted(cell))) continue;
    mine.push_back(&cell);
    if (!std::ranges::binary_search(done, cell.key)) repeated.add(cell);
  }
  timed_elsewhere = time_again_elsewhere(run, repeated);
  for (const PlannedCell* cell : mine) {
    const bool again = repeated.holds(*cell) || timed_elsewhere.contains(cell->key);
    if (again || !std::ranges::binary_search(done, cell->key)) todo.push_back(cell);
  }
  // A reference that failed earlier still fails what depends on it.
  std::map<std::string, const PlannedCell*> references;
  for (const PlannedCell& cell : plan.cells) {
    if (cell.reads == Reads::kFineRun) references[cell.key] = &cell;
  }
  for (const Cell& cell : run.store.cells()) {
    const auto found = references.find(cell.key);
    if (found == references.end() || cell.outcome == Outcome::kOk || cell.outcome == Outcome::kUnstable) continue;
    if (std::ranges::binary_search(again_keys, cell.key)) continue;
    failed_runs[found->second->trajectory] = {cell.outcome, cell.reason};
  }
}

}  // namespace assay
