// Bullet 3.2.7, BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY and _WORLD: no gyroscopic torque where the product of a
// body's principal moments is below SIMD_EPSILON (2.2e-16 in double, 1.2e-7 in single precision, so already a body of
// 0.3 kg and 0.3 m).
//
// A free body is spun about no principal axis. Its angular velocity changes in a step by what does not depend on the
// scale of its inertia. With moments of about 1 kg m^2 it does; scaled down until their product is below SIMD_EPSILON
// it does not change at all, and the explicit torque still acts.
//
// Cause: btMatrix3x3::solve33, which solves the 3 x 3 system of the implicit torque, divides by the determinant only if
// this is above SIMD_EPSILON; else it multiplies by it.
//
// Ends with status 0 while Bullet behaves so, 1 when it does not: then LightBody in rigid.cc can go.
#include <cstdio>

#include "world.h"

namespace {

// What the angular velocity changes by within a step of 1 ms, rad/s.
btScalar change(btScalar scale, int mode) {
  finding::World world(0);
  world.getSolverInfo().m_maxGyroscopicForce = SIMD_INFINITY;
  btSphereShape shape(static_cast<btScalar>(0.1));
  btRigidBody& body =
      world.add_body(1, shape, btVector3(1, 2, static_cast<btScalar>(2.5)) * scale, btTransform::getIdentity());
  body.setFlags(mode);
  const btVector3 spin(10, -20, 15);
  body.setAngularVelocity(spin);
  world.stepSimulation(static_cast<btScalar>(1e-3), 0);
  return (body.getAngularVelocity() - spin).length();
}

}  // namespace

int main() {
  // 1, and what puts the product of the moments on either side of SIMD_EPSILON
  const btScalar edge = btPow(SIMD_EPSILON / 5, static_cast<btScalar>(1) / 3);
  bool so = true;
  for (const int mode : {BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY, BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD,
                         BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT}) {
    const btScalar heavy = change(1, mode), above = change(edge * static_cast<btScalar>(1.1), mode);
    const btScalar below = change(edge * static_cast<btScalar>(0.9), mode);
    std::printf("flag %d: %.6f rad/s in a step at 1 kg m^2, %.6f just above SIMD_EPSILON, %.6f below\n", mode,
                static_cast<double>(heavy), static_cast<double>(above), static_cast<double>(below));
    const auto alike = [heavy](btScalar other) { return btFabs(other - heavy) < heavy / 100; };
    const bool implicit = mode != BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT;
    so = so && heavy > static_cast<btScalar>(0.1) && alike(above) && (implicit ? below < heavy / 1000 : alike(below));
  }
  return so ? 0 : 1;
}
