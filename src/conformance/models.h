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

Quat about_axis(double angle, const Vec3& axis);  // rad; the axis need not be of unit length

Solid sphere_solid(double mass, double radius);
Solid capsule_solid(double mass, double radius, double half_length, const Vec3& axis);
Solid box_solid(double mass, const Vec3& half_size);
Solid cylinder_solid(double mass, double radius, double half_length);  // along z
// Principal moments along the axes of a frame turned by `q_BI` in the body.
Solid principal_solid(double mass, const Vec3& p_BBcm, const Vec3& moments, const Quat& q_BI);

// Each adds an element to the model and returns it. The next addition invalidates the reference.
Body& add_free_body(Model& model, const std::string& name, const Solid& solid, const Pose& X_WB = {});
Joint& add_hinged_body(Model& model, const std::string& name, int parent, const Pose& X_PB, const Solid& solid,
                       const Vec3& axis_B, const Vec3& p_BJ = Vec3::Zero());
Joint& add_sliding_body(Model& model, const std::string& name, int parent, const Pose& X_PB, const Solid& solid,
                        const Vec3& axis_B, const Vec3& p_BJ = Vec3::Zero());
BallJoint& add_ball_body(Model& model, const std::string& name, int parent, const Pose& X_PB, const Solid& solid,
                         const Vec3& p_BJ = Vec3::Zero());
// A body without mass: for `solid` of the bodies that only compose joints.
Solid massless();
int add_shape(Model& model, ShapeType type, int body, const Pose& X_BS = {}, double radius = 0, double half_length = 0,
              double friction = 1);
void add_contact(Model& model, int shape_a, int shape_b, double friction);

// The hull of a box, centred: eight vertices, twelve triangles.
Hull box_hull(const Vec3& half_size);
// A square height field of 2 half by 2 half metres whose heights rise from 0 along x with `slope`.
HeightField flat_field(double half, double base, double slope);

// Fills the initial state (reference, at rest) and the hash. Call it last.
Model finished(Model model);

// The same model at other positions and rates of hinges and slides; free bodies and the relative motions of ball joints
// do not change.
State with_joints(const Model& model, const std::vector<double>& angle, const std::vector<double>& rate);

// Puts the body of a ball joint at a relative rotation from X_PB and a relative angular velocity (rad/s, child axes).
// Its parent's state has to be right; bodies_from_joints() does the rest.
void set_ball(const Model& model, State& state, int ball, const Quat& rotation, const Vec3& velocity);

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

// Which joints random_tree() may use beside hinges, and how large and heavy it is.
struct TreeOptions {
  int bodies = 6;     // with mass
  double mass = 1;    // kg, of a body, within a factor of 2
  double size = 0.3;  // m, length of a body, within a factor of 2
  bool free = true;   // the first tree floats
  bool slides = true, balls = true;
  bool massless = true;  // up to three joints in a row between two bodies
};

// Two trees of random shape, frames, axes, inertias and joints, in a random state. Equal seeds and options give equal
// trees; another size gives a similar one whose motion is the same, with times scaled by the square root of the size.
Model random_tree(unsigned seed, const TreeOptions& options);

}  // namespace assay::conformance
