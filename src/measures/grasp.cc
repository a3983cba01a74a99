#include "measures/grasp.h"

#include <algorithm>
#include <cassert>

namespace assay {

double slip(const State& start, const State& state, int object, int hand) {
  const auto in_hand = [&](const State& at) -> Vec3 {
    const BodyState& palm = at.bodies[static_cast<size_t>(hand)];
    return palm.q_WB.conjugate() * (at.bodies[static_cast<size_t>(object)].p_WBcm - palm.p_WBcm);
  };
  return (in_hand(state) - in_hand(start)).norm();
}

Grasp grasp(const std::vector<State>& states, const GraspBodies& bodies) {
  assert(!states.empty() && bodies.drop_m > 0);
  Grasp result;
  for (const State& state : states) {
    const double moved = slip(states.front(), state, bodies.object, bodies.hand);
    result.slip = std::max(result.slip, moved);
    if (moved > bodies.drop_m && !result.dropped_at) result.dropped_at = state.time;
  }
  return result;
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

}  // namespace assay
