// The largest timestep that explicit springs and dampers stand, from the model alone.
//
// Semi-implicit Euler with forces -K q - D v of the step's start, v' = v - h M^-1 (K q + D v), q' = q + h v', is stable
// in a configuration if and only if 4 M - 2 h D - h^2 K is positive definite (M, D, K symmetric, D and K positive
// semidefinite: each mode's characteristic polynomial m (z - 1)^2 + h d z'(z - 1) + h^2 k z then meets Jury's
// conditions, and leaves them at z = -1). For one damper alone that is h < 2 I / B, for one spring alone h < 2 / omega.
// M is the joint-space inertia in one configuration with armature; I is what the damper feels while the other joints
// are free, 1 / (g^T M^-1 g). Couplings of joints are obeyed; connects, welds and contacts are left out: they only add
// inertia. Where they hold the other joints, as a grasp does, I is the diagonal of M.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "model/model.h"

namespace assay {

// One spring, damper or servo.
struct ExplicitSpring {
  std::string element = {};  // "joint 'knee'", "tendon 'flexor'", "actuator 'knee_p'"
  double inertia = 0;        // kg m^2 (kg for slides), as it feels it while the other joints are free
  double held_inertia = 0;   // the same while they are held; of several joints or a coupled one: not known, 0
  double stiffness = 0;      // F/u
  double damping = 0;        // F s/u
  double share = 0;          // of the mode that becomes unstable first, 0 to 1; all of StepBounds sum to 1

  // Alone, s: 2 I / B, 2 / omega, and both together 4 / (b + sqrt(b^2 + 4 omega^2)) with b = B / I; infinite without.
  double damper_step() const;
  double spring_step() const;
  double step() const;
  double held_damper_step() const;  // 2 I / B while the other joints are held; infinite where that is not known
};

struct StepBound {
  double largest = std::numeric_limits<double>::infinity();  // s, of all springs and dampers together
  std::vector<ExplicitSpring> springs;                       // smallest step() first
  double frequency = 0;                                      // Hz, of the stiffest mode without damping
  double decay = 0;                                          // 1/s, of the fastest mode without springs

  const ExplicitSpring* critical() const;  // with the largest share; none without springs
};

struct StepBounds {
  StepBound joints;         // springs and dampers of joints and tendons
  StepBound with_feedback;  // the same with the actuators' position and velocity feedback; equal without any
  bool has_feedback = false;
  bool singular = false;  // the inertia has no inverse in this configuration: no bounds
};

// In the configuration of `state`.
StepBounds step_bounds(const Model& model, const State& state);

}  // namespace assay
