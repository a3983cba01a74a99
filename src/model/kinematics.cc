#include "model/kinematics.h"

#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>

namespace assay {
namespace {

// A body's pose, velocity at its origin and angular velocity, for the recursion down the tree.
struct FrameMotion {
  Pose X_WB;
  Vec3 v_WBo = Vec3::Zero();
  Vec3 w_WB = Vec3::Zero();
};

FrameMotion frame_motion(const Model& model, const State& state, int body) {
  if (body == kWorld) return {};
  const Body& b = model.bodies[body];
  const BodyState& s = state.bodies[body];
  FrameMotion motion;
  motion.X_WB = body_pose(b, s);
  motion.w_WB = s.w_WB;
  motion.v_WBo = s.v_WBcm - s.w_WB.cross(motion.X_WB.q * b.p_BBcm);
  return motion;
}

Quat orientation(const State& state, int body) {
  return body == kWorld ? Quat(Quat::Identity()) : state.bodies[body].q_WB;
}

Vec3 angular_velocity(const State& state, int body) {
  return body == kWorld ? Vec3(Vec3::Zero()) : state.bodies[body].w_WB;
}

}  // namespace

Pose body_pose(const Body& body, const BodyState& state) {
  return {state.p_WBcm - state.q_WB * body.p_BBcm, state.q_WB};
}

Vec3 anchor_in_parent(const Model& model, int hinge) {
  const Hinge& h = model.hinges[hinge];
  return model.bodies[h.body].X_PB * h.p_BJ;
}

Vec3 axis_in_parent(const Model& model, int hinge) {
  const Hinge& h = model.hinges[hinge];
  return model.bodies[h.body].X_PB.q * h.axis_B;
}

void bodies_from_joints(const Model& model, State& state) {
  state.bodies.resize(model.bodies.size());
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    if (body.is_free()) continue;
    const Hinge& hinge = model.hinges[body.hinge];
    const FrameMotion parent = frame_motion(model, state, body.parent);

    // orientation first, then the position that keeps the anchor fixed in the parent
    const double angle = state.angle[body.hinge] - hinge.reference;
    const Vec3 p_PJ = anchor_in_parent(model, body.hinge);
    BodyState& s = state.bodies[i];
    s.q_WB = (parent.X_WB.q * body.X_PB.q * Quat(Eigen::AngleAxisd(angle, hinge.axis_B))).normalized();
    const Vec3 p_WJ = parent.X_WB * p_PJ;
    s.p_WBcm = p_WJ + s.q_WB * (body.p_BBcm - hinge.p_BJ);

    const Vec3 axis_W = s.q_WB * hinge.axis_B;
    s.w_WB = parent.w_WB + axis_W * state.rate[body.hinge];
    const Vec3 v_WJ = parent.v_WBo + parent.w_WB.cross(p_WJ - parent.X_WB.p);
    s.v_WBcm = v_WJ + s.w_WB.cross(s.p_WBcm - p_WJ);
  }
}

void joints_from_bodies(const Model& model, State& state) {
  if (state.angle.size() != model.hinges.size()) {
    state.angle.resize(model.hinges.size());
    for (size_t j = 0; j < model.hinges.size(); ++j) state.angle[j] = model.hinges[j].reference;
  }
  state.rate.resize(model.hinges.size());
  for (size_t j = 0; j < model.hinges.size(); ++j) {
    const Hinge& hinge = model.hinges[j];
    const Body& body = model.bodies[hinge.body];

    // relative rotation from the reference configuration, in child axes; its twist about the axis is the angle
    const Quat q_PB = orientation(state, body.parent).conjugate() * state.bodies[hinge.body].q_WB;
    const Quat relative = body.X_PB.q.conjugate() * q_PB;
    const double twist = 2 * std::atan2(relative.vec().dot(hinge.axis_B), relative.w()) + hinge.reference;
    const double turns = std::round((state.angle[j] - twist) / (2 * std::numbers::pi));
    state.angle[j] = twist + turns * 2 * std::numbers::pi;

    const HingeFrames frames = hinge_frames(model, state, static_cast<int>(j));
    const Vec3 axis_W = (frames.axis_W_parent + frames.axis_W_child).normalized();
    state.rate[j] = axis_W.dot(angular_velocity(state, hinge.body) - angular_velocity(state, body.parent));
  }
}

State reference_state(const Model& model) {
  State state;
  state.bodies.resize(model.bodies.size());
  state.rate.assign(model.hinges.size(), 0.0);
  for (const Hinge& hinge : model.hinges) state.angle.push_back(hinge.reference);
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    if (!body.is_free()) continue;
    state.bodies[i].q_WB = body.X_PB.q;
    state.bodies[i].p_WBcm = body.X_PB * body.p_BBcm;
  }
  bodies_from_joints(model, state);
  return state;
}

HingeFrames hinge_frames(const Model& model, const State& state, int hinge) {
  const Hinge& h = model.hinges[hinge];
  const Body& body = model.bodies[h.body];
  const Pose X_WB = body_pose(body, state.bodies[h.body]);
  const Pose X_WP = body.parent == kWorld ? Pose{} : body_pose(model.bodies[body.parent], state.bodies[body.parent]);
  return {X_WP * anchor_in_parent(model, hinge), X_WB * h.p_BJ, X_WP.q * axis_in_parent(model, hinge),
          X_WB.q * h.axis_B};
}

double spring_torque(const Hinge& hinge, double angle, double rate) {
  return -hinge.stiffness * (angle - hinge.spring_reference) - hinge.damping * rate;
}

Vec3 capsule_inertia(double mass, double radius, double half_length) {
  // cylinder of length 2h plus two half balls, whose centroids lie 3r/8 beyond the cylinder's ends
  const double r = radius, h = half_length;
  const double cylinder_volume = 2 * h * r * r, ball_volume = 4.0 / 3 * r * r * r;  // both divided by pi
  const double cylinder = mass * cylinder_volume / (cylinder_volume + ball_volume);
  const double ball = mass - cylinder;
  const double axial = cylinder * r * r / 2 + ball * 2 * r * r / 5;
  const double transverse = cylinder * (3 * r * r + 4 * h * h) / 12 + ball * (2 * r * r / 5 + h * h + 3 * h * r / 4);
  return {transverse, transverse, axial};
}

PrincipalInertia principal_inertia(const Mat3& I_B) {
  PrincipalInertia result;
  const double off_diagonal = std::abs(I_B(0, 1)) + std::abs(I_B(0, 2)) + std::abs(I_B(1, 2));
  if (off_diagonal <= 1e-14 * I_B.trace()) {
    result.diagonal = I_B.diagonal();
    return result;
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(I_B);
  Mat3 axes = solver.eigenvectors();
  if (axes.determinant() < 0) axes.col(2) = -axes.col(2);
  result.q_BI = Quat(axes).normalized();
  result.diagonal = solver.eigenvalues();
  return result;
}

}  // namespace assay
