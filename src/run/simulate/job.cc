#include "run/simulate/job.h"

#include <cmath>
#include <tuple>

#include <fmt/format.h>

#include "base/console.h"
#include "base/errors.h"
#include "base/option_values.h"
#include "base/paths.h"
#include "base/run_bounds.h"
#include "base/text.h"
#include "check/feedback.h"
#include "check/step_bounds.h"
#include "controls/engine_actuators.h"
#include "engines/describe.h"
#include "engines/facts.h"
#include "load/mjcf.h"

namespace assay {
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

SimulateJob prepare(const SimulateRequest& request) {
  SimulateJob job;
  job.timestep_ms = parse_positive("--timestep", request.timestep, "milliseconds");
  job.duration_s = parse_positive("--duration", request.duration, "seconds");
  const std::string sample = request.sample.value_or(request.timestep);
  const double sample_ms = parse_positive("--sample", sample, "milliseconds");
  for (const auto& [option, given, ms] :
       {std::tuple("--timestep", request.timestep, job.timestep_ms), std::tuple("--sample", sample, sample_ms)}) {
    const std::string obstacle = milliseconds_obstacle(ms);
    if (!obstacle.empty()) throw InputError(fmt::format("{} is {} ms: {}", option, given, obstacle));
  }
  if (const std::string obstacle = duration_obstacle(job.duration_s, job.timestep_ms); !obstacle.empty()) {
    throw InputError(fmt::format("--duration is {} s: {}", request.duration, obstacle));
  }
  const auto per_sample = whole_number_of(sample_ms, job.timestep_ms);
  if (!per_sample) {
    throw InputError(fmt::format("--sample is {} ms, which is not a whole number of timesteps of {} ms: use {}", sample,
                                 request.timestep, neighbours(sample_ms, job.timestep_ms)));
  }
  job.steps_per_sample = *per_sample;
  const auto samples = whole_number_of(job.duration_s * 1000, sample_ms);
  if (!samples) {
    throw InputError(fmt::format("--duration is {} s, which is not a whole number of {} of {} ms: use {}",
                                 request.duration, request.sample ? "samples" : "timesteps", sample,
                                 neighbours(job.duration_s, sample_ms / 1000)));
  }
  job.steps = *samples * job.steps_per_sample;

  const bool contacts = parse_switch("--contacts", request.contacts);
  const bool gravity = parse_switch("--gravity", request.gravity);
  job.contender = Registry::instance().resolve(request.contender, parse_settings(request.settings));
  job.contender.settings.timestep = job.timestep_ms / 1000;
  job.model = load_model(find_model(request.model), request.load);
  if (!contacts) job.model = without_contacts(std::move(job.model));
  if (!gravity) job.model = without_gravity(std::move(job.model));
  job.control = make_control(job.model, request.control);
  job.control->check_timestep(job.contender.settings.timestep);
  const Capabilities capabilities = job.contender.engine->capabilities(job.contender.settings);
  if (request.control.kind == "actuators") {
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

}  // namespace assay
