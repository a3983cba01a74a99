#include "run/coordinator/run_accuracy_jobs.h"

#include <algorithm>
#include <tuple>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/hash.h"
#include "base/json.h"
#include "base/text.h"
#include "measures/measure.h"
#include "results/store/trajectory.h"
#include "run/coordinator/subject.h"

namespace assay {
namespace {

using nlohmann::json;

// Of the reference solution.
std::string truth_address(const CampaignSystem& system) {
  json content = {
      {"truth", 2}, {"model", system.model.hash}, {"duration_s", system.duration_s}, {"sample_ms", system.sample_ms}};
  if (!system.solution.empty()) content["solution"] = solution_content(system);
  return content_hash(dump_json(content));
}

// Of what is seen between samples of the run with this address.
std::string watched_address(const std::string& run, const RunJob& job) {
  constexpr int kVersion = 1;
  const json content = {{"watched", kVersion},
                        {"run", run},
                        {"grasp", {job.grasp.object, job.grasp.hand, job.grasp.drop_m}},
                        {"seed", job.seed}};
  return content_hash(dump_json(content));
}

class AccuracyPlanner {
 public:
  AccuracyPlanner(const RunShared& run, const Work& work, KeptRuns& kept, TimeLeft& time_left,
                  const RunForOthers& ended)
      : run_(run), work_(work), kept_(kept), time_left_(time_left), ended_(ended) {}

  AccuracyJobs plan() {
    plan_references();
    plan_truths();
    plan_measures();
    plan_agreement();
    return std::move(jobs_);
  }

 private:
  using Cells = std::vector<const PlannedCell*>;

  // A run that is needed.
  struct Reference {
    const PlannedCell* cell = nullptr;
    int state = 0;                             // number of the initial state
    const CampaignContender* owner = nullptr;  // whose run it is
  };

  void plan_references();
  void plan_reference(const std::string& address, const Reference& from, const Cells& cells, const Cells& part_of,
                      double run_s);
  void plan_truths();
  void plan_truth(const CampaignSystem& of, double run_s);
  void plan_measures();
  void plan_cold(const PlannedCell& reader);
  void plan_agreement();

  bool is_scored(const PlannedCell& cell) const { return work_.is_scored(run_.contender(cell)); }
  const CampaignContender& owner(const PlannedCell& cell) const;
  bool is_there(const std::string& address, double run_s) {
    return run_s > 0 ? kept_.others_have(address) : kept_.has(address);
  }
  RunJob run_job(const PlannedCell& cell, double timestep_ms) const;
  PiecesJob pieces_job(const PlannedCell& cell, std::vector<std::string> addresses) const;

