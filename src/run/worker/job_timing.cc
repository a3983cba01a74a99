// Jobs whose figure is a time: whole runs for scaling, and the sessions of the timing pass.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <sched.h>
#include <stdexcept>
#include <sys/resource.h>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
#include "controls/work.h"
#include "measures/plausible.h"
#include "measures/statistics.h"
#include "measures/windows.h"
#include "run/worker/failures.h"
#include "run/worker/job_parts.h"

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

long long involuntary_switches() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_nivcsw;
}

// One contender on one system, at one timestep after the other.
class TimingSession {
 public:
  explicit TimingSession(const TimingJob& job)
      : subject_(subject_of(job.subject)),
        warmup_(job.warmup),
        duration_s_(job.subject.duration_s),
        sample_ms_(job.subject.sample_ms),
        trajectories_(job.trajectories) {
    if (job.reference.empty()) {  // the null engine has no run of its own
      states_ = {subject_.model.initial};
    } else {
      states_ = load(job.trajectories, job.reference, subject_.model).states;
      if (states_.size() > 1) states_.pop_back();  // nothing starts at the run's end
    }
    core_ = pin_to_core();
    clock_s_ = clock_cost();
  }

  int core() const { return core_; }
  double clock_s() const { return clock_s_; }

  Prepared prepare(double timestep_ms) {
    const double timestep_s = 1e-3 * timestep_ms, before = engine_s_;
    Prepared prepared;
    try {
      check_supported(subject_, timestep_s);
      prepared.step_s = step_time(timestep_s);
    } catch (const EngineError& error) {
      prepared.ending = failed_to_start(error);
    }
    prepared.engine_s = engine_s_ - before;
    return prepared;
  }

  // One turn: the windows of the run, several times where one pass is short.
  Sampled sample(const TurnPlan& how) {
    const std::vector<TimingWindow> windows = windows_of(how);
    const double engine_before = engine_s_;
    Sampled sampled;
    sampled.ending = go_to(how, windows);
    if (sampled.ending.outcome == Outcome::kDiverged) return sampled;
    const double cpu_before = cpu_seconds();
    const long long switches_before = involuntary_switches();
    const Clock::time_point start = Clock::now();
    std::vector<std::vector<double>> times(windows.size());  // of each window, s a step, one a pass
    double timed_s = 0, input_s = 0;
    long long reads = 0, steps = 0;
    for (int pass = 0; pass < how.passes && sampled.ending.outcome != Outcome::kDiverged; ++pass) {
      const Ending ending = run_through(how, windows, [&](size_t window, Stepper& stepper) {
        const double engine_s = stepper.engine_s(), outside_s = stepper.input_s();
        const long long clock_reads = stepper.clock_reads();
        stepper.advance(windows[window].steps);
        const double spent_s = stepper.engine_s() - engine_s;
        times[window].push_back(spent_s / static_cast<double>(windows[window].steps));
        timed_s += spent_s;
        input_s += stepper.input_s() - outside_s;
        reads += stepper.clock_reads() - clock_reads;
        steps += windows[window].steps;
      });
      if (sampled.ending.outcome == Outcome::kOk || ending.outcome == Outcome::kDiverged) sampled.ending = ending;
    }
    if (sampled.ending.outcome != Outcome::kDiverged) {
      for (const std::vector<double>& of : times) sampled.step_us.push_back(1e6 * median(of));
    }
    sampled.engine_s = engine_s_ - engine_before;
    sampled.cpu_s = cpu_seconds() - cpu_before;
    sampled.wall_s = seconds_since(start);
    sampled.switches = involuntary_switches() - switches_before;
    sampled.clock_share = timed_s > 0 ? static_cast<double>(reads) * clock_s_ / timed_s : 0;
    sampled.input_us = steps > 0 ? 1e6 * input_s / static_cast<double>(steps) : 0;
    return sampled;
  }

