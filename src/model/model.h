// The neutral robot model: the content of one MJCF or URDF file in terms from which every engine can be set up.
//
// A tree of rigid bodies with one joint each: free, ball, hinge or slide. A body with several joints in its file is a
// chain of massless bodies that ends in the body itself, so that joints act in the file's order; massless links of a
// file are the same. Beside it shapes, contact pairs, equality constraints, fixed tendons and actuators. The loader
// (mjcf.h) refuses everything else by name, so a Model never simplifies its file silently. features.h names what a
// model uses, and each adapter declares which of it is exact, approximated or refused.
//
// A Model is built once and then only passed as `const Model&`; anything derived (no contacts, no gravity) is a copy.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "model/geometry.h"
#include "model/state.h"

namespace assay {

inline constexpr int kWorld = -1;  // parent of a tree's root, body of a static shape

enum class JointType { kFree, kBall, kHinge, kSlide };

// A moving body. Every body has exactly one joint to its parent: `joint` names a hinge or a slide, `ball` a ball joint,
// and a body with neither is free.
struct Body {
  std::string name;
  int parent = kWorld;               // index into Model::bodies, always smaller than the body's own; kWorld for a root
  int joint = -1;                    // index into Model::joints (hinge or slide), else -1
  int ball = -1;                     // index into Model::balls, else -1
  Pose X_PB;                         // body frame in the parent's body frame, at the reference configuration
  double mass = 0;                   // kg; 0 for a massless body, which only composes joints, then the inertia is 0 too
  Vec3 p_BBcm = Vec3::Zero();        // centre of mass in the body frame, m; zero for a massless body
  Mat3 I_BBcm_B = Mat3::Identity();  // rotational inertia about the centre of mass, in body axes, kg m^2

  bool is_free() const { return joint < 0 && ball < 0; }  // its parent is the world
  bool is_massless() const { return mass == 0; }
};

// A joint of one coordinate between body and parent: a hinge turns about its axis, a slide moves along it. At position
// = reference the body has the pose X_PB; the axis is fixed in both bodies. "u" below stands for rad (hinge) or m
// (slide), "F" for Nm (hinge) or N (slide).
struct Joint {
  std::string name;
  int body = 0;                 // the child: index into Model::bodies
  Vec3 p_BJ = Vec3::Zero();     // anchor in the child's body frame, m
  Vec3 axis_B = Vec3::UnitZ();  // unit axis in the child's body frame (the same in the parent's, through X_PB)
  double reference = 0;         // u
  bool limited = false;
  double lower = 0, upper = 0;         // u; meaningful when limited
  double stiffness = 0;                // F/u, force = -stiffness (position - spring_reference)
  double spring_reference = 0;         // u
  double damping = 0;                  // F s/u, force = -damping velocity
  double armature = 0;                 // F s^2/u, added to the joint-space inertia's diagonal
  JointType type = JointType::kHinge;  // kHinge or kSlide
  double dry_friction = 0;             // F, the largest force of Coulomb friction in the joint; 0 for none

  bool is_slide() const { return type == JointType::kSlide; }
  bool has_spring() const { return stiffness != 0 || damping != 0; }
};

// A ball joint between body and parent. Its state is the body's own orientation and angular velocity; its deflection is
// the rotation vector of the relative rotation from the pose X_PB.
struct BallJoint {
  std::string name;
  int body = 0;              // the child: index into Model::bodies
  Vec3 p_BJ = Vec3::Zero();  // anchor in the child's body frame, m
  bool limited = false;
  double upper = 0;      // rad, largest angle of the deflection; meaningful when limited
  double stiffness = 0;  // Nm/rad, torque = -stiffness deflection from spring_reference, about its rotation vector
  Quat spring_reference = Quat::Identity();  // relative rotation from X_PB at which the spring is at rest
  double damping = 0;                        // Nms/rad, torque = -damping (relative angular velocity)
  double armature = 0;      // kg m^2, added to the joint-space inertia of the relative angular velocity
  double dry_friction = 0;  // Nm, a component of the relative angular velocity in child axes; 0 for none

