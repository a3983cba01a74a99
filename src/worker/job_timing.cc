// Jobs whose figure is a time: whole runs for scaling, and the sessions of the timing pass.
#include <algorithm>
#include <cmath>
#include <limits>
#include <sched.h>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
#include "controls/work.h"
#include "measures/plausible.h"
#include "measures/statistics.h"
#include "worker/job_parts.h"

namespace assay::jobs {

namespace {

// The last core that we may use: the first ones get the machine's interrupts. -1 when that is not known.
int pin_to_core() {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  if (::sched_getaffinity(0, sizeof allowed, &allowed) != 0) return -1;
  for (int core = CPU_SETSIZE - 1; core >= 0; --core) {
    if (!CPU_ISSET(core, &allowed)) continue;
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(core, &one);
    return ::sched_setaffinity(0, sizeof one, &one) == 0 ? core : -1;
  }
  return -1;
}

// Seconds that reading the clock takes: the median of many pairs.
double clock_cost() {
  std::vector<double> pairs(1001);
  for (double& pair : pairs) {
    const Clock::time_point first = Clock::now();
    pair = seconds_since(first);
  }
  return median(pairs);
}

// One contender on one system, at one timestep after the other.
class TimingSession {
 public:
  explicit TimingSession(const TimingJob& job)
      : subject_(subject_of(job.subject)),
        batch_s_(1e-3 * job.batch_ms),
        warmup_(job.warmup),
        duration_s_(job.subject.duration_s) {
    if (job.reference.empty()) {  // the null engine has no run of its own
      starts_ = {subject_.model.initial};
    } else {
      const Trajectory trajectory = load(job.trajectories, job.reference, subject_.model);
      const size_t samples = trajectory.states.size() - 1;
      for (int k = 0; k < job.states; ++k) {
        starts_.push_back(trajectory.states[samples * static_cast<size_t>(k) / static_cast<size_t>(job.states)]);
      }
    }
    core_ = pin_to_core();
    clock_s_ = clock_cost();
  }

  int core() const { return core_; }
  double clock_s() const { return clock_s_; }

  // Finds how many steps make a sample and a batch, and how many batches a round; `steps` fixes the first two, 0
  // leaves them free.
  Prepared prepare(double timestep_ms, long long steps) {
    timestep_ms_ = timestep_ms;
    steps_ = 1;
    batches_ = static_cast<int>(starts_.size());
    const double timestep_s = 1e-3 * timestep_ms;
    const double before = engine_s_;
    Ending ending;
    try {
      check_supported(subject_, timestep_s);
      const double step_s = step_time(timestep_s);
      slice_ = steps > 0 ? steps : static_cast<long long>(std::clamp(std::ceil(kSliceSeconds / step_s), 1.0, 1e9));
      ending = choose_steps(timestep_s, step_s, steps);
      // Enough batches for the round's time; an engine that does nothing must not go on for ever.
      constexpr double kMostBatches = 2000;
      const double round_s = static_cast<double>(starts_.size()) * static_cast<double>(steps_) * step_s;
      const double rounds = std::clamp(std::ceil(batch_s_ / round_s), 1.0, kMostBatches);
      batches_ = static_cast<int>(rounds) * static_cast<int>(starts_.size());
    } catch (const UnsupportedError& error) {
      ending = {Outcome::kUnsupported, error.what()};
    } catch (const EngineError& error) {
      ending = {Outcome::kCrashed, fmt::format("the engine failed to start: {}", error.what())};
    }
    return {ending, engine_s_ - before, {timestep_ms_, std::min(slice_, steps_), steps_, batches_}};
  }