  // Every step of the windows by itself. The same step does the same work in each pass, so the least of its times is
  // the one that the machine disturbed least.
  SingleSteps single_steps(const TurnPlan& how) {
    constexpr int kPasses = 3;
    const double before = engine_s_;
    SingleSteps found;
    std::vector<double> least;
    found.ending = go_to(how, windows_of(how));
    for (int pass = 0; pass < kPasses && found.ending.outcome != Outcome::kDiverged; ++pass) {
      size_t at = 0;
      const std::vector<TimingWindow> windows = windows_of(how);
      const Ending ending = run_through(how, windows, [&](size_t window, Stepper& stepper) {
        for (long long step = 0; step < windows[window].steps; ++step, ++at) {
          const double engine_s = stepper.engine_s();
          stepper.advance(1);
          const double spent_s = stepper.engine_s() - engine_s;
          if (at == least.size()) least.push_back(spent_s);
          least[at] = std::min(least[at], spent_s);
        }
      });
      if (found.ending.outcome == Outcome::kOk || ending.outcome == Outcome::kDiverged) found.ending = ending;
    }
    if (found.ending.outcome != Outcome::kDiverged && !least.empty()) {
      found.p50_us = 1e6 * median(least);
      found.p99_us = 1e6 * quantile(least, 0.99);
      found.worst_us = 1e6 * *std::ranges::max_element(least);
    }
    found.engine_s = engine_s_ - before;
    return found;
  }

 private:
  // Makes `starts_` the states that windows of `how` start from. How many contacts there are, and how deep, depends on
  // the timestep, and the cost of a step on both: so they are those of the run that is timed, not of a finer one.
  Ending go_to(const TurnPlan& how, const std::vector<TimingWindow>& windows) {
    const bool too_coarse = how.timestep_ms > sample_ms_;
    if (how.run.empty() || too_coarse ||
        std::ranges::none_of(windows, [](const TimingWindow& each) { return each.state > 0; })) {
      starts_ = &states_;
      return {};
    }
    starts_ = &own_;
    if (own_of_ == how.run) return {};
    if (has_trajectory(trajectories_, how.run)) {
      own_ = load(trajectories_, how.run, subject_.model).states;
    } else {
      Trajectory run;
      if (Ending ending = run_to_end(1e-3 * how.timestep_ms, run); ending.outcome == Outcome::kDiverged) return ending;
      save(trajectories_, how.run, run);
      own_ = std::move(run.states);
    }
    own_of_ = how.run;
    return {};
  }

  // The run with states as far apart as those of the reference, as nearly as the timestep allows.
  Ending run_to_end(double timestep_s, Trajectory& run) {
    const auto states = std::max(1LL, std::llround(1e3 * duration_s_ / sample_ms_));  // without the last one
    const State& start = subject_.model.initial;
    run.states = {start};
    try {
      const Plausibility plausibility(subject_.model, start, duration_s_,
                                      largest_work(subject_.model, *subject_.control, duration_s_),
                                      arithmetic_of(subject_.capabilities, timestep_s));
      Stepper stepper(subject_, start, timestep_s);
      long long taken = 0;
      for (long long k = 1; k < states; ++k) {
        const long long until = std::llround(1e-3 * static_cast<double>(k) * sample_ms_ / timestep_s);
        if (until > taken) stepper.advance(until - taken);
        taken = until;
        const State& state = stepper.read();
        if (const std::string why = plausibility.divergence(state); !why.empty()) {
          return {Outcome::kDiverged, fmt::format("by {:.4g} s: {}", state.time, why)};
        }
        run.states.push_back(state);
      }
      engine_s_ += stepper.engine_s();
    } catch (const EngineError& error) {
      return {Outcome::kDiverged, fmt::format("within {:.4g} s: {}", duration_s_, error.what())};
    }
    return {};
  }

  std::vector<TimingWindow> windows_of(const TurnPlan& how) const {
    return timing_windows({duration_s_, sample_ms_, how.timestep_ms, how.windows, warmup_, how.share, how.restart});
  }

