// Bullet 3.2.7, btHeightfieldTerrainShape: what slides over a flat height field without friction is braked, deflected
// and turned, because each triangle collides alone and a body's flat side or edge meets the triangles' inner edges. A
// ball passes.
//
// Ends with status 0 while Bullet behaves so, 1 when it does not: then the deviation in engine.cc can go.
#include <algorithm>
#include <cstdio>
#include <vector>

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <btBulletDynamicsCommon.h>

namespace {

btScalar real(double x) { return static_cast<btScalar>(x); }

// The change of a body's velocity in 1 s, relative to the first.
double change(const char* name, btCollisionShape& shape) {
  constexpr int kSamples = 21;
  constexpr double kHalf = 3;
  const std::vector<btScalar> heights(kSamples * kSamples, 0);
  btHeightfieldTerrainShape field(kSamples, kSamples, heights.data(), 1, 0, 0, 2,
                                  sizeof(btScalar) == sizeof(double) ? PHY_DOUBLE : PHY_FLOAT, false);
  const btScalar spacing = real(2 * kHalf / (kSamples - 1));
  field.setLocalScaling(btVector3(spacing, spacing, 1));
  field.setMargin(real(0.001));
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity(btVector3(0, 0, real(-9.81)));
  world.getSolverInfo().m_numIterations = 50;
  btCollisionObject ground;
  ground.setCollisionShape(&field);
  ground.setFriction(0);
  world.addCollisionObject(&ground, btBroadphaseProxy::StaticFilter, btBroadphaseProxy::AllFilter);

  btVector3 inertia;
  shape.calculateLocalInertia(1, inertia);
  btRigidBody body(btRigidBody::btRigidBodyConstructionInfo(1, nullptr, &shape, inertia));
  body.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(real(-1.2), real(0.07), real(0.051))));
  const btVector3 velocity(1, real(0.3), 0);
  body.setLinearVelocity(velocity);
  body.setFriction(0);
  body.setActivationState(DISABLE_DEACTIVATION);
  world.addRigidBody(&body);
  for (int i = 0; i < 1000; ++i) world.stepSimulation(real(1e-3), 0);
  const double found = static_cast<double>((body.getLinearVelocity() - velocity).length() / velocity.length());
  world.removeRigidBody(&body);
  world.removeCollisionObject(&ground);
  std::printf("%s: the velocity changes by %.3f of itself in 1 s\n", name, found);
  return found;
}

}  // namespace

int main() {
  btSphereShape ball(real(0.05));
  btBoxShape box(btVector3(real(0.1), real(0.1), real(0.05)));
  btCylinderShapeZ cylinder(btVector3(real(0.05), real(0.05), real(0.05)));
  const double smooth = change("a ball", ball);
  const double edged = std::max(change("a box", box), change("a standing cylinder", cylinder));
  return smooth < 0.02 && edged > 0.05 ? 0 : 1;
}
