// Whether an adapter adds forces of its own to the torques that it is given.
#pragma once

#include <algorithm>

#include "engines/engine.h"
#include "model/actuator_force.h"
#include "model/joint_rows.h"

namespace assay {

// Whether torques have to be given before every step, even if they are zero: the adapter adds to them what it computes
// itself, or gives the engine's own actuators what follows time. The springs of ball joints and tendons may be its own
// whatever it does with those of hinges.
inline bool adapter_adds_torques(const Model& model, const Capabilities& capabilities) {
  return (model.has_springs() && capabilities.springs == SpringKind::kExplicit) ||
         std::ranges::any_of(model.balls, &BallJoint::has_spring) ||
         std::ranges::any_of(model.tendons, &Tendon::has_spring) || has_joint_rows(model) ||
         (capabilities.actuators && std::ranges::any_of(model.actuators, follows_time));
}

}  // namespace assay
