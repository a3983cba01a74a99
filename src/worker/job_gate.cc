// Jobs before anything is measured: the gate, and a look at the speed.
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/errors.h"
#include "conformance/conformance.h"
#include "measures/plausible.h"
#include "worker/job_parts.h"

namespace assay::jobs {

using nlohmann::json;

namespace {

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

// Seconds of processor time of a step in the mean of a whole run. A run that costs too much is left: its other steps
// then cost what the last ones did, for piles grow.
double whole_run_step_seconds(Stepper& stepper, long long steps) {
  constexpr double kMostSeconds = 3;
  std::vector<double> spent = {0};
  const double before = thread_cpu_seconds();
  while (std::ssize(spent) <= steps && spent.back() < kMostSeconds) {
    stepper.advance(1);
    spent.push_back(thread_cpu_seconds() - before);
  }
  const size_t taken = spent.size() - 1, recent = (taken + 2) / 3;
  const double recent_s = (spent.back() - spent[taken - recent]) / static_cast<double>(recent);
  return (spent.back() + recent_s * static_cast<double>(steps - std::ssize(spent) + 1)) / static_cast<double>(steps);
}

}  // namespace

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

// {"timestep_ms", "whole_run"} -> {"step_us"}: for the estimate of the time that the campaign takes. The mean of steps
// at moments of a coarse run, as far as that comes in little time, for a pile costs more than a fall; or of all steps
// of a whole run.
json do_probe(const json& job) {
  constexpr double kCoarseMs = 1, kCoarseSeconds = 0.4;
  constexpr long long kMoments = 4;
  const Subject subject = subject_of(job);
  const double timestep_ms = job.at("timestep_ms"), duration_s = job.at("duration_s");
  try {
    check_supported(subject, 1e-3 * timestep_ms);
    if (job.at("whole_run")) {
      Stepper stepper(subject, subject.model.initial, 1e-3 * timestep_ms);
      const auto steps = std::max(1LL, std::llround(1e3 * duration_s / timestep_ms));
      return {{"step_us", 1e6 * whole_run_step_seconds(stepper, steps)}};
    }
    Stepper first(subject, subject.model.initial, 1e-3 * timestep_ms);
    double sum_s = step_seconds(first);
    long long moments = 1;
    const double coarse_ms = std::max(kCoarseMs, timestep_ms);
    Stepper coarse(subject, subject.model.initial, 1e-3 * coarse_ms);
    const auto steps = static_cast<long long>(1e3 * duration_s / coarse_ms);
    const Plausibility plausibility(subject.model, subject.model.initial, duration_s);
    const double before = thread_cpu_seconds();
    double probing_s = 0;  // at the moments
    for (long long taken = 1; taken <= steps; ++taken) {
      coarse.advance(1);
      const bool enough = thread_cpu_seconds() - before - probing_s > kCoarseSeconds;
      if (!enough && taken < steps * moments / (kMoments - 1)) continue;
      const State state = coarse.read();
      if (!plausibility.divergence(state).empty()) break;
      const double moment_before = thread_cpu_seconds();
      Stepper there(subject, state, 1e-3 * timestep_ms);
      sum_s += step_seconds(there);
      probing_s += thread_cpu_seconds() - moment_before;
      ++moments;
      if (enough) break;
    }
    return {{"step_us", 1e6 * sum_s / static_cast<double>(moments)}};
  } catch (const EngineError&) {
    return {{"step_us", 0}};  // its cells will say why
  }
}

}  // namespace assay::jobs
