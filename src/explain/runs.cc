#include "explain/runs.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/paths.h"
#include "coordinator/pool.h"
#include "coordinator/temporary_folder.h"
#include "store/trajectory.h"

namespace assay {
namespace {

// A delay counts steps of the plan's timestep: at a smaller one it is as many more of those. A policy counts its own.
std::vector<Change> at_timestep(const std::vector<Change>& changes, double factor) {
  const int delay = delay_of(changes);
  if (factor == 1 || delay == 0) return changes;
  std::vector<Change> found;
  std::ranges::copy_if(changes, std::back_inserter(found),
                       [](const Change& change) { return change.kind != ChangeKind::kDelay; });
  found.push_back({ChangeKind::kDelay, "", fmt::format("{}", std::llround(delay / factor))});
  return found;
}

class WorkerRunner {
 public:
  explicit WorkerRunner(RunPlan plan) : plan_(std::move(plan)), pool_(program_path(), plan_.jobs, interrupts_) {}

  std::vector<RunSet> run(const std::vector<Side>& sides, int starts) {
    // few sides are cut into several jobs, so that all workers have one
    const int wanted = (plan_.jobs + static_cast<int>(sides.size()) - 1) / static_cast<int>(sides.size());
    const int parts = std::clamp(wanted, 1, starts);
    std::vector<RunSet> sets(sides.size());
    done_ = 0, of_ = sides.size() * static_cast<size_t>(parts);
    std::vector<int> falls_of(sides.size(), 0);
    std::vector<double> falls(sides.size(), 0.0);
    for (size_t i = 0; i < sides.size(); ++i) {
      sets[i].tracks.resize(static_cast<size_t>(starts));
      for (int part = 0; part < parts; ++part) {
        const int first = starts * part / parts, count = (starts * (part + 1) / parts) - first;
        add(sides[i], first, count, [this, &set = sets[i], &runs = falls_of[i], &fell = falls[i], first,
                                     count](const JobEnd& end, const std::string& address) {
          take(end, address, first, count, set);
          const auto [measure, ending, values, samples] = end.result(plan_.policy ? "transfer" : "reference");
          for (const Value& value : values) {
            if (value.name != "fall_rate" || !value.value) continue;
            fell += *value.value * count;
            runs += count;
          }
          ++done_;
          if (plan_.progress) plan_.progress(done_, of_);
        });
      }
    }
    pool_.run({});
    if (interrupts_.signal() != 0) throw SystemError("interrupted: nothing was found out");
    for (size_t i = 0; i < sides.size(); ++i) {
      if (falls_of[i] > 0) sets[i].fall_rate = falls[i] / falls_of[i];
      const bool any = std::ranges::any_of(sets[i].tracks, [](const Track& track) { return track.samples() > 0; });
      if (any) sets[i].failure.clear();
    }
    return sets;
  }

 private:
  void add(const Side& side, int first, int count,
           const std::function<void(const JobEnd&, const std::string&)>& on_end) {
    const Recipe recipe = recipe_of(side);
    RunJob run;
    run.subject = {.model = plan_.model,
                   .control = plan_.control,
                   .contender = {side.name, recipe.contender.base, recipe.overrides},
                   .duration_s = plan_.duration_s,
                   .sample_ms = plan_.sample_ms,
                   .states = plan_.states,
                   .changes = change_texts(plan_.policy ? recipe.changes
                                                        : at_timestep(recipe.changes, recipe.timestep_factor))};
    run.timestep_ms = plan_.timestep_ms * recipe.timestep_factor;
    run.measures = {plan_.policy ? "transfer" : "reference"};
    run.trajectories = folder_.path();
    run.state = first;
    run.states = count;
    run.save = fmt::format("{}", number_++);
    run.partial = true;
    Job job;
    job.title = fmt::format("{} {}", side.name, side.contender);
    job.limit_s = plan_.limit_s;
    job.cost = count;
    job.on_end = [on_end, address = run.save](const JobEnd& end) { on_end(end, address); };
    job.request = std::move(run);
    pool_.add(std::move(job));
  }

  void take(const JobEnd& end, const std::string& address, int first, int count, RunSet& set) const {
    const Ending ending = end.result(plan_.policy ? "transfer" : "reference").ending;
    if (ending.outcome != Outcome::kOk) {
      set.failure = fmt::format("{} ({})", outcome_text(ending.outcome), ending.reason);
    }
    for (int i = 0; i < count; ++i) {
      const std::string own = count > 1 ? fmt::format("{}-{}", address, first + i) : address;
      const auto trajectory = read_trajectory(folder_.path(), own);
      if (trajectory) set.tracks[static_cast<size_t>(first + i)] = track_of(trajectory->states);
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

Runner worker_runner(RunPlan plan) {
  const auto runner = std::make_shared<WorkerRunner>(std::move(plan));
  return [runner](const std::vector<Side>& sides, int starts) { return runner->run(sides, starts); };
}

}  // namespace assay