  bool has_spring() const { return stiffness != 0 || damping != 0; }
};

// The convex hull of a mesh, computed once and the same for every engine. Closed, outward-facing triangles.
struct Hull {
  std::string name;                       // the mesh's
  std::vector<Vec3> vertices;             // m, in the shape frame; each belongs to a triangle
  std::vector<std::array<int, 3>> faces;  // indices into vertices, counter-clockwise from outside
};

// Heights over a grid in the shape frame's x-y plane, joined by triangles whose diagonal runs from (row, column + 1) to
// (row + 1, column). Sample (row, column) lies at x = -half_x + column 2 half_x / (columns - 1), y = -half_y + row
// 2 half_y / (rows - 1).
struct HeightField {
  std::string name;
  int rows = 0, columns = 0;      // at least 2
  double half_x = 0, half_y = 0;  // m
  double base = 0;                // m, thickness of the solid below height 0
  std::vector<double> heights;    // m, row by row, not negative
};

enum class ShapeType { kSphere, kCapsule, kPlane, kBox, kCylinder, kEllipsoid, kHull, kHeightField };

// A collision shape. Capsules and cylinders lie along their own z axis; a plane's normal is its z axis, and planes and
// height fields belong to the world.
struct Shape {
  std::string name;
  ShapeType type = ShapeType::kSphere;
  int body = kWorld;       // index into Model::bodies, or kWorld
  Pose X_BS;               // shape frame in the body frame (world frame for static shapes)
  double radius = 0;       // m; sphere, capsule, cylinder
  double half_length = 0;  // m; capsule: half of the cylinder's length, caps not counted; cylinder: half of its length
  double friction = 1;     // Coulomb coefficient, before combination; see ContactPair for the one that acts
  bool collides = true;    // false: drawn only
  std::array<float, 4> rgba = {0.5f, 0.5f, 0.5f, 1.0f};
  Vec3 half_size = Vec3::Zero();  // m; box: half of its edges; ellipsoid: semi-axes
  int data = -1;                  // hull: index into Model::hulls; height field: into Model::height_fields
};

// Two shapes that may touch. `friction` is the combined Coulomb coefficient that every engine has to use: MuJoCo's
// rule, the larger of the two, unless the file gives the pair a value of its own. Torsional and rolling friction resist
// the relative rotation about and across the contact's normal with at most that length times the normal force.
struct ContactPair {
  int shape_a = 0, shape_b = 0;  // indices into Model::shapes, a < b
  double friction = 1;
  double torsional = 0, rolling = 0;  // m; 0 for none
};

// ---- equality constraints and tendons -------------------------------------------------------------------------------

// One joint's share in a sum of joint positions.
struct JointTerm {
  int joint = 0;           // index into Model::joints
  double coefficient = 0;  // of its position
};

// position of `joint` = offset + sum of the terms: mimic in URDF, equality of joints or of a fixed tendon in MJCF.
struct Coupling {
  std::string name;
  int joint = 0;                 // index into Model::joints
  std::vector<JointTerm> terms;  // none for a joint that is held at `offset`
  double offset = 0;             // in the unit of `joint`
};

// A point of one body held at a point of another (connect in MJCF).
struct Connect {
  std::string name;
  int body_a = 0, body_b = kWorld;  // indices into Model::bodies, kWorld for the world; not both
  Vec3 p_A = Vec3::Zero();          // m, in body a's frame
  Vec3 p_B = Vec3::Zero();          // m, in body b's frame
};

// One body held rigidly at another (weld in MJCF).
struct Weld {
  std::string name;
  int body_a = 0, body_b = kWorld;  // indices into Model::bodies, kWorld for the world; not both
  Pose X_AB;                        // body b's frame in body a's
};

// A fixed tendon: its length is the sum of its terms. It acts on every joint of it with its tension times the joint's
// coefficient.
struct Tendon {
  std::string name;
  std::vector<JointTerm> terms;
  double stiffness = 0;                   // tension = -stiffness (length - the nearest length of the rest range)
  double rest_lower = 0, rest_upper = 0;  // no spring force between
  double damping = 0;                     // tension = -damping d(length)/dt
  bool limited = false;
  double lower = 0, upper = 0;  // meaningful when limited
  double dry_friction = 0;      // largest tension of Coulomb friction; 0 for none

