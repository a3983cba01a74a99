// Method: Kane's (projected Newton-Euler) equations, M(q) u' = sum over bodies of J^T (applied - bias), with the
// Jacobians of each body's centre of mass and angular velocity built down the tree (Kane and Levinson, Dynamics: Theory
// and Applications, 1985). Equality constraints add Lagrange multipliers at the level of accelerations: the tolerance
// of the integration is so small that the drift needs no stabilization.
#include "measures/reference/system.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <fmt/format.h>

#include "model/joint.h"
#include "model/kinematics.h"

namespace assay::reference {
namespace {

RVec3 wide(const Vec3& v) { return v.cast<Real>(); }
RQuat wide(const Quat& q) { return RQuat(q.cast<Real>()).normalized(); }
Vec3 narrow(const RVec3& v) { return v.cast<double>(); }

// As rotation_vector() of model/kinematics.h.
RVec3 turn_of(const RQuat& rotation) {
  const Real sign = rotation.w() < 0 ? -1 : 1;
  const Real sine = rotation.vec().norm();
  if (sine == 0) return RVec3::Zero();
  return sign * 2 * std::atan2(sine, std::abs(rotation.w())) / sine * rotation.vec();
}

}  // namespace

System::System(const Model& model, JointTorques torques)
    : model_(model),
      given_torques_(std::move(torques)),
      constraint_rows_(static_cast<int>(model.couplings.size() + 3 * model.connects.size() + 6 * model.welds.size())) {
  // coordinates of all bodies come first; speeds after them
  for (const Body& body : model.bodies) {
    Part part;
    part.type = joint_type(model, body);
    coordinates_ += part.coordinates();
  }
  int coordinate = 0, speed = coordinates_;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    Part part;
    part.type = joint_type(model, body);
    part.parent = body.parent;
    part.joint = body.joint;
    part.ball = body.ball;
    const bool root = body.parent == kWorld;
    if (root && (constraint_rows_ == 0 || groups_.empty())) groups_.emplace_back();
    part.group = root ? static_cast<int>(groups_.size()) - 1 : parts_[body.parent].group;
    Group& group = groups_[part.group];
    group.bodies.push_back(static_cast<int>(i));
    part.coordinate = coordinate;
    part.speed = speed;
    part.group_speed = group.speeds;
    coordinate += part.coordinates();
    speed += part.speeds();
    group.speeds += part.speeds();
    part.p_BBcm = wide(body.p_BBcm);
    part.mass = body.mass;
    part.inertia_B = body.I_BBcm_B.cast<Real>();
    if (body.is_massless()) part.inertia_B.setZero();
    part.q_PB = wide(body.X_PB.q);
    if (part.joint >= 0) {
      const Joint& joint = model.joints[body.joint];
      part.axis_B = wide(joint.axis_B).normalized();
    }
    if (!body.is_free()) {
      part.p_BJ = wide(anchor_of(model, body));
      part.p_PJ = wide(body.X_PB.p) + part.q_PB * part.p_BJ;
    }
    parts_.push_back(part);
  }
  size_ = speed;
  gravity_ = wide(model.gravity);
  moving_.resize(parts_.size());
  position_.resize(model.joints.size());
  velocity_.resize(model.joints.size());
  torque_.resize(model.joints.size());
}

Flat System::flatten(const State& state) const {
  Flat y(size_);
  for (size_t i = 0; i < parts_.size(); ++i) {
    const Part& part = parts_[i];
    if (part.joint >= 0) {
      y[part.coordinate] = state.position.at(part.joint);
      y[part.speed] = state.velocity.at(part.joint);
      continue;
    }
    const BodyState& body = state.bodies.at(i);
    const RQuat q = wide(body.q_WB);
    if (part.ball >= 0) {
      const bool root = part.parent == kWorld;
      const RQuat parent_q = root ? RQuat(RQuat::Identity()) : wide(state.bodies.at(part.parent).q_WB);
      const RVec3 parent_w = root ? RVec3(RVec3::Zero()) : wide(state.bodies.at(part.parent).w_WB);
      const RQuat relative = ((parent_q * part.q_PB).conjugate() * q).normalized();
      const RVec3 w_B = q.conjugate() * RVec3(wide(body.w_WB) - parent_w);
      y[part.coordinate] = relative.w();
      for (int k = 0; k < 3; ++k) {
        y[part.coordinate + 1 + k] = relative.vec()[k];
        y[part.speed + k] = w_B[k];
      }
      continue;
    }
    for (int k = 0; k < 3; ++k) {
      y[part.coordinate + k] = body.p_WBcm[k];
      y[part.coordinate + 4 + k] = q.vec()[k];
      y[part.speed + k] = body.v_WBcm[k];
      y[part.speed + 3 + k] = body.w_WB[k];
    }
    y[part.coordinate + 3] = q.w();
  }
  return y;
}