  // Calls `timed` for each window, with an instance that stands at its beginning. Input, untimed steps and looking at
  // the state lie outside the clock. `timed` takes the window's steps.
  template <typename Timed>
  Ending run_through(const TurnPlan& how, const std::vector<TimingWindow>& windows, const Timed& timed) {
    const double timestep_s = 1e-3 * how.timestep_ms;
    Ending ending;
    std::optional<Plausibility> plausibility;
    std::optional<Stepper> stepper;
    double start_s = 0, length_s = 0;  // of the instance
    const auto end_instance = [&] {
      if (stepper) engine_s_ += stepper->engine_s();
      stepper.reset();
    };
    for (size_t window = 0; window < windows.size(); ++window) {
      const TimingWindow& at = windows[window];
      try {
        if (at.state >= 0) {
          end_instance();
          const State& start = (*starts_)[std::min(static_cast<size_t>(at.state), starts_->size() - 1)];
          start_s = start.time;
          length_s = timestep_s * static_cast<double>(at.untimed + at.steps);
          for (size_t next = window + 1; next < windows.size() && windows[next].state < 0; ++next) {
            length_s += timestep_s * static_cast<double>(windows[next].steps);
          }
          plausibility.emplace(subject_.model, start, length_s,
                               largest_work(subject_.model, *subject_.control, length_s),
                               arithmetic_of(subject_.capabilities, timestep_s));
          stepper.emplace(subject_, start, timestep_s);
        }
        if (!stepper || !plausibility) throw std::logic_error("the first window of a turn starts from no state");
        if (at.untimed > 0) stepper->advance(at.untimed);
        timed(window, *stepper);
        const State& state = stepper->read();
        if (std::string why = plausibility->divergence(state); !why.empty()) {
          ending = {Outcome::kDiverged, fmt::format("by {:.4g} s: {}", state.time, why)};
        } else if (why = plausibility->impossibility(state); !why.empty() && ending.outcome == Outcome::kOk) {
          ending = {Outcome::kUnstable, fmt::format("by {:.4g} s: {}", state.time, why)};
        }
      } catch (const EngineError& error) {
        ending = {Outcome::kDiverged, fmt::format("within {:.4g} s: {}", start_s + length_s, error.what())};
      }
      if (ending.outcome == Outcome::kDiverged) break;
    }
    end_instance();
    return ending;
  }

  // Seconds of one step in the mean over some saved states; a step in a pile costs many times one in a fall.
  double step_time(double timestep_s) {
    constexpr size_t kStates = 8;
    const size_t count = std::min(kStates, states_.size());
    double sum = 0;
    for (size_t k = 0; k < count; ++k) sum += step_time_at(states_[states_.size() * k / count], timestep_s);
    return std::clamp(sum / static_cast<double>(count), 1e-12, 1e3);
  }

  // The least of several short spans: a moment in which the machine did something else must not decide how much is
  // timed.
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
        break;  // the turns will report the reason
      }
    }
    return std::isfinite(least) ? least : 1e-6;
  }

  Subject subject_;
  int warmup_;
  double duration_s_, sample_ms_;
  std::string trajectories_;
  std::vector<State> states_;  // of the reference run, at regular distances from its start
  std::vector<State> own_;     // the same of the run at the timestep that is timed
  std::string own_of_;         // its address
  const std::vector<State>* starts_ = &states_;
  int core_ = -1;
  double clock_s_ = 0;
  double engine_s_ = 0;
};

}  // namespace

// The processor time of the whole run, several times when it is short.
JobDone do_job(const ScalingJob& job) {
  const Subject subject = subject_of(job.subject);
  const long long samples = std::llround(1000 * job.subject.duration_s / job.subject.sample_ms);
  const long long per_sample = std::llround(job.subject.sample_ms / job.timestep_ms);
  pin_to_core();
  CellResult cell = {job.measure, {}, {}, {}};
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
  } catch (const EngineError& error) {
    ending = failed_to_start(error);
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
      report(session.prepare(prepare->timestep_ms));
    } else if (const auto* sample = std::get_if<SampleCommand>(&*command)) {
      report(session.sample(sample->how));
    } else if (const auto* steps = std::get_if<SingleStepsCommand>(&*command)) {
      report(session.single_steps(steps->how));
    } else {
      throw SystemError("a timing session was sent a second job");
    }
  }
  return {};
}

}  // namespace assay::jobs
