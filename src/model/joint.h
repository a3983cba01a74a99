// What code outside the engines asks about joints, whatever their type: how many speeds they have, what their numbers
// mean, how far a state is off them. A type of joint is added to model.h, kinematics.h and here; beyond the engines and
// the loader also to what solves equations of motion (measures/reference/system.h, check/parity/inverse_dynamics.h)
// and to what draws random states (measures/initial_states.h, check/parity/experiments.h).
//
// Functions of a hinge or slide (`Joint`) and of a ball joint (`BallJoint`) have the same names, and both types name
// alike what both have, so that each_joint() takes one generic lambda. A joint is an element of its model's vectors.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "model/kinematics.h"
#include "model/model.h"

namespace assay {

// ---- all joints but free ones ---------------------------------------------------------------------------------------

// Calls `visit` with every hinge and slide, then with every ball joint.
template <typename SomeModel, typename Visit>
void each_joint(SomeModel& model, const Visit& visit) {
  for (auto& joint : model.joints) visit(joint);
  for (auto& ball : model.balls) visit(ball);
}

template <typename Is>
bool any_joint(const Model& model, const Is& is) {
  bool any = false;
  each_joint(model, [&](const auto& joint) { any = any || is(joint); });
  return any;
}

inline size_t joint_count(const Model& model) { return model.joints.size() + model.balls.size(); }

// ---- the joint of a body --------------------------------------------------------------------------------------------

JointType joint_type(const Model& model, const Body& body);
// Generalized speeds: 6 of a free joint, 3 of a ball joint, else 1.
int speeds_of(JointType type);
int speeds_of(const Body& body);
// Empty for a free body.
std::string joint_name(const Model& model, const Body& body);
// Its anchor in the body's frame, m; a free body's centre of mass.
const Vec3& anchor_of(const Model& model, const Body& body);
double armature_of(const Model& model, const Body& body);
// Null unless it is a hinge.
const Joint* hinge_of(const Model& model, const Body& body);
bool slides(const Model& model, const Body& body);

// ---- words ----------------------------------------------------------------------------------------------------------

// "hinge", "slide", "ball joint".
const char* type_name(const Joint& joint);
const char* type_name(const BallJoint& ball);
// "joint", of one with a coordinate; "ball joint".
const char* noun(const Joint& joint);
const char* noun(const BallJoint& ball);

struct JointUnits {
  const char *position, *force, *stiffness, *damping, *inertia;
};
const JointUnits& units_of(const Joint& joint);
const JointUnits& units_of(const BallJoint& ball);

inline int speeds_of(const Joint& /*joint*/) { return 1; }
inline int speeds_of(const BallJoint& /*ball*/) { return 3; }
inline bool is_slide(const Joint& joint) { return joint.is_slide(); }
inline bool is_slide(const BallJoint& /*ball*/) { return false; }

// ---- in a state -----------------------------------------------------------------------------------------------------

// How far the two bodies of a joint are from what it allows.
struct JointError {
  Vec3 p_WJ_child = Vec3::Zero();  // the anchor that the child carries, m
  Vec3 apart_W = Vec3::Zero();     // from the parent's anchor to it, without a slide's way, m
  double dislocation = 0;          // m, its length
  double misalignment = 0;  // rad, between the axes; of a slide the relative rotation; a ball joint allows every one
};
JointError joint_error(const Model& model, const State& state, const Joint& joint);
JointError joint_error(const Model& model, const State& state, const BallJoint& ball);

inline constexpr double kNoLimit = -std::numeric_limits<double>::infinity();
// How far the joint is beyond its limit, rad or m: negative within, kNoLimit where it has none.
double beyond_limit(const Model& model, const State& state, const Joint& joint);
double beyond_limit(const Model& model, const State& state, const BallJoint& ball);
// The limit of a joint that is beyond it.
double passed_limit(const Model& model, const State& state, const Joint& joint);
double passed_limit(const Model& model, const State& state, const BallJoint& ball);

// J, in the joint's own spring.
double spring_energy(const Model& model, const State& state, const Joint& joint);
double spring_energy(const Model& model, const State& state, const BallJoint& ball);
// J, kinetic, of its armature, which belongs to no body.
double armature_energy(const Model& model, const State& state, const Joint& joint);
double armature_energy(const Model& model, const State& state, const BallJoint& ball);

std::vector<BallCoordinates> ball_coordinates(const Model& model, const State& state);

// ---- joints of one coordinate ---------------------------------------------------------------------------------------

// The inertia of the child by itself against the joint's motion: kg m^2 or kg.
double child_inertia(const Model& model, const Joint& joint);
// How far a unit of its position moves the farthest centre of mass that it carries: m/rad or m/m.
double reach_of_unit(const Model& model, const State& state, const Joint& joint);

}  // namespace assay
