// The equations of motion of a model in joint coordinates and extended precision: what the reference solution
// integrates and dynamics.h evaluates. Contacts, limits and dry friction are not part of it.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "model/joint.h"
#include "model/model.h"

namespace assay::reference {

using Real = long double;
using RVec3 = Eigen::Matrix<Real, 3, 1>;
using RMat3 = Eigen::Matrix<Real, 3, 3>;
using RQuat = Eigen::Quaternion<Real, Eigen::DontAlign>;
using Columns = Eigen::Matrix<Real, 3, Eigen::Dynamic>;
using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using Flat = std::vector<Real>;  // coordinates, then speeds

// As SmoothOptions::torques.
using JointTorques = std::function<void(double time, std::span<const double> position, std::span<const double> velocity,
                                        std::span<double> torque)>;

// Bodies whose motions depend on each other: a tree, or all bodies where equality constraints may join trees.
struct Group {
  std::vector<int> bodies;  // parents first
  int speeds = 0;           // generalized speeds of the group
};

// Constants of one body in extended precision, and the positions of its coordinates in the flat state.
struct Part {
  JointType type = JointType::kFree;
  int parent = kWorld;  // index into the system's parts
  int group = 0;
  int coordinate = 0;  // hinge, slide: position; ball: relative quaternion w x y z (4); free: centre of mass (3),
                       // quaternion w x y z (4)
  int speed = 0;  // in the flat state: rate; ball: relative angular velocity in child axes (3); free: velocity of the
                  // centre of mass (3), angular velocity (3), world axes
  int group_speed = 0;  // the same among the group's speeds
  int joint = -1, ball = -1;
  RVec3 p_BBcm, p_BJ, axis_B, p_PJ;
  RQuat q_PB;
  Real mass = 0;
  RMat3 inertia_B;

  int coordinates() const { return speeds() == 1 ? 1 : speeds() + 1; }  // rotations as quaternions
  int speeds() const { return speeds_of(type); }
};

// Quantities of one body while the equations are set up.
struct Moving {
  RQuat q;
  RVec3 p_cm, p_J, w, axis;
  RVec3 v_cm;
  RVec3 bias_linear, bias_angular;  // accelerations when all generalized accelerations vanish
  Columns linear, angular;          // Jacobians over the group's speeds
};

class System {
 public:
  System(const Model& model, JointTorques torques);

  int speeds() const { return size_ - coordinates_; }
  const std::vector<Group>& groups() const { return groups_; }
  const std::vector<Part>& parts() const { return parts_; }
  // Where the speeds of `part` stand in a vector of all bodies' speeds, in the order of the bodies.
  int column(const Part& part) const { return part.speed - coordinates_; }

  Flat flatten(const State& state) const;
  State unflatten(const Flat& y, double time);

  // y' = f(y, t), the signature odeint asks for.
  void derivative(const Flat& y, Flat& dydt, Real time);

  // Joint-space inertia and generalized forces of a group, M u' = force: with gravity and the bias of the motion, and
  // when `applied` with torques and the joints' springs and dampers, but without tendons. Needs prepare().
  void prepare(const Flat& y, Real time);
  void assemble(const Group& group, const Flat& y, bool applied, Matrix& inertia, Vector& force);
  // Adds the forces of springs, dampers and tendons to `force` over all speeds.
  void add_springs(const Flat& y, Vector& force) const;
  // u' = M^-1 force, on the equality constraints.
  Vector accelerations(const Group& group, const Matrix& inertia, const Vector& force);

  // How far `y` is from the equality constraints: the largest gap (m, rad) and its rate (m/s, rad/s).
  struct Gap {
    Real position = 0, velocity = 0;
  };
  Gap constraint_gap(const Flat& y);
  // Moves `y`, which is close to them, onto the constraints.
  void project(Flat& y);

  // "hinge 'knee'": the first joint or tendon beyond its limits; empty for none.
  std::string violated_limit(const Flat& y) const;

 private:
  void set_kinematics(const Flat& y);
  void set_torques(const Flat& y, Real time);
  // The joint's anchor, carried by the parent.
  struct Anchor {
    RVec3 v = RVec3::Zero(), bias = RVec3::Zero();
  };
  // Sets p_J and what `m` has of its parent's motion, of which its own angular quantities are already known.
  Anchor carry_anchor(const Part& part, Moving& m) const;
  // Moves the centre of mass about the anchor; the joint has `speeds` speeds.
  static void swing_about_anchor(const Part& part, const Anchor& anchor, int speeds, Moving& m);
  void move_ball(const Part& part, const Flat& y, Moving& m);
  void move_slide(const Part& part, const Flat& y, Moving& m);
  RVec3 ball_spring(const Part& part, const Flat& y) const;
  void add_tendons(const Flat& y, Vector& force) const;
  static RQuat relative_rotation(const Part& part, const Flat& y);
  Real position_of(int joint, const Flat& y) const { return y[joint_part(joint).coordinate]; }
  Real velocity_of(int joint, const Flat& y) const { return y[joint_part(joint).speed]; }
  const Part& joint_part(int joint) const { return parts_[model_.joints[joint].body]; }
  Real sum_of(const std::vector<JointTerm>& terms, const Flat& y, bool velocity) const;

  // Rows of the constraints' Jacobian over all speeds, their accelerations when all generalized accelerations vanish,
  // and the gaps and their rates. Needs set_kinematics().
  struct Constraints {
    Matrix jacobian;
    Vector bias, gap, rate;
  };
  Constraints constraints(const Flat& y) const;
  void add_point_rows(int body_a, const Vec3& p_A, int body_b, const Vec3& p_B, int row, Constraints& c) const;

  const Model& model_;
  JointTorques given_torques_;
  std::vector<Part> parts_;
  std::vector<Group> groups_;
  int coordinates_ = 0, size_ = 0;
  int constraint_rows_ = 0;
  RVec3 gravity_;
  std::vector<Moving> moving_;  // scratch, valid after set_kinematics()
  std::vector<double> position_, velocity_, torque_;
  Flat prepared_;  // the state of the last prepare(), when there are constraints
};

}  // namespace assay::reference
