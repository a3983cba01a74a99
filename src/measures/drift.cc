// The measure 'drift': how far conserved quantities drift over a run, and hidden damping.
#include <algorithm>

#include "measures/damping.h"
#include "measures/mechanics.h"
#include "measures/run_measures.h"
#include "measures/trend.h"
#include "model/joint.h"

namespace assay {
namespace {

std::string drift_obstacle(const Model& model, bool passive) {
  return conserved_quantities(model, !passive).any() ? "" : "conserves neither energy nor momentum";
}

// Where all the energy is kinetic, its decay has a rate.
std::optional<Interval> hidden_damping(const MeasuredRun& run) {
  const auto is_spring = [](const auto& joint) { return joint.stiffness != 0; };
  const bool springs = any_joint(run.model, is_spring) || std::ranges::any_of(run.model.tendons, is_spring);
  if (!run.model.gravity.isZero(0) || springs) return std::nullopt;
  std::vector<double> time, energy;
  time.reserve(run.states.size());
  energy.reserve(run.states.size());
  for (const State& state : run.states) {
    time.push_back(state.time);
    energy.push_back(kinetic_energy(run.model, state));
  }
  return damping_rate(time, energy, run.seed);
}

// The unit of a quantity a second.
std::string rate_unit(const std::string& unit) {
  if (unit == "J") return "W";
  return unit == "kg m/s" ? "N" : "N m";
}

std::vector<RunValue> drift_values(const MeasuredRun& run) {
  std::vector<RunValue> values;
  std::vector<double> time;
  time.reserve(run.states.size());
  for (const State& state : run.states) time.push_back(state.time);
  const Conserved conserved = conserved_quantities(run.model, !run.passive);
  for (const Drift::Quantity& quantity : drift(run.model, conserved, run.states).quantities) {
    values.push_back({quantity.name + "_drift", quantity.unit, quantity.absolute, {}, {}});
    if (quantity.relative) values.push_back({quantity.name + "_drift_relative", "1", quantity.relative, {}, {}});
    if (const auto rate = robust_slope(time, quantity.deviation, run.seed)) {
      values.push_back({quantity.name + "_drift_rate", rate_unit(quantity.unit), rate->value, rate->low, rate->high});
    }
  }
  if (conserved.energy) {
    if (const auto rate = hidden_damping(run)) {
      values.push_back({"damping_rate", "1/s", rate->value, rate->low, rate->high});
    }
  }
  return values;
}

}  // namespace

RunMeasure drift_measure() { return {"drift", drift_obstacle, drift_values}; }

}  // namespace assay
