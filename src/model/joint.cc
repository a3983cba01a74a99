#include "model/joint.h"

#include <algorithm>
#include <cmath>

namespace assay {
namespace {

constexpr JointUnits kAngular = {"rad", "Nm", "Nm/rad", "Nms/rad", "kg m^2"};
constexpr JointUnits kLinear = {"m", "N", "N/m", "N s/m", "kg"};

template <typename Element>
int number_of(const std::vector<Element>& all, const Element& element) {
  return static_cast<int>(&element - all.data());
}

Pose parent_frame(const Model& model, const State& state, const Body& body) {
  if (body.parent == kWorld) return {};
  const auto parent = static_cast<size_t>(body.parent);
  return body_pose(model.bodies[parent], state.bodies[parent]);
}

double position_of(const Model& model, const State& state, const Joint& joint) {
  return state.position[static_cast<size_t>(number_of(model.joints, joint))];
}

// Its angle from the pose X_PB.
double deflection_of(const Model& model, const State& state, const BallJoint& ball) {
  return rotation_vector(ball_rotation(model, state, number_of(model.balls, ball))).norm();
}

}  // namespace

JointType joint_type(const Model& model, const Body& body) {
  if (body.is_free()) return JointType::kFree;
  return body.ball >= 0 ? JointType::kBall : model.joints[static_cast<size_t>(body.joint)].type;
}

int speeds_of(JointType type) {
  switch (type) {
    case JointType::kFree:
      return 6;
    case JointType::kBall:
      return 3;
    case JointType::kHinge:
    case JointType::kSlide:
      break;
  }
  return 1;
}

int speeds_of(const Body& body) {
  if (body.is_free()) return 6;
  return body.ball >= 0 ? 3 : 1;
}

std::string joint_name(const Model& model, const Body& body) {
  if (body.joint >= 0) return model.joints[static_cast<size_t>(body.joint)].name;
  return body.ball >= 0 ? model.balls[static_cast<size_t>(body.ball)].name : "";
}

const Vec3& anchor_of(const Model& model, const Body& body) {
  if (body.is_free()) return body.p_BBcm;
  return body.ball >= 0 ? model.balls[static_cast<size_t>(body.ball)].p_BJ
                        : model.joints[static_cast<size_t>(body.joint)].p_BJ;
}

double armature_of(const Model& model, const Body& body) {
  if (body.joint >= 0) return model.joints[static_cast<size_t>(body.joint)].armature;
  return body.ball >= 0 ? model.balls[static_cast<size_t>(body.ball)].armature : 0;
}

const Joint* hinge_of(const Model& model, const Body& body) {
  if (body.joint < 0) return nullptr;
  const Joint& joint = model.joints[static_cast<size_t>(body.joint)];
  return joint.is_slide() ? nullptr : &joint;
}

bool slides(const Model& model, const Body& body) {
  return body.joint >= 0 && model.joints[static_cast<size_t>(body.joint)].is_slide();
}

const char* type_name(const Joint& joint) { return joint.is_slide() ? "slide" : "hinge"; }
const char* type_name(const BallJoint& /*ball*/) { return "ball joint"; }
const char* noun(const Joint& /*joint*/) { return "joint"; }
const char* noun(const BallJoint& /*ball*/) { return "ball joint"; }

const JointUnits& units_of(const Joint& joint) { return joint.is_slide() ? kLinear : kAngular; }
const JointUnits& units_of(const BallJoint& /*ball*/) { return kAngular; }

JointError joint_error(const Model& model, const State& state, const Joint& joint) {
  const JointFrames frames = joint_frames(model, state, number_of(model.joints, joint));
  JointError error{.p_WJ_child = frames.p_WJ_child, .apart_W = frames.p_WJ_child - frames.p_WJ_parent};
  if (joint.is_slide()) {
    // off the axis, and the whole relative rotation, which a slide does not allow
    error.dislocation = frames.axis_W_parent.cross(error.apart_W).norm();
    error.apart_W -= error.apart_W.dot(frames.axis_W_parent) * frames.axis_W_parent;
    const auto child = static_cast<size_t>(joint.body);
    const Body& body = model.bodies[child];
    const Quat expected = parent_frame(model, state, body).q * body.X_PB.q;
    error.misalignment = rotation_vector(expected.conjugate() * state.bodies[child].q_WB).norm();
    return error;
  }
  error.dislocation = error.apart_W.norm();
  // exact for small angles, where the arc cosine loses all digits
  error.misalignment =
      std::atan2(frames.axis_W_parent.cross(frames.axis_W_child).norm(), frames.axis_W_parent.dot(frames.axis_W_child));
  return error;
}

JointError joint_error(const Model& model, const State& state, const BallJoint& ball) {
  const auto child = static_cast<size_t>(ball.body);
  const Body& body = model.bodies[child];
  JointError error;
  error.p_WJ_child = body_pose(body, state.bodies[child]) * ball.p_BJ;
  const Vec3 parent = parent_frame(model, state, body) * (body.X_PB * ball.p_BJ);
  error.apart_W = error.p_WJ_child - parent;
  error.dislocation = error.apart_W.norm();
  return error;
}

double beyond_limit(const Model& model, const State& state, const Joint& joint) {
  if (!joint.limited) return kNoLimit;
  const double q = position_of(model, state, joint);
  return std::max(joint.lower - q, q - joint.upper);
}

double beyond_limit(const Model& model, const State& state, const BallJoint& ball) {
  return ball.limited ? deflection_of(model, state, ball) - ball.upper : kNoLimit;
}

double passed_limit(const Model& model, const State& state, const Joint& joint) {
  return position_of(model, state, joint) < joint.lower ? joint.lower : joint.upper;
}

double passed_limit(const Model& /*model*/, const State& /*state*/, const BallJoint& ball) { return ball.upper; }

double spring_energy(const Model& model, const State& state, const Joint& joint) {
  if (joint.stiffness == 0) return 0;
  const double stretch = position_of(model, state, joint) - joint.spring_reference;
  return 0.5 * joint.stiffness * stretch * stretch;
}

double spring_energy(const Model& model, const State& state, const BallJoint& ball) {
  if (ball.stiffness == 0) return 0;
  const Quat deflection = ball.spring_reference.conjugate() * ball_rotation(model, state, number_of(model.balls, ball));
  return 0.5 * ball.stiffness * rotation_vector(deflection).squaredNorm();
}

double armature_energy(const Model& model, const State& state, const Joint& joint) {
  if (joint.armature == 0) return 0;
  const double velocity = state.velocity[static_cast<size_t>(number_of(model.joints, joint))];
  return 0.5 * joint.armature * velocity * velocity;
}

double armature_energy(const Model& model, const State& state, const BallJoint& ball) {
  if (ball.armature == 0) return 0;
  return 0.5 * ball.armature * ball_velocity(model, state, number_of(model.balls, ball)).squaredNorm();
}

std::vector<BallCoordinates> ball_coordinates(const Model& model, const State& state) {
  std::vector<BallCoordinates> balls;
  balls.reserve(model.balls.size());
  for (size_t i = 0; i < model.balls.size(); ++i) {
    const auto ball = static_cast<int>(i);
    balls.push_back({ball_rotation(model, state, ball), ball_velocity(model, state, ball)});
  }
  return balls;
}

double child_inertia(const Model& model, const Joint& joint) {
  const Body& child = model.bodies[static_cast<size_t>(joint.body)];
  if (joint.is_slide()) return child.mass;
  const Vec3 arm = child.p_BBcm - joint.p_BJ;
  return joint.axis_B.dot(child.I_BBcm_B * joint.axis_B) + child.mass * joint.axis_B.cross(arm).squaredNorm();
}

double reach_of_unit(const Model& model, const State& state, const Joint& joint) {
  if (joint.is_slide()) return 1;
  const auto root = static_cast<size_t>(joint.body);
  const BodyState& child = state.bodies[root];
  const Vec3 anchor = child.p_WBcm + child.q_WB * (joint.p_BJ - model.bodies[root].p_BBcm);
  std::vector<bool> carried(model.bodies.size(), false);
  double reach = 0;
  for (size_t i = root; i < model.bodies.size(); ++i) {  // parents come before their children
    const int parent = model.bodies[i].parent;
    carried[i] = i == root || (parent != kWorld && carried[static_cast<size_t>(parent)]);
    if (carried[i]) reach = std::max(reach, (state.bodies[i].p_WBcm - anchor).norm());
  }
  return reach;
}

}  // namespace assay