  const RunShared& run_;
  const Work& work_;
  KeptRuns& kept_;
  TimeLeft& time_left_;
  const RunForOthers& ended_;
  AccuracyJobs jobs_;
};

// Whose run it is: timings may start from another contender's states.
const CampaignContender& AccuracyPlanner::owner(const PlannedCell& cell) const {
  const int of = cell.reads == Reads::kSteps ? run_.system(cell).states_of : -1;
  return run_.contender(of < 0 ? cell.contender : of);
}

// Without measures.
RunJob AccuracyPlanner::run_job(const PlannedCell& cell, double timestep_ms) const {
  RunJob job;
  job.subject = subject_spec(run_.system(cell), run_.contender(cell));
  job.timestep_ms = timestep_ms;
  job.trajectories = run_.store.trajectories_dir();
  job.seed = run_.seed();
  job.grasp = run_.system(cell).grasp;
  return job;
}

PiecesJob AccuracyPlanner::pieces_job(const PlannedCell& cell, std::vector<std::string> addresses) const {
  const CampaignSystem& of = run_.system(cell);
  std::vector<double> lengths = {of.piece_ms};
  lengths.insert(lengths.end(), of.more_pieces_ms.begin(), of.more_pieces_ms.end());
  return {cell.measure,
          subject_spec(of, run_.contender(cell)),
          cell.timestep_ms,
          run_.store.trajectories_dir(),
          std::move(addresses),
          of.pieces,
          std::move(lengths),
          of.reference_of(run_.contender(cell)),
          of.grid_ms(),
          run_.seed(),
          cell.cold};
}

// Runs that others need or that are cells of their own.
void AccuracyPlanner::plan_references() {
  std::map<std::string, Reference> needed;
  std::map<std::string, double> for_others;  // seconds by address
  for (const PlannedRun* each : work_.runs) {
    if (each->contender < 0) continue;
    const CampaignContender& of = run_.contender(each->contender);
    const double run_s = time_left_.run_cost(*each);
    if (!work_.is_scored(of)) {
      ended_(false, run_s);
      continue;
    }
    needed[each->address] = {&work_.plan.cells[each->cell], each->state, &of};
    for_others[each->address] = run_s;
  }
  for (const PlannedCell* cell : work_.todo) {
    if (cell->against.empty() || !is_scored(*cell)) continue;
    const CampaignContender& of = run_.contender(run_.system(*cell).trained_in);
    if (!work_.is_scored(of)) continue;
    for (size_t i = 0; i < cell->against.size(); ++i) needed[cell->against[i]] = {cell, static_cast<int>(i), &of};
  }
  std::map<std::pair<int, int>, const PlannedCell*> reference_of;  // by system and contender
  for (const PlannedCell* cell : work_.todo) {
    if (cell->reads == Reads::kFineRun) reference_of[{cell->system, cell->contender}] = cell;
  }
  std::map<std::string, Cells> cells;  // of equal contenders under several names share one run
  std::map<std::string, std::set<const PlannedCell*>> part_of;
  for (const PlannedCell* cell : work_.todo) {
    if (cell->trajectory.empty() || !work_.is_scored(owner(*cell))) continue;
    needed[cell->trajectory] = {cell, 0, &owner(*cell)};
    if (cell->reads == Reads::kFineRun) cells[cell->trajectory].push_back(cell);
    const auto reference = reference_of.find({cell->system, cell->contender});
    for (size_t i = 0; i < cell->other_states.size(); ++i) {
      needed[cell->other_states[i]] = {cell, static_cast<int>(i) + 1, &owner(*cell)};
      if (reference != reference_of.end()) part_of[cell->other_states[i]].insert(reference->second);
    }
  }
  for (const auto& [address, from] : needed) {
    if (work_.failed_runs.contains(address)) continue;
    const auto other = for_others.find(address);
    const std::set<const PlannedCell*>& whole = part_of[address];
    plan_reference(address, from, cells[address], {whole.begin(), whole.end()},
                   other == for_others.end() ? 0 : other->second);
  }
}

// `cells`: that the run is; `part_of`: whose cost includes it; `run_s`: as in AccuracyJob.
void AccuracyPlanner::plan_reference(const std::string& address, const Reference& from, const Cells& cells,
                                     const Cells& part_of, double run_s) {
  const auto& [cell, state, whose] = from;
  const bool there = is_there(address, run_s);
  if (there && cells.empty()) {
    if (run_s > 0) ended_(true, run_s);
    for (const PlannedCell* reference : part_of) time_left_.spare_run(*reference);
    return;
  }
  const CampaignSystem& system = run_.system(*cell);
  RunJob run = run_job(*cell, system.reference_of(*whose));
  run.subject = subject_spec(system, *whose);
  run.subject.sample_ms = system.grid_ms();
  run.measures = {kFineRunCell};
  run.state = state;
  const bool watches =
      std::ranges::any_of(system.measures, [](const Measure* measure) { return measure->reads_between; });
  if (there) {
    run.use = {address};
  } else {
    run.save = address;
    if (watches) run.watched = {watched_address(address, run)};
  }
  AccuracyJob& planned = jobs_.producers[address];
  planned = {{}, {}, cells, part_of, run_s, !there};
  planned.job.request = std::move(run);
  planned.job.title = fmt::format("reference {} {}{}", system.name, whose->resolved.name,
                                  state == 0 ? "" : fmt::format(", initial state {}", state + 1));
  planned.job.limit_s = run_.campaign.time_limit_s;
  // Others wait for these, so they come first, the dearest before the others.
  planned.job.cost = 1e6 + (cells.empty() ? 0 : time_left_.cost(*cells.front())) - state;
}

void AccuracyPlanner::plan_truths() {
  for (const PlannedCell* cell : work_.todo) {
    if (cell->reads == Reads::kSolution) plan_truth(run_.system(*cell), 0);
  }
  for (const PlannedRun* each : work_.runs) {
    if (each->contender < 0) plan_truth(run_.system(work_.plan.cells[each->cell]), time_left_.run_cost(*each));
  }
}

void AccuracyPlanner::plan_truth(const CampaignSystem& of, double run_s) {
  const std::string address = truth_address(of);
  if (jobs_.producers.contains(address)) return;
  if (!of.solution_hash.empty()) {  // nothing is to be solved
    Trajectory given = {of.solution_states};
    given.states.insert(given.states.begin(), of.model.initial);
    write_trajectory(run_.store.trajectories_dir(), address, given);
    kept_.keep(address);
  }
  if (is_there(address, run_s)) {
    if (run_s > 0) ended_(true, run_s);
    return;
  }
  AccuracyJob& planned = jobs_.producers[address];
  planned.run_s = run_s;
  planned.job.request =
      TruthJob{model_spec(of), of.solution, of.duration_s, of.sample_ms, run_.store.trajectories_dir(), address};
  planned.job.title = fmt::format("truth {}", of.name);
  planned.job.limit_s = std::min(run_.options.truth_limit_s, run_.campaign.time_limit_s);
  planned.job.cost = 1e7;
}

// All measures but those of pieces read the same run.
void AccuracyPlanner::plan_measures() {
  std::map<std::tuple<int, int, double>, size_t> runs;
  std::map<std::string, const PlannedCell*> readers;  // of pieces at the fine-step run's timestep
  for (const PlannedCell* cell : work_.todo) {
    if (cell->reads != Reads::kPieces && !shares_runs(cell->reads)) continue;
    if (!is_scored(*cell)) continue;
    const CampaignSystem& system = run_.system(*cell);
    const bool is_run = cell->reads != Reads::kPieces;
    const auto at = std::tuple(cell->system, cell->contender, cell->timestep_ms);
    const auto found = runs.find(at);
    const bool shared = is_run && found != runs.end();
    AccuracyJob& planned = shared ? jobs_.waiting[found->second] : jobs_.waiting.emplace_back();
    Job& job = planned.job;
    planned.cells.push_back(cell);
    std::vector<std::string> addresses;
    if (!cell->trajectory.empty()) addresses = {cell->trajectory};
    addresses.insert(addresses.end(), cell->other_states.begin(), cell->other_states.end());
    planned.needs.insert(addresses.begin(), addresses.end());
    const int states = system.initial_states.count;
    if (!shared) {
      job.title = run_.title(*cell);
      // the limit is that of one motion
      job.limit_s = run_.campaign.time_limit_s * states;
      job.cost = time_left_.cost(*cell);
    }
    if (!is_run) {
      const PiecesJob pieces = pieces_job(*cell, std::move(addresses));
      const bool is_reference = same_timestep(cell->timestep_ms, pieces.reference_ms);
      if (is_reference) {
        planned.makes = cell->cold;
        planned.is_made = !kept_.has(cell->cold);
      } else {
        planned.needs.insert(cell->cold);
        readers[cell->cold] = cell;
      }
      job.request = pieces;
      continue;
    }
    if (!shared) {
      runs[at] = jobs_.waiting.size() - 1;
      job.request = run_job(*cell, cell->timestep_ms);
    }
    auto& run = std::get<RunJob>(job.request);
    run.measures.push_back(cell->measure);
    if (addresses.size() > run.use.size()) run.use = std::move(addresses);
    if (measure_of(cell->measure)->reads_between && run.watched.size() < run.use.size()) {
      run.watched.clear();
      for (const std::string& address : run.use) {
        run.watched.push_back(watched_address(address, run));
        kept_.has(run.watched.back());  // fetched from another campaign, if it is there
      }
    }
    if (takes_all_states(cell->reads)) run.states = states;
    if (!cell->keep.empty()) {
      run.keep = cell->keep;
      run.keep_state = system.shown_state();
    }
    if (!cell->against.empty() && system.trained_in >= 0 && work_.is_scored(run_.contender(system.trained_in))) {
      run.against = cell->against;
      planned.needs.insert(cell->against.begin(), cell->against.end());
    }
    if (cell->reads == Reads::kSolution) {
      run.truth = truth_address(system);
      if (system.solution_hash.empty()) run.solution = system.solution;
      planned.needs.insert(run.truth);
    }
  }
  for (const AccuracyJob& planned : jobs_.waiting) readers.erase(planned.makes);
  for (const auto& [address, reader] : readers) {
    if (!kept_.has(address)) plan_cold(*reader);
  }
}

// Pieces at the fine-step run's timestep whose cell is measured already, or by another part.
void AccuracyPlanner::plan_cold(const PlannedCell& reader) {
  const CampaignContender& of = run_.contender(reader);
  PlannedCell cell = reader;
  cell.timestep_ms = run_.system(reader).reference_of(of);
  std::vector<std::string> addresses = {cell.trajectory};
  addresses.insert(addresses.end(), cell.other_states.begin(), cell.other_states.end());
  AccuracyJob& planned = jobs_.waiting.emplace_back();
  planned.makes = cell.cold;
  planned.needs.insert(addresses.begin(), addresses.end());
  planned.job.request = pieces_job(cell, std::move(addresses));
  planned.job.title =
      fmt::format("pieces of {} {} at the reference's timestep", run_.system(cell).name, of.resolved.name);
  planned.job.limit_s = run_.campaign.time_limit_s * run_.system(cell).initial_states.count;
  planned.job.cost = time_left_.cost(reader) * reader.timestep_ms / cell.timestep_ms;
}

// Compares each contender's reference run with those of all others that have one.
void AccuracyPlanner::plan_agreement() {
  std::map<std::pair<int, std::string>, Cells> systems;  // by system and measure
  for (const PlannedCell* cell : work_.todo) {
    if (cell->reads == Reads::kFineRuns && is_scored(*cell)) systems[{cell->system, cell->measure}].push_back(cell);
  }
  for (const auto& [index, cells] : systems) {
    for (const PlannedCell* own : cells) {
      AccuracyJob& planned = jobs_.waiting.emplace_back();
      planned.cells = {own};
      planned.needs = {own->trajectory};
      AgreementJob compared = {own->measure, run_.store.trajectories_dir(), own->trajectory, {}};
      planned.job.title = run_.title(*own);
      planned.job.limit_s = run_.campaign.time_limit_s;
      for (const PlannedCell* other : cells) {
        if (other == own || work_.failed_runs.contains(other->trajectory)) continue;
        compared.others.push_back({run_.contender(*other).resolved.name, other->trajectory});
        planned.needs.insert(other->trajectory);
      }
      planned.job.request = std::move(compared);
    }
  }
}

}  // namespace

AccuracyJobs plan_accuracy(const RunShared& run, const Work& work, KeptRuns& kept, TimeLeft& time_left,
                           const RunForOthers& ended) {
  return AccuracyPlanner(run, work, kept, time_left, ended).plan();
}

}  // namespace assay
