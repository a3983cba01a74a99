// Bullet 3.2.7 keeps contact points from step to step, on each body where they were found, until they are 2 cm apart
// (btPersistentManifold). On a round body such a point turns away from where the body touches and pushes it from
// beside: a capsule that lies on a box rolls away.
//
// gContactProcessedCallback is called for each point that is kept. With one that puts the capsule's point back to where
// it touches, it no longer gains speed. It keeps the speed that its first step gives it, in which it has a contact at
// one end only: half a millimetre a second at 4 ms.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include "world.h"

namespace {

constexpr double kRadius = 0.1, kHalf = 0.15, kDuration = 20;  // m, s

// The second body is the ground.
bool put_back(btManifoldPoint& point, void* a, void* b) {
  const auto* first = static_cast<const btCollisionObject*>(a);
  const auto* second = static_cast<const btCollisionObject*>(b);
  const bool swapped = first->getCollisionShape()->getShapeType() != CAPSULE_SHAPE_PROXYTYPE;
  const btTransform& X = (swapped ? second : first)->getWorldTransform();
  const btVector3 towards = swapped ? point.m_normalWorldOnB : -point.m_normalWorldOnB;
  btVector3& on_capsule = swapped ? point.m_positionWorldOnB : point.m_positionWorldOnA;
  btVector3& on_ground = swapped ? point.m_positionWorldOnA : point.m_positionWorldOnB;
  const double height = std::clamp(X.invXform(on_capsule).z(), -kHalf, kHalf);
  on_capsule = X * btVector3(0, 0, height) + kRadius * towards;
  point.m_distance1 = (on_ground - on_capsule).dot(towards);
  on_ground = on_capsule + point.m_distance1 * towards;
  point.m_localPointA = first->getWorldTransform().invXform(point.m_positionWorldOnA);
  point.m_localPointB = second->getWorldTransform().invXform(point.m_positionWorldOnB);
  return true;
}

// The way of a capsule that is put down at rest, m.
double way(bool renewed, double timestep) {
  gContactProcessedCallback = renewed ? &put_back : nullptr;
  finding::World world(-9.81);
  btBoxShape box(btVector3(0.5, 0.5, 0.1));
  world.add_ground(box, 1, -0.1);

  btCapsuleShapeZ capsule(kRadius, 2 * kHalf);
  btVector3 moments;
  capsule.calculateLocalInertia(1, moments);
  const btVector3 axis(std::cos(0.3), std::sin(0.3), 0), up(0, 0, 1);
  btRigidBody& body =
      world.add_body(1, capsule, moments, btTransform(shortestArcQuat(up, axis), btVector3(0.03, 0.01, kRadius)));
  body.setFriction(1);
  const btVector3 start = body.getWorldTransform().getOrigin();
  const long steps = std::lround(kDuration / timestep);
  for (long i = 0; i < steps; ++i) world.stepSimulation(timestep, 0);
  btVector3 moved = body.getWorldTransform().getOrigin() - start;
  moved.setZ(0);
  return moved.length();
}

}  // namespace

int main() {
  bool so = true;
  for (const double timestep : {4e-3, 1e-3}) {
    const double kept = way(false, timestep), renewed = way(true, timestep);
    std::printf(
        "%g ms: a capsule at rest on a box rolls %.4f m within %g s with kept points, %.4f m with points put back\n",
        1e3 * timestep, kept, kDuration, renewed);
    so = so && kept > 0.03 && renewed < 0.2 * kept;
  }
  return so ? 0 : 1;
}
