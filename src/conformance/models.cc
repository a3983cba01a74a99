#include "conformance/models.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "model/kinematics.h"

namespace assay::conformance {
namespace {

Quat turned(double degrees, const Vec3& axis) {
  return Quat(Eigen::AngleAxisd(degrees * EIGEN_PI / 180, axis.normalized()));
}

}  // namespace

Solid sphere_solid(double mass, double radius) {
  return {mass, Vec3::Zero(), Mat3::Identity() * (2 * mass * radius * radius / 5)};
}

Solid capsule_solid(double mass, double radius, double half_length, const Vec3& axis) {
  const Vec3 I = capsule_inertia(mass, radius, half_length);
  const Vec3 n = axis.normalized();
  return {mass, Vec3::Zero(), I[0] * Mat3::Identity() + (I[2] - I[0]) * n * n.transpose()};
}

Solid principal_solid(double mass, const Vec3& p_BBcm, const Vec3& moments, const Quat& q_BI) {
  const Mat3 R = q_BI.toRotationMatrix();
  const Mat3 I = R * moments.asDiagonal() * R.transpose();
  return {mass, p_BBcm, (I + I.transpose()) / 2};
}

Body& add_free_body(Model& model, const std::string& name, const Solid& solid, const Pose& X_WB) {
  Body body;
  body.name = name;
  body.X_PB = X_WB;
  body.mass = solid.mass;
  body.p_BBcm = solid.p_BBcm;
  body.I_BBcm_B = solid.I_BBcm_B;
  model.bodies.push_back(body);
  return model.bodies.back();
}

Joint& add_hinged_body(Model& model, const std::string& name, int parent, const Pose& X_PB, const Solid& solid,
                       const Vec3& axis_B, const Vec3& p_BJ) {
  Body& body = add_free_body(model, name, solid, X_PB);
  body.parent = parent;
  body.joint = static_cast<int>(model.joints.size());
  Joint hinge;
  hinge.name = name + "_hinge";
  hinge.body = static_cast<int>(model.bodies.size()) - 1;
  hinge.axis_B = axis_B.normalized();
  hinge.p_BJ = p_BJ;
  model.joints.push_back(hinge);
  return model.joints.back();
}

int add_shape(Model& model, ShapeType type, int body, const Pose& X_BS, double radius, double half_length,
              double friction) {
  Shape shape;
  shape.name = fmt::format("shape_{}", model.shapes.size());
  shape.type = type;
  shape.body = body;
  shape.X_BS = X_BS;
  shape.radius = radius;
  shape.half_length = half_length;
  shape.friction = friction;
  model.shapes.push_back(shape);
  return static_cast<int>(model.shapes.size()) - 1;
}

void add_contact(Model& model, int shape_a, int shape_b, double friction) {
  model.contacts.push_back({std::min(shape_a, shape_b), std::max(shape_a, shape_b), friction});
}

Model finished(Model model) {
  model.initial = reference_state(model);
  model.hash = model_hash(model);
  return model;
}

State with_joints(const Model& model, const std::vector<double>& angle, const std::vector<double>& rate) {
  State state = model.initial;
  state.position = angle;
  state.velocity = rate;
  bodies_from_joints(model, state);
  return state;
}

Model chain(bool spatial) {
  Model model;
  model.name = spatial ? "conformance-spatial-chain" : "conformance-planar-chain";
  Solid link = capsule_solid(1, 0.05, 0.15, Vec3::UnitX());
  link.p_BBcm = {0.15, 0, 0};
  for (int i = 0; i < 5; ++i) {
    const Vec3 axis = spatial && i % 2 == 1 ? Vec3::UnitZ() : Vec3::UnitY();
    add_hinged_body(model, fmt::format("link_{}", i), i - 1, {Vec3(i == 0 ? 0 : 0.3, 0, 0), Quat::Identity()}, link,
                    axis);
  }
  model = finished(std::move(model));
  model.initial = with_joints(model, std::vector<double>(5, 0.0), std::vector<double>(5, 1.0));
  model.hash = model_hash(model);
  return model;
}

Model oblique_trees() {
  Model model;
  model.name = "conformance-oblique-trees";
  const Solid trunk = principal_solid(3, {0.04, -0.03, 0.05}, {0.05, 0.07, 0.04}, turned(40, {1, 2, 3}));
  const Solid arm = principal_solid(1.2, {0.12, 0.02, -0.01}, {0.004, 0.012, 0.014}, turned(25, {0, 1, 1}));
  const Solid hand = principal_solid(0.7, {0.02, 0.09, 0.03}, {0.006, 0.003, 0.007}, turned(-70, {2, -1, 1}));
  const Solid leg = principal_solid(1.6, {-0.02, 0.01, -0.15}, {0.018, 0.02, 0.005}, turned(15, {1, -1, 0}));
  const Solid vane = principal_solid(0.9, {0.08, -0.06, 0.1}, {0.007, 0.009, 0.012}, turned(55, {-1, 1, 2}));

  add_free_body(model, "trunk", trunk, {Vec3(0.3, -0.2, 1.1), turned(35, {1, 1, -1})});
  add_hinged_body(model, "arm", 0, {Vec3(0.15, 0.1, 0.08), turned(60, {0, 1, 2})}, arm, {1, 2, -1}, {-0.03, 0.02, 0.01})
      .reference = 0.3;
  add_hinged_body(model, "hand", 1, {Vec3(0.25, 0.03, -0.02), turned(-50, {3, 1, 0})}, hand, {0, 1, 3}, {0, -0.04, 0})
      .reference = -0.6;
  add_hinged_body(model, "leg", 0, {Vec3(-0.1, 0.05, -0.2), turned(80, {-1, 2, 1})}, leg, {2, 1, 1}, {0.01, 0, 0.05});
  add_hinged_body(model, "vane", kWorld, {Vec3(-1.2, 0.4, 0.6), turned(120, {1, 0, 2})}, vane, {-1, 1, 1},
                  {0.02, 0.03, -0.05})
      .reference = 0.8;
  return finished(std::move(model));
}

Flywheel flywheel() {
  Flywheel wheel;
  const Quat q_BI = turned(50, {1, 2, 2});
  const Vec3 moments(0.02, 0.03, 0.025);
  const Vec3 axis = q_BI * Vec3::UnitZ();
  // the anchor lies beside the centre of mass by 0.1 m along the first principal axis
  const Vec3 com(0.05, -0.02, 0.03);
  const Solid solid = principal_solid(2, com, moments, q_BI);
  wheel.model.name = "conformance-flywheel";
  wheel.model.gravity.setZero();
  add_hinged_body(wheel.model, "wheel", kWorld, {Vec3(0.2, 0.3, 0.5), turned(30, {0, 1, 1})}, solid, axis,
                  com + q_BI * Vec3(0.1, 0, 0));
  wheel.model = finished(std::move(wheel.model));
  wheel.axial_inertia = moments[2] + solid.mass * 0.1 * 0.1;
  return wheel;
}

PendulumModel pendulum() {
  PendulumModel result;
  Solid bob = capsule_solid(1, 0.05, 0.15, Vec3::UnitZ());
  bob.p_BBcm = {0, 0, -0.25};
  result.model.name = "conformance-pendulum";
  add_hinged_body(result.model, "bob", kWorld, {Vec3(0, 0, 1), Quat::Identity()}, bob, Vec3::UnitY());
  result.model = finished(std::move(result.model));
  const double pivot_inertia = bob.I_BBcm_B(1, 1) + bob.mass * 0.25 * 0.25;
  result.frequency = std::sqrt(bob.mass * kGravity * 0.25 / pivot_inertia);
  return result;
}

}  // namespace assay::conformance