  bool has_spring() const { return stiffness != 0 || damping != 0; }
};

// amplitude sin(2 pi frequency t + phase)
struct Sine {
  double amplitude = 0;  // in the unit of the quantity it is added to
  double frequency = 1;  // Hz
  double phase = 0;      // rad
};

// What stands between an actuator's control u and its force: an activation a that follows u and takes its place.
enum class ActivationType {
  kNone,        // a = u
  kFilter,      // da/dt = (u - a) / time_constant
  kIntegrator,  // da/dt = u
};

// Acts on one joint or, through a fixed tendon, on several: its length l is the sum of coefficient (there: gear) times
// position over its terms, and each joint gets its coefficient times the force
//   force = gain a + bias[0] + bias[1] l + bias[2] dl/dt,
// clamped to [force_lower, force_upper] when force_limited, u to [control_lower, control_upper] when control_limited,
// a to [activation_lower, activation_upper] when activation_limited. A motor has gain 1 and no bias, a position
// actuator gain kp and bias (0, -kp, -kv), a velocity actuator gain kv and bias (0, 0, -kv). u is the keyframe's
// control plus `sine` at the state's time. An actuator with an activation and a sine has no limits of either.
struct Actuator {
  std::string name;
  std::vector<JointTerm> terms;
  double gain = 1;
  std::array<double, 3> bias = {0, 0, 0};
  Sine sine;  // amplitude in the control's unit
  bool control_limited = false, force_limited = false;
  double control_lower = 0, control_upper = 0;
  double force_lower = 0, force_upper = 0;
  ActivationType activation = ActivationType::kNone;
  double time_constant = 0;     // s, positive; filter
  double activation_start = 0;  // at time 0
  bool activation_limited = false;
  double activation_lower = 0, activation_upper = 0;

  bool has_activation() const { return activation != ActivationType::kNone; }
  bool has_feedback() const { return bias[1] != 0 || bias[2] != 0; }
};

struct Keyframe {
  std::string name;
  State state;
  std::vector<double> control;  // one per actuator
};

struct Model {
  std::string name;              // MJCF's model name, or the file's stem
  std::string source;            // path as the user gave it, empty for a string
  std::string hash;              // content address of everything below: equal hashes mean equal physics
  Vec3 gravity = {0, 0, -9.81};  // m/s^2
  std::vector<Body> bodies;
  std::vector<Joint> joints;  // hinges and slides
  std::vector<BallJoint> balls;
  std::vector<Shape> shapes;
  std::vector<Hull> hulls;
  std::vector<HeightField> height_fields;
  std::vector<ContactPair> contacts;
  std::vector<Coupling> couplings;
  std::vector<Connect> connects;
  std::vector<Weld> welds;
  std::vector<Tendon> tendons;
  std::vector<Actuator> actuators;
  std::vector<Keyframe> keyframes;
  State initial;                   // the first keyframe where there is one, else the reference state at rest; time 0
  std::vector<double> control0;    // the first keyframe's controls, else zero; one per actuator
  std::vector<std::string> notes;  // parts of the file that were ignored, fused or left out, a sentence each

  int dof() const;  // as MuJoCo's nv: 1 for a hinge or slide, 3 for a ball, 6 for a free joint
  double total_mass() const;
  bool has_springs() const;  // of hinges and slides, as the next two
  bool has_armature() const;
  bool has_limits() const;
};

// Copies that differ in one respect, for `--contacts off`, `--gravity off` and the astronaut's energy test. Their hash
// differs too.
Model without_contacts(Model model);
Model without_gravity(Model model);

// The content address that the loader stores in Model::hash. It covers the physics and the initial state, not file
// names.
std::string model_hash(const Model& model);

}  // namespace assay
