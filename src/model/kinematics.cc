#include "model/kinematics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

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

// A body's state from its parent's and its own joint's coordinates.
void place_body(const Model& model, State& state, int index) {
  const Body& body = model.bodies[index];
  const FrameMotion parent = frame_motion(model, state, body.parent);
  BodyState& s = state.bodies[index];

  if (body.ball >= 0) {
    // orientation and angular velocity are given; the anchor is fixed in the parent
    const Vec3& p_BJ = model.balls[body.ball].p_BJ;
    const Vec3 p_WJ = parent.X_WB * (body.X_PB * p_BJ);
    s.p_WBcm = p_WJ + s.q_WB * (body.p_BBcm - p_BJ);
    s.v_WBcm = parent.v_WBo + parent.w_WB.cross(p_WJ - parent.X_WB.p) + s.w_WB.cross(s.p_WBcm - p_WJ);
    return;
  }

  const Joint& joint = model.joints[body.joint];
  const double way = state.position[body.joint] - joint.reference;
  if (joint.is_slide()) {
    s.q_WB = (parent.X_WB.q * body.X_PB.q).normalized();
    const Vec3 axis_W = s.q_WB * joint.axis_B;
    s.p_WBcm = parent.X_WB * (body.X_PB * body.p_BBcm) + axis_W * way;
    s.w_WB = parent.w_WB;
    s.v_WBcm = parent.v_WBo + parent.w_WB.cross(s.p_WBcm - parent.X_WB.p) + axis_W * state.velocity[body.joint];
    return;
  }

  // orientation first, then the position that keeps the anchor fixed in the parent
  const Vec3 p_PJ = anchor_in_parent(model, body.joint);
  s.q_WB = (parent.X_WB.q * body.X_PB.q * Quat(Eigen::AngleAxisd(way, joint.axis_B))).normalized();
  const Vec3 p_WJ = parent.X_WB * p_PJ;
  s.p_WBcm = p_WJ + s.q_WB * (body.p_BBcm - joint.p_BJ);

  const Vec3 axis_W = s.q_WB * joint.axis_B;
  s.w_WB = parent.w_WB + axis_W * state.velocity[body.joint];
  const Vec3 v_WJ = parent.v_WBo + parent.w_WB.cross(p_WJ - parent.X_WB.p);
  s.v_WBcm = v_WJ + s.w_WB.cross(s.p_WBcm - p_WJ);
}

// The coordinate of a joint whose two bodies are both known.
void solve_joint(const Model& model, State& state, int index) {
  const Joint& joint = model.joints[index];
  const Body& body = model.bodies[joint.body];
  const JointFrames frames = joint_frames(model, state, index);
  const Vec3 axis_W = (frames.axis_W_parent + frames.axis_W_child).normalized();
  if (joint.is_slide()) {
    const FrameMotion parent = frame_motion(model, state, body.parent), child = frame_motion(model, state, joint.body);
    const Vec3 way = frames.p_WJ_child - frames.p_WJ_parent;
    state.position[index] = joint.reference + axis_W.dot(way);
    // the child's velocity relative to the parent's material point below it
    const Vec3 v_child = child.v_WBo + child.w_WB.cross(frames.p_WJ_child - child.X_WB.p);
    const Vec3 v_parent = parent.v_WBo + parent.w_WB.cross(frames.p_WJ_child - parent.X_WB.p);
    state.velocity[index] = axis_W.dot(v_child - v_parent);
    return;
  }

  // relative rotation from the reference configuration, in child axes; its twist about the axis is the angle
  const Quat q_PB = orientation(state, body.parent).conjugate() * state.bodies[joint.body].q_WB;
  const Quat relative = body.X_PB.q.conjugate() * q_PB;
  const double twist = 2 * std::atan2(relative.vec().dot(joint.axis_B), relative.w()) + joint.reference;
  const double turns = std::round((state.position[index] - twist) / (2 * std::numbers::pi));
  state.position[index] = twist + turns * 2 * std::numbers::pi;
  state.velocity[index] = axis_W.dot(angular_velocity(state, joint.body) - angular_velocity(state, body.parent));
}

