// Geometry of a model in a state, the same for every engine: joint coordinates to bodies and back, anchors and axes in
// the world, joint position error.
#pragma once

#include <vector>

#include "model/model.h"

namespace assay {

// The body frame's pose in the world, from the centre of mass that the state carries.
Pose body_pose(const Body& body, const BodyState& state);

// Fills the hinged bodies of `state` from its `angle` and `rate`; free bodies are read from `state.bodies`. Joints are
// satisfied to rounding.
void bodies_from_joints(const Model& model, State& state);

// Fills `angle` and `rate` from the bodies: the angle is the twist of the relative rotation about the hinge axis, the
// rate the relative angular velocity along the mean of the two bodies' axes. `angle` on entry is the guess that unwraps
// the result: the new angle is the one nearest to it, so the guess has to be within pi. An empty `angle` starts at the
// reference.
void joints_from_bodies(const Model& model, State& state);

// The reference configuration at rest.
State reference_state(const Model& model);

// One hinge in the world, computed from each of its two bodies. Engines in joint coordinates agree on both to rounding.
struct HingeFrames {
  Vec3 p_WJ_parent, p_WJ_child;      // anchor carried by the parent, by the child, m
  Vec3 axis_W_parent, axis_W_child;  // unit
};
HingeFrames hinge_frames(const Model& model, const State& state, int hinge);

// The anchor and axis in the parent's body frame (world for roots), constant.
Vec3 anchor_in_parent(const Model& model, int hinge);
Vec3 axis_in_parent(const Model& model, int hinge);

// Torque of a hinge's own spring and damper, Nm.
double spring_torque(const Hinge& hinge, double angle, double rate);

// Exact inertia of a homogeneous capsule about its centre, axis z: (Ixx = Iyy, Izz) in kg m^2.
Vec3 capsule_inertia(double mass, double radius, double half_length);

// Principal inertia: I_B = R diag R^T with R a right-handed rotation. R is the identity for principal axes.
struct PrincipalInertia {
  Quat q_BI = Quat::Identity();
  Vec3 diagonal = Vec3::Ones();
};
PrincipalInertia principal_inertia(const Mat3& I_B);

}  // namespace assay
