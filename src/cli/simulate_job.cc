#include "cli/simulate_job.h"

#include <cmath>
#include <tuple>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/run_bounds.h"
#include "base/text.h"
#include "check/feedback.h"
#include "check/step_bounds.h"
#include "cli/cli.h"
#include "controls/engine_actuators.h"
#include "engines/describe.h"

namespace assay::cli {
namespace {

// How many times `part` goes into `whole`, if that is a whole number within rounding.
std::optional<long long> whole_number_of(double whole, double part) {
  const double ratio = whole / part;
  const double nearest = std::round(ratio);
  if (nearest < 1 || nearest > kMostRunSteps || std::abs(ratio - nearest) > 1e-9 * nearest) return std::nullopt;
  return std::llround(nearest);
}

// "4 or 6": the multiples of `part` on both sides of `whole`.
std::string neighbours(double whole, double part) {
  const double below = std::floor(whole / part);
  const std::string above = fmt::format("{:.12g}", (below + 1) * part);
  return below < 1 ? above : fmt::format("{:.12g} or {}", below * part, above);
}

}  // namespace

SimulateJob prepare(const SimulateOptions& options) {
  SimulateJob job;
  job.timestep_ms = parse_positive("--timestep", options.timestep, "milliseconds");
  job.duration_s = parse_positive("--duration", options.duration, "seconds");
  const std::string sample = options.sample.value_or(options.timestep);
  const double sample_ms = parse_positive("--sample", sample, "milliseconds");
  for (const auto& [option, given, ms] :
       {std::tuple("--timestep", options.timestep, job.timestep_ms), std::tuple("--sample", sample, sample_ms)}) {
    const std::string obstacle = milliseconds_obstacle(ms);
    if (!obstacle.empty()) throw InputError(fmt::format("{} is {} ms: {}", option, given, obstacle));
  }
  if (const std::string obstacle = duration_obstacle(job.duration_s, job.timestep_ms); !obstacle.empty()) {
    throw InputError(fmt::format("--duration is {} s: {}", options.duration, obstacle));
  }
  const auto per_sample = whole_number_of(sample_ms, job.timestep_ms);
  if (!per_sample) {
    throw InputError(fmt::format("--sample is {} ms, which is not a whole number of timesteps of {} ms: use {}", sample,
                                 options.timestep, neighbours(sample_ms, job.timestep_ms)));
  }
  job.steps_per_sample = *per_sample;
  const auto samples = whole_number_of(job.duration_s * 1000, sample_ms);
  if (!samples) {
    throw InputError(fmt::format("--duration is {} s, which is not a whole number of {} of {} ms: use {}",
                                 options.duration, options.sample ? "samples" : "timesteps", sample,
                                 neighbours(job.duration_s, sample_ms / 1000)));
  }
  job.steps = *samples * job.steps_per_sample;

  const bool contacts = parse_switch("--contacts", options.contacts);
  const bool gravity = parse_switch("--gravity", options.gravity);
  const ControlSpec control = control_given(options.control, options.policy).value_or(ControlSpec());
  job.contender = Registry::instance().resolve(options.engine, parse_settings(options.set));
  job.contender.settings.timestep = job.timestep_ms / 1000;
  job.model = load(options.model);
  if (!contacts) job.model = without_contacts(std::move(job.model));
  if (!gravity) job.model = without_gravity(std::move(job.model));
  job.control = make_control(job.model, control);
  job.control->check_timestep(job.contender.settings.timestep);
  const Capabilities capabilities = job.contender.engine->capabilities(job.contender.settings);
  if (control.kind == "actuators") {
    job.feedback = feedback_limitations(job.model, capabilities);
    add_feedback_bound(job.feedback, step_bounds(job.model, job.model.initial));
  }
  job.engine_drives = equip_for(capabilities.actuators, *job.control, job.model);
  return job;
}

void check_fidelity(const SimulateJob& job) {
  std::vector<Limitation> limitations = job.contender.engine->check(job.model, job.contender.settings);
  for (const Limitation& limitation : limitations) {
    if (limitation.fidelity == Fidelity::kRefused) {
      throw InputError(fmt::format("{} refuses {} of '{}': {}", job.contender.name, limitation.element, job.model.name,
                                   limitation.how));
    }
  }
  limitations.insert(limitations.end(), job.feedback.begin(), job.feedback.end());
  tell_notes(job.model);
  for (const std::string& line : approximations(limitations)) {
    message(fmt::format("note: {} approximates {}", job.contender.name, line));
  }
}

}  // namespace assay::cli