  // One round's samples: every saved state in turn until the time is spent. `how` is what prepare() answered, here or
  // in another process.
  Sampled sample(const RoundPlan& how) {
    timestep_ms_ = how.timestep_ms;
    slice_ = how.sample_steps;
    steps_ = how.batch_steps;
    batches_ = how.batches;
    const double before = engine_s_, cpu_before = cpu_seconds();
    const Clock::time_point start = Clock::now();
    Sampled sampled;
    double timed_s = 0;
    long long clock_reads = 0;
    for (int i = 0; i < batches_; ++i) {
      const Batch done = batch(starts_[static_cast<size_t>(i) % starts_.size()]);
      if (sampled.ending.outcome == Outcome::kOk) sampled.ending = done.ending;
      if (done.ending.outcome == Outcome::kDiverged) {
        sampled.ending = done.ending;
        break;
      }
      sampled.step_us.insert(sampled.step_us.end(), done.step_us.begin(), done.step_us.end());
      timed_s += done.timed_s;
      clock_reads += done.clock_reads;
    }
    sampled.engine_s = engine_s_ - before;
    sampled.cpu_s = cpu_seconds() - cpu_before;
    sampled.wall_s = seconds_since(start);
    sampled.clock_share = timed_s > 0 ? static_cast<double>(clock_reads) * clock_s_ / timed_s : 0;
    return sampled;
  }

 private:
  // Seconds of engine time that one sample of the clock covers: long against the clock's cost, short against the time
  // for which a busy machine takes the core away, so that such moments spoil few samples.
  static constexpr double kSliceSeconds = 5e-4;

  struct Batch {
    std::vector<double> step_us;  // a sample for each slice
    double timed_s = 0;
    long long clock_reads = 0;
    Ending ending;
  };

  // A batch covers its share of the run, so that a round covers the run. Without contacts a step's cost does not
  // depend on where in the run it is, and a batch may go on for longer, as long as the motion stays plausible.
  Ending choose_steps(double timestep_s, double step_s, long long given) {
    const auto states = static_cast<double>(starts_.size());
    const double share = duration_s_ / states;
    std::vector<double> lengths = {share};
    if (subject_.model.contacts.empty()) lengths = {10 * duration_s_, duration_s_, share};
    Ending ending;
    for (const double length : lengths) {
      const double most = std::clamp(std::floor(length / timestep_s - warmup_), 1.0, 1e9);
      steps_ = given > 0 ? given : static_cast<long long>(std::clamp(std::ceil(batch_s_ / states / step_s), 1.0, most));
      ending = {};
      for (const State& start : starts_) {
        if (ending.outcome == Outcome::kOk) ending = batch(start).ending;
      }
      if (ending.outcome == Outcome::kOk) break;
    }
    return ending;
  }

  // Input, warming up and looking at the state lie outside the clock.
  Batch batch(const State& start) {
    const double length = 1e-3 * timestep_ms_ * static_cast<double>(steps_ + warmup_);
    const Plausibility plausibility(subject_.model, start, length,
                                    largest_work(subject_.model, *subject_.control, length));
    Stepper stepper(subject_, start, 1e-3 * timestep_ms_);
    Batch result;
    try {
      stepper.advance(warmup_);
      const double warm_s = stepper.engine_s();
      const long long reads = stepper.clock_reads();
      const long long slices = std::max(1LL, (steps_ + slice_ / 2) / slice_);
      result.step_us.reserve(static_cast<size_t>(slices));
      for (long long slice = 0; slice < slices; ++slice) {
        const long long steps = steps_ * (slice + 1) / slices - steps_ * slice / slices;
        const double slice_before = stepper.engine_s();
        stepper.advance(steps);
        result.step_us.push_back(1e6 * (stepper.engine_s() - slice_before) / static_cast<double>(steps));
      }
      result.timed_s = stepper.engine_s() - warm_s;
      result.clock_reads = stepper.clock_reads() - reads;
      const State& state = stepper.read();
      if (std::string why = plausibility.divergence(state); !why.empty()) {
        result.ending = {Outcome::kDiverged, fmt::format("by {:.4g} s: {}", state.time, why)};
      } else if (why = plausibility.impossibility(state); !why.empty()) {
        result.ending = {Outcome::kUnstable, fmt::format("by {:.4g} s: {}", state.time, why)};
      }
    } catch (const EngineError& error) {
      result.ending = {Outcome::kDiverged, fmt::format("within {:.4g} s: {}", start.time + length, error.what())};
    }
    engine_s_ += stepper.engine_s();
    return result;
  }