State System::unflatten(const Flat& y, double time) {
  set_kinematics(y);
  State state;
  state.time = time;
  state.bodies.resize(parts_.size());
  state.position.resize(model_.joints.size());
  state.velocity.resize(model_.joints.size());
  for (size_t i = 0; i < parts_.size(); ++i) {
    const Moving& m = moving_[i];
    state.bodies[i] = {narrow(m.p_cm), Quat(m.q.cast<double>()).normalized(), narrow(m.v_cm), narrow(m.w)};
    if (parts_[i].joint < 0) continue;
    state.position[parts_[i].joint] = static_cast<double>(y[parts_[i].coordinate]);
    state.velocity[parts_[i].joint] = static_cast<double>(y[parts_[i].speed]);
  }
  return state;
}

void System::prepare(const Flat& y, Real time) {
  set_kinematics(y);
  set_torques(y, time);
  if (constraint_rows_ > 0) prepared_ = y;
}

RQuat System::relative_rotation(const Part& part, const Flat& y) {
  const Real* c = &y[part.coordinate];
  return RQuat(c[0], c[1], c[2], c[3]).normalized();
}

Real System::sum_of(const std::vector<JointTerm>& terms, const Flat& y, bool velocity) const {
  Real sum = 0;
  for (const JointTerm& term : terms) {
    sum += static_cast<Real>(term.coefficient) * (velocity ? velocity_of(term.joint, y) : position_of(term.joint, y));
  }
  return sum;
}

std::string System::violated_limit(const Flat& y) const {
  for (const Part& part : parts_) {
    if (part.joint >= 0 && model_.joints[part.joint].limited) {
      const Joint& joint = model_.joints[part.joint];
      if (y[part.coordinate] < joint.lower || y[part.coordinate] > joint.upper) {
        return fmt::format("{} '{}'", type_name(joint), joint.name);
      }
    }
    if (part.ball >= 0 && model_.balls[part.ball].limited) {
      const BallJoint& ball = model_.balls[part.ball];
      if (turn_of(relative_rotation(part, y)).norm() > ball.upper) return fmt::format("ball joint '{}'", ball.name);
    }
  }
  for (const Tendon& tendon : model_.tendons) {
    if (!tendon.limited) continue;
    const Real length = sum_of(tendon.terms, y, false);
    if (length < tendon.lower || length > tendon.upper) return fmt::format("tendon '{}'", tendon.name);
  }
  return "";
}

// ---- kinematics -----------------------------------------------------------------------------------------------------

void System::set_kinematics(const Flat& y) {
  for (size_t i = 0; i < parts_.size(); ++i) {
    const Part& part = parts_[i];
    Moving& m = moving_[i];
    const int speeds = groups_[part.group].speeds;
    if (part.type == JointType::kFree) {
      const Real* c = &y[part.coordinate];
      const Real* u = &y[part.speed];
      m.p_cm = RVec3(c[0], c[1], c[2]);
      m.q = RQuat(c[3], c[4], c[5], c[6]).normalized();
      m.v_cm = RVec3(u[0], u[1], u[2]);
      m.w = RVec3(u[3], u[4], u[5]);
      m.bias_linear.setZero();
      m.bias_angular.setZero();
      m.linear.setZero(3, speeds);
      m.angular.setZero(3, speeds);
      m.linear.template block<3, 3>(0, part.group_speed).setIdentity();
      m.angular.template block<3, 3>(0, part.group_speed + 3).setIdentity();
      continue;
    }
    m.angular.setZero(3, speeds);
    m.linear.setZero(3, speeds);
    if (part.type == JointType::kBall) {
      move_ball(part, y, m);
      continue;
    }
    if (part.type == JointType::kSlide) {
      move_slide(part, y, m);
      continue;
    }

    // a root's parent is the world, which neither moves nor turns
    const bool root = part.parent == kWorld;
    const RQuat parent_q = root ? RQuat(RQuat::Identity()) : moving_[part.parent].q;
    const RVec3 parent_w = root ? RVec3(RVec3::Zero()) : moving_[part.parent].w;
    const Real angle = y[part.coordinate] - static_cast<Real>(model_.joints[part.joint].reference);
    const Real rate = y[part.speed];
    m.q = (parent_q * part.q_PB * RQuat(Eigen::AngleAxis<Real>(angle, part.axis_B))).normalized();
    m.axis = m.q * part.axis_B;
    m.w = parent_w + m.axis * rate;
    m.bias_angular = parent_w.cross(m.axis * rate);

    const Anchor anchor = carry_anchor(part, m);
    m.angular.col(part.group_speed) = m.axis;
    swing_about_anchor(part, anchor, 1, m);
  }
}

