// The neutral robot model: the content of one MJCF or URDF file in terms from which every engine can be set up.
//
// It covers the common subset of the paper (section II): hinge joints between parent and child, free joints for
// floating bodies, spheres, capsules and a fixed plane, Coulomb friction, gravity, joint springs, dampers and torques.
// The loader (mjcf.h) refuses everything else, so a Model never simplifies its file silently.
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

// A moving rigid body. Every body has exactly one joint to its parent: `hinge` names it, or the body is free.
struct Body {
  std::string name;
  int parent = kWorld;               // index into Model::bodies, always smaller than the body's own; kWorld for a root
  int hinge = -1;                    // index into Model::hinges; -1: free joint (then parent is the world)
  Pose X_PB;                         // body frame in the parent's body frame, at the reference configuration
  double mass = 0;                   // kg, positive
  Vec3 p_BBcm = Vec3::Zero();        // centre of mass in the body frame, m
  Mat3 I_BBcm_B = Mat3::Identity();  // rotational inertia about the centre of mass, in body axes, kg m^2

  bool is_free() const { return hinge < 0; }
};

// A hinge between body and parent. At angle = reference the body has the pose X_PB; the axis is fixed in both bodies.
struct Hinge {
  std::string name;
  int body = 0;                 // the child: index into Model::bodies
  Vec3 p_BJ = Vec3::Zero();     // anchor in the child's body frame, m
  Vec3 axis_B = Vec3::UnitZ();  // unit axis in the child's body frame (the same in the parent's, through X_PB)
  double reference = 0;         // rad
  bool limited = false;
  double lower = 0, upper = 0;  // rad; meaningful when limited
  double stiffness = 0;         // Nm/rad, torque = -stiffness (angle - spring_reference)
  double spring_reference = 0;  // rad
  double damping = 0;           // Nms/rad, torque = -damping rate
  double armature = 0;          // kg m^2, added to the joint-space inertia's diagonal

  bool has_spring() const { return stiffness != 0 || damping != 0; }
};

enum class ShapeType { kSphere, kCapsule, kPlane };

// A collision shape. Capsules lie along their own z axis; a plane's normal is its z axis and it belongs to the world.
struct Shape {
  std::string name;
  ShapeType type = ShapeType::kSphere;
  int body = kWorld;       // index into Model::bodies, or kWorld
  Pose X_BS;               // shape frame in the body frame (world frame for static shapes)
  double radius = 0;       // m; sphere, capsule
  double half_length = 0;  // m; capsule: half of the cylinder's length, caps not counted
  double friction = 1;     // Coulomb coefficient, before combination; see ContactPair for the one that acts
  bool collides = true;    // false: drawn only
  std::array<float, 4> rgba = {0.5f, 0.5f, 0.5f, 1.0f};
};

// Two shapes that may touch. `friction` is the combined Coulomb coefficient that every engine has to use: MuJoCo's
// rule, the larger of the two, unless the file gives the pair a value of its own.
struct ContactPair {
  int shape_a = 0, shape_b = 0;  // indices into Model::shapes, a < b
  double friction = 1;
};

// amplitude sin(2 pi frequency t + phase)
struct Sine {
  double amplitude = 0;  // in the unit of the quantity it is added to
  double frequency = 1;  // Hz
  double phase = 0;      // rad
};

enum class ActuatorType { kMotor, kPosition };

// torque = gear * u for a motor; for a position actuator kp (u - gear angle) - kv gear rate, times gear. Clamped to
// [force_lower, force_upper] before the gear when force_limited, u to [control_lower, control_upper] when
// control_limited. u is the keyframe's control plus `sine` at the state's time.
struct Actuator {
  std::string name;
  ActuatorType type = ActuatorType::kMotor;
  int hinge = 0;  // index into Model::hinges
  double gear = 1;
  double kp = 0;  // Nm/rad
  double kv = 0;  // Nms/rad
  Sine sine;      // amplitude in the control's unit: for a motor with gear 1 Nm, for a position actuator rad
  bool control_limited = false, force_limited = false;
  double control_lower = 0, control_upper = 0;
  double force_lower = 0, force_upper = 0;
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
  std::vector<Hinge> hinges;
  std::vector<Shape> shapes;
  std::vector<ContactPair> contacts;
  std::vector<Actuator> actuators;
  std::vector<Keyframe> keyframes;
  State initial;                   // the first keyframe where there is one, else the reference state at rest; time 0
  std::vector<double> control0;    // the first keyframe's controls, else zero; one per actuator
  std::vector<std::string> notes;  // parts of the file that were ignored, fused or left out, a sentence each

  int dof() const;  // as MuJoCo's nv: 1 for a hinge, 6 for a free joint
  double total_mass() const;
  bool has_springs() const;
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
