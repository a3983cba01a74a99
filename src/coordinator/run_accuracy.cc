// Every cell that is not a timing: on all cores.
#include <filesystem>

#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/hash.h"
#include "coordinator/runner.h"
#include "store/trajectory.h"

namespace assay {

using nlohmann::json;

namespace {

// Of the reference solution.
std::string truth_address(const CampaignSystem& system) {
  return content_hash(json{{"truth", 1}, {"model", system.model.hash}, {"duration_s", system.duration_s}}.dump());
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
  std::map<std::string, const PlannedCell*> any;
  for (const PlannedCell* cell : todo_) {
    if (cell->trajectory.empty() || failed_gate_.contains(contender(*cell).resolved.name)) continue;
    any[cell->trajectory] = cell;
    if (cell->measure == "reference") cells[cell->trajectory].push_back(cell);
  }
  for (const auto& [address, cell] : any) {
    if (failed_trajectory_.contains(address)) continue;
    const bool there = has_run(address);
    if (there && !cells.contains(address)) continue;
    Waiting waiting;
    waiting.cells = cells[address];
    Job& job = waiting.job;
    RunJob run = run_job(*cell, system(*cell).reference_ms);
    run.measures = {"reference"};
    (there ? run.use : run.save) = address;
    job.request = std::move(run);
    job.title = fmt::format("reference {} {}", system(*cell).name, contender(*cell).resolved.name);
    job.limit_s = campaign_.time_limit_s;
    // Others wait for these, so they come first, the dearest before the others.
    job.cost = 1e6 + (waiting.cells.empty() ? 0 : cost(*waiting.cells.front()));
    producers[address] = std::move(waiting);
  }
}

void Runner::plan_truths(std::map<std::string, Waiting>& producers) {
  for (const PlannedCell* cell : todo_) {
    if (cell->measure != "truth") continue;
    const std::string address = truth_address(system(*cell));
    if (producers.contains(address) || has_run(address)) continue;
    Waiting waiting;
    waiting.job.request =
        TruthJob{model_spec(system(*cell)), system(*cell).duration_s, store_.trajectories_dir(), address};
    waiting.job.title = fmt::format("truth {}", system(*cell).name);
    waiting.job.limit_s = std::min(options_.truth_limit_s, campaign_.time_limit_s);
    waiting.job.cost = 1e7;
    producers[address] = std::move(waiting);
  }
}

std::vector<Runner::Waiting> Runner::plan_measures() {
  std::vector<Waiting> jobs;
  // All measures but consistency read the same run.
  std::map<std::tuple<int, int, double>, size_t> runs;
  for (const PlannedCell* cell : todo_) {
    if (cell->measure == "reference" || cell->measure == "agreement" || is_timed(*cell)) continue;
    if (failed_gate_.contains(contender(*cell).resolved.name)) continue;
    const bool is_run = cell->measure != "consistency";
    const auto at = std::tuple(cell->system, cell->contender, cell->timestep_ms);
    const auto found = runs.find(at);
    const bool shared = is_run && found != runs.end();
    Waiting& waiting = shared ? jobs[found->second] : jobs.emplace_back();
    Job& job = waiting.job;
    waiting.cells.push_back(cell);
    if (!cell->trajectory.empty()) waiting.needs.insert(cell->trajectory);
    if (!shared) {
      job.title = title(*cell);
      job.limit_s = campaign_.time_limit_s;
      job.cost = cost(*cell);
    }
    if (!is_run) {
      const CampaignSystem& of = system(*cell);
      job.request = PiecesJob{subject_spec(of, contender(*cell)),
                              cell->timestep_ms,
                              store_.trajectories_dir(),
                              cell->trajectory,
                              of.pieces,
                              of.piece_ms,
                              of.reference_ms,
                              seed()};
      continue;
    }
    if (!shared) {
      runs[at] = jobs.size() - 1;
      RunJob run = run_job(*cell, cell->timestep_ms);
      run.use = cell->trajectory;
      job.request = std::move(run);
    }
    auto& run = std::get<RunJob>(job.request);
    run.measures.push_back(cell->measure);
    if (cell->measure == "truth") {
      run.truth = truth_address(system(*cell));
      waiting.needs.insert(run.truth);
    }
  }
  plan_agreement(jobs);
  return jobs;
}

// Compares each contender's reference run with those of all others that have one.
void Runner::plan_agreement(std::vector<Waiting>& jobs) {
  std::map<int, std::vector<const PlannedCell*>> systems;
  for (const PlannedCell* cell : todo_) {
    if (cell->measure == "agreement" && !failed_gate_.contains(contender(*cell).resolved.name)) {
      systems[cell->system].push_back(cell);
    }
  }
  for (const auto& [index, cells] : systems) {
    for (const PlannedCell* own : cells) {
      Waiting& waiting = jobs.emplace_back();
      waiting.cells = {own};
      waiting.needs = {own->trajectory};
      Job& job = waiting.job;
      AgreementJob compared = {store_.trajectories_dir(), own->trajectory, {}};
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
    std::erase(run->measures, "truth");
    std::erase_if(one.cells, [](const PlannedCell* cell) { return cell->measure == "truth"; });
    return one.cells.empty();
  });
}

void Runner::accuracy() {
  progress_.phase("accuracy");
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
      const bool fails = failure && needed && (agreement == nullptr || agreement->own == address);
      if (needed && failure && !fails)
        std::erase_if(agreement->others, [&](const auto& other) { return other.address == address; });
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
    producer.job.on_end = [this, &release, &leave, &waiting, is_run, address = address,
                           cells = producer.cells](const JobEnd& end) {
      if (end.outside) {
        leave(address);
        return;
      }
      put_answer(cells, end);
      // A reference solution is no cell and has no result.
      Ending failure = end.answer && !is_run ? Ending() : end.result("reference").ending;
      if (failure.outcome == Outcome::kOk || failure.outcome == Outcome::kUnstable) {
        references_.keep(address, store_.trajectories_dir());
        release(address, std::nullopt);
      } else if (!is_run && options_.truth_optional) {
        for (const Waiting& one : waiting) {
          if (!one.needs.contains(address)) continue;
          without_truth_.push_back(fmt::format("{}: {}", system(*one.cells.front()).name, failure.reason));
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
  pool.run([&](const std::string& job) { progress_.started(job); });
}

}  // namespace assay