System::Anchor System::carry_anchor(const Part& part, Moving& m) const {
  if (part.parent == kWorld) {
    m.p_J = part.p_PJ;
    return {};
  }
  const Moving& p = moving_[part.parent];
  const RVec3 arm = p.q * (part.p_PJ - parts_[part.parent].p_BBcm);
  m.p_J = p.p_cm + arm;
  m.bias_angular += p.bias_angular;
  m.angular = p.angular;
  m.linear = p.linear;
  for (int k = 0; k < part.group_speed; ++k) m.linear.col(k) += RVec3(p.angular.col(k)).cross(arm);
  return {p.v_cm + p.w.cross(arm), p.bias_linear + p.bias_angular.cross(arm) + p.w.cross(p.w.cross(arm))};
}

void System::swing_about_anchor(const Part& part, const Anchor& anchor, int speeds, Moving& m) {
  const RVec3 arm = m.q * (part.p_BBcm - part.p_BJ);
  m.p_cm = m.p_J + arm;
  m.v_cm = anchor.v + m.w.cross(arm);
  m.bias_linear = anchor.bias + m.bias_angular.cross(arm) + m.w.cross(m.w.cross(arm));
  for (int k = 0; k < part.group_speed + speeds; ++k) m.linear.col(k) += RVec3(m.angular.col(k)).cross(arm);
}

void System::move_ball(const Part& part, const Flat& y, Moving& m) {
  const Real* u = &y[part.speed];
  const bool root = part.parent == kWorld;
  const RQuat parent_q = root ? RQuat(RQuat::Identity()) : moving_[part.parent].q;
  const RVec3 parent_w = root ? RVec3(RVec3::Zero()) : moving_[part.parent].w;
  m.q = (parent_q * part.q_PB * relative_rotation(part, y)).normalized();
  const RVec3 relative_w = m.q * RVec3(u[0], u[1], u[2]);
  m.w = parent_w + relative_w;
  m.bias_angular = parent_w.cross(relative_w);

  const Anchor anchor = carry_anchor(part, m);
  for (int k = 0; k < 3; ++k) m.angular.col(part.group_speed + k) = m.q * RVec3(RVec3::Unit(k));
  swing_about_anchor(part, anchor, 3, m);
}

void System::move_slide(const Part& part, const Flat& y, Moving& m) {
  const bool root = part.parent == kWorld;
  const RQuat parent_q = root ? RQuat(RQuat::Identity()) : moving_[part.parent].q;
  m.q = (parent_q * part.q_PB).normalized();
  m.axis = m.q * part.axis_B;
  const RVec3 way = m.axis * (y[part.coordinate] - static_cast<Real>(model_.joints[part.joint].reference));
  const RVec3 moved = m.axis * y[part.speed];

  // the centre of mass moves with the parent, beside its way along the axis
  const RVec3 from_anchor = m.q * (part.p_BBcm - part.p_BJ) + way;
  if (root) {
    m.p_cm = part.p_PJ + from_anchor;
    m.v_cm = moved;
    m.w.setZero();
    m.bias_linear.setZero();
    m.bias_angular.setZero();
  } else {
    const Moving& p = moving_[part.parent];
    const RVec3 arm = p.q * (part.p_PJ - parts_[part.parent].p_BBcm) + from_anchor;
    m.p_cm = p.p_cm + arm;
    m.w = p.w;
    m.v_cm = p.v_cm + p.w.cross(arm) + moved;
    m.bias_angular = p.bias_angular;
    m.bias_linear = p.bias_linear + p.bias_angular.cross(arm) + p.w.cross(p.w.cross(arm)) + 2 * p.w.cross(moved);
    m.angular = p.angular;
    m.linear = p.linear;
    for (int k = 0; k < part.group_speed; ++k) m.linear.col(k) += RVec3(p.angular.col(k)).cross(arm);
  }
  m.p_J = m.p_cm - m.q * (part.p_BBcm - part.p_BJ);
  m.linear.col(part.group_speed) = m.axis;
}

