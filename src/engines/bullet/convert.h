// Between assay's double vectors and Bullet's, whose scalar is float or double.
#pragma once

#include <LinearMath/btTransform.h>

#include "model/geometry.h"

namespace assay::bullet {

inline btVector3 to_bt(const Vec3& v) { return {btScalar(v.x()), btScalar(v.y()), btScalar(v.z())}; }
inline btQuaternion to_bt(const Quat& q) {
  return {btScalar(q.x()), btScalar(q.y()), btScalar(q.z()), btScalar(q.w())};
}
inline btTransform to_bt(const Pose& X) { return btTransform(to_bt(X.q), to_bt(X.p)); }

inline Vec3 from_bt(const btVector3& v) { return {double(v.x()), double(v.y()), double(v.z())}; }

inline Mat3 from_bt(const btMatrix3x3& m) {
  Mat3 result;
  for (int i = 0; i < 3; ++i) result.row(i) = from_bt(m.getRow(i)).transpose();
  return result;
}

inline Quat from_bt(const btQuaternion& q) {
  return Quat(double(q.w()), double(q.x()), double(q.y()), double(q.z())).normalized();
}

inline Pose from_bt(const btTransform& X) { return {from_bt(X.getOrigin()), Quat(from_bt(X.getBasis())).normalized()}; }

}  // namespace assay::bullet
