// Sessions of the measure 'batch': many worlds of one contender.
#include <algorithm>
#include <cmath>
#include <optional>
#include <sys/resource.h>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
#include "engines/batch.h"
#include "measures/batch.h"
#include "measures/plausible.h"
#include "measures/statistics.h"
#include "run/worker/failures.h"
#include "run/worker/job_parts.h"
#include "run/worker/process_batch.h"
#include "run/worker/stepper.h"

namespace assay::jobs {
namespace {

class BatchSession {
 public:
  explicit BatchSession(const BatchJob& job)
      : subject_(subject_of(job.subject)),
        job_(job),
        timestep_s_(1e-3 * job.timestep_ms),
        steps_of_run_(std::llround(job.subject.duration_s / timestep_s_)),
        batch_engine_(batch_engine(subject_.contender.engine)),
        settings_(subject_.contender.settings) {
    settings_.timestep = timestep_s_;
  }

  BatchPrepared prepare() {
    BatchPrepared prepared;
    try {
      check_supported(subject_, timestep_s_);
      if (!subject_.free_running || !subject_.control->is_zero()) {
        throw UnsupportedError("its adapter computes torques before each step, which a batch does not read states for");
      }
      find_starts();
      batch_ = engines_own([&] { return made(); });
      compare(prepared);
      const BatchFacts facts = batch_->facts();
      prepared.device = facts.device;
      prepared.driver = facts.driver;
      prepared.memory_bytes = facts.memory_bytes;
      prepared.compile_s = facts.compile_s;
      if (const auto* processes = dynamic_cast<const ProcessBatch*>(batch_.get())) {
        prepared.processes = processes->processes();
      }
      if (prepared.ending.outcome == Outcome::kOk) prepared.step_s = step_time();
    } catch (const EngineError& error) {
      prepared.ending = ended_by(error, Outcome::kDiverged);
    }
    prepared.engine_s = engine_s_;
    return prepared;
  }

  BatchSampled sample(const BatchSampleCommand& how) {
    BatchSampled sampled;
    if (!batch_) {  // a worker that took the place of a lost one
      sampled.ending = prepare().ending;
      if (sampled.ending.outcome != Outcome::kOk) return sampled;
    }
    const double before = engine_s_;
    const Clock::time_point start = Clock::now();
    try {
      if (since_restart_ + how.steps + how.single_steps > steps_of_run_) restart();
      sampled.step_us = 1e6 * timed(how.steps) / static_cast<double>(how.steps);
      std::vector<double> singles;
      singles.reserve(static_cast<size_t>(std::max(0, how.single_steps)));
      for (int i = 0; i < how.single_steps; ++i) singles.push_back(timed(1));
      if (!singles.empty()) sampled.latency_us = 1e6 * median(singles);
      for (const int world : compared_worlds(job_.worlds, job_.seed)) {
        read_world(world);
      }
    } catch (const EngineError& error) {
      sampled.ending = {Outcome::kDiverged, error.what()};
    }
    sampled.engine_s = engine_s_ - before;
    sampled.wall_s = seconds_since(start);
    return sampled;
  }

 private:
  void read_world(int world) {
    batch_->read_state(world, state_);
    examine_state(state_, subject_.model, starts_[static_cast<size_t>(world)].time, timestep_s_, since_restart_);
  }

  std::unique_ptr<BatchSimulation> made() const {
    if (batch_engine_ != nullptr) {
      return batch_engine_->create_batch(subject_.model, starts_, settings_, job_.device);
    }
    return std::make_unique<ProcessBatch>(*subject_.contender.engine, subject_.model, starts_, settings_);
  }

  // One world of the contender, as every other measure runs it. Of an engine without batches in a process of its own:
  // this one must not have started it.
  class OneWorld {
   public:
    OneWorld(const BatchSession& session, const State& start)
        : model_(session.subject_.model), start_s_(start.time), timestep_s_(session.timestep_s_) {
      const Engine& engine = *session.subject_.contender.engine;
      if (session.batch_engine_ != nullptr) {
        simulation_ = engine.create(model_, start, session.settings_);
      } else {
        process_ = std::make_unique<ProcessBatch>(engine, model_, std::span(&start, 1), session.settings_);
      }
    }
    void set_torques(std::span<const double> torques) {
      simulation_ ? simulation_->set_torques(torques) : process_->set_torques(torques);
    }
    void advance(long long steps) {
      steps_ += steps;
      if (simulation_) {
        simulation_->advance(static_cast<int>(steps));
        return;
      }
      process_->advance(static_cast<int>(steps));
      process_->synchronize();
    }
    const State& read() {
      simulation_ ? simulation_->read_state(state_) : process_->read_state(0, state_);
      examine_state(state_, model_, start_s_, timestep_s_, steps_);
      return state_;
    }

