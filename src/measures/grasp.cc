#include "measures/grasp.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "measures/measure.h"
#include "measures/watch.h"

namespace assay {

double slip(const State& start, const State& state, int object, int hand) {
  const auto in_hand = [&](const State& at) -> Vec3 {
    const BodyState& palm = at.bodies[static_cast<size_t>(hand)];
    return palm.q_WB.conjugate() * (at.bodies[static_cast<size_t>(object)].p_WBcm - palm.p_WBcm);
  };
  return (in_hand(state) - in_hand(start)).norm();
}

void add_to_grasp(Grasp& grasp, const State& start, const State& state, const GraspBodies& bodies) {
  assert(bodies.drop_m > 0);
  const double moved = slip(start, state, bodies.object, bodies.hand);
  grasp.slip = std::max(grasp.slip, moved);
  if (moved > bodies.drop_m && !grasp.dropped_at) grasp.dropped_at = state.time;
}

LargestHeld largest_held(const std::vector<HeldAt>& timesteps) {
  LargestHeld largest;
  bool hole = false;
  for (const HeldAt& at : timesteps) {
    hole |= !at.held;
    if (!at.held) continue;
    largest.any = at.timestep_ms;
    if (!hole) largest.without_hole = at.timestep_ms;
  }
  return largest;
}

namespace {

std::string grasp_obstacle(const MeasuredSystem& system) {
  return system.grasp.object >= 0
             ? ""
             : "does not say who is to stay in whose hand: give grasp = {object = \"...\", hand = \"...\"}, names of "
               "bodies";
}

std::vector<Parameter> grasp_parameters(const MeasuredSystem& system) {
  return {system.grasp.object, system.grasp.hand, system.grasp.drop_m};
}

// A run that diverges did not hold its object, even if the object was still in the hand.
Measured grasp_values(const MeasuredRun& run) {
  const Grasp& found = run.watched->grasp;
  std::vector<Value> values = {{"grasp_held", "1", !run.diverged && found.held() ? 1.0 : 0.0}};
  if (!run.diverged) values.push_back({"grasp_slip", "m", found.slip});
  if (found.dropped_at) values.push_back({"drop_time", "s", *found.dropped_at - run.states.front().time});
  return {std::move(values)};
}

}  // namespace

Measure grasp_measure() {
  using namespace rows;
  return {
      .name = "grasp",
      .reads = Reads::kRun,
      .version = 1,
      .values = {{"grasp_slip", "m", "Grasp slip", "slip", kLow, kPlot, kLimit,
                  "largest distance that the object has moved in the hand over the run", 4},
                 {"grasp_held", "1", "Grasp held", "object held", kHigh, kNo, kNo,
                  "1 when the object stayed in the hand for the whole run, else 0", 4, kShare},
                 {"drop_time", "s", "Drop time", "drop time", kHigh, kNo, kNo, "when the object left the hand", 4,
                  kLeast},
                 {"largest_stable_timestep", "ms", "Largest stable timestep", "largest stable timestep", kHigh, kNo,
                  kNo, "largest timestep at which the object stays in the hand", 4},
                 {"stable_up_to_timestep", "ms", "Stable up to", "stable up to", kHigh, kNo, kNo,
                  "largest timestep at which the object stays in the hand, as it does at every smaller one measured",
                  4}},
      .obstacle = grasp_obstacle,
      .parameters = grasp_parameters,
      .of_run = grasp_values,
      .of_failed_runs = true,
      .reads_between = true,
      .held = "grasp_held"};
}

}  // namespace assay
