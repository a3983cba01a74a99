// Between assay's double vectors and Bullet's, whose scalar is float or double.
#pragma once

#include <LinearMath/btTransform.h>

#include "model/geometry.h"

namespace assay::bullet {

// A number in Bullet's precision.
constexpr btScalar real(double x) { return static_cast<btScalar>(x); }

inline btVector3 to_bt(const Vec3& v) { return {real(v.x()), real(v.y()), real(v.z())}; }
inline btQuaternion to_bt(const Quat& q) { return {real(q.x()), real(q.y()), real(q.z()), real(q.w())}; }
inline btTransform to_bt(const Pose& X) { return btTransform(to_bt(X.q), to_bt(X.p)); }

inline Vec3 from_bt(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

inline Mat3 from_bt(const btMatrix3x3& m) {
  Mat3 result;
  for (int i = 0; i < 3; ++i) result.row(i) = from_bt(m.getRow(i)).transpose();
  return result;
}

inline Quat from_bt(const btQuaternion& q) { return Quat(q.w(), q.x(), q.y(), q.z()).normalized(); }

inline Pose from_bt(const btTransform& X) { return {from_bt(X.getOrigin()), Quat(from_bt(X.getBasis())).normalized()}; }

}  // namespace assay::bullet
