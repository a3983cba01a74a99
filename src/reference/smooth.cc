// Method: Kane's (projected Newton-Euler) equations, M(q) u' = sum over bodies of J^T (applied - bias), with the
// Jacobians of each body's centre of mass and angular velocity built down the tree (Kane and Levinson, Dynamics: Theory
// and Applications, 1985); integrated by the Bulirsch-Stoer method with step and order control (Hairer, Norsett,
// Wanner, Solving Ordinary Differential Equations I, section II.9).
#include "reference/smooth.h"

#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <boost/numeric/odeint.hpp>
#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using Real = long double;
using RVec3 = Eigen::Matrix<Real, 3, 1>;
using RMat3 = Eigen::Matrix<Real, 3, 3>;
using RQuat = Eigen::Quaternion<Real, Eigen::DontAlign>;
using Columns = Eigen::Matrix<Real, 3, Eigen::Dynamic>;
using Flat = std::vector<Real>;

RVec3 wide(const Vec3& v) { return v.cast<Real>(); }
RQuat wide(const Quat& q) { return RQuat(q.cast<Real>()).normalized(); }
Vec3 narrow(const RVec3& v) { return v.cast<double>(); }

// Bodies connected by joints. Trees do not act on each other.
struct Tree {
  std::vector<int> bodies;  // parents first
  int speeds = 0;           // generalized speeds of the tree
};

// Constants of one body in extended precision, and the positions of its coordinates in the state.
struct Part {
  int parent = kWorld;  // index into the system's parts
  int tree = 0;
  int coordinate = 0;  // hinge: angle; free: centre of mass (3), quaternion w x y z (4)
  int speed = 0;  // in the flat state: rate; free: velocity of the centre of mass (3), angular velocity (3), world axes
  int tree_speed = 0;  // the same among the tree's speeds
  int joint = -1;
  RVec3 p_BBcm, p_BJ, axis_B, p_PJ;
  RQuat q_PB;
  Real mass = 0;
  RMat3 inertia_B;
};

// Quantities of one body while the equations are set up.
struct Moving {
  RQuat q;
  RVec3 p_cm, p_J, w, axis;
  RVec3 v_cm;
  RVec3 bias_linear, bias_angular;  // accelerations when all generalized accelerations vanish
  Columns linear, angular;          // Jacobians over the tree's speeds
};