// The coordinates of the joints between the body `last` and its nearest ancestor with mass (or the world), and the
// states of the massless bodies between: Gauss-Newton on the pose of `last`, then its velocity, both least squares.
void solve_chain(const Model& model, State& state, int last) {
  constexpr int kMostIterations = 50;
  constexpr double kConverged = 1e-14;
  std::vector<int> chain;  // bodies, `last` first
  for (int b = last; b != kWorld && (b == last || model.bodies[b].is_massless()); b = model.bodies[b].parent) {
    if (!model.bodies[b].is_free()) chain.insert(chain.begin(), b);
  }
  const BodyState target = state.bodies[last];
  int columns = 0;
  for (const int b : chain) {
    columns += model.bodies[b].ball >= 0 ? 3 : 1;
    const int joint = model.bodies[b].joint;
    if (joint >= 0) state.velocity[joint] = 0;
    if (model.bodies[b].ball >= 0) {
      state.bodies[b].w_WB = angular_velocity(state, model.bodies[chain.front()].parent);
    }
  }

  Eigen::MatrixXd jacobian(6, columns);  // of the velocity of last's centre of mass and of its angular velocity
  const auto place = [&] {
    for (const int b : chain) place_body(model, state, b);
    const Vec3 p = state.bodies[last].p_WBcm;
    int column = 0;
    for (const int b : chain) {
      const Body& body = model.bodies[b];
      const Pose X_WB = body_pose(body, state.bodies[b]);
      if (body.ball >= 0) {
        const Vec3 arm = p - X_WB * model.balls[body.ball].p_BJ;
        for (int k = 0; k < 3; ++k, ++column) {
          jacobian.col(column) << Vec3::Unit(k).cross(arm), Vec3::Unit(k);
        }
        continue;
      }
      const Joint& joint = model.joints[body.joint];
      const Vec3 axis = X_WB.q * joint.axis_B;
      if (joint.is_slide()) {
        jacobian.col(column++) << axis, Vec3::Zero();
      } else {
        jacobian.col(column++) << axis.cross(p - X_WB * joint.p_BJ), axis;
      }
    }
  };
  const auto solution = [&](const Vec3& linear, const Vec3& angular) -> Eigen::VectorXd {
    Eigen::Matrix<double, 6, 1> wanted;
    wanted << linear, angular;
    return jacobian.completeOrthogonalDecomposition().solve(wanted);
  };

  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    place();
    const Eigen::VectorXd change =
        solution(target.p_WBcm - state.bodies[last].p_WBcm,
                 rotation_vector((target.q_WB * state.bodies[last].q_WB.conjugate()).normalized()));
    int column = 0;
    for (const int b : chain) {
      if (const int joint = model.bodies[b].joint; joint >= 0) {
        state.position[joint] += change[column++];
      } else {
        const Vec3 turn = change.segment<3>(column);
        column += 3;
        if (const double angle = turn.norm(); angle > 0) {
          const Quat q(Eigen::AngleAxisd(angle, turn / angle));
          state.bodies[b].q_WB = (q * state.bodies[b].q_WB).normalized();
        }
      }
    }
    if (change.lpNorm<Eigen::Infinity>() <= kConverged) break;
  }

  // with all joints at rest, `last` moves as if it were fixed to the ancestor; the joints give the rest
  place();
  const Eigen::VectorXd rates =
      solution(target.v_WBcm - state.bodies[last].v_WBcm, target.w_WB - state.bodies[last].w_WB);
  int column = 0;
  Vec3 spin = Vec3::Zero();  // of the joints so far, which a ball's absolute angular velocity contains
  for (const int b : chain) {
    const Body& body = model.bodies[b];
    if (body.joint >= 0) {
      const Joint& joint = model.joints[body.joint];
      state.velocity[body.joint] = rates[column++];
      if (!joint.is_slide()) spin += state.bodies[b].q_WB * joint.axis_B * state.velocity[body.joint];
    } else {
      spin += rates.segment<3>(column);
      column += 3;
      state.bodies[b].w_WB += spin;
    }
  }
  for (const int b : chain) {
    if (b != last) place_body(model, state, b);
  }
  state.bodies[last] = target;  // bodies with mass are given
}

}  // namespace

Pose body_pose(const Body& body, const BodyState& state) {
  return {state.p_WBcm - state.q_WB * body.p_BBcm, state.q_WB};
}

Vec3 anchor_in_parent(const Model& model, int joint) {
  const Joint& j = model.joints[joint];
  return model.bodies[j.body].X_PB * j.p_BJ;
}

Vec3 axis_in_parent(const Model& model, int joint) {
  const Joint& j = model.joints[joint];
  return model.bodies[j.body].X_PB.q * j.axis_B;
}