   private:
    const Model& model_;
    double start_s_, timestep_s_;
    long long steps_ = 0;
    std::unique_ptr<Simulation> simulation_;
    std::unique_ptr<ProcessBatch> process_;
    State state_;
  };

  // The contender's own run of one world, and from it the states in which worlds start.
  void find_starts() {
    const State& initial = subject_.model.initial;
    Plausibility plausibility(subject_.model, initial, job_.subject.duration_s, 0);
    OneWorld world(*this, initial);
    std::vector<State> run = {world.read()};
    for (int moment = 1; moment < kBatchMoments; ++moment) {
      const long long from = steps_of_run_ * (moment - 1) / kBatchMoments, to = steps_of_run_ * moment / kBatchMoments;
      if (to > from) world.advance(to - from);
      run.push_back(world.read());
      if (const std::string why = plausibility.divergence(run.back()); !why.empty()) {
        throw EngineError(fmt::format("by {:.4g} s of the run of one world: {}", run.back().time, why));
      }
    }
    starts_ = batch_states(subject_.model, run, subject_.states, job_.worlds);
  }

  // Worlds of the batch against runs of one world.
  void compare(BatchPrepared& prepared) {
    const size_t joints = subject_.model.joints.size();
    const bool pushed = subject_.capabilities.torques && joints > 0;
    const std::vector<double> torques = batch_torques(subject_.model, job_.worlds, timestep_s_, job_.seed);
    if (pushed) batch_->set_torques(torques);
    timed(1);
    timed(kEquivalenceSteps - 1);
    std::vector<State> found;
    const std::vector<int> worlds = compared_worlds(job_.worlds, job_.seed);
    for (const int world : worlds) {
      read_world(world);
      found.push_back(state_);
    }
    const bool single =
        subject_.capabilities.precision == Precision::kSingle || batch_->facts().precision == Precision::kSingle;
    const double bound = equivalence_bound(single);
    for (size_t i = 0; i < worlds.size(); ++i) {
      const auto world = static_cast<size_t>(worlds[i]);
      OneWorld one(*this, starts_[world]);
      if (pushed) one.set_torques(std::span(torques).subspan(world * joints, joints));
      one.advance(1);
      one.advance(kEquivalenceSteps - 1);
      const double distance = centre_distance(found[i], one.read());
      prepared.equivalence_m = std::max(prepared.equivalence_m, distance);
      if (distance > bound && prepared.ending.outcome == Outcome::kOk) {
        prepared.ending = {
            Outcome::kDiverged,
            fmt::format("world {} of {} is {:.2g} m from its run of one world after {} steps, where rounding "
                        "explains {:g} m",
                        world, job_.worlds, distance, kEquivalenceSteps, bound)};
      }
    }
    prepared.compared = static_cast<int>(worlds.size());
    prepared.bound_m = bound;
  }

  void restart() {
    engines_own([&] { batch_->restart(starts_); });
    since_restart_ = 0;
    if (job_.warmup > 0) timed(job_.warmup);
  }

  // Seconds of these steps of all worlds.
  double timed(long long steps) {
    const Clock::time_point start = Clock::now();
    batch_->advance(static_cast<int>(steps));
    batch_->synchronize();
    const double spent_s = seconds_since(start);
    engine_s_ += spent_s;
    since_restart_ += steps;
    return spent_s;
  }

  // Roughly, s: for the length of a turn.
  double step_time() {
    constexpr double kLongEnough = 0.02;
    restart();
    for (long long steps = 1;; steps *= 4) {
      if (since_restart_ + steps > steps_of_run_) restart();
      const double spent_s = timed(steps);
      if (spent_s > kLongEnough || 4 * steps + job_.warmup > steps_of_run_) {
        return std::max(1e-9, spent_s / static_cast<double>(steps));
      }
    }
  }

  Subject subject_;
  BatchJob job_;
  double timestep_s_;
  long long steps_of_run_;
  const BatchEngine* batch_engine_;
  Settings settings_;
  std::vector<State> starts_;
  std::unique_ptr<BatchSimulation> batch_;
  State state_;
  long long since_restart_ = 0;
  double engine_s_ = 0;
};

}  // namespace

JobDone do_job(const BatchJob& job, const Report& report, const Next& next) {
  BatchSession session(job);
  report(SessionReady{});
  while (const auto command = next()) {
    if (std::holds_alternative<PrepareCommand>(*command)) {
      report(session.prepare());
    } else if (const auto* sample = std::get_if<BatchSampleCommand>(&*command)) {
      report(session.sample(*sample));
    } else {
      throw SystemError("a session of a batch was sent a command of another job");
    }
  }
  return {};
}

}  // namespace assay::jobs
