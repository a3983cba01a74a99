// Between assay's double vectors and PhysX's, whose scalar is float.
#pragma once

#include <foundation/PxTransform.h>

#include "model/geometry.h"

namespace assay::px {

constexpr float real(double x) { return static_cast<float>(x); }

inline physx::PxVec3 to_px(const Vec3& v) { return {real(v.x()), real(v.y()), real(v.z())}; }
inline physx::PxQuat to_px(const Quat& q) { return {real(q.x()), real(q.y()), real(q.z()), real(q.w())}; }
inline physx::PxTransform to_px(const Pose& X) { return {to_px(X.p), to_px(X.q)}; }

inline Vec3 from_px(const physx::PxVec3& v) { return {v.x, v.y, v.z}; }
inline Quat from_px(const physx::PxQuat& q) { return Quat(q.w, q.x, q.y, q.z).normalized(); }
inline Pose from_px(const physx::PxTransform& X) { return {from_px(X.p), from_px(X.q)}; }

// PhysX's capsules lie along x, its planes face x, its hinges turn about x; in the model it is z, or the hinge's axis.
inline Quat x_to(const Vec3& axis) { return Quat(Eigen::Quaterniond::FromTwoVectors(Vec3::UnitX(), axis)); }

}  // namespace assay::px
