// The timing pass: alone on one core, contenders interleaved.
#include <nlohmann/json.hpp>

#include "base/hash.h"
#include "coordinator/runner.h"

namespace assay {

using nlohmann::json;

void Runner::time_system(TimingPass& pass, int system_index) {
  const CampaignSystem& timed = campaign_.systems[static_cast<size_t>(system_index)];
  std::vector<double> timesteps;
  for (const PlannedCell* cell : todo_) {
    if (cell->measure != "raw_speed" || cell->system != system_index) continue;
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
      if (cell->measure != "raw_speed" || cell->system != system_index || cell->timestep_ms != timestep) continue;
      const std::string& name = contender(*cell).resolved.name;
      if (failed_gate_.contains(name)) continue;
      const auto failed = failed_trajectory_.find(cell->trajectory);
      if (failed != failed_trajectory_.end()) {
        put_failed(*cell, failed->second.outcome, failed->second.reason);
        continue;
      }
      contenders.push_back({name, subject_json(timed, contender(*cell)), cell->trajectory});
      keys[name] = cell->key;
      planned[name] = cell;
    }
    if (contenders.empty()) continue;
    const std::string key =
        content_hash(json{{"harness", campaign_.name}, {"system", timed.name}, {"h", timestep}}.dump());
    // a finished cell is not measured again when a run is resumed, this one neither
    const bool with_harness = has_harness && !std::ranges::binary_search(stored, key);
    if (with_harness) {
      CampaignContender harness;
      harness.resolved = Registry::instance().resolve(kHarness);
      json subject = subject_json(timed, harness);
      contenders.push_back({kHarness, std::move(subject), ""});
      keys[kHarness] = key;
    }
    pass.measure(
        timed, contenders, timestep, keys, with_harness ? kHarness : "",
        [&](const std::string& what) { progress_.started(what); },
        [&](const Cell& cell, const std::vector<SampleSeries>& samples) {
          if (has_harness && cell.contender == kHarness) {
            store_.put_cell(cell, samples);  // no cell of the campaign
            return;
          }
          count(*planned.at(cell.contender));
          put(cell, samples);
        });
    if (interrupted()) return;
  }
}

// Whole runs, one after the other: nothing else is to fill the caches meanwhile.
void Runner::scaling() {
  Pool pool(program_, 1, interrupts_);
  bool any = false;
  for (const PlannedCell* cell : todo_) {
    if (cell->measure != "scaling" || failed_gate_.contains(contender(*cell).resolved.name)) continue;
    any = true;
    Job job;
    job.message = subject_json(system(*cell), contender(*cell));
    job.message["kind"] = "scaling";
    job.message["timestep_ms"] = cell->timestep_ms;
    job.message["seed"] = campaign_.seed;
    job.message["trajectories"] = store_.trajectories_dir();
    job.message["save"] = cell->final_state;
    job.title = title(*cell);
    job.limit_s = campaign_.time_limit_s;
    job.cost = cost(*cell);
    job.on_end = [this, cell](const JobEnd& end) { put_answer({cell}, end); };
    pool.add(std::move(job));
  }
  if (!any) return;
  progress_.phase("scaling, one run at a time");
  timing_.since = Clock::now();
  pool.run([&](const std::string& job) { progress_.started(job); });
}

void Runner::timing() {
  if (std::ranges::none_of(todo_, [](const PlannedCell* cell) { return cell->measure == "raw_speed"; })) return;
  progress_.phase("timing, alone on one core");
  if (timing_.done_s == 0) timing_.since = Clock::now();
  TimingPass pass(campaign_, program_, store_.trajectories_dir(), interrupts_);
  for (size_t s = 0; s < campaign_.systems.size() && !interrupted(); ++s) {
    time_system(pass, static_cast<int>(s));
    pass.close();
  }
  timing_facts_ = pass.facts();
}

}  // namespace assay
