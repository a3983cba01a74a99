// Joint springs: how adapters describe them, and whether they add forces of their own to the torques that they are
// given.
#pragma once

#include <algorithm>
#include <string>

#include "engines/engine.h"
#include "model/actuator_force.h"
#include "model/joint_rows.h"

namespace assay {

// Joint springs and dampers in the fairness table: the engine's own, or explicit torques of the adapter.
inline void describe_springs(Capabilities& capabilities, bool native, const std::string& native_note) {
  capabilities.springs = native ? SpringKind::kNative : SpringKind::kExplicit;
  capabilities.spring_note = native ? native_note : "torque from the state at the step's start, held for the step";
}

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
