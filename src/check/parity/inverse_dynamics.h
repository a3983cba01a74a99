// Newton and Euler's equations of a model, solved for forces: which joint forces go with given accelerations. It is the
// ruler of parity: it needs no engine, takes O(bodies), and is linear in masses, inertias, armature, damping, stiffness
// and dry friction, so that differences lead back to parameters.
#pragma once

#include <Eigen/Core>

#include "model/model.h"
#include "model/state.h"

namespace assay::parity {

// Positions of a body's generalized speeds in one vector over the model: 1 for a hinge or slide (its velocity), 3 for a
// ball joint (angular velocity relative to the parent, world axes), 6 for a free body (velocity of the centre of mass,
// angular velocity, world axes).
struct SpeedLayout {
  explicit SpeedLayout(const Model& model);

  std::vector<int> first;     // by Model::bodies
  std::vector<int> of_joint;  // by Model::joints
  int count = 0;
};

// The generalized speeds of a state.
Eigen::VectorXd speeds(const Model& model, const SpeedLayout& layout, const State& state);

// Forces (N, Nm, conjugate to the speeds above) that cause the accelerations `acceleration` (derivatives of the speeds)
// in `state`: those of inertia, armature, Coriolis terms, gravity, springs, dampers, dry friction and tendons' springs.
// Contacts, limits and equality constraints are left out. Dry friction acts against the sign of the velocity, and not
// at all at rest.
Eigen::VectorXd inverse_dynamics(const Model& model, const SpeedLayout& layout, const State& state,
                                 const Eigen::VectorXd& acceleration);

}  // namespace assay::parity