void bodies_from_joints(const Model& model, State& state) {
  state.bodies.resize(model.bodies.size());
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    if (!model.bodies[i].is_free()) place_body(model, state, static_cast<int>(i));
  }
}

void bodies_from_joints(const Model& model, const std::vector<BallCoordinates>& balls, State& state) {
  state.bodies.resize(model.bodies.size());
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    if (body.is_free()) continue;
    if (body.ball >= 0) {
      const BallCoordinates& ball = balls[body.ball];
      BodyState& s = state.bodies[i];
      s.q_WB = (orientation(state, body.parent) * body.X_PB.q * ball.rotation).normalized();
      s.w_WB = angular_velocity(state, body.parent) + s.q_WB * ball.velocity;
    }
    place_body(model, state, static_cast<int>(i));
  }
}

void joints_from_bodies(const Model& model, State& state) {
  if (state.position.size() != model.joints.size()) {
    state.position.resize(model.joints.size());
    for (size_t j = 0; j < model.joints.size(); ++j) state.position[j] = model.joints[j].reference;
  }
  state.velocity.resize(model.joints.size());
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    if (body.is_massless()) continue;
    if (body.parent != kWorld && model.bodies[body.parent].is_massless()) {
      solve_chain(model, state, static_cast<int>(i));
    } else if (body.joint >= 0) {
      solve_joint(model, state, body.joint);
    }
  }
}

Quat ball_rotation(const Model& model, const State& state, int ball) {
  const int child = model.balls[ball].body;
  const Body& body = model.bodies[child];
  return (body.X_PB.q.conjugate() * orientation(state, body.parent).conjugate() * state.bodies[child].q_WB)
      .normalized();
}

Vec3 ball_velocity(const Model& model, const State& state, int ball) {
  const int child = model.balls[ball].body;
  const Vec3 w_W = state.bodies[child].w_WB - angular_velocity(state, model.bodies[child].parent);
  return state.bodies[child].q_WB.conjugate() * w_W;
}

Vec3 rotation_vector(const Quat& rotation) {
  const double sign = rotation.w() < 0 ? -1 : 1;
  const double sine = rotation.vec().norm();
  if (sine == 0) return Vec3::Zero();
  return sign * 2 * std::atan2(sine, std::abs(rotation.w())) / sine * rotation.vec();
}

State reference_state(const Model& model) {
  State state;
  state.bodies.resize(model.bodies.size());
  state.velocity.assign(model.joints.size(), 0.0);
  for (const Joint& joint : model.joints) state.position.push_back(joint.reference);
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    if (body.ball >= 0) state.bodies[i].q_WB = (orientation(state, body.parent) * body.X_PB.q).normalized();
    if (body.is_free()) {
      state.bodies[i].q_WB = body.X_PB.q;
      state.bodies[i].p_WBcm = body.X_PB * body.p_BBcm;
    } else {
      place_body(model, state, static_cast<int>(i));
    }
  }
  return state;
}

JointFrames joint_frames(const Model& model, const State& state, int joint) {
  const Joint& h = model.joints[joint];
  const Body& body = model.bodies[h.body];
  const Pose X_WB = body_pose(body, state.bodies[h.body]);
  const Pose X_WP = body.parent == kWorld ? Pose{} : body_pose(model.bodies[body.parent], state.bodies[body.parent]);
  return {X_WP * anchor_in_parent(model, joint), X_WB * h.p_BJ, X_WP.q * axis_in_parent(model, joint),
          X_WB.q * h.axis_B};
}

double spring_torque(const Joint& joint, double position, double velocity) {
  return -joint.stiffness * (position - joint.spring_reference) - joint.damping * velocity;
}

Vec3 ball_spring_torque(const BallJoint& ball, const Quat& rotation, const Vec3& velocity) {
  Vec3 torque = -ball.damping * velocity;
  if (ball.stiffness != 0) {
    torque -= ball.stiffness * rotation_vector(ball.spring_reference.conjugate() * rotation);
  }
  return torque;
}

double sum_of_terms(const std::vector<JointTerm>& terms, const std::vector<double>& of_joints) {
  double sum = 0;
  for (const JointTerm& term : terms) sum += term.coefficient * of_joints[term.joint];
  return sum;
}

double tendon_tension(const Tendon& tendon, double length, double speed) {
  const double rest = std::clamp(length, tendon.rest_lower, tendon.rest_upper);
  return -tendon.stiffness * (length - rest) - tendon.damping * speed;
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