class SmoothSystem {
 public:
  SmoothSystem(const Model& model, const SmoothOptions& options) : model_(model), options_(options) {
    // quaternions and centres of mass of free bodies, and angles, come first; speeds after them
    int coordinates = 0;
    for (const Body& body : model.bodies) coordinates += body.is_free() ? 7 : 1;
    int coordinate = 0, speed = coordinates;
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      const Body& body = model.bodies[i];
      Part part;
      part.parent = body.parent;
      part.joint = body.joint;
      if (body.parent == kWorld) trees_.emplace_back();
      part.tree = body.parent == kWorld ? static_cast<int>(trees_.size()) - 1 : parts_[body.parent].tree;
      Tree& tree = trees_[part.tree];
      tree.bodies.push_back(static_cast<int>(i));
      part.coordinate = coordinate;
      part.speed = speed;
      part.tree_speed = tree.speeds;
      const int speeds = body.is_free() ? 6 : 1;
      coordinate += body.is_free() ? 7 : 1;
      speed += speeds;
      tree.speeds += speeds;
      part.p_BBcm = wide(body.p_BBcm);
      part.mass = body.mass;
      part.inertia_B = body.I_BBcm_B.cast<Real>();
      part.q_PB = wide(body.X_PB.q);
      if (!body.is_free()) {
        const Joint& hinge = model.joints[body.joint];
        part.p_BJ = wide(hinge.p_BJ);
        part.axis_B = wide(hinge.axis_B).normalized();
        part.p_PJ = wide(body.X_PB.p) + part.q_PB * part.p_BJ;
      }
      parts_.push_back(part);
    }
    size_ = speed;
    gravity_ = wide(model.gravity);
    moving_.resize(parts_.size());
    angle_.resize(model.joints.size());
    rate_.resize(model.joints.size());
    torque_.resize(model.joints.size());
  }

  Flat flatten(const State& state) const {
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

  State unflatten(const Flat& y, double time) {
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

  // y' = f(y, t), the signature odeint asks for.
  void derivative(const Flat& y, Flat& dydt, Real time) {
    set_kinematics(y);
    set_torques(y, time);
    for (const Tree& tree : trees_) solve(tree, y, dydt);
  }

  // The first hinge outside its limits, or -1.
  int violated_limit(const Flat& y) const {
    for (const Part& part : parts_) {
      if (part.joint < 0 || !model_.joints[part.joint].limited) continue;
      const Joint& hinge = model_.joints[part.joint];
      if (y[part.coordinate] < hinge.lower || y[part.coordinate] > hinge.upper) return part.joint;
    }
    return -1;
  }

 private:
  void set_kinematics(const Flat& y) {
    for (size_t i = 0; i < parts_.size(); ++i) {
      const Part& part = parts_[i];
      Moving& m = moving_[i];
      const int speeds = trees_[part.tree].speeds;
      if (part.joint < 0) {
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
        m.linear.template block<3, 3>(0, part.tree_speed).setIdentity();
        m.angular.template block<3, 3>(0, part.tree_speed + 3).setIdentity();
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
      m.angular.setZero(3, speeds);
      m.linear.setZero(3, speeds);

      // the anchor moves with the parent
      RVec3 v_J = RVec3::Zero(), bias_J = RVec3::Zero();
      if (root) {
        m.p_J = part.p_PJ;
      } else {
        const Moving& p = moving_[part.parent];
        const RVec3 arm = p.q * (part.p_PJ - parts_[part.parent].p_BBcm);
        m.p_J = p.p_cm + arm;
        v_J = p.v_cm + p.w.cross(arm);
        bias_J = p.bias_linear + p.bias_angular.cross(arm) + p.w.cross(p.w.cross(arm));
        m.bias_angular += p.bias_angular;
        m.angular = p.angular;
        m.linear = p.linear;
        for (int k = 0; k < part.tree_speed; ++k) m.linear.col(k) += RVec3(p.angular.col(k)).cross(arm);
      }
      m.angular.col(part.tree_speed) = m.axis;

      // and the centre of mass turns about the anchor
      const RVec3 arm = m.q * (part.p_BBcm - part.p_BJ);
      m.p_cm = m.p_J + arm;
      m.v_cm = v_J + m.w.cross(arm);
      m.bias_linear = bias_J + m.bias_angular.cross(arm) + m.w.cross(m.w.cross(arm));
      for (int k = 0; k <= part.tree_speed; ++k) m.linear.col(k) += RVec3(m.angular.col(k)).cross(arm);
    }
  }

  void set_torques(const Flat& y, Real time) {
    for (const Part& part : parts_) {
      if (part.joint < 0) continue;
      angle_[part.joint] = static_cast<double>(y[part.coordinate]);
      rate_[part.joint] = static_cast<double>(y[part.speed]);
      torque_[part.joint] = 0;
    }
    if (options_.torques) options_.torques(static_cast<double>(time), angle_, rate_, torque_);
  }

  void solve(const Tree& tree, const Flat& y, Flat& dydt) {
    using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
    using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
    Matrix inertia = Matrix::Zero(tree.speeds, tree.speeds);
    Vector force = Vector::Zero(tree.speeds);
    for (int i : tree.bodies) {
      const Part& part = parts_[i];
      const Moving& m = moving_[i];
      const RMat3 R = m.q.toRotationMatrix();
      const RMat3 I = R * part.inertia_B * R.transpose();
      inertia.noalias() += part.mass * m.linear.transpose() * m.linear;
      inertia.noalias() += m.angular.transpose() * I * m.angular;
      const RVec3 spin_momentum = I * m.w;
      force.noalias() += m.linear.transpose() * (part.mass * (gravity_ - m.bias_linear));
      force.noalias() -= m.angular.transpose() * (I * m.bias_angular + m.w.cross(spin_momentum));
      if (part.joint < 0) continue;
      const Joint& hinge = model_.joints[part.joint];
      const Real q = y[part.coordinate], rate = y[part.speed];
      inertia(part.tree_speed, part.tree_speed) += static_cast<Real>(hinge.armature);
      force[part.tree_speed] += torque_[part.joint] -
                                hinge.stiffness * (q - static_cast<Real>(hinge.spring_reference)) -
                                hinge.damping * rate;
    }
    const Vector acceleration = inertia.llt().solve(force);

    for (int i : tree.bodies) {
      const Part& part = parts_[i];
      if (part.joint >= 0) {
        dydt[part.coordinate] = y[part.speed];
        dydt[part.speed] = acceleration[part.tree_speed];
        continue;
      }
      // q' = (0, w) q / 2 for an angular velocity in world axes
      const Real* c = &y[part.coordinate];
      const RQuat q(c[3], c[4], c[5], c[6]);
      const RVec3 w = moving_[i].w;
      const RVec3 vector_rate = (w * q.w() + w.cross(q.vec())) / 2;
      for (int k = 0; k < 3; ++k) {
        dydt[part.coordinate + k] = y[part.speed + k];
        dydt[part.coordinate + 4 + k] = vector_rate[k];
      }
      dydt[part.coordinate + 3] = -w.dot(q.vec()) / 2;
      for (int k = 0; k < 6; ++k) dydt[part.speed + k] = acceleration[part.tree_speed + k];
    }
  }

  const Model& model_;
  const SmoothOptions& options_;
  std::vector<Part> parts_;
  std::vector<Tree> trees_;
  int size_ = 0;
  RVec3 gravity_;
  std::vector<Moving> moving_;  // scratch, valid after set_kinematics()
  std::vector<double> angle_, rate_, torque_;
};

}  // namespace

std::string smooth_obstacle(const Model& model) {
  if (!model.contacts.empty()) {
    return fmt::format("its {} contact pairs make the motion non-smooth", model.contacts.size());
  }
  return "";
}

std::vector<State> smooth_solution(const Model& model, const State& start, const std::vector<double>& times,
                                   const SmoothOptions& options) {
  namespace odeint = boost::numeric::odeint;
  if (const std::string obstacle = smooth_obstacle(model); !obstacle.empty()) {
    throw InputError(fmt::format("model '{}' has no smooth solution: {}; switch contacts off", model.name, obstacle));
  }
  SmoothSystem system(model, options);
  const auto derivative = [&](const Flat& y, Flat& dydt, Real t) { system.derivative(y, dydt, t); };
  const Real tolerance = options.tolerance;
  odeint::bulirsch_stoer<Flat, Real> stepper(tolerance, tolerance, 1, 1);

  Flat y = system.flatten(start);
  Real time = start.time, step = 1e-3L;
  const auto check_limits = [&] {
    if (const int hinge = system.violated_limit(y); hinge >= 0) {
      throw InputError(fmt::format("model '{}' has no smooth solution beyond {} s: hinge '{}' reaches its limit there",
                                   model.name, shortest(static_cast<double>(time)), model.joints[hinge].name));
    }
  };
  check_limits();

  std::vector<State> states;
  for (const double target : times) {
    if (target < static_cast<double>(time)) {
      throw InputError(fmt::format("time {} of a smooth solution comes after {}: times must ascend from the start's",
                                   shortest(target), shortest(static_cast<double>(time))));
    }
    int rejected = 0;
    while (time < target) {
      Real next = std::min<Real>(step, target - time);
      const bool last = next == target - time;
      const Real before = step;
      if (stepper.try_step(derivative, y, time, next) == odeint::success) {
        rejected = 0;
        if (last) time = target;                      // without leftover rounding
        step = last ? std::max(before, next) : next;  // a step shortened to reach a target is no estimate for the next
        check_limits();
      } else {
        step = next;
        if (++rejected > 100 || step < 1e-14L) {
          throw InputError(
              fmt::format("model '{}': the smooth solution stops at {} s, where no step keeps an error of {}",
                          model.name, shortest(static_cast<double>(time)), shortest(options.tolerance)));
        }
      }
    }
    states.push_back(system.unflatten(y, target));
  }
  return states;
}

State smooth_solution(const Model& model, const State& start, double time, const SmoothOptions& options) {
  return smooth_solution(model, start, std::vector<double>{time}, options).front();
}

}  // namespace assay
