// Jobs whose figure is a time: whole runs for scaling, and the sessions of the timing pass.
#include <algorithm>
#include <cmath>
#include <limits>
#include <sched.h>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
#include "campaign/plan.h"
#include "controls/work.h"
#include "measures/plausible.h"
#include "measures/statistics.h"
#include "worker/job_parts.h"

namespace assay::jobs {

using nlohmann::json;

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
  explicit TimingSession(const json& job)
      : subject_(subject_of(job)),
        batch_s_(1e-3 * job.at("batch_ms").get<double>()),
        warmup_(job.at("warmup")),
        duration_s_(job.at("duration_s")) {
    const std::string reference = job.at("reference");
    if (reference.empty()) {  // the null engine has no run of its own
      starts_ = {subject_.model.initial};
    } else {
      const Trajectory trajectory = load(job.at("trajectories"), reference);
      const int count = job.at("states");
      const size_t samples = trajectory.states.size() - 1;
      for (int k = 0; k < count; ++k) {
        starts_.push_back(trajectory.states[samples * static_cast<size_t>(k) / static_cast<size_t>(count)]);
      }
    }
    core_ = pin_to_core();
    clock_s_ = clock_cost();
  }

  int core() const { return core_; }
  double clock_s() const { return clock_s_; }

  // Finds how many steps make a sample and a batch, and how many batches a round; `steps` fixes the former two (0:
  // free).
  json prepare(double timestep_ms, long long steps) {
    timestep_ms_ = timestep_ms;
    steps_ = 1;
    batches_ = static_cast<int>(starts_.size());
    const double timestep_s = 1e-3 * timestep_ms;
    const double before = engine_s_;
    Verdict verdict;
    try {
      check_supported(subject_, timestep_s);
      const double step_s = step_time(timestep_s);
      slice_ = steps > 0 ? steps : static_cast<long long>(std::clamp(std::ceil(kSliceSeconds / step_s), 1.0, 1e9));
      verdict = choose_steps(timestep_s, step_s, steps);
      // Enough batches for the round's time; an engine that does nothing must not go on for ever.
      constexpr double kMostBatches = 2000;
      const double round_s = static_cast<double>(starts_.size()) * static_cast<double>(steps_) * step_s;
      const double rounds = std::clamp(std::ceil(batch_s_ / round_s), 1.0, kMostBatches);
      batches_ = static_cast<int>(rounds) * static_cast<int>(starts_.size());
    } catch (const UnsupportedError& error) {
      verdict = {Outcome::kUnsupported, error.what()};
    } catch (const EngineError& error) {
      verdict = {Outcome::kCrashed, fmt::format("the engine failed to start: {}", error.what())};
    }
    json answer = cell_answer(verdict, engine_s_ - before);
    answer["how"] = {{"timestep_ms", timestep_ms_},
                     {"sample_steps", std::min(slice_, steps_)},
                     {"batch_steps", steps_},
                     {"batches", batches_}};
    return answer;
  }

  // One round's samples: every saved state in turn until the time is spent. `how` is what prepare() answered, here or
  // in another process.
  json sample(const json& how) {
    timestep_ms_ = how.at("timestep_ms");
    slice_ = how.at("sample_steps");
    steps_ = how.at("batch_steps");
    batches_ = how.at("batches");
    const double before = engine_s_, cpu_before = cpu_seconds();
    const Clock::time_point start = Clock::now();
    std::vector<double> step_us;
    double timed_s = 0;
    long long clock_reads = 0;
    Verdict verdict;
    for (int i = 0; i < batches_; ++i) {
      const Batch done = batch(starts_[static_cast<size_t>(i) % starts_.size()]);
      if (verdict.outcome == Outcome::kOk) verdict = done.verdict;
      if (done.verdict.outcome == Outcome::kDiverged) {
        verdict = done.verdict;
        break;
      }
      step_us.insert(step_us.end(), done.step_us.begin(), done.step_us.end());
      timed_s += done.timed_s;
      clock_reads += done.clock_reads;
    }
    json answer = cell_answer(verdict, engine_s_ - before);
    answer["step_us"] = step_us;
    answer["clock_share"] = timed_s > 0 ? static_cast<double>(clock_reads) * clock_s_ / timed_s : 0;
    answer["cpu_s"] = cpu_seconds() - cpu_before;
    answer["wall_s"] = seconds_since(start);
    return answer;
  }

 private:
  // Seconds of engine time that one sample of the clock covers: long against the clock's cost, short against the time
  // for which a busy machine takes the core away, so that such moments spoil few samples.
  static constexpr double kSliceSeconds = 5e-4;

  struct Batch {
    std::vector<double> step_us;  // a sample for each slice
    double timed_s = 0;
    long long clock_reads = 0;
    Verdict verdict;
  };

