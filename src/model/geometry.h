// Vectors, rotations and poses. SI units; right-handed world frame with z up.
//
// Notation (after Drake's monogram notation): p_AB_C is the position of B's origin from A's, expressed in C; q_AB is
// the rotation that takes coordinates in B to coordinates in A; X_AB is the pose (p_AB_A, q_AB). W is the world, B a
// body's MJCF frame, P its parent's, Bcm its centre of mass.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace assay {

// No type needs over-aligned memory, so they cross plugin boundaries for any compiler flags of a plugin.
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaternion<double, Eigen::DontAlign>;  // constructed (w, x, y, z); unit length

struct Pose {
  Vec3 p = Vec3::Zero();
  Quat q = Quat::Identity();

  Vec3 operator*(const Vec3& point) const { return p + q * point; }
  Pose operator*(const Pose& other) const { return {p + q * other.p, q * other.q}; }
  Pose inverse() const { return {q.conjugate() * -p, q.conjugate()}; }
};

}  // namespace assay
