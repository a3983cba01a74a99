#include "run/coordinator/run_timing.h"

#include <algorithm>
#include <tuple>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/hash.h"
#include "base/json.h"
#include "engines/registry.h"
#include "measures/measure.h"
#include "run/coordinator/batch.h"
#include "run/coordinator/subject.h"
#include "run/coordinator/timing.h"

namespace assay {
namespace {

using nlohmann::json;

// The harness times the same windows where it is installed and no contender of the campaign.
bool has_harness(const Campaign& campaign) {
  const std::vector<std::string> known = Registry::instance().contender_names();
  return std::ranges::find(known, kHarness) != known.end() &&
         std::ranges::none_of(campaign.contenders,
                              [](const CampaignContender& each) { return each.resolved.name == kHarness; });
}

// The share of the run that contenders were timed in at this timestep, where some have been.
std::optional<double> share_in(const std::vector<Cell>& cells, const std::string& system, double timestep_ms) {
  for (const Cell& cell : cells) {
    if (!reads(cell.measure, Reads::kSteps) || cell.system != system || !same_timestep(cell.timestep_ms, timestep_ms))
      continue;
    if (const Value* share = find_value(cell, "window_share")) return share->value;
  }
  return std::nullopt;
}

class TimedPasses {
 public:
  TimedPasses(RunShared& run, const Work& work, TimeLeft& time_left, Answers& answers)
      : run_(run), work_(work), time_left_(time_left), answers_(answers) {}

  void scaling();
  void steps();
  void worlds();

  const TimingNotes& notes() const { return notes_; }

 private:
  using Planned = std::map<std::string, const PlannedCell*>;  // by key

  TimingJob session_job(const CampaignSystem& timed, const CampaignContender& contender,
                        const std::string& reference) const;
  std::optional<Ending> without_states(const PlannedCell& cell) const;
  void time_system(TimingPass& pass, int index);
  void time_at(TimingPass& pass, int index, double timestep_ms);
  std::optional<double> stored_share(const std::string& system, double timestep_ms) const;
  TimingPass::Started started(const Planned& planned) const;

