// The measure 'drift': how far conserved quantities drift over a run, and hidden damping.
#include <algorithm>
#include <utility>

#include "measures/damping.h"
#include "measures/measure.h"
#include "measures/mechanics.h"
#include "measures/trend.h"
#include "model/joint.h"

namespace assay {
namespace {

std::string drift_obstacle(const MeasuredSystem& system) {
  return conserved_quantities(system.model, !system.passive).any()
             ? ""
             : "conserves neither energy nor momentum: leave 'drift' out of its measures";
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

Measured drift_values(const MeasuredRun& run) {
  std::vector<Value> values;
  std::vector<double> time;
  time.reserve(run.states.size());
  for (const State& state : run.states) time.push_back(state.time);
  const Conserved conserved = conserved_quantities(run.model, !run.passive);
  for (const Drift::Quantity& quantity : drift(run.model, conserved, run.states).quantities) {
    values.push_back({quantity.name + "_drift", quantity.unit, quantity.absolute});
    if (quantity.relative) values.push_back({quantity.name + "_drift_relative", "1", quantity.relative});
    if (const auto rate = robust_slope(time, quantity.deviation, run.seed)) {
      values.push_back({quantity.name + "_drift_rate", rate_unit(quantity.unit), rate->value, rate->low, rate->high});
    }
  }
  if (conserved.energy) {
    if (const auto rate = hidden_damping(run)) {
      values.push_back({"damping_rate", "1/s", rate->value, rate->low, rate->high});
    }
  }
  return {std::move(values)};
}

}  // namespace

Measure drift_measure() {
  using namespace rows;
  return {
      .name = "drift",
      .reads = Reads::kRun,
      .values =
          {{"energy_drift", "J", "Energy drift", "energy drift", kLow, kPlot, kLimit,
            "largest deviation of the total energy from its initial value over the run", 2},
           {"angular_momentum_drift", "kg m^2/s", "Angular momentum drift", "angular momentum drift", kLow, kPlot,
            kLimit, "largest deviation of the conserved angular momentum from its initial value over the run", 2},
           {"linear_momentum_drift", "kg m/s", "Linear momentum drift", "linear momentum drift", kLow, kPlot, kLimit,
            "largest deviation of the linear momentum from its initial value over the run", 2},
           {"damping_rate", "1/s", "Hidden damping", "hidden damping", kNone, kNo, kNo,
            "rate at which velocities decay although the model has no damping; negative when energy is gained", 5},
           {"energy_drift_relative", "1", "Energy drift, relative", "relative energy drift", kLow, kNo, kLimit,
            "energy drift divided by the initial kinetic energy", 9},
           {"angular_momentum_drift_relative", "1", "Angular momentum drift, relative",
            "relative angular momentum drift", kLow, kNo, kLimit,
            "angular momentum drift divided by the momentum's scale", 9},
           {"linear_momentum_drift_relative", "1", "Linear momentum drift, relative", "relative linear momentum drift",
            kLow, kNo, kLimit, "linear momentum drift divided by the momentum's scale", 9},
           {"energy_drift_rate", "W", "Secular energy drift", "secular energy drift", kNone, kNo, kNo,
            "slope of the total energy over the whole run, by robust regression: what an oscillation does not add to",
            9},
           {"angular_momentum_drift_rate", "N m", "Secular angular momentum drift", "secular angular momentum drift",
            kNone, kNo, kNo, "slope of the conserved angular momentum over the whole run, by robust regression", 9},
           {"linear_momentum_drift_rate", "N", "Secular linear momentum drift", "secular linear momentum drift", kNone,
            kNo, kNo, "slope of the linear momentum over the whole run, by robust regression", 9}},
      .obstacle = drift_obstacle,
      .of_run = drift_values};
}

}  // namespace assay
