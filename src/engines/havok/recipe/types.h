// What the arguments and results of Havok's exported functions look like. The module itself describes its structures
// and enumerations when it starts (to JavaScript, through the functions named _embind_register_*): these are the
// offsets and numbers that it gives.
#pragma once

#include <cstdint>

namespace havok {

using Id = std::uint64_t;

// Structures as they lie in the module's memory.
struct Vector3 {
  float x = 0, y = 0, z = 0;
};
struct Quaternion {
  float x = 0, y = 0, z = 0, w = 1;
};
struct QTransform {
  Vector3 translation;
  Quaternion rotation;
};
struct MassProperties {
  Vector3 center_of_mass;
  float mass = 1;
  Vector3 inertia_per_mass{1, 1, 1};
  Quaternion inertia_orientation;
};
struct Material {
  float static_friction = 0.5f, dynamic_friction = 0.5f, restitution = 0;
  std::uint32_t friction_combine = 0, restitution_combine = 0;
};
struct FilterInfo {
  std::uint32_t membership = 0, collision = 0;
};
struct QSTransform {
  Vector3 translation;
  Quaternion rotation;
  Vector3 scale{1, 1, 1};
};

// The numbers of the module's enumerations. Its declarations for TypeScript have other ones.
enum MotionType : std::uint32_t { kStatic = 1, kKinematic = 2, kDynamic = 4 };
enum Axis : std::uint32_t { kLinearX, kLinearY, kLinearZ, kAngularX, kAngularY, kAngularZ };
enum AxisMode : std::uint32_t { kFree, kLimited, kLocked };
enum MotorType : std::uint32_t { kNoMotor, kVelocityMotor, kPositionMotor, kSpringForce, kSpringAcceleration };
enum Combine : std::uint32_t { kGeometricMean, kMinimum, kMaximum, kArithmeticMean, kMultiply };
enum ActivationControl : std::uint32_t { kSimulationControlled, kAlwaysActive, kAlwaysInactive };

}  // namespace havok
