// Geometry of a model in a state, the same for every engine: joint coordinates to bodies and back, anchors and axes in
// the world, joint position error.
#pragma once

#include <vector>

#include "model/model.h"

namespace assay {

// The body frame's pose in the world, from the centre of mass that the state carries.
Pose body_pose(const Body& body, const BodyState& state);

// Fills the bodies of `state` from its joint coordinates: `position` and `velocity` of hinges and slides, and for a
// ball joint the orientation and angular velocity that `state.bodies` already has. Free bodies are read from
// `state.bodies`. Joints are satisfied to rounding.
void bodies_from_joints(const Model& model, State& state);

// A ball joint's coordinates, as ball_rotation() and ball_velocity() give them.
struct BallCoordinates {
  Quat rotation = Quat::Identity();  // from the pose X_PB, in child axes
  Vec3 velocity = Vec3::Zero();      // relative angular velocity in child axes, rad/s
};

// The same with the ball joints' coordinates, in the order of Model::balls, in place of what `state.bodies` has: for
// engines in joint coordinates.
void bodies_from_joints(const Model& model, const std::vector<BallCoordinates>& balls, State& state);

// Fills `position` and `velocity` from the bodies that have mass, and then the massless bodies, whose state on entry is
// not read (except that of a massless free body). A hinge's position is the twist of the relative rotation about its
// axis, a slide's the way along its axis; several joints in a row between two bodies with mass are solved for together,
// in the least squares sense where the bodies do not fit the joints. `position` on entry is the guess that unwraps the
// result and starts that solution: an angle becomes the one nearest to it, so the guess has to be within pi. An empty
// `position` starts at the reference.
void joints_from_bodies(const Model& model, State& state);

// The relative rotation of a ball joint from the pose X_PB, in child axes: identity at the reference.
Quat ball_rotation(const Model& model, const State& state, int ball);
// Its relative angular velocity, in child axes, rad/s.
Vec3 ball_velocity(const Model& model, const State& state, int ball);
// The rotation vector of `rotation`, angle at most pi, rad.
Vec3 rotation_vector(const Quat& rotation);

// The reference configuration at rest.
State reference_state(const Model& model);

// One hinge or slide in the world, computed from each of its two bodies. Engines in joint coordinates agree on both to
// rounding, except that the anchors of a slide are apart along its axis.
struct JointFrames {
  Vec3 p_WJ_parent, p_WJ_child;      // anchor carried by the parent, by the child, m
  Vec3 axis_W_parent, axis_W_child;  // unit
};
JointFrames joint_frames(const Model& model, const State& state, int joint);

// The anchor and axis in the parent's body frame (world for roots), constant.
Vec3 anchor_in_parent(const Model& model, int joint);
Vec3 axis_in_parent(const Model& model, int joint);

// Torque of a hinge's own spring and damper, Nm; a slide's force, N.
double spring_torque(const Joint& joint, double position, double velocity);
// Torque of a ball joint's own spring and damper on the child, in child axes, Nm; its opposite acts on the parent.
Vec3 ball_spring_torque(const BallJoint& ball, const Quat& rotation, const Vec3& velocity);

// Length of a sum of joint positions, and its derivative: of a tendon, of an actuator's transmission.
double sum_of_terms(const std::vector<JointTerm>& terms, const std::vector<double>& of_joints);
// Tension of a tendon's own spring and damper.
double tendon_tension(const Tendon& tendon, double length, double speed);

// Exact inertia of a homogeneous capsule about its centre, axis z: (Ixx = Iyy, Izz) in kg m^2.
Vec3 capsule_inertia(double mass, double radius, double half_length);

// Principal inertia: I_B = R diag R^T with R a right-handed rotation. R is the identity for principal axes.
struct PrincipalInertia {
  Quat q_BI = Quat::Identity();
  Vec3 diagonal = Vec3::Ones();
};
PrincipalInertia principal_inertia(const Mat3& I_B);

}  // namespace assay