// ---- equations of motion --------------------------------------------------------------------------------------------

void System::set_torques(const Flat& y, Real time) {
  for (const Part& part : parts_) {
    if (part.joint < 0) continue;
    position_[part.joint] = static_cast<double>(y[part.coordinate]);
    velocity_[part.joint] = static_cast<double>(y[part.speed]);
    torque_[part.joint] = 0;
  }
  if (given_torques_) given_torques_(static_cast<double>(time), position_, velocity_, torque_);
}

void System::assemble(const Group& group, const Flat& y, bool applied, Matrix& inertia, Vector& force) {
  inertia = Matrix::Zero(group.speeds, group.speeds);
  force = Vector::Zero(group.speeds);
  for (int i : group.bodies) {
    const Part& part = parts_[i];
    const Moving& m = moving_[i];
    if (part.mass > 0) {
      const RMat3 R = m.q.toRotationMatrix();
      const RMat3 I = R * part.inertia_B * R.transpose();
      inertia.noalias() += part.mass * m.linear.transpose() * m.linear;
      inertia.noalias() += m.angular.transpose() * I * m.angular;
      const RVec3 spin_momentum = I * m.w;
      force.noalias() += m.linear.transpose() * (part.mass * (gravity_ - m.bias_linear));
      force.noalias() -= m.angular.transpose() * (I * m.bias_angular + m.w.cross(spin_momentum));
    }
    if (part.ball >= 0) {
      for (int k = part.group_speed; k < part.group_speed + 3; ++k) {
        inertia(k, k) += static_cast<Real>(model_.balls[part.ball].armature);
      }
      if (applied) force.segment<3>(part.group_speed) += ball_spring(part, y);
    }
    if (part.joint < 0) continue;
    const Joint& joint = model_.joints[part.joint];
    const Real q = y[part.coordinate], rate = y[part.speed];
    inertia(part.group_speed, part.group_speed) += static_cast<Real>(joint.armature);
    if (!applied) continue;
    force[part.group_speed] +=
        torque_[part.joint] - joint.stiffness * (q - static_cast<Real>(joint.spring_reference)) - joint.damping * rate;
  }
}

// Torque on the child, in child axes.
RVec3 System::ball_spring(const Part& part, const Flat& y) const {
  const BallJoint& ball = model_.balls[part.ball];
  RVec3 torque;
  for (int k = 0; k < 3; ++k) torque[k] = -static_cast<Real>(ball.damping) * y[part.speed + k];
  if (ball.stiffness != 0) {
    const RQuat deflection = wide(ball.spring_reference).conjugate() * relative_rotation(part, y);
    torque -= static_cast<Real>(ball.stiffness) * turn_of(deflection);
  }
  return torque;
}

void System::add_springs(const Flat& y, Vector& force) const {
  for (const Part& part : parts_) {
    const int first = column(part);
    if (part.ball >= 0) force.segment<3>(first) += ball_spring(part, y);
    if (part.joint < 0) continue;
    const Joint& joint = model_.joints[part.joint];
    force[first] -= joint.stiffness * (y[part.coordinate] - static_cast<Real>(joint.spring_reference)) +
                    joint.damping * y[part.speed];
  }
  add_tendons(y, force);
}

// Adds the tendons' tensions to `force` over all speeds.
void System::add_tendons(const Flat& y, Vector& force) const {
  for (const Tendon& tendon : model_.tendons) {
    if (!tendon.has_spring()) continue;
    const Real length = sum_of(tendon.terms, y, false);
    const Real rest = std::clamp<Real>(length, tendon.rest_lower, tendon.rest_upper);
    const Real tension = -static_cast<Real>(tendon.stiffness) * (length - rest) -
                         static_cast<Real>(tendon.damping) * sum_of(tendon.terms, y, true);
    for (const JointTerm& term : tendon.terms) {
      force[column(joint_part(term.joint))] += static_cast<Real>(term.coefficient) * tension;
    }
  }
}

