// Bullet 3.2.7, btMultiBodyJointLimitConstraint: while split impulse is on, which is Bullet's default, a joint that is
// beyond its limit stays there.
//
// One link on a hinge starts at rest 0.08 rad beyond its limit. Without split impulse it comes back within some steps;
// with it, it does not move.
//
// Cause: with split impulse the correction of a position goes to m_rhsPenetration of its row. The multibody solver
// reads m_rhs alone. (Contacts of multibodies put it into m_rhs in any case: multibody_contact.cc.)
//
// Ends with status 0 while Bullet behaves so, 1 when it does not: then split_impulse may apply to multibodies.
#include <cmath>
#include <cstdio>

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyJointLimitConstraint.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include "world.h"

namespace {

using finding::real;

constexpr double kLimit = 0.6, kStart = 0.68;

// The nearest that the hinge comes to the limit within 1 s, rad beyond it.
double remains(bool split_impulse) {
  finding::MultiBodyWorld world(0);
  world.getSolverInfo().m_splitImpulse = split_impulse ? 1 : 0;
  world.getSolverInfo().m_splitImpulsePenetrationThreshold = 0;
  btMultiBody body(1, 0, btVector3(0, 0, 0), true, false);
  body.setLinearDamping(0);
  body.setAngularDamping(0);
  body.setupRevolute(0, 1, btVector3(1, 1, 1) * real(0.01), -1, btQuaternion::getIdentity(), btVector3(0, 0, 1),
                     btVector3(0, 0, 0), btVector3(0, 0, 0), false);
  body.finalizeMultiDof();
  world.addMultiBody(&body);
  body.setJointPos(0, real(kStart));
  // the island of a limit is found through its link's collider
  btSphereShape shape(real(0.01));
  btMultiBodyLinkCollider collider(&body, 0);
  collider.setCollisionShape(&shape);
  collider.setActivationState(DISABLE_DEACTIVATION);
  body.getLink(0).m_collider = &collider;
  world.addCollisionObject(&collider, 0, 0);
  btMultiBodyJointLimitConstraint limit(&body, 0, real(-1), real(kLimit));
  world.addMultiBodyConstraint(&limit);
  double nearest = kStart - kLimit;
  for (int i = 0; i < 1000; ++i) {
    world.stepSimulation(real(1e-3), 0);
    nearest = std::fmin(nearest, static_cast<double>(body.getJointPos(0)) - kLimit);
  }
  world.removeMultiBodyConstraint(&limit);
  world.removeCollisionObject(&collider);
  world.removeMultiBody(&body);
  return std::fmax(nearest, 0);
}

}  // namespace

int main() {
  const double without = remains(false), with = remains(true);
  std::printf("from %.3f rad beyond its limit: %.4f rad remain without split impulse, %.4f rad with it\n",
              kStart - kLimit, without, with);
  return without < 0.01 && with > 0.9 * (kStart - kLimit) ? 0 : 1;
}
