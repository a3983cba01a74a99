// Every cell that is not a timing: on all cores.
#include <filesystem>

#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/hash.h"
#include "base/json.h"
#include "campaign/shards.h"
#include "results/store/trajectory.h"
#include "run/coordinator/runner.h"

namespace assay {

using nlohmann::json;

namespace {

// Of the reference solution.
std::string truth_address(const CampaignSystem& system) {
  json content = {
      {"truth", 2}, {"model", system.model.hash}, {"duration_s", system.duration_s}, {"sample_ms", system.sample_ms}};
  if (!system.solution.empty()) content["solution"] = system.solution;
  return content_hash(dump_json(content));
}

}  // namespace

// Whether the trajectory is in the results directory or could be fetched from another campaign. A file that is damaged
// or holds another run is removed: it is made again like one that is missing.
bool Runner::has_run(const std::string& address) {
  const auto known = run_is_there_.find(address);
  if (known != run_is_there_.end()) return known->second;
  const std::string dir = store_.trajectories_dir();
  if (const std::string fault = trajectory_fault(dir, address); !fault.empty()) {
    damaged_runs_.push_back(fmt::format("'{}' {}", trajectory_path(dir, address), fault));
    std::error_code error;
    std::filesystem::remove(trajectory_path(dir, address), error);
  }
  return run_is_there_[address] = has_trajectory(dir, address) || references_.fetch(address, dir);
}

// What others read has to be where they look. What lies only here is made again: see where runs are kept.
bool Runner::others_have(const std::string& address) {
  const std::string dir = store_.trajectories_dir();
  if (references_.fetch(address, dir)) return true;
  std::error_code error;
  std::filesystem::remove(trajectory_path(dir, address), error);
  return false;
}

// All of them at once.
void Runner::say_damaged_runs() {
  if (damaged_runs_.empty()) return;
  progress_.message(fmt::format("{} stored {} not used and made again: {}", damaged_runs_.size(),
                                damaged_runs_.size() == 1 ? "run is" : "runs are", join(damaged_runs_, "; ")));
}

RunJob Runner::run_job(const PlannedCell& cell, double timestep_ms) const {
  RunJob job;
  job.subject = subject_spec(system(cell), contender(cell));
  job.timestep_ms = timestep_ms;
  job.trajectories = store_.trajectories_dir();
  job.seed = seed();
  job.grasp = system(cell).grasp;
  return job;
}

// Runs that others need or that are cells of their own.
void Runner::plan_references(std::map<std::string, Waiting>& producers) {
  // Cells of equal contenders under several names share one run.
  std::map<std::string, std::vector<const PlannedCell*>> cells;
  struct From {
    const PlannedCell* cell = nullptr;
    int state = 0;                             // number of the initial state
    const CampaignContender* owner = nullptr;  // whose run it is
  };
  std::map<std::string, From> any;
  std::map<std::string, double> for_others;  // seconds by address
  for (const PlannedRun* run : runs_) {
    if (run->contender < 0) continue;
    const CampaignContender& of = campaign_.contenders[static_cast<size_t>(run->contender)];
    if (failed_gate_.contains(of.resolved.name)) {
      made_for_others(run_seconds(plan_, *run, step_us_), false);
      continue;
    }
    any[run->address] = {&plan_.cells[run->cell], run->state, &of};
    for_others[run->address] = run_seconds(plan_, *run, step_us_);
  }
  // Whose run it is: timings may start from another contender's states.
  const auto owner = [&](const PlannedCell& cell) -> const CampaignContender& {
    const int of = cell.reads == Reads::kSteps ? system(cell).states_of : -1;
    return of < 0 ? contender(cell) : campaign_.contenders[static_cast<size_t>(of)];
  };
  for (const PlannedCell* cell : todo_) {
    const int trained_in = system(*cell).trained_in;
    if (!cell->against.empty() && !failed_gate_.contains(contender(*cell).resolved.name)) {
      const CampaignContender& of = campaign_.contenders[static_cast<size_t>(trained_in)];
      if (failed_gate_.contains(of.resolved.name)) continue;
      for (size_t i = 0; i < cell->against.size(); ++i) any[cell->against[i]] = {cell, static_cast<int>(i), &of};
    }
  }
  std::map<std::pair<int, int>, const PlannedCell*> reference_of;  // by system and contender
  for (const PlannedCell* cell : todo_) {
    if (cell->reads == Reads::kFineRun) reference_of[{cell->system, cell->contender}] = cell;
  }
  std::map<std::string, std::set<const PlannedCell*>> part_of;
  for (const PlannedCell* cell : todo_) {
    if (cell->trajectory.empty() || failed_gate_.contains(owner(*cell).resolved.name)) continue;
    any[cell->trajectory] = {cell, 0, &owner(*cell)};
    if (cell->reads == Reads::kFineRun) cells[cell->trajectory].push_back(cell);
    const auto reference = reference_of.find({cell->system, cell->contender});
    for (size_t i = 0; i < cell->other_states.size(); ++i) {
      any[cell->other_states[i]] = {cell, static_cast<int>(i) + 1, &owner(*cell)};
      if (reference != reference_of.end()) part_of[cell->other_states[i]].insert(reference->second);
    }
  }
  for (const auto& [address, from] : any) {
    const auto& [cell, state, whose] = from;
    if (failed_trajectory_.contains(address)) continue;
    const auto other = for_others.find(address);
    const bool there = other != for_others.end() ? others_have(address) : has_run(address);
    if (there && !cells.contains(address)) {
      if (other != for_others.end()) made_for_others(other->second, true);
      for (const PlannedCell* reference : part_of[address]) accuracy_.all_s -= run_cost(*reference);
      continue;
    }
    Waiting waiting;
    waiting.cells = cells[address];
    waiting.part_of.assign(part_of[address].begin(), part_of[address].end());
    if (other != for_others.end()) waiting.run_s = other->second;
    waiting.is_made = !there;
    Job& job = waiting.job;
    RunJob run = run_job(*cell, system(*cell).reference_of(*whose));
    run.subject = subject_spec(system(*cell), *whose);
    run.subject.sample_ms = system(*cell).grid_ms();
    run.measures = {kFineRunCell};
    run.state = state;
    if (there) {
      run.use = {address};
    } else {
      run.save = address;
    }
    job.request = std::move(run);
    job.title = fmt::format("reference {} {}{}", system(*cell).name, whose->resolved.name,
                            state == 0 ? "" : fmt::format(", initial state {}", state + 1));
    job.limit_s = campaign_.time_limit_s;
    // Others wait for these, so they come first, the dearest before the others.
    job.cost = 1e6 + (waiting.cells.empty() ? 0 : cost(*waiting.cells.front())) - state;
    producers[address] = std::move(waiting);
  }
}

void Runner::plan_truths(std::map<std::string, Waiting>& producers) {
  const auto add = [&](const CampaignSystem& of, double run_s) {
    const std::string address = truth_address(of);
    if (producers.contains(address)) return;
    const bool there = run_s > 0 ? others_have(address) : has_run(address);
    if (there) {
      if (run_s > 0) made_for_others(run_s, true);
      return;
    }
    Waiting waiting;
    waiting.run_s = run_s;
    waiting.job.request =
        TruthJob{model_spec(of), of.solution, of.duration_s, of.sample_ms, store_.trajectories_dir(), address};
    waiting.job.title = fmt::format("truth {}", of.name);
    waiting.job.limit_s = std::min(options_.truth_limit_s, campaign_.time_limit_s);
    waiting.job.cost = 1e7;
    producers[address] = std::move(waiting);
  };
  for (const PlannedCell* cell : todo_) {
    if (cell->reads == Reads::kSolution) add(system(*cell), 0);
  }
  for (const PlannedRun* run : runs_) {
    if (run->contender < 0) add(system(plan_.cells[run->cell]), run_seconds(plan_, *run, step_us_));
  }
}

// A run of this part's that other parts find in the shared folder, or will have to make themselves.
void Runner::made_for_others(double seconds, bool made) {
  accuracy_.done_s += seconds;
  ++(made ? runs_made_ : runs_failed_);
  describe_node(/*finished=*/false, 0, 0);
}

std::vector<Runner::Waiting> Runner::plan_measures() {
  std::vector<Waiting> jobs;
  // All measures but those of pieces read the same run.
  std::map<std::tuple<int, int, double>, size_t> runs;
  for (const PlannedCell* cell : todo_) {
    if (cell->reads != Reads::kPieces && !shares_runs(cell->reads)) continue;
    if (failed_gate_.contains(contender(*cell).resolved.name)) continue;
    const bool is_run = cell->reads != Reads::kPieces;
    const auto at = std::tuple(cell->system, cell->contender, cell->timestep_ms);
    const auto found = runs.find(at);
    const bool shared = is_run && found != runs.end();
    Waiting& waiting = shared ? jobs[found->second] : jobs.emplace_back();
    Job& job = waiting.job;
    waiting.cells.push_back(cell);
    if (!cell->trajectory.empty()) waiting.needs.insert(cell->trajectory);
    waiting.needs.insert(cell->other_states.begin(), cell->other_states.end());
    std::vector<std::string> addresses;
    if (!cell->trajectory.empty()) addresses = {cell->trajectory};
    addresses.insert(addresses.end(), cell->other_states.begin(), cell->other_states.end());
    const int states = system(*cell).initial_states.count;
    if (!shared) {
      job.title = title(*cell);
      // the limit is that of one motion
      job.limit_s = campaign_.time_limit_s * states;
      job.cost = cost(*cell);
    }
    if (!is_run) {
      const CampaignSystem& of = system(*cell);
      std::vector<double> lengths = {of.piece_ms};
      lengths.insert(lengths.end(), of.more_pieces_ms.begin(), of.more_pieces_ms.end());
      job.request = PiecesJob{cell->measure,        subject_spec(of, contender(*cell)),
                              cell->timestep_ms,    store_.trajectories_dir(),
                              std::move(addresses), of.pieces,
                              std::move(lengths),   of.reference_of(contender(*cell)),
                              of.grid_ms(),         seed()};
      continue;
    }
    if (!shared) {
      runs[at] = jobs.size() - 1;
      job.request = run_job(*cell, cell->timestep_ms);
    }
    auto& run = std::get<RunJob>(job.request);
    run.measures.push_back(cell->measure);
    if (addresses.size() > run.use.size()) run.use = std::move(addresses);
    if (takes_all_states(cell->reads)) run.states = states;
    if (!cell->keep.empty()) {
      run.keep = cell->keep;
      run.keep_state = system(*cell).shown_state();
    }
    if (!cell->against.empty() && system(*cell).trained_in >= 0 &&
        !failed_gate_.contains(campaign_.contenders[static_cast<size_t>(system(*cell).trained_in)].resolved.name)) {
      run.against = cell->against;
      waiting.needs.insert(cell->against.begin(), cell->against.end());
    }
    if (cell->reads == Reads::kSolution) {
      run.truth = truth_address(system(*cell));
      waiting.needs.insert(run.truth);
    }
  }
  plan_agreement(jobs);
  return jobs;
}

// Compares each contender's reference run with those of all others that have one.
void Runner::plan_agreement(std::vector<Waiting>& jobs) {
  std::map<std::pair<int, std::string>, std::vector<const PlannedCell*>> systems;  // by system and measure
  for (const PlannedCell* cell : todo_) {
    if (cell->reads == Reads::kFineRuns && !failed_gate_.contains(contender(*cell).resolved.name)) {
      systems[{cell->system, cell->measure}].push_back(cell);
    }
  }
  for (const auto& [index, cells] : systems) {
    for (const PlannedCell* own : cells) {
      Waiting& waiting = jobs.emplace_back();
      waiting.cells = {own};
      waiting.needs = {own->trajectory};
      Job& job = waiting.job;
      AgreementJob compared = {own->measure, store_.trajectories_dir(), own->trajectory, {}};
      job.title = title(*own);
      job.limit_s = campaign_.time_limit_s;
      for (const PlannedCell* other : cells) {
        if (other == own || failed_trajectory_.contains(other->trajectory)) continue;
        compared.others.push_back({contender(*other).resolved.name, other->trajectory});
        waiting.needs.insert(other->trajectory);
      }
      job.request = std::move(compared);
    }
  }
}

// Runs whose reference solution there is not are measured without it.
void Runner::leave_truth_out(std::vector<Waiting>& waiting, const std::string& address) {
  std::erase_if(waiting, [&](Waiting& one) {
    auto* run = std::get_if<RunJob>(&one.job.request);
    if (run == nullptr || run->truth != address) return false;
    run->truth.clear();
    std::erase_if(run->measures, [](const std::string& measure) { return reads(measure, Reads::kSolution); });
    std::erase_if(one.cells, [](const PlannedCell* cell) { return cell->reads == Reads::kSolution; });
    return one.cells.empty();
  });
}

void Runner::accuracy() {
  progress_.phase(runs_.empty() ? "accuracy" : "runs that other parts read");
  for (const PlannedCell* cell : todo_) {
    const auto failed = failed_gate_.find(contender(*cell).resolved.name);
    if (failed != failed_gate_.end()) put_failed(*cell, failed->second);
  }
  std::map<std::string, Waiting> producers;
  plan_references(producers);
  plan_truths(producers);
  std::vector<Waiting> waiting = plan_measures();
  say_damaged_runs();

  Pool pool(program_, jobs_, interrupts_);
  const auto start = [&](Waiting& ready) {
    ready.job.on_end = [this, cells = ready.cells](const JobEnd& end) { put_answer(cells, end); };
    pool.add(std::move(ready.job));
  };
  // What waits for a trajectory goes on or fails with it.
  const auto release = [&](const std::string& address, const std::optional<Ending>& failure) {
    for (size_t i = 0; i < waiting.size();) {
      Waiting& one = waiting[i];
      const bool needed = one.needs.erase(address) > 0;
      // An agreement does without others' runs, but not without its own.
      auto* agreement = std::get_if<AgreementJob>(&one.job.request);
      bool fails = failure && needed && (agreement == nullptr || agreement->own == address);
      if (needed && failure && !fails)
        std::erase_if(agreement->others, [&](const auto& other) { return other.address == address; });
      // A policy's run does without one to compare it with.
      if (auto* run = std::get_if<RunJob>(&one.job.request);
          fails && run != nullptr && std::ranges::count(run->against, address) > 0) {
        std::ranges::replace(run->against, address, std::string());
        fails = std::ranges::count(run->use, address) > 0;
      }
      if (!needed || (!fails && !one.needs.empty())) {
        ++i;
        continue;
      }
      if (fails) {
        for (const PlannedCell* cell : one.cells) put_failed(*cell, *failure);
      } else {
        start(one);
      }
      waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(i));
    }
  };
  // Somebody else ended the workers that were to make it: what needs it is left for the next start.
  const auto leave = [&](const std::string& address) {
    lost_trajectory_.insert(address);
    std::erase_if(waiting, [&](const Waiting& one) { return one.needs.contains(address); });
  };
  for (auto& [address, producer] : producers) {
    const bool is_run = std::holds_alternative<RunJob>(producer.job.request);
    producer.job.on_end = [this, &release, &leave, &waiting, is_run, address = address, cells = producer.cells,
                           part_of = producer.part_of, run_s = producer.run_s, is_made = producer.is_made,
                           title = producer.job.title](const JobEnd& end) {
      if (end.outside) {
        leave(address);
        return;
      }
      put_answer(cells, end);
      for (const PlannedCell* reference : part_of) accuracy_.done_s += run_cost(*reference);
      if (cells.empty() && run_s == 0) progress_.made(title, remaining_s());
      // A reference solution is no cell: it has a result only when there is none.
      const bool solved = !is_run && end.answer && end.answer->cells.empty();
      Ending failure = solved ? Ending() : end.result(is_run ? kFineRunCell : kTruthJobCell).ending;
      const bool made = failure.outcome == Outcome::kOk || failure.outcome == Outcome::kUnstable;
      if (run_s > 0) {
        made_for_others(run_s, made);
        progress_.made(fmt::format("{}, {}/{} runs", title, runs_made_ + runs_failed_, runs_.size()), remaining_s());
      }
      if (made) {
        // what lay in the results may be a stranger's, who can give any states a right checksum
        if (is_made) references_.keep(address, store_.trajectories_dir());
        release(address, std::nullopt);
      } else if (!is_run && options_.truth_optional) {
        for (const Waiting& one : waiting) {
          if (!one.needs.contains(address)) continue;
          without_truth_.push_back({system(*one.cells.front()).name, failure.reason});
          break;
        }
        leave_truth_out(waiting, address);
        release(address, std::nullopt);
      } else {
        failure.reason = fmt::format("its reference run: {}", failure.reason);
        failed_trajectory_[address] = failure;
        release(address, failure);
      }
    };
    pool.add(std::move(producer.job));
  }
  // Trajectories that are there, or that are known to fail.
  std::set<std::string> settled;
  for (const Waiting& one : waiting) {
    for (const std::string& address : one.needs) {
      if (!producers.contains(address)) settled.insert(address);
    }
  }
  for (const std::string& address : settled) {
    const auto failed = failed_trajectory_.find(address);
    release(address, failed == failed_trajectory_.end() ? std::nullopt : std::optional(failed->second));
  }
  // Jobs that need no trajectory.
  for (size_t i = 0; i < waiting.size();) {
    if (!waiting[i].needs.empty()) {
      ++i;
      continue;
    }
    start(waiting[i]);
    waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(i));
  }
  pool.run([&](const std::string& job) { progress_.started(job, remaining_s()); });
}

}  // namespace assay
