// The suite's own small models, written in C++ instead of MJCF. So the suite needs neither the loader nor MuJoCo, an
// engine's author can run it without them, and a mistake of the loader cannot hide one of an adapter.
#pragma once

#include <string>

#include "model/model.h"

namespace assay::conformance {

inline constexpr double kGravity = 9.81;  // m/s^2

// Mass, centre of mass in the body frame, and inertia about it in body axes.
struct Solid {
  double mass = 1;
  Vec3 p_BBcm = Vec3::Zero();
  Mat3 I_BBcm_B = Mat3::Identity();
};

Solid sphere_solid(double mass, double radius);
Solid capsule_solid(double mass, double radius, double half_length, const Vec3& axis);
// Principal moments along the axes of a frame turned by `q_BI` in the body.
Solid principal_solid(double mass, const Vec3& p_BBcm, const Vec3& moments, const Quat& q_BI);

// Each adds an element to the model and returns it. The next addition invalidates the reference.
Body& add_free_body(Model& model, const std::string& name, const Solid& solid, const Pose& X_WB = {});
Joint& add_hinged_body(Model& model, const std::string& name, int parent, const Pose& X_PB, const Solid& solid,
                       const Vec3& axis_B, const Vec3& p_BJ = Vec3::Zero());
int add_shape(Model& model, ShapeType type, int body, const Pose& X_BS = {}, double radius = 0, double half_length = 0,
              double friction = 1);
void add_contact(Model& model, int shape_a, int shape_b, double friction);

// Fills the initial state (reference, at rest) and the hash. Call it last.
Model finished(Model model);

// The same model at other joint angles and rates; free bodies do not change.
State with_joints(const Model& model, const std::vector<double>& angle, const std::vector<double>& rate);

// Five capsules of 1 kg, radius 0.05 m and cylinder 0.3 m, each 0.3 m from the last along x, the first pinned at the
// origin; gravity; every joint rate 1 rad/s in the initial state. Axes y, or y z y z y when spatial.
Model chain(bool spatial);

// A floating body with a branch of two bodies and one of a single body, and a second tree fixed to the world by a
// hinge. Frames are rotated, anchors, centres of mass and axes are oblique, inertias have products, references are not
// 0.
Model oblique_trees();

// One body on a hinge to the world, off its centre of mass and along an oblique principal axis of no symmetry; no
// gravity. `axial_inertia` is the inertia about the hinge's axis.
struct Flywheel {
  Model model;
  double axial_inertia = 0;  // kg m^2
};
Flywheel flywheel();

// A capsule that hangs from a hinge along y; angle 0 is straight down.
struct PendulumModel {
  Model model;
  double frequency = 0;  // of small swings, rad/s
};
PendulumModel pendulum();

}  // namespace assay::conformance