Vector System::accelerations(const Group& group, const Matrix& inertia, const Vector& force) {
  const auto factor = inertia.llt();
  Vector acceleration = factor.solve(force);
  if (constraint_rows_ == 0 || group.bodies.empty()) return acceleration;
  // J u' = -bias: multipliers of J M^-1 J^T, of least norm where constraints repeat each other
  const Constraints c = constraints(prepared_);
  const Matrix response = factor.solve(c.jacobian.transpose());
  const Matrix compliance = c.jacobian * response;
  Eigen::CompleteOrthogonalDecomposition<Matrix> decomposition;
  decomposition.setThreshold(1e-12L);
  decomposition.compute(compliance);
  acceleration -= response * decomposition.solve(c.jacobian * acceleration + c.bias);
  return acceleration;
}

void System::derivative(const Flat& y, Flat& dydt, Real time) {
  prepare(y, time);
  Vector tensions;
  if (!model_.tendons.empty()) {
    tensions = Vector::Zero(speeds());
    add_tendons(y, tensions);
  }
  Matrix inertia;
  Vector force;
  for (const Group& group : groups_) {
    assemble(group, y, true, inertia, force);
    if (tensions.size() > 0) {
      for (int i : group.bodies) {
        const Part& part = parts_[i];
        for (int k = 0; k < part.speeds(); ++k) force[part.group_speed + k] += tensions[column(part) + k];
      }
    }
    const Vector acceleration = accelerations(group, inertia, force);
    for (int i : group.bodies) {
      const Part& part = parts_[i];
      if (part.joint >= 0) {
        dydt[part.coordinate] = y[part.speed];
        dydt[part.speed] = acceleration[part.group_speed];
        continue;
      }
      const Real* c = &y[part.coordinate];
      if (part.ball >= 0) {
        // q' = q (0, w) / 2 for an angular velocity in child axes
        const RQuat q(c[0], c[1], c[2], c[3]);
        const RVec3 w(y[part.speed], y[part.speed + 1], y[part.speed + 2]);
        const RVec3 vector_rate = (w * q.w() + q.vec().cross(w)) / 2;
        dydt[part.coordinate] = -w.dot(q.vec()) / 2;
        for (int k = 0; k < 3; ++k) {
          dydt[part.coordinate + 1 + k] = vector_rate[k];
          dydt[part.speed + k] = acceleration[part.group_speed + k];
        }
        continue;
      }
      // q' = (0, w) q / 2 for an angular velocity in world axes
      const RQuat q(c[3], c[4], c[5], c[6]);
      const RVec3 w = moving_[i].w;
      const RVec3 vector_rate = (w * q.w() + w.cross(q.vec())) / 2;
      for (int k = 0; k < 3; ++k) {
        dydt[part.coordinate + k] = y[part.speed + k];
        dydt[part.coordinate + 4 + k] = vector_rate[k];
      }
      dydt[part.coordinate + 3] = -w.dot(q.vec()) / 2;
      for (int k = 0; k < 6; ++k) dydt[part.speed + k] = acceleration[part.group_speed + k];
    }
  }
}

// ---- equality constraints -------------------------------------------------------------------------------------------

// Three rows: the velocity of a's point less that of b's.
void System::add_point_rows(int body_a, const Vec3& p_A, int body_b, const Vec3& p_B, int row, Constraints& c) const {
  c.gap.segment<3>(row).setZero();
  c.rate.segment<3>(row).setZero();
  c.bias.segment<3>(row).setZero();
  for (const bool first : {true, false}) {
    const int body = first ? body_a : body_b;
    const Real sign = first ? 1 : -1;
    const RVec3 point = wide(first ? p_A : p_B);
    if (body == kWorld) {
      c.gap.segment<3>(row) += sign * point;
      continue;
    }
    const Moving& m = moving_[body];
    const RVec3 arm = m.q * (point - parts_[body].p_BBcm);
    c.gap.segment<3>(row) += sign * (m.p_cm + arm);
    c.rate.segment<3>(row) += sign * (m.v_cm + m.w.cross(arm));
    c.bias.segment<3>(row) += sign * (m.bias_linear + m.bias_angular.cross(arm) + m.w.cross(m.w.cross(arm)));
    for (int k = 0; k < c.jacobian.cols(); ++k) {
      c.jacobian.block<3, 1>(row, k) += sign * (m.linear.col(k) + RVec3(m.angular.col(k)).cross(arm));
    }
  }
}

