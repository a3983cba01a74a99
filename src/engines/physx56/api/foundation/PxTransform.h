// PhysX's vectors, quaternions and poses: laid out as PhysX has them, in this memory as in the module's.
#pragma once

#include <cmath>
#include <cstdint>

#define PX_MAX_F32 3.4028234663852885981170418348452e+38F

namespace physx {

using PxU8 = std::uint8_t;
using PxU16 = std::uint16_t;
using PxI16 = std::int16_t;
using PxU32 = std::uint32_t;
using PxReal = float;

enum PxIDENTITY { PxIdentity };  // NOLINT(performance-enum-size): PhysX's own

inline constexpr float PxPi = 3.141592653589793F;
inline constexpr float PxHalfPi = 1.57079632679489661923F;

struct PxVec3 {
  float x = 0, y = 0, z = 0;

  PxVec3() = default;
  explicit PxVec3(float all) : x(all), y(all), z(all) {}
  PxVec3(float x_, float y_, float z_) : x(x_), y(y_), z(z_) {}

  PxVec3 operator-() const { return {-x, -y, -z}; }
  PxVec3 operator+(const PxVec3& v) const { return {x + v.x, y + v.y, z + v.z}; }
  PxVec3 operator-(const PxVec3& v) const { return {x - v.x, y - v.y, z - v.z}; }
  PxVec3 operator*(float f) const { return {x * f, y * f, z * f}; }
  float dot(const PxVec3& v) const { return x * v.x + y * v.y + z * v.z; }
  PxVec3 cross(const PxVec3& v) const { return {y * v.z - z * v.y, z * v.x - x * v.z, x * v.y - y * v.x}; }
  float magnitude() const { return std::sqrt(dot(*this)); }
};

struct PxQuat {
  float x = 0, y = 0, z = 0, w = 1;

  PxQuat() = default;
  explicit PxQuat(PxIDENTITY /*identity*/) {}
  PxQuat(float x_, float y_, float z_, float w_) : x(x_), y(y_), z(z_), w(w_) {}
  PxQuat(float angle, const PxVec3& axis) {
    const float s = std::sin(angle / 2);
    x = axis.x * s;
    y = axis.y * s;
    z = axis.z * s;
    w = std::cos(angle / 2);
  }

  PxQuat operator*(const PxQuat& q) const {
    return {w * q.x + q.w * x + y * q.z - q.y * z, w * q.y + q.w * y + z * q.x - q.z * x,
            w * q.z + q.w * z + x * q.y - q.x * y, w * q.w - x * q.x - y * q.y - z * q.z};
  }
  PxVec3 rotate(const PxVec3& v) const {
    const PxVec3 im(x, y, z);
    return v * (2 * (w * w - 0.5F)) + im.cross(v) * (2 * w) + im * (2 * im.dot(v));
  }
  PxVec3 getBasisVector0() const { return rotate({1, 0, 0}); }
};

struct PxTransform {
  PxQuat q;
  PxVec3 p;

  PxTransform() = default;
  explicit PxTransform(PxIDENTITY /*identity*/) {}
  explicit PxTransform(const PxVec3& p_) : p(p_) {}
  explicit PxTransform(const PxQuat& q_) : q(q_) {}
  PxTransform(float x, float y, float z) : p(x, y, z) {}
  PxTransform(const PxVec3& p_, const PxQuat& q_) : q(q_), p(p_) {}

  PxVec3 transform(const PxVec3& v) const { return q.rotate(v) + p; }
  PxTransform operator*(const PxTransform& X) const { return {q.rotate(X.p) + p, q * X.q}; }
};

}  // namespace physx
