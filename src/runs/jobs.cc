#include "runs/jobs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <limits>
#include <sched.h>
#include <sys/resource.h>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "conformance/conformance.h"
#include "measures/accuracy.h"
#include "measures/agreement.h"
#include "measures/damping.h"
#include "measures/grasp.h"
#include "measures/mechanics.h"
#include "measures/plausible.h"
#include "measures/statistics.h"
#include "measures/violation.h"
#include "model/mjcf.h"
#include "reference/smooth.h"
#include "runs/plan.h"
#include "runs/stepper.h"
#include "runs/work.h"
#include "store/store.h"
#include "store/trajectory.h"

namespace assay {
namespace {

using nlohmann::json;
using Report = std::function<void(const json&)>;
using Next = std::function<json()>;

double thread_cpu_seconds() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double cpu_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// ---- subjects -------------------------------------------------------------------------------------------------------

ResolvedContender contender_of(const json& contender) {
  ResolvedContender resolved = Registry::instance().resolve(
      contender.at("base"), contender.at("overrides").get<std::map<std::string, std::string>>());
  resolved.name = contender.at("name");
  return resolved;
}

Model model_of(const json& job) {
  Model model = load_model(job.at("model_path").get<std::string>());
  if (!job.at("contacts")) model = without_contacts(std::move(model));
  if (!job.at("gravity")) model = without_gravity(std::move(model));
  if (model.hash != job.at("model_hash").get<std::string>()) {
    throw InputError(fmt::format("'{}' has changed since the campaign was read: start it again",
                                 job.at("model_path").get<std::string>()));
  }
  return model;
}

Subject subject_of(const json& job) {
  Subject subject;
  subject.model = model_of(job);
  const json& control = job.at("control");
  subject.control = make_control(subject.model, {.kind = control.at("kind"),
                                                 .amplitude = control.at("amplitude"),
                                                 .frequency = control.at("frequency"),
                                                 .phase_step = control.at("phase_step")});
  subject.contender = contender_of(job.at("contender"));
  subject.capabilities = subject.contender.engine->capabilities(subject.contender.settings);
  const bool adapter_springs = subject.model.has_springs() && subject.capabilities.springs == SpringKind::kExplicit;
  subject.free_running = subject.control->is_zero() && !adapter_springs;
  return subject;
}

// What can be said without a run.
void check_supported(const Subject& subject, double timestep_s) {
  if (!subject.control->is_zero() && !subject.capabilities.torques) {
    throw UnsupportedError("the engine takes no joint torques");
  }
  Settings settings = subject.contender.settings;
  settings.timestep = timestep_s;
  subject.contender.engine->require_supported(subject.model, settings);
}

// ---- outcomes -------------------------------------------------------------------------------------------------------

struct Verdict {
  Outcome outcome = Outcome::kOk;
  std::string reason;
};

json value_json(const std::string& name, const std::string& unit, std::optional<double> value,
                std::optional<double> low = {}, std::optional<double> high = {}) {
  const auto number = [](std::optional<double> x) { return x && std::isfinite(*x) ? json(*x) : json(nullptr); };
  return {{"name", name}, {"unit", unit}, {"value", number(value)}, {"low", number(low)}, {"high", number(high)}};
}

json cell_json(const std::string& measure, const Verdict& verdict, json values = json::array(),
               json samples = json::object()) {
  return {{"measure", measure},
          {"outcome", std::string(outcome_text(verdict.outcome))},
          {"reason", verdict.reason},
          {"values", std::move(values)},
          {"samples", std::move(samples)}};
}

json answer_json(json cells, double engine_s) {
  return {{"cells", std::move(cells)}, {"engine_s", engine_s}, {"cpu_s", cpu_seconds()}};
}

// A run that is sampled at a fixed distance.
struct Run {
  Trajectory trajectory;  // up to where it went
  Verdict verdict;        // ok, unstable (of its last state), diverged
  double engine_s = 0;    // of the processor's time, for runs share the machine with others
};

// Takes `samples` times `per_sample` steps from `start`. EngineError from create() is the caller's.
Run run_sampled(const Subject& subject, const State& start, double timestep_ms, long long samples,
                long long per_sample) {
  const long long steps = per_sample;
  const double timestep_s = 1e-3 * timestep_ms;
  const double duration_s = timestep_s * static_cast<double>(samples * steps);
  const Plausibility plausibility(subject.model, start, duration_s,
                                  largest_work(subject.model, *subject.control, duration_s));
  Run run;
  Stepper stepper(subject, start, timestep_s);
  run.trajectory.states.reserve(static_cast<size_t>(samples) + 1);
  run.trajectory.states.push_back(stepper.read());
  std::string impossible;
  for (long long sample = 1; sample <= samples; ++sample) {
    const double time = start.time + timestep_s * static_cast<double>(sample * steps);
    std::string why;
    const double cpu_before = thread_cpu_seconds(), engine_before = stepper.engine_s();
    try {
      stepper.advance(steps);
    } catch (const EngineError& error) {
      why = error.what();
    }
    // With torques at each step only the wall clock is cheap enough to tell the engine's part.
    const double cpu_s = thread_cpu_seconds() - cpu_before;
    run.engine_s += subject.free_running ? cpu_s : std::min(cpu_s, stepper.engine_s() - engine_before);
    const State& state = stepper.read();
    if (const std::string divergence = plausibility.divergence(state); !divergence.empty()) why = divergence;
    if (!why.empty()) {
      run.verdict = {Outcome::kDiverged, fmt::format("by {:.4g} s: {}", time, why)};
      break;
    }
    if (impossible.empty()) {
      impossible = plausibility.impossibility(state);
      if (!impossible.empty()) impossible = fmt::format("at {:.4g} s: {}", time, impossible);
    }
    run.trajectory.states.push_back(state);
  }
  if (run.verdict.outcome == Outcome::kOk && !impossible.empty()) run.verdict = {Outcome::kUnstable, impossible};
  return run;
}

// The verdict on a run that is read from its file: it was stored because it came to its end.
Verdict judge(const Subject& subject, const Trajectory& trajectory) {
  const double duration_s = trajectory.states.back().time - trajectory.states.front().time;
  const Plausibility plausibility(subject.model, trajectory.states.front(), duration_s,
                                  largest_work(subject.model, *subject.control, duration_s));
  for (const State& state : trajectory.states) {
    if (const std::string why = plausibility.impossibility(state); !why.empty()) {
      return {Outcome::kUnstable, fmt::format("at {:.4g} s: {}", state.time, why)};
    }
  }
  return {};
}

// Same file, same bytes: who comes second need not wait for the first.
void save(const std::string& dir, const std::string& address, const Trajectory& trajectory) {
  if (!has_trajectory(dir, address)) write_trajectory(dir, address, trajectory);
}

Trajectory load(const std::string& dir, const std::string& address) {
  auto trajectory = read_trajectory(dir, address);
  if (!trajectory || trajectory->states.empty()) {
    // The parent saw it a moment ago. Gone or damaged: the next start computes it again.
    std::error_code error;
    std::filesystem::remove(trajectory_path(dir, address), error);
    throw SystemError(fmt::format("the trajectory '{}' is damaged and was removed: start the same command again",
                                  trajectory_path(dir, address)));
  }
  return *std::move(trajectory);
}

// ---- runs from the initial state --------------------------------------------------------------------------------------

json truth_cell(const Subject& subject, const Run& run, const Trajectory& truth, double steps) {
  if (run.verdict.outcome == Outcome::kDiverged) return cell_json("truth", run.verdict);
  const double error = position_error(run.trajectory.states.back(), truth.states.back());
  double extent = 0;
  for (const State& state : truth.states) {
    for (const BodyState& body : state.bodies) extent = std::max(extent, body.p_WBcm.cwiseAbs().maxCoeff());
  }
  const double rounding = rounding_error(subject.capabilities.precision == Precision::kSingle, extent, steps);
  return cell_json("truth", run.verdict,
                   {value_json("truth_error", "m", error), value_json("truth_rounding", "m", rounding)});
}

// Where all the energy is kinetic, its decay has a rate.
std::optional<Interval> hidden_damping(const Model& model, const std::vector<State>& states, std::uint64_t seed) {
  const bool springs = std::ranges::any_of(model.hinges, [](const Hinge& hinge) { return hinge.stiffness != 0; });
  if (!model.gravity.isZero(0) || springs) return std::nullopt;
  std::vector<double> time, energy;
  time.reserve(states.size());
  energy.reserve(states.size());
  for (const State& state : states) {
    time.push_back(state.time);
    energy.push_back(kinetic_energy(model, state));
  }
  return damping_rate(time, energy, seed);
}

json drift_cell(const Subject& subject, const Run& run, std::uint64_t seed) {
  if (run.verdict.outcome == Outcome::kDiverged) return cell_json("drift", run.verdict);
  json values = json::array();
  const Conserved conserved = conserved_quantities(subject.model, !subject.control->is_zero());
  for (const Drift::Quantity& quantity : drift(subject.model, conserved, run.trajectory.states).quantities) {
    values.push_back(value_json(quantity.name + "_drift", quantity.unit, quantity.absolute));
    if (quantity.relative) values.push_back(value_json(quantity.name + "_drift_relative", "1", quantity.relative));
  }
  if (conserved.energy) {
    if (const auto rate = hidden_damping(subject.model, run.trajectory.states, seed)) {
      values.push_back(value_json("damping_rate", "1/s", rate->value, rate->low, rate->high));
    }
  }
  return cell_json("drift", run.verdict, std::move(values));
}

// Only what the model has can be violated.
json violation_cell(const Subject& subject, const Run& run, std::uint64_t seed) {
  if (run.verdict.outcome == Outcome::kDiverged) return cell_json("violation", run.verdict);
  const ViolationSummary summary = violation_summary(subject.model, run.trajectory.states, seed);
  json values = json::array();
  const auto add = [&](const std::string& name, const std::string& unit, double Violation::* kind) {
    values.push_back(value_json(name + "_max", unit, summary.largest.*kind));
    values.push_back(value_json(name + "_rms", unit, summary.rms.*kind, summary.rms_low.*kind, summary.rms_high.*kind));
  };
  if (!subject.model.hinges.empty()) {
    add("joint_dislocation", "m", &Violation::dislocation);
    add("joint_misalignment", "rad", &Violation::misalignment);
  }
  if (subject.model.has_limits()) add("limit_violation", "rad", &Violation::limit);
  if (!subject.model.contacts.empty()) add("penetration", "m", &Violation::penetration);
  return cell_json("violation", run.verdict, std::move(values));
}

// A run that diverges has not held, whether or not the object had left the hand before.
json grasp_cell(const Run& run, const json& bodies) {
  const Grasp found =
      grasp(run.trajectory.states, bodies.at("object"), bodies.at("hand"), bodies.at("drop_m").get<double>());
  const bool ended = run.verdict.outcome != Outcome::kDiverged;
  json values = {value_json("grasp_held", "1", ended && found.held() ? 1 : 0)};
  if (ended) values.push_back(value_json("grasp_slip", "m", found.slip));
  if (found.dropped_at) {
    values.push_back(value_json("drop_time", "s", *found.dropped_at - run.trajectory.states.front().time));
  }
  return cell_json("grasp", run.verdict, std::move(values));
}

// {"timestep_ms", "measures", "save": address or "", "use": address or "", "truth": address or "", "trajectories",
// "seed", "grasp": {"object", "hand", "drop_m"}, "partial": save what diverges too, as far as it went}
json do_run(const json& job) {
  const Subject subject = subject_of(job);
  const std::vector<std::string> measures = job.at("measures");
  const double timestep_ms = job.at("timestep_ms"), sample_ms = job.at("sample_ms"), duration_s = job.at("duration_s");
  const std::string dir = job.at("trajectories"), saved = job.at("save"), used = job.at("use");
  const long long per_sample = std::llround(sample_ms / timestep_ms);
  const long long samples = std::llround(1000 * duration_s / sample_ms);
  json cells = json::array();
  Run run;
  try {
    check_supported(subject, 1e-3 * timestep_ms);
    if (!used.empty()) {
      run.trajectory = load(dir, used);
      run.verdict = judge(subject, run.trajectory);
    } else {
      run = run_sampled(subject, subject.model.initial, timestep_ms, samples, per_sample);
    }
  } catch (const UnsupportedError& error) {
    run.verdict = {Outcome::kUnsupported, error.what()};
  } catch (const EngineError& error) {
    run.verdict = {Outcome::kCrashed, fmt::format("the engine failed to start: {}", error.what())};
  }
  const bool ended = run.verdict.outcome == Outcome::kOk || run.verdict.outcome == Outcome::kUnstable;
  const bool partial = job.value("partial", false) && !run.trajectory.states.empty();
  if ((ended || partial) && !saved.empty()) save(dir, saved, run.trajectory);
  for (const std::string& measure : measures) {
    const bool ran = ended || run.verdict.outcome == Outcome::kDiverged;
    if (measure == "reference" || !ran) {
      cells.push_back(cell_json(measure, run.verdict));
    } else if (measure == "truth") {
      cells.push_back(truth_cell(subject, run, load(dir, job.at("truth")), static_cast<double>(samples * per_sample)));
    } else if (measure == "violation") {
      cells.push_back(violation_cell(subject, run, job.at("seed").get<std::uint64_t>()));
    } else if (measure == "grasp") {
      cells.push_back(grasp_cell(run, job.at("grasp")));
    } else {
      cells.push_back(drift_cell(subject, run, job.at("seed").get<std::uint64_t>()));
    }
  }
  return answer_json(std::move(cells), run.engine_s);
}

// The truth itself: no engine takes part.
json do_truth(const json& job) {
  const Model model = model_of(job);
  const std::string dir = job.at("trajectories"), address = job.at("save");
  Trajectory truth;
  truth.states = {model.initial,
                  smooth_solution(model, model.initial, model.initial.time + job.at("duration_s").get<double>())};
  save(dir, address, truth);
  return answer_json(json::array(), 0);
}

// ---- consistency ----------------------------------------------------------------------------------------------------

// {"timestep_ms", "reference", "pieces", "piece_ms", "reference_ms", "seed", "trajectories"}
json do_pieces(const json& job) {
  const Subject subject = subject_of(job);
  const double timestep_ms = job.at("timestep_ms"), sample_ms = job.at("sample_ms"), piece_ms = job.at("piece_ms");
  const Trajectory reference = load(job.at("trajectories"), job.at("reference"));
  const auto total = static_cast<long long>(reference.states.size()) - 1;
  const long long samples = std::llround(piece_ms / sample_ms);
  const long long per_sample = std::llround(sample_ms / timestep_ms);
  Verdict verdict;
  std::vector<double> errors;
  double engine_s = 0;
  int piece = 0;
  try {
    check_supported(subject, 1e-3 * timestep_ms);
    for (const long long start : piece_starts(total, samples, job.at("pieces"))) {
      ++piece;
      const Run run =
          run_sampled(subject, reference.states[static_cast<size_t>(start)], timestep_ms, samples, per_sample);
      engine_s += run.engine_s;
      if (run.verdict.outcome != Outcome::kOk && verdict.outcome != Outcome::kDiverged) {
        verdict = {run.verdict.outcome, fmt::format("piece {}, {}", piece, run.verdict.reason)};
      }
      if (run.verdict.outcome == Outcome::kDiverged) break;
      errors.push_back(
          position_error(run.trajectory.states.back(), reference.states[static_cast<size_t>(start + samples)]));
    }
  } catch (const UnsupportedError& error) {
    verdict = {Outcome::kUnsupported, error.what()};
  } catch (const EngineError& error) {
    verdict = {Outcome::kCrashed, fmt::format("piece {}: the engine failed to start: {}", piece, error.what())};
  }
  json values = json::array();
  json series = json::object();
  if (verdict.outcome == Outcome::kOk || verdict.outcome == Outcome::kUnstable) {
    const Interval error = bootstrap_mean(errors, job.at("seed").get<std::uint64_t>());
    values.push_back(value_json("consistency", "m", error.value, error.low, error.high));
    if (std::abs(timestep_ms - job.at("reference_ms").get<double>()) <= 1e-9 * timestep_ms) {
      values.push_back(value_json("restart_floor", "m", error.value, error.low, error.high));
    }
    series["piece_error_m"] = errors;
  }
  return answer_json({cell_json("consistency", verdict, std::move(values), std::move(series))}, engine_s);
}

// ---- agreement --------------------------------------------------------------------------------------------------------

// {"own": address, "others": [{"name", "address"}], "trajectories"}
json do_agreement(const json& job) {
  const std::string dir = job.at("trajectories");
  const Trajectory own = load(dir, job.at("own"));
  std::vector<double> time;
  time.reserve(own.states.size());
  for (const State& state : own.states) time.push_back(state.time);
  const double duration_s = time.back() - time.front();
  // enough for a plot
  constexpr size_t kMostSamples = 64;
  const size_t stride = (time.size() + kMostSamples - 1) / kMostSamples;
  const auto thinned = [&](const std::vector<double>& series) {
    std::vector<double> kept;
    kept.reserve(kMostSamples);
    for (size_t i = 0; i < series.size(); i += stride) kept.push_back(series[i]);
    return kept;
  };
  json series = json::object();
  std::vector<double> at_end, parted;
  for (const json& other : job.at("others")) {
    const std::vector<double> apart = distances(own.states, load(dir, other.at("address")).states);
    const std::string name = other.at("name");
    at_end.push_back(apart.back());
    parted.push_back(parting_time(time, apart).value_or(duration_s));
    series["distance_m " + name] = thinned(apart);
    series["parting_time_s " + name] = {parted.back()};
  }
  json values = json::array();
  if (!at_end.empty()) {
    series["time_s"] = thinned(time);
    values.push_back(value_json("agreement", "m", median(at_end)));
    values.push_back(value_json("parting_time", "s", median(parted)));
  }
  return answer_json({cell_json("agreement", {}, std::move(values), std::move(series))}, 0);
}

// ---- scaling ------------------------------------------------------------------------------------------------------------

int pin_to_core();

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

// ---- the gate, and a look at the speed --------------------------------------------------------------------------------

json do_gate(const json& job, const Report& report) {
  ConformanceOptions options;
  options.tests = job.at("tests").get<std::vector<std::string>>();
  options.on_result = [&](const ConformanceResult& result) {
    report({{"test", result.test},
            {"status", std::string(status_text(result.status))},
            {"figure", result.figure},
            {"tolerance", result.tolerance},
            {"unit", result.unit},
            {"note", result.note}});
  };
  run_conformance(contender_of(job.at("contender")), options);
  return answer_json(json::array(), 0);
}

// Seconds of processor time of a step, over a few milliseconds of them.
double step_seconds(Stepper& stepper) {
  constexpr double kLongEnough = 5e-3;
  long long steps = 1, taken = 0;
  const double before = thread_cpu_seconds();
  while (thread_cpu_seconds() - before < kLongEnough && taken < (1LL << 20)) {
    stepper.advance(steps);
    taken += steps;
    steps *= 2;
  }
  return (thread_cpu_seconds() - before) / static_cast<double>(taken);
}

// {"timestep_ms", "whole_run"} -> {"step_us"}: for the estimate of the time that the campaign takes. The mean of steps
// at the start and of steps where a coarse run has come to within a moment, for a pile costs more than a fall; or of
// all steps of a whole run.
json do_probe(const json& job) {
  constexpr double kCoarseMs = 1, kWholeRunSeconds = 3, kMomentSeconds = 0.15;
  const Subject subject = subject_of(job);
  const double timestep_ms = job.at("timestep_ms"), duration_s = job.at("duration_s");
  try {
    check_supported(subject, 1e-3 * timestep_ms);
    Stepper first(subject, subject.model.initial, 1e-3 * timestep_ms);
    const bool whole = job.at("whole_run");
    const double at_start = whole ? 0 : step_seconds(first);
    const double coarse_ms = whole ? timestep_ms : std::max(kCoarseMs, timestep_ms);
    Stepper coarse(subject, subject.model.initial, 1e-3 * coarse_ms);
    const auto steps = static_cast<long long>(1e3 * duration_s / coarse_ms);
    const double before = thread_cpu_seconds(), most = whole ? kWholeRunSeconds : kMomentSeconds;
    long long taken = 0;
    while (taken < steps && thread_cpu_seconds() - before < most) {
      coarse.advance(1);
      ++taken;
    }
    const double each_s = (thread_cpu_seconds() - before) / static_cast<double>(std::max(1LL, taken));
    if (whole) return {{"step_us", 1e6 * each_s}};
    const State state = coarse.read();
    if (!Plausibility(subject.model, subject.model.initial, duration_s).divergence(state).empty()) {
      return {{"step_us", 1e6 * at_start}};
    }
    Stepper later(subject, state, 1e-3 * timestep_ms);
    return {{"step_us", 0.5e6 * (at_start + step_seconds(later))}};
  } catch (const EngineError&) {
    return {{"step_us", 0}};  // its cells will say why
  }
}

// ---- timing ---------------------------------------------------------------------------------------------------------

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

}  // namespace

json subject_json(const CampaignSystem& system, const CampaignContender& contender) {
  return {{"model_path", system.model_path},
          {"model_hash", system.model.hash},
          {"contacts", system.contacts},
          {"gravity", system.gravity},
          {"control",
           {{"kind", system.control.kind},
            {"amplitude", system.control.amplitude},
            {"frequency", system.control.frequency},
            {"phase_step", system.control.phase_step}}},
          {"contender",
           {{"name", contender.resolved.name}, {"base", contender.resolved.base}, {"overrides", contender.overrides}}},
          {"duration_s", system.duration_s},
          {"sample_ms", system.sample_ms}};
}

json do_job(const json& job, const Report& report, const Next& next) {
  const std::string kind = job.at("kind");
  if (kind == "run") return do_run(job);
  if (kind == "pieces") return do_pieces(job);
  if (kind == "truth") return do_truth(job);
  if (kind == "agreement") return do_agreement(job);
  if (kind == "scaling") return do_scaling(job);
  if (kind == "gate") return do_gate(job, report);
  if (kind == "probe") return do_probe(job);
  if (kind == "timing") return do_timing(job, report, next);
  throw InputError(fmt::format("a worker has no job '{}'", kind));
}

}  // namespace assay