  // A batch covers its share of the run, so that a round covers the run. Without contacts a step's cost does not
  // depend on where in the run it is, and a batch may go on for longer, as long as the motion stays a possible one.
  Verdict choose_steps(double timestep_s, double step_s, long long given) {
    const auto states = static_cast<double>(starts_.size());
    const double share = duration_s_ / states;
    std::vector<double> lengths = {share};
    if (subject_.model.contacts.empty()) lengths = {10 * duration_s_, duration_s_, share};
    Verdict verdict;
    for (const double length : lengths) {
      const double most = std::clamp(std::floor(length / timestep_s - warmup_), 1.0, 1e9);
      steps_ = given > 0 ? given : static_cast<long long>(std::clamp(std::ceil(batch_s_ / states / step_s), 1.0, most));
      verdict = {};
      for (const State& start : starts_) {
        if (verdict.outcome == Outcome::kOk) verdict = batch(start).verdict;
      }
      if (verdict.outcome == Outcome::kOk) break;
    }
    return verdict;
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
        result.verdict = {Outcome::kDiverged, fmt::format("by {:.4g} s: {}", state.time, why)};
      } else if (why = plausibility.impossibility(state); !why.empty()) {
        result.verdict = {Outcome::kUnstable, fmt::format("by {:.4g} s: {}", state.time, why)};
      }
    } catch (const EngineError& error) {
      result.verdict = {Outcome::kDiverged, fmt::format("within {:.4g} s: {}", start.time + length, error.what())};
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

  // The least of several short batches, for a moment in which the machine did something else must not shorten every
  // sample.
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
        break;  // batches will say why
      }
    }
    return std::isfinite(least) ? least : 1e-6;
  }

  static json cell_answer(const Verdict& verdict, double engine_s) {
    return {
        {"outcome", std::string(outcome_text(verdict.outcome))}, {"reason", verdict.reason}, {"engine_s", engine_s}};
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

// {"timestep_ms", "seed", "trajectories", "save": address of the last state, or ""}: the processor's time of the whole
// run, several times when it is short.
json do_scaling(const json& job) {
  const Subject subject = subject_of(job);
  const double timestep_ms = job.at("timestep_ms"), sample_ms = job.at("sample_ms"), duration_s = job.at("duration_s");
  const long long samples = std::llround(1000 * duration_s / sample_ms);
  const long long per_sample = std::llround(sample_ms / timestep_ms);
  pin_to_core();
  Verdict verdict;
  std::vector<double> seconds;
  Trajectory end;
  double engine_s = 0;
  try {
    check_supported(subject, 1e-3 * timestep_ms);
    while (seconds.size() < kScalingMostRuns && engine_s < kScalingEnoughSeconds) {
      Run run = run_sampled(subject, subject.model.initial, timestep_ms, samples, per_sample);
      engine_s += run.engine_s;
      verdict = run.verdict;
      if (verdict.outcome == Outcome::kDiverged) break;
      seconds.push_back(run.engine_s);
      end.states = {std::move(run.trajectory.states.back())};
    }
  } catch (const UnsupportedError& error) {
    verdict = {Outcome::kUnsupported, error.what()};
  } catch (const EngineError& error) {
    verdict = {Outcome::kCrashed, fmt::format("the engine failed to start: {}", error.what())};
  }
  json values = json::array(), series = json::object();
  if (verdict.outcome == Outcome::kOk || verdict.outcome == Outcome::kUnstable) {
    const Interval time = bootstrap_median(seconds, job.at("seed").get<std::uint64_t>());
    const auto steps = static_cast<double>(samples * per_sample);
    values.push_back(value_json("run_time", "s", time.value, time.low, time.high));
    if (time.low > 0) {
      values.push_back(value_json("steps_per_second", "1/s", steps / time.value, steps / time.high, steps / time.low));
    }
    series["run_time_s"] = seconds;
    if (const std::string address = job.at("save"); !address.empty()) save(job.at("trajectories"), address, end);
  }
  return answer_json({cell_json("scaling", verdict, std::move(values), std::move(series))}, engine_s);
}

// {"reference", "states", "warmup", "batch_ms", "trajectories"}, then commands {"prepare": timestep_ms}, {"sample":
// true}, each with an answer.
json do_timing(const json& job, const Report& report, const Next& next) {
  TimingSession session(job);
  report({{"ready", true}, {"core", session.core()}, {"clock_s", session.clock_s()}});
  for (json command = next(); !command.is_null(); command = next()) {
    report(command.contains("prepare") ? session.prepare(command.at("prepare"), command.at("steps"))
                                       : session.sample(command.at("sample")));
  }
  return json::object();
}

}  // namespace assay::jobs
