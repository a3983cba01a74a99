// The timing pass: alone on one core, contenders interleaved.
#include <tuple>

#include <nlohmann/json.hpp>

#include "base/hash.h"
#include "base/json.h"
#include "run/coordinator/batch.h"
#include "run/coordinator/runner.h"

namespace assay {

using nlohmann::json;

TimingJob Runner::session_job(const CampaignSystem& timed, const CampaignContender& contender,
                              const std::string& reference) const {
  return {subject_spec(timed, contender), store_.trajectories_dir(), reference, campaign_.timing.warmup};
}

void Runner::time_system(TimingPass& pass, int system_index) {
  const CampaignSystem& timed = campaign_.systems[static_cast<size_t>(system_index)];
  std::vector<double> timesteps;
  for (const PlannedCell* cell : todo_) {
    if (cell->reads != Reads::kSteps || cell->system != system_index) continue;
    if (std::ranges::find(timesteps, cell->timestep_ms) == timesteps.end()) timesteps.push_back(cell->timestep_ms);
  }
  std::ranges::sort(timesteps);
  const std::vector<std::string> known = Registry::instance().contender_names();
  const bool has_harness = std::ranges::find(known, kHarness) != known.end() &&
                           std::ranges::none_of(campaign_.contenders, [](const CampaignContender& each) {
                             return each.resolved.name == kHarness;
                           });
  const std::vector<std::string> stored = store_.cell_keys();
  for (const double timestep : timesteps) {
    std::vector<TimedContender> contenders;
    std::map<std::string, std::string> keys;
    std::map<std::string, const PlannedCell*> planned;
    for (const PlannedCell* cell : todo_) {
      if (cell->reads != Reads::kSteps || cell->system != system_index || cell->timestep_ms != timestep) continue;
      const std::string& name = contender(*cell).resolved.name;
      if (failed_gate_.contains(name) || lost_trajectory_.contains(cell->trajectory)) continue;
      const auto failed = failed_trajectory_.find(cell->trajectory);
      if (failed != failed_trajectory_.end()) {
        put_failed(*cell, failed->second);
        continue;
      }
      if (timed.states_of >= 0) {
        const std::string& of = campaign_.contenders[static_cast<size_t>(timed.states_of)].resolved.name;
        if (const auto gate = failed_gate_.find(of); gate != failed_gate_.end()) {
          put_failed(*cell, {Outcome::kUnsupported,
                             fmt::format("there are no states of '{}' to start from: {}", of, gate->second.reason)});
          continue;
        }
      }
      contenders.push_back({name, session_job(timed, contender(*cell), cell->trajectory), cell->timed_run});
      keys[name] = cell->key;
      planned[name] = cell;
    }
    if (contenders.empty()) continue;
    double of_all_s = 0;
    for (const auto& [name, cell] : planned) of_all_s += run_cost(*cell);
    const std::string key =
        content_hash(dump_json(json{{"harness", campaign_.name}, {"system", timed.name}, {"h", timestep}}));
    // When a run is resumed, the harness's finished cell is not measured again either.
    const bool with_harness =
        has_harness && (timed_elsewhere_.contains(key) || !std::ranges::binary_search(stored, key));
    if (with_harness) {
      CampaignContender harness;
      harness.resolved = Registry::instance().resolve(kHarness);
      contenders.push_back({kHarness, session_job(timed, harness, "")});
      keys[kHarness] = key;
    }
    pass.measure(
        timed, contenders, timestep, keys, with_harness ? kHarness : "", stored_share(timed.name, timestep),
        [&](const std::string& what, double done) {
          timing_.under_way_s = done * of_all_s;
          progress_.started(what, remaining_s());
        },
        [&](const std::vector<MeasuredCell>& cells) {
          store_.put_cells(cells);
          timing_.under_way_s = 0;
          for (const MeasuredCell& each : cells) {
            if (has_harness && each.cell.contender == kHarness) continue;  // not a cell of the campaign
            count(*planned.at(each.cell.contender));
            note_stored(each.cell);
          }
        });
    if (interrupted()) return;
  }
}

// The share of the run that contenders were timed in at this timestep, where some have been: others then time the same.
std::optional<double> Runner::stored_share(const std::string& system, double timestep_ms) const {
  const std::optional<double> own = share_in(store_.cells(), system, timestep_ms);
  return own ? own : share_in(windows_of_, system, timestep_ms);
}

std::optional<double> Runner::share_in(const std::vector<Cell>& cells, const std::string& system, double timestep_ms) {
  for (const Cell& cell : cells) {
    if (!reads(cell.measure, Reads::kSteps) || cell.system != system || !same_timestep(cell.timestep_ms, timestep_ms))
      continue;
    if (const Value* share = find_value(cell, "window_share")) return share->value;
  }
  return std::nullopt;
}

// Whole runs, one after the other, so that nothing else fills the caches meanwhile.
void Runner::scaling() {
  Pool pool(program_, 1, interrupts_);
  bool any = false;
  for (const PlannedCell* cell : todo_) {
    if (cell->reads != Reads::kWholeRuns || failed_gate_.contains(contender(*cell).resolved.name)) continue;
    any = true;
    Job job;
    job.request = ScalingJob{cell->measure,
                             subject_spec(system(*cell), contender(*cell)),
                             cell->timestep_ms,
                             seed(),
                             store_.trajectories_dir(),
                             cell->final_state,
                             kScalingMostRuns,
                             kScalingEnoughSeconds};
    job.title = title(*cell);
    job.limit_s = campaign_.time_limit_s;
    job.cost = cost(*cell);
    job.on_end = [this, cell](const JobEnd& end) { put_answer({cell}, end); };
    pool.add(std::move(job));
  }
  if (!any) return;
  progress_.phase("scaling, one run at a time");
  timing_.since = Clock::now();
  pool.run([&](const std::string& job) { progress_.started(job, remaining_s()); });
}

void Runner::timing() {
  if (std::ranges::none_of(todo_, [](const PlannedCell* cell) { return cell->reads == Reads::kSteps; })) return;
  progress_.phase("timing, alone on one core");
  if (!options_.windows_of.empty()) windows_of_ = Store::open(options_.windows_of).cells();
  if (timing_.done_s == 0) timing_.since = Clock::now();
  TimingPass pass(campaign_, program_, interrupts_);
  for (size_t s = 0; s < campaign_.systems.size() && !interrupted(); ++s) {
    time_system(pass, static_cast<int>(s));
    pass.close();
  }
  timing_facts_ = pass.facts();
}

// Many worlds at once: all cores belong to the contender whose turn it is.
void Runner::batches() {
  std::map<std::tuple<int, double, int>, std::vector<const PlannedCell*>> groups;  // system, timestep, worlds
  for (const PlannedCell* cell : todo_) {
    if (cell->reads != Reads::kWorlds || failed_gate_.contains(contender(*cell).resolved.name)) continue;
    groups[{cell->system, cell->timestep_ms, cell->worlds}].push_back(cell);
  }
  if (groups.empty()) return;
  progress_.phase("many worlds, one contender at a time");
  if (timing_.done_s == 0) timing_.since = Clock::now();
  for (const auto& [of, cells] : groups) {
    const CampaignSystem& timed = system(*cells.front());
    std::vector<BatchContender> contenders;
    std::map<std::string, const PlannedCell*> planned;
    double of_all_s = 0;
    for (const PlannedCell* cell : cells) {
      of_all_s += run_cost(*cell);
      const CampaignContender& own = contender(*cell);
      contenders.push_back({own.resolved.name, cell->key,
                            BatchJob{subject_spec(timed, own), cell->timestep_ms, cell->worlds, cell->device,
                                     campaign_.timing.warmup, seed()}});
      planned[cell->key] = cell;
    }
    measure_batch(
        campaign_, timed, program_, interrupts_, contenders, devices_,
        [&](const std::string& what, double done) {
          timing_.under_way_s = done * of_all_s;
          progress_.started(what, remaining_s());
        },
        [&](const std::vector<MeasuredCell>& measured) {
          store_.put_cells(measured);
          timing_.under_way_s = 0;
          for (const MeasuredCell& each : measured) {
            count(*planned.at(each.cell.key));
            note_stored(each.cell);
          }
        });
    if (interrupted()) return;
  }
}

}  // namespace assay
