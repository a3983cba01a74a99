#include "results/values.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "measures/batch.h"

namespace assay {

std::vector<std::string> values_not_given(std::string_view contact_forces) {
  if (contact_forces == "none") {
    return {"contact_depth", "signorini_residual", "cone_violation", "dissipation_residual"};
  }
  if (contact_forces == "normal") return {"cone_violation", "dissipation_residual"};
  return {};
}

std::string_view better_text(Better better) {
  constexpr std::array<std::string_view, 3> kTexts = {"low", "high", "none"};
  return kTexts.at(static_cast<size_t>(better));
}

const std::vector<ValueInfo>& value_catalogue() {
  using enum Better;
  constexpr bool kPlot = true, kLimit = true, kNo = false;
  static const std::vector<ValueInfo> kRows = {
      {"truth_error_max", "m", "Error against the reference solution", "error", kLow, "truth", kPlot, kLimit,
       "mean distance of the bodies from an independent, error-controlled solution, the largest of the run's samples"},
      {"truth_error_rms", "m", "Error against the reference solution, RMS", "error (RMS)", kLow, "truth", kPlot, kLimit,
       "mean distance of the bodies from an independent, error-controlled solution, root mean square over the run"},
      {"truth_error", "m", "Error against the reference solution, at the end", "error at the end", kLow, "truth", kPlot,
       kLimit, "mean distance of the bodies from an independent, error-controlled solution at the end of the run"},
      {"consistency", "m", "Self-consistency error", "self-consistency error", kLow, "consistency", kPlot, kLimit,
       "mean distance of the bodies from the contender's own fine-step run, over short pieces of it"},
      {"energy_drift", "J", "Energy drift", "energy drift", kLow, "drift", kPlot, kLimit,
       "largest deviation of the total energy from its initial value over the run"},
      {"angular_momentum_drift", "kg m^2/s", "Angular momentum drift", "angular momentum drift", kLow, "drift", kPlot,
       kLimit, "largest deviation of the conserved angular momentum from its initial value over the run"},
      {"linear_momentum_drift", "kg m/s", "Linear momentum drift", "linear momentum drift", kLow, "drift", kPlot,
       kLimit, "largest deviation of the linear momentum from its initial value over the run"},
      {"joint_dislocation_max", "m", "Joint position error", "joint position error", kLow, "violation", kPlot, kLimit,
       "largest distance between the two anchors of a hinge over the run"},
      {"joint_dislocation_rms", "m", "Joint position error, RMS", "joint position error (RMS)", kLow, "violation", kNo,
       kLimit, "largest distance between the two anchors of a hinge in each sample, root mean square over the run"},
      {"joint_misalignment_max", "rad", "Joint axis error", "joint axis error", kLow, "violation", kPlot, kLimit,
       "largest angle between the two axes of a hinge over the run"},
      {"joint_misalignment_rms", "rad", "Joint axis error, RMS", "joint axis error (RMS)", kLow, "violation", kNo,
       kLimit, "largest angle between the two axes of a hinge in each sample, root mean square over the run"},
      {"limit_violation_max", "rad", "Joint limit violation", "joint limit violation", kLow, "violation", kPlot, kLimit,
       "largest angle of a joint beyond its limit over the run"},
      {"limit_violation_rms", "rad", "Joint limit violation, RMS", "joint limit violation (RMS)", kLow, "violation",
       kNo, kLimit, "largest angle of a joint beyond its limit in each sample, root mean square over the run"},
      {"penetration_max", "m", "Penetration", "penetration", kLow, "violation", kPlot, kLimit,
       "largest depth of two colliding shapes in each other over the run"},
      {"penetration_rms", "m", "Penetration, RMS", "penetration (RMS)", kLow, "violation", kNo, kLimit,
       "largest depth of two colliding shapes in each other in each sample, root mean square over the run"},
      {"rebound", "1", "Rebound", "rebound", kLow, "violation", kNo, kLimit,
       "part of its speed with which a ball of the size of the system's smallest shape leaves a plane at 1 m/s; no "
       "model "
       "has restitution, so 0 is right"},
      {"contact_depth", "m", "Depth of pressed contacts", "depth of contacts", kLow, "violation", kNo, kNo,
       "overlap at the contact points, in the mean by their normal forces; rigid contact has none"},
      {"signorini_residual", "m/s", "Signorini residual", "Signorini residual", kNone, "violation", kNo, kNo,
       "speed along the normal of shapes that contact forces press together, in the mean by these forces; rigid "
       "contact "
       "has none, and neither has a soft one at rest: look at the depth, too"},
      {"cone_violation", "1", "Friction beyond the cone", "friction beyond the cone", kLow, "violation", kNo, kNo,
       "friction above the coefficient times the normal force, over the normal force, in the mean by these forces"},
      {"dissipation_residual", "m/s", "Maximum dissipation residual", "dissipation residual", kNone, "violation", kNo,
       kNo,
       "speed of slip times the part of the largest friction that does not act against it, in the mean by forces; "
       "where "
       "nothing slips there is none"},
      {"grasp_slip", "m", "Grasp slip", "slip", kLow, "grasp", kPlot, kLimit,
       "largest distance that the object has moved in the hand over the run"},
      {"grasp_held", "1", "Grasp held", "object held", kHigh, "grasp", kNo, kNo,
       "1 when the object stayed in the hand for the whole run, else 0"},
      {"drop_time", "s", "Drop time", "drop time", kHigh, "grasp", kNo, kNo, "when the object left the hand"},
      {"largest_stable_timestep", "ms", "Largest stable timestep", "largest stable timestep", kHigh, "grasp", kNo, kNo,
       "largest timestep at which the object stays in the hand"},
      {"stable_up_to_timestep", "ms", "Stable up to", "stable up to", kHigh, "grasp", kNo, kNo,
       "largest timestep at which the object stays in the hand, as it does at every smaller one measured"},
      {"damping_rate", "1/s", "Hidden damping", "hidden damping", kNone, "drift", kNo, kNo,
       "rate at which velocities decay although the model has no damping; negative when energy is gained"},
      {"agreement", "m", "Distance from the others", "distance from the others", kNone, "agreement", kNo, kNo,
       "median distance from the other contenders' fine-step runs at the end of the run"},
      {"parting_time", "s", "Separation time", "separation time", kHigh, "agreement", kNo, kNo,
       "median time up to which the other contenders' fine-step runs stay within 1 mm"},
      {"fall_rate", "1", "Fall rate", "fall rate", kLow, "transfer", kNo, kLimit,
       "share of the runs under a policy in which the robot fell, or the engine failed"},
      {"time_up", "s", "Time until a fall", "time up", kHigh, "transfer", kNo, kNo,
       "time until the robot fell under its policy, or the run's length"},
      {"velocity_error", "m/s", "Velocity error", "velocity error", kLow, "transfer", kNo, kLimit,
       "mean distance of the base's planar velocity from the commanded one, in its heading, while the robot is up"},
      {"turning_error", "rad/s", "Turning error", "turning error", kLow, "transfer", kNo, kLimit,
       "mean distance of the base's rate about the vertical from the commanded one while the robot is up"},
      {"foot_slip", "m/s", "Foot slip", "foot slip", kLow, "transfer", kNo, kLimit,
       "mean horizontal speed of the shapes' lowest points while they touch the ground and the robot is up"},
      {"joint_power", "W", "Joint power", "joint power", kNone, "transfer", kNo, kNo,
       "mean over the run of the sum over joints of |torque x rate|, of the torques that the policy asked for"},
      {"policy_time", "us", "Policy time", "policy time", kNone, "transfer", kNo, kNo,
       "wall time of a control step of the policy, outside the engine's clock, beside other workers"},
      {"policy_parting_time", "s", "Separation time from training", "separation from training", kHigh, "transfer", kNo,
       kNo, "time until the run is more than 1 mm from that of the contender that the policy was trained in"},
      {"run_time", "s", "Run time", "run time", kLow, "scaling", kNo, kNo, "processor time of all steps of the run"},
      {"steps_per_second", "1/s", "Steps per second", "steps per second", kHigh, "scaling", kNo, kNo,
       "steps of the whole run over their processor time"},
      {"scaling_exponent", "1", "Scaling exponent", "scaling exponent", kLow, "scaling", kNo, kNo,
       "power of the number of bodies with which the run time grows"},
      {"energy_drift_relative", "1", "Energy drift, relative", "relative energy drift", kLow, "drift", kNo, kLimit,
       "energy drift divided by the initial kinetic energy"},
      {"angular_momentum_drift_relative", "1", "Angular momentum drift, relative", "relative angular momentum drift",
       kLow, "drift", kNo, kLimit, "angular momentum drift divided by the momentum's scale"},
      {"linear_momentum_drift_relative", "1", "Linear momentum drift, relative", "relative linear momentum drift", kLow,
       "drift", kNo, kLimit, "linear momentum drift divided by the momentum's scale"},
      {"energy_drift_rate", "W", "Secular energy drift", "secular energy drift", kNone, "drift", kNo, kNo,
       "slope of the total energy over the whole run, by robust regression: what an oscillation does not add to"},
      {"angular_momentum_drift_rate", "N m", "Secular angular momentum drift", "secular angular momentum drift", kNone,
       "drift", kNo, kNo, "slope of the conserved angular momentum over the whole run, by robust regression"},
      {"linear_momentum_drift_rate", "N", "Secular linear momentum drift", "secular linear momentum drift", kNone,
       "drift", kNo, kNo, "slope of the linear momentum over the whole run, by robust regression"},
      {"raw_speed", "kHz", "Raw speed", "raw speed", kHigh, "raw_speed", kNo, kNo,
       "the engine's own step calls per second"},
      {"step_time", "us", "Step time", "step time", kLow, "raw_speed", kNo, kNo,
       "time of one call of the engine's step, in the mean over the run"},
      {"realtime_factor", "1", "Realtime factor", "speed", kHigh, "raw_speed", kNo, kNo,
       "simulated seconds per second of computing: timestep divided by step time"},
      {"step_p50", "us", "Step time, median", "median step", kLow, "raw_speed", kNo, kNo,
       "median over the run's steps, each timed by itself; the clock's own cost is included"},
      {"step_p99", "us", "Step time, 99th percentile", "99th percentile step", kLow, "raw_speed", kNo, kNo,
       "time that 99 of 100 steps of the run do not exceed, each timed by itself"},
      {"step_worst", "us", "Step time, worst", "worst step", kLow, "raw_speed", kNo, kNo,
       "longest step of the run; of each step the least of three passes, so that it is the engine's and not the "
       "machine's"},
      {"input_time", "us", "Input time", "input time", kLow, "raw_speed", kNo, kNo,
       "time a step outside the clock: torques, the state that they are computed from, and springs of the adapter; an "
       "engine's own springs cost step time instead"},
      {"coverage", "1", "Coverage", "coverage", kNone, "raw_speed", kNo, kNo,
       "share of the run that was timed; the same windows for all contenders of a system at a timestep"},
      {"restart_floor", "m", "Restart floor", "restart floor", kNone, "consistency", kNo, kNo,
       "self-consistency error at the fine-step run's own timestep: hidden state and rounding, not integration"},
      {"truth_floor", "m", "Error floor", "error floor", kNone, "truth", kNo, kNo,
       "error that stays however small the timestep, far above rounding: not an integration error"},
      {"truth_rounding", "m", "Rounding part of the error", "rounding", kNone, "truth", kNo, kNo,
       "estimate of the part of the error against the reference solution that rounding explains"},
      {"consistency_floor", "m", "Near the floor", "floor", kNone, "consistency", kNo, kNo,
       "restart floor, or the error at which the curve stops falling, given where the self-consistency error is so "
       "close "
       "to it that it says little of the timestep"},
      {"consistency_bound", "m", "Bound of the self-consistency error", "bound", kNone, "consistency", kNo, kNo,
       "upper bound of the self-consistency error near the floor: the measured distance and the floor together"},
      {"aa_ratio", "1", "A/A ratio", "A/A ratio", kNone, "raw_speed", kNo, kNo,
       "step time of one contender measured under two names: its distance from 1 is the error of the timing"},
      {"time_ratio", "1", "Step time ratio", "step time ratio", kNone, "raw_speed", kNo, kNo,
       "step time over that of the contender that the campaign names for comparison"},
      {"truth_order", "1", "Observed order", "observed order", kNone, "truth", kNo, kNo,
       "slope of the error against the reference solution between this timestep and the next smaller one"},
      {"clock_share", "1", "Clock share", "clock share", kNone, "raw_speed", kNo, kNo,
       "share of the timed span that reading the clock takes"},
      {"engine_share", "1", "Engine share", "engine share", kNone, "raw_speed", kNo, kNo,
       "share of the cell's wall time inside the engine's steps"},
      {"sample_steps", "1", "Steps a window", "steps a window", kNone, "raw_speed", kNo, kNo,
       "engine steps of the shortest window that was timed"},
      {"window_share", "1", "Share of each window", "share of each window", kNone, "raw_speed", kNo, kNo,
       "share of each equal part of the run that was to be timed"},
      {"repeated_rounds", "1", "Repeated turns", "repeated turns", kNone, "raw_speed", kNo, kNo,
       "turns that were taken again because the machine did something else meanwhile"},
      {"disturbed_rounds", "1", "Disturbed rounds", "disturbed rounds", kNone, "raw_speed", kNo, kNo,
       "rounds whose turn was disturbed however often it was repeated; their times count all the same"},
      {"step_clock_share", "1", "Clock share of single steps", "clock share of single steps", kNone, "raw_speed", kNo,
       kNo, "share of the median step, timed by itself, that reading the clock takes"},
      {"batch_rate", "1/s", "World-steps per second", "world-steps per second", kHigh, "batch", kNo, kNo,
       "steps per second times the number of worlds that are stepped together"},
      {"batch_step_time", "us", "Step time of all worlds", "step of all worlds", kLow, "batch", kNo, kNo,
       "time of one step of all worlds, in the mean over steps that are asked for at once"},
      {"batch_latency", "us", "Latency", "latency", kLow, "batch", kNo, kNo,
       "time of a single step of all worlds, from the call until all are done"},
      {"batch_memory", "B", "Memory of the worlds", "memory", kLow, "batch", kNo, kNo,
       "memory that all worlds take: the engine's arrays, or what the processes of one world each have for themselves"},
      {"batch_compile_time", "s", "Compile time", "compile time", kLow, "batch", kNo, kNo,
       "time until the first step of so many worlds can be asked for; kernels that were compiled before are loaded"},
      {"batch_equivalence", "m", "Distance from one world", "distance from one world", kLow, "batch", kNo, kNo,
       "largest distance of a body in the batch from the same contender's run of one world, after the same steps from "
       "the "
       "same state"},
      {"batch_bound", "m", "Bound of the distance", "bound", kNone, "batch", kNo, kNo,
       "distance from one world that rounding explains; what is further off has no rate"},
      {"batch_compared", "1", "Compared worlds", "compared worlds", kNone, "batch", kNo, kNo,
       "worlds of the batch that were compared with a run of one world"},
      {"batch_worlds", "1", "Worlds", "worlds", kNone, "batch", kNo, kNo, "worlds that are stepped together"},
      {"batch_processes", "1", "Processes", "processes", kNone, "batch", kNo, kNo,
       "processes, each on a core of its own, that share the worlds of an engine that steps one"}};
  return kRows;
}

bool is_timing(std::string_view measure) { return measure == "raw_speed" || measure == "scaling" || is_batch(measure); }

std::string_view time_of(std::string_view measure) {
  if (is_batch(measure)) return "batch_step_time";
  return measure == "scaling" ? "run_time" : "step_time";
}

const ValueInfo* find_value_info(std::string_view name) {
  const auto& rows = value_catalogue();
  const auto found = std::ranges::find(rows, name, &ValueInfo::name);
  return found == rows.end() ? nullptr : &*found;
}

bool can_limit(std::string_view name) { return value_info(name).limit; }

ValueInfo value_info(std::string_view name) {
  if (const ValueInfo* row = find_value_info(name)) return *row;
  // The self-consistency error of pieces of another length: "consistency_8ms".
  constexpr std::string_view kLength = "consistency_", kUnit = "ms";
  if (name.starts_with(kLength) && name.ends_with(kUnit) &&
      std::isdigit(static_cast<unsigned char>(name[kLength.size()])) != 0) {
    const std::string length(name.substr(kLength.size(), name.size() - kLength.size() - kUnit.size()));
    ValueInfo info = *find_value_info("consistency");
    info.name = name;
    info.label += ", pieces of " + length + " ms";
    info.brief += ", pieces of " + length + " ms";
    return info;
  }
  std::string words(name);
  std::ranges::replace(words, '_', ' ');
  ValueInfo info;
  info.name = name;
  info.label = info.brief = info.meaning = words;
  if (!words.empty()) info.label[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(words[0])));
  return info;
}

std::string value_named(std::string_view name) {
  const auto& rows = value_catalogue();
  for (const auto key : {&ValueInfo::name, &ValueInfo::measure}) {
    const auto found = std::ranges::find(rows, name, key);
    if (found != rows.end()) return found->name;
  }
  return "";
}

std::string value_named(std::string_view name, const std::vector<ValueInfo>& measured) {
  if (find_value_info(name) == nullptr) {
    for (const ValueInfo& row : value_catalogue()) {
      if (row.measure == name && std::ranges::find(measured, row.name, &ValueInfo::name) != measured.end()) {
        return row.name;
      }
    }
  }
  return value_named(name);
}

const std::vector<Term>& glossary() {
  static const std::vector<Term> kTerms = {
#include "glossary.inc"
  };
  return kTerms;
}

}  // namespace assay
