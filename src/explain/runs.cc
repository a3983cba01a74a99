#include "explain/runs.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/paths.h"
#include "results/store/trajectory.h"
#include "run/coordinator/pool.h"
#include "run/coordinator/temporary_folder.h"

namespace assay {
namespace {

// A delay counts steps of the plan's timestep: at a smaller one it is as many more of those. A policy counts its own.
std::vector<RunChange> at_timestep(const std::vector<RunChange>& changes, double factor) {
  const int delay = delay_of(changes);
  if (factor == 1 || delay == 0) return changes;
  std::vector<RunChange> found;
  std::ranges::copy_if(changes, std::back_inserter(found),
                       [](const RunChange& change) { return change.kind != ChangeKind::kDelay; });
  found.push_back({ChangeKind::kDelay, "", fmt::format("{}", std::llround(delay / factor))});
  return found;
}

class WorkerRunner {
 public:
  explicit WorkerRunner(RunPlan plan) : plan_(std::move(plan)), pool_(program_path(), plan_.jobs, interrupts_) {}

  std::vector<RunSet> run(const std::vector<Side>& sides, int starts) {
    if (sides.empty()) return {};  // an engine without settings has none to try
    // sides are spread over the workers; few of them are cut, so that all workers have some
    const auto workers = static_cast<size_t>(std::max(1, plan_.jobs));
    const size_t wanted = (workers + sides.size() - 1) / sides.size();
    const int parts = std::clamp(static_cast<int>(wanted), 1, starts);
    done_ = 0, of_ = sides.size() * static_cast<size_t>(parts);
    std::vector<RunsJob> jobs(std::min(workers, of_));
    std::vector<std::vector<Part>> of_job(jobs.size());
    size_t next = 0;
    for (size_t i = 0; i < sides.size(); ++i) {
      for (int part = 0; part < parts; ++part, next = (next + 1) % jobs.size()) {
        const int first = starts * part / parts, count = (starts * (part + 1) / parts) - first;
        jobs[next].runs.push_back(run_job(sides[i], first, count));
        of_job[next].push_back({i, first, count});
      }
    }
    std::vector<RunSet> sets(sides.size());
    for (RunSet& set : sets) set.tracks.resize(static_cast<size_t>(starts));
    std::vector<TaskValues> tasks(sides.size());
    for (size_t j = 0; j < jobs.size(); ++j) {
      jobs[j].trajectories = folder_.path();
      jobs[j].limit_s = plan_.limit_s;
      Job job;
      job.title = fmt::format("{} runs", jobs[j].runs.size());
      job.limit_s = 2 * plan_.limit_s;  // it reports each run
      job.on_test = [this](const TestResult&) {
        ++done_;
        if (plan_.progress) plan_.progress(done_, of_);
      };
      job.on_end = [this, &sets, &tasks, runs = jobs[j].runs, own = of_job[j]](const JobEnd& end) {
        for (size_t k = 0; k < own.size(); ++k) {
          const bool answered = end.answer && k < end.answer->cells.size();
          take(answered ? end.answer->cells[k] : CellResult{measure(), end.failure, {}, {}}, runs[k].save, own[k],
               sets[own[k].side], tasks[own[k].side]);
        }
      };
      job.request = std::move(jobs[j]);
      pool_.add(std::move(job));
    }
    pool_.run({});
    if (interrupts_.signal() != 0) throw SystemError("interrupted: nothing was found out");
    for (size_t i = 0; i < sides.size(); ++i) {
      sets[i].fall_rate = tasks[i].mean("fall_rate");
      sets[i].velocity_error = tasks[i].mean("velocity_error");
      sets[i].turning_error = tasks[i].mean("turning_error");
      const bool any = std::ranges::any_of(sets[i].tracks, [](const Track& track) { return track.samples() > 0; });
      if (any) sets[i].early = std::exchange(sets[i].failure, "");
    }
    return sets;
  }

 private:
  // Starts of one side that one process runs.
  struct Part {
    size_t side = 0;
    int first = 0, count = 0;
  };
  // Sums over the starts of one side, of what a policy's runs are measured by.
  struct TaskValues {
    std::map<std::string, std::pair<double, int>> sums;

    std::optional<double> mean(const std::string& name) const {
      const auto found = sums.find(name);
      if (found == sums.end()) return std::nullopt;
      return found->second.first / found->second.second;
    }
  };

  const char* measure() const { return plan_.policy ? "transfer" : "reference"; }

  RunJob run_job(const Side& side, int first, int count) {
    const Recipe recipe = recipe_of(side);
    RunJob run;
    run.subject = {
        .model = plan_.model,
        .control = plan_.control,
        .contender = {side.contender, recipe.contender.base, recipe.overrides},
        .duration_s = plan_.duration_s,
        .sample_ms = plan_.sample_ms,
        .states = plan_.states,
        .changes = change_texts(plan_.policy ? recipe.changes : at_timestep(recipe.changes, recipe.timestep_factor))};
    run.timestep_ms = plan_.timestep_ms * recipe.timestep_factor;
    run.measures = {measure()};
    run.trajectories = folder_.path();
    run.state = first;
    run.states = count;
    run.save = fmt::format("{}", number_++);
    run.partial = true;
    return run;
  }

  void take(const CellResult& cell, const std::string& address, const Part& part, RunSet& set, TaskValues& task) const {
    if (cell.ending.outcome != Outcome::kOk) {
      set.failure = fmt::format("{} ({})", outcome_text(cell.ending.outcome), cell.ending.reason);
    }
    for (const Value& value : cell.values) {
      if (!value.value) continue;
      auto& [sum, runs] = task.sums[value.name];
      sum += *value.value * part.count;
      runs += part.count;
    }
    for (int i = part.first; i < part.first + part.count; ++i) {
      const std::string own = part.count > 1 ? fmt::format("{}-{}", address, i) : address;
      const auto trajectory = read_trajectory(folder_.path(), own);
      if (trajectory) {
        set.tracks[static_cast<size_t>(i)] = track_of(trajectory->states);
        if (plan_.on_run) plan_.on_run(part.side, i, trajectory->states);
      }
      std::error_code ignored;
      std::filesystem::remove(trajectory_path(folder_.path(), own), ignored);
    }
  }

  RunPlan plan_;
  TemporaryFolder folder_;
  Interrupts interrupts_;
  Pool pool_;
  size_t number_ = 0, done_ = 0, of_ = 0;
};

}  // namespace

MakeRuns worker_runner(RunPlan plan) {
  const auto runner = std::make_shared<WorkerRunner>(std::move(plan));
  return [runner](const std::vector<Side>& sides, int starts) { return runner->run(sides, starts); };
}

}  // namespace assay