  RunShared& run_;
  const Work& work_;
  TimeLeft& time_left_;
  Answers& answers_;
  std::vector<Cell> windows_of_;  // of RunOptions::windows_of
  TimingNotes notes_;
};

// Whole runs, one after the other, so that nothing else fills the caches meanwhile.
void TimedPasses::scaling() {
  Pool pool(run_.program, 1, run_.interrupts);
  bool any = false;
  for (const PlannedCell* cell : work_.todo) {
    const CampaignContender& contender = run_.contender(*cell);
    if (cell->reads != Reads::kWholeRuns || !work_.is_scored(contender)) continue;
    any = true;
    Job job;
    job.request = ScalingJob{cell->measure,
                             subject_spec(run_.system(*cell), contender),
                             cell->timestep_ms,
                             run_.seed(),
                             run_.store.trajectories_dir(),
                             cell->final_state,
                             kScalingMostRuns,
                             kScalingEnoughSeconds};
    job.title = run_.title(*cell);
    job.limit_s = run_.campaign.time_limit_s;
    job.cost = time_left_.cost(*cell);
    job.on_end = [this, cell](const JobEnd& end) { answers_.put({cell}, end); };
    pool.add(std::move(job));
  }
  if (!any) return;
  run_.progress.phase("scaling, one run at a time");
  time_left_.begin_timing();
  pool.run([&](const std::string& job) { run_.progress.started(job, time_left_.seconds()); });
}

void TimedPasses::steps() {
  if (std::ranges::none_of(work_.todo, [](const PlannedCell* cell) { return cell->reads == Reads::kSteps; })) return;
  run_.progress.phase("timing, alone on one core");
  if (!run_.options.windows_of.empty()) windows_of_ = Store::open(run_.options.windows_of).cells();
  time_left_.begin_timing();
  TimingPass pass(run_.campaign, run_.program, run_.interrupts);
  for (size_t s = 0; s < run_.campaign.systems.size() && !run_.interrupted(); ++s) {
    time_system(pass, static_cast<int>(s));
    pass.close();
  }
  notes_.facts = pass.facts();
}

void TimedPasses::time_system(TimingPass& pass, int index) {
  std::set<double> timesteps_ms;
  for (const PlannedCell* cell : work_.todo) {
    if (cell->reads == Reads::kSteps && cell->system == index) timesteps_ms.insert(cell->timestep_ms);
  }
  for (const double timestep_ms : timesteps_ms) {
    time_at(pass, index, timestep_ms);
    if (run_.interrupted()) return;
  }
}

// Why a timing has no states to start from, where it has none.
std::optional<Ending> TimedPasses::without_states(const PlannedCell& cell) const {
  const auto failed = work_.failed_runs.find(cell.trajectory);
  if (failed != work_.failed_runs.end()) return failed->second;
  const int states_of = run_.system(cell).states_of;
  if (states_of < 0) return std::nullopt;
  const std::string& of = run_.contender(states_of).resolved.name;
  const auto unscored = work_.unscored.find(of);
  if (unscored == work_.unscored.end()) return std::nullopt;
  return Ending{Outcome::kUnsupported,
                fmt::format("there are no states of '{}' to start from: {}", of, unscored->second.reason)};
}

void TimedPasses::time_at(TimingPass& pass, int index, double timestep_ms) {
  const CampaignSystem& timed = run_.system(index);
  std::vector<TimedContender> contenders;
  std::map<std::string, std::string> keys;
  Planned planned;
  for (const PlannedCell* cell : work_.todo) {
    if (cell->reads != Reads::kSteps || cell->system != index || cell->timestep_ms != timestep_ms) continue;
    const CampaignContender& contender = run_.contender(*cell);
    if (!work_.is_scored(contender) || work_.lost_runs.contains(cell->trajectory)) continue;
    if (const auto failure = without_states(*cell)) {
      answers_.put_failed(*cell, *failure);
      continue;
    }
    const std::string& name = contender.resolved.name;
    contenders.push_back({name, session_job(timed, contender, cell->trajectory), cell->timed_run});
    keys[name] = cell->key;
    planned[cell->key] = cell;
  }
  if (contenders.empty()) return;
  const std::string key =
      content_hash(dump_json(json{{"harness", run_.campaign.name}, {"system", timed.name}, {"h", timestep_ms}}));
  // When a run is resumed, the harness's finished cell is not measured again either.
  const bool with_harness = has_harness(run_.campaign) && (work_.timed_elsewhere.contains(key) ||
                                                           !std::ranges::binary_search(run_.store.cell_keys(), key));
  if (with_harness) {
    CampaignContender harness;
    harness.resolved = Registry::instance().resolve(kHarness);
    contenders.push_back({kHarness, session_job(timed, harness, "")});
    keys[kHarness] = key;
  }
  pass.measure(timed, contenders, timestep_ms, keys, with_harness ? kHarness : "",
               stored_share(timed.name, timestep_ms), started(planned),
               [&](const std::vector<MeasuredCell>& cells) { answers_.put_timed(cells, planned); });
}

TimingJob TimedPasses::session_job(const CampaignSystem& timed, const CampaignContender& contender,
                                   const std::string& reference) const {
  return {subject_spec(timed, contender), run_.store.trajectories_dir(), reference, run_.campaign.timing.warmup};
}

// Others have been timed in this share of the run: new contenders time the same.
std::optional<double> TimedPasses::stored_share(const std::string& system, double timestep_ms) const {
  const std::optional<double> own = share_in(run_.store.cells(), system, timestep_ms);
  return own ? own : share_in(windows_of_, system, timestep_ms);
}

// Tells how far the cells of `planned` are, which are timed together.
TimingPass::Started TimedPasses::started(const Planned& planned) const {
  double all_s = 0;
  for (const auto& [key, cell] : planned) all_s += time_left_.run_cost(*cell);
  return [this, all_s](const std::string& what, double done) {
    time_left_.under_way(done * all_s);
    run_.progress.started(what, time_left_.seconds());
  };
}

// Many worlds at once: all cores belong to the contender whose turn it is.
void TimedPasses::worlds() {
  std::map<std::tuple<int, double, int>, std::vector<const PlannedCell*>> groups;  // system, timestep, worlds
  for (const PlannedCell* cell : work_.todo) {
    if (cell->reads != Reads::kWorlds || !work_.is_scored(run_.contender(*cell))) continue;
    groups[{cell->system, cell->timestep_ms, cell->worlds}].push_back(cell);
  }
  if (groups.empty()) return;
  run_.progress.phase("many worlds, one contender at a time");
  time_left_.begin_timing();
  for (const auto& [of, cells] : groups) {
    const CampaignSystem& timed = run_.system(*cells.front());
    std::vector<BatchContender> contenders;
    Planned planned;
    for (const PlannedCell* cell : cells) {
      const CampaignContender& own = run_.contender(*cell);
      contenders.push_back({own.resolved.name, cell->key,
                            BatchJob{subject_spec(timed, own), cell->timestep_ms, cell->worlds, cell->device,
                                     run_.campaign.timing.warmup, run_.seed()}});
      planned[cell->key] = cell;
    }
    measure_batch(run_.campaign, timed, run_.program, run_.interrupts, contenders, notes_.devices, started(planned),
                  [&](const std::vector<MeasuredCell>& measured) { answers_.put_timed(measured, planned); });
    if (run_.interrupted()) return;
  }
}

}  // namespace

TimingNotes measure_times(RunShared& run, const Work& work, TimeLeft& time_left, Answers& answers) {
  TimedPasses passes(run, work, time_left, answers);
  passes.scaling();
  if (!run.interrupted()) passes.steps();
  if (!run.interrupted()) passes.worlds();
  return passes.notes();
}

}  // namespace assay