  // Seconds of one step in the mean over the saved states; a step in a pile costs many times one in a fall.
  double step_time(double timestep_s) {
    double sum = 0;
    for (const State& start : starts_) sum += step_time_at(start, timestep_s);
    return std::clamp(sum / static_cast<double>(starts_.size()), 1e-12, 1e3);
  }

  // The least of several short batches: a moment in which the machine did something else must not shorten every sample.
  double step_time_at(const State& start, double timestep_s) {
    constexpr double kLongEnough = 3e-4;
    constexpr int kTimes = 3;
    long long steps = 1;
    double least = std::numeric_limits<double>::infinity();
    for (int times = 0; times < kTimes;) {
      Stepper stepper(subject_, start, timestep_s);
      try {
        stepper.advance(1);
        const double first = stepper.engine_s();
        stepper.advance(steps);
        const double spent = stepper.engine_s() - first;
        least = std::min(least, spent / static_cast<double>(steps));
        engine_s_ += stepper.engine_s();
        const bool at_end = timestep_s * static_cast<double>(steps) > duration_s_ || steps >= (1LL << 24);
        if (spent > kLongEnough || at_end) {
          ++times;
        } else {
          steps *= 4;
        }
      } catch (const EngineError&) {
        break;  // the batches will report the reason
      }
    }
    return std::isfinite(least) ? least : 1e-6;
  }

  Subject subject_;
  double batch_s_;
  int warmup_;
  double duration_s_;
  std::vector<State> starts_;
  int core_ = -1;
  double clock_s_ = 0;
  double engine_s_ = 0;
  double timestep_ms_ = 1;
  long long steps_ = 1;  // of a batch
  long long slice_ = 1;  // of a sample
  int batches_ = 1;      // of a round
};

}  // namespace

// The processor time of the whole run, several times when it is short.
JobDone do_job(const ScalingJob& job) {
  const Subject subject = subject_of(job.subject);
  const long long samples = std::llround(1000 * job.subject.duration_s / job.subject.sample_ms);
  const long long per_sample = std::llround(job.subject.sample_ms / job.timestep_ms);
  pin_to_core();
  CellResult cell = {"scaling", {}, {}, {}};
  Ending& ending = cell.ending;
  std::vector<double> seconds;
  Trajectory end;
  double engine_s = 0;
  try {
    check_supported(subject, 1e-3 * job.timestep_ms);
    while (std::ssize(seconds) < job.most_runs && engine_s < job.enough_s) {
      Run run = run_sampled(subject, subject.model.initial, job.timestep_ms, samples, per_sample);
      engine_s += run.engine_s;
      ending = run.ending;
      if (ending.outcome == Outcome::kDiverged) break;
      seconds.push_back(run.engine_s);
      end.states = {std::move(run.trajectory.states.back())};
    }
  } catch (const UnsupportedError& error) {
    ending = {Outcome::kUnsupported, error.what()};
  } catch (const EngineError& error) {
    ending = {Outcome::kCrashed, fmt::format("the engine failed to start: {}", error.what())};
  }
  if (ending.outcome == Outcome::kOk || ending.outcome == Outcome::kUnstable) {
    const Interval time = bootstrap_median(seconds, job.seed);
    const auto steps = static_cast<double>(samples * per_sample);
    cell.values.push_back({"run_time", "s", time.value, time.low, time.high});
    if (time.low > 0) {
      cell.values.push_back({"steps_per_second", "1/s", steps / time.value, steps / time.high, steps / time.low});
    }
    cell.samples = {{"run_time_s", seconds}};
    if (!job.save.empty()) save(job.trajectories, job.save, end);
  }
  return job_done({std::move(cell)}, engine_s);
}

JobDone do_job(const TimingJob& job, const Report& report, const Next& next) {
  TimingSession session(job);
  report(SessionReady{session.core(), session.clock_s()});
  while (const auto command = next()) {
    if (const auto* prepare = std::get_if<PrepareCommand>(&*command)) {
      report(session.prepare(prepare->timestep_ms, prepare->steps));
    } else if (const auto* sample = std::get_if<SampleCommand>(&*command)) {
      report(session.sample(sample->how));
    } else {
      throw SystemError("a timing session was sent a second job");
    }
  }
  return {};
}

}  // namespace assay::jobs
