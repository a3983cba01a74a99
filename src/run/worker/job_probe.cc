// A look at the speed before anything is measured.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "base/errors.h"
#include "measures/plausible.h"
#include "run/worker/job_parts.h"

namespace assay::jobs {

namespace {

// What steps cost since its construction: processor time of this process, or the elapsed time of an engine that works
// in another process, for which this one only waits.
class Effort {
 public:
  double seconds() const {
    const double busy = cpu_seconds() - busy_before_, elapsed = elapsed_seconds();
    return elapsed > kWaiting * busy ? elapsed : busy;
  }
  // So that a look at such an engine comes to its end, too.
  bool exceeds(double seconds) const {
    return cpu_seconds() - busy_before_ > seconds || elapsed_seconds() > kWaiting * seconds;
  }

 private:
  static constexpr double kWaiting = 20;  // elapsed per processor time, more than a machine's load makes of it
  using Clock = std::chrono::steady_clock;
  double elapsed_seconds() const { return std::chrono::duration<double>(Clock::now() - before_).count(); }

  double busy_before_ = cpu_seconds();
  Clock::time_point before_ = Clock::now();
};

// Seconds of a step, over a few milliseconds of them.
double step_seconds(Stepper& stepper) {
  constexpr double kLongEnough = 5e-3;
  long long steps = 1, taken = 0;
  const Effort effort;
  while (!effort.exceeds(kLongEnough) && taken < (1LL << 20)) {
    stepper.advance(steps);
    taken += steps;
    steps *= 2;
  }
  return effort.seconds() / static_cast<double>(taken);
}

// Seconds of a step in the mean of a whole run. A run that costs too much is left: its other steps are then taken to
// cost what the last ones did, because piles grow.
double whole_run_step_seconds(Stepper& stepper, long long steps) {
  constexpr double kMostSeconds = 3;
  std::vector<double> spent = {0};
  const Effort effort;
  while (std::ssize(spent) <= steps && !effort.exceeds(kMostSeconds)) {
    stepper.advance(1);
    spent.push_back(std::max(spent.back(), effort.seconds()));
  }
  const size_t taken = spent.size() - 1, recent = (taken + 2) / 3;
  const double recent_s = (spent.back() - spent[taken - recent]) / static_cast<double>(recent);
  return (spent.back() + recent_s * static_cast<double>(steps - std::ssize(spent) + 1)) / static_cast<double>(steps);
}

// The mean over steps at some moments of a coarse run, as far as that run comes in little time, because a step in a
// pile costs more than one in a fall.
double step_us_at_moments(const Subject& subject, double timestep_ms, double duration_s, Stepper& first) {
  constexpr double kCoarseMs = 1, kCoarseSeconds = 0.4;
  constexpr long long kMoments = 4;
  double sum_s = step_seconds(first);
  long long moments = 1;
  const double coarse_ms = std::max(kCoarseMs, timestep_ms);
  Stepper coarse(subject, subject.model.initial, 1e-3 * coarse_ms);
  const auto steps = static_cast<long long>(1e3 * duration_s / coarse_ms);
  const Plausibility plausibility(subject.model, subject.model.initial, duration_s);
  const Effort effort;
  double probing_s = 0;  // at the moments
  for (long long taken = 1; taken <= steps; ++taken) {
    coarse.advance(1);
    const bool enough = effort.exceeds(kCoarseSeconds + probing_s);
    if (!enough && taken < steps * moments / (kMoments - 1)) continue;
    const State state = coarse.read();
    if (!plausibility.divergence(state).empty()) break;
    const Effort moment;
    Stepper there(subject, state, 1e-3 * timestep_ms);
    sum_s += step_seconds(there);
    probing_s += moment.seconds();
    ++moments;
    if (enough) break;
  }
  return 1e6 * sum_s / static_cast<double>(moments);
}

}  // namespace

JobDone do_job(const ProbeJob& job) {
  const Subject subject = subject_of(job.subject);
  const double duration_s = job.subject.duration_s;
  JobDone done = job_done({}, 0);
  try {
    check_supported(subject, 1e-3 * job.timestep_ms);
    Stepper(subject, subject.model.initial, 1e-3 * job.timestep_ms).advance(1);  // may compile
    done.start_s = cpu_seconds();
    Stepper stepper(subject, subject.model.initial, 1e-3 * job.timestep_ms);
    stepper.advance(1);
    done.instance_s = cpu_seconds() - done.start_s;
    if (job.whole_run) {
      const auto steps = std::max(1LL, std::llround(1e3 * duration_s / job.timestep_ms));
      done.step_us = 1e6 * whole_run_step_seconds(stepper, steps);
    } else {
      done.step_us = step_us_at_moments(subject, job.timestep_ms, duration_s, stepper);
    }
  } catch (const EngineError&) {
    done.step_us = 0;  // its cells will give the reason
  }
  return done;
}

}  // namespace assay::jobs