System::Constraints System::constraints(const Flat& y) const {
  Constraints c;
  c.jacobian = Matrix::Zero(constraint_rows_, speeds());
  c.bias = c.gap = c.rate = Vector::Zero(constraint_rows_);
  int row = 0;
  for (const Coupling& coupling : model_.couplings) {
    c.jacobian(row, joint_part(coupling.joint).group_speed) += 1;
    for (const JointTerm& term : coupling.terms) {
      c.jacobian(row, joint_part(term.joint).group_speed) -= static_cast<Real>(term.coefficient);
    }
    c.gap[row] = position_of(coupling.joint, y) - static_cast<Real>(coupling.offset) - sum_of(coupling.terms, y, false);
    c.rate[row] = velocity_of(coupling.joint, y) - sum_of(coupling.terms, y, true);
    ++row;
  }
  for (const Connect& connect : model_.connects) {
    add_point_rows(connect.body_a, connect.p_A, connect.body_b, connect.p_B, row, c);
    row += 3;
  }
  for (const Weld& weld : model_.welds) {
    add_point_rows(weld.body_a, weld.X_AB.p, weld.body_b, Vec3::Zero(), row, c);
    row += 3;
    const auto orientation = [&](int body) { return body == kWorld ? RQuat(RQuat::Identity()) : moving_[body].q; };
    // in world axes; its rate is the relative angular velocity, where the gap is zero
    c.gap.segment<3>(row) =
        turn_of(orientation(weld.body_a) * wide(weld.X_AB.q) * orientation(weld.body_b).conjugate());
    for (const bool first : {true, false}) {
      const int body = first ? weld.body_a : weld.body_b;
      if (body == kWorld) continue;
      const Real sign = first ? 1 : -1;
      c.rate.segment<3>(row) += sign * moving_[body].w;
      c.bias.segment<3>(row) += sign * moving_[body].bias_angular;
      c.jacobian.middleRows<3>(row) += sign * moving_[body].angular;
    }
    row += 3;
  }
  return c;
}

System::Gap System::constraint_gap(const Flat& y) {
  if (constraint_rows_ == 0) return {};
  set_kinematics(y);
  const Constraints c = constraints(y);
  return {c.gap.cwiseAbs().maxCoeff(), c.rate.cwiseAbs().maxCoeff()};
}

void System::project(Flat& y) {
  if (constraint_rows_ == 0) return;
  constexpr int kIterations = 10;
  Eigen::CompleteOrthogonalDecomposition<Matrix> decomposition;
  decomposition.setThreshold(1e-12L);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    set_kinematics(y);
    const Constraints c = constraints(y);
    decomposition.compute(c.jacobian);
    const Vector change = decomposition.solve(c.gap);
    for (const Part& part : parts_) {
      const int first = column(part);
      if (part.joint >= 0) {
        y[part.coordinate] -= change[first];
        continue;
      }
      const bool free = part.type == JointType::kFree;
      if (free) {
        for (int k = 0; k < 3; ++k) y[part.coordinate + k] -= change[first + k];
      }
      Real* q = &y[part.coordinate + (free ? 3 : 0)];
      const RVec3 turn = -change.segment<3>(first + (free ? 3 : 0));
      const Real angle = turn.norm();
      if (angle == 0) continue;
      const RQuat by(Eigen::AngleAxis<Real>(angle, turn / angle));
      const RQuat old(q[0], q[1], q[2], q[3]);
      const RQuat turned = free ? by * old : old * by;
      q[0] = turned.w();
      for (int k = 0; k < 3; ++k) q[1 + k] = turned.vec()[k];
    }
    if (change.cwiseAbs().maxCoeff() < 1e-18L) break;
  }
  set_kinematics(y);
  const Constraints c = constraints(y);
  decomposition.compute(c.jacobian);
  const Vector change = decomposition.solve(c.rate);
  for (int k = 0; k < speeds(); ++k) y[coordinates_ + k] -= change[k];
}

}  // namespace assay::reference
