// Bullet 3.2.7, btHeightfieldTerrainShape: what slides over a flat height field without friction is braked, deflected
// and turned, because each triangle collides alone and a body's flat side or edge meets the triangles' inner edges. A
// ball passes.
//
// Ends with status 0 while Bullet behaves so, 1 when it does not: then the deviation in engine.cc can go.
#include <algorithm>
#include <cstdio>
#include <vector>

#include "world.h"

namespace {

using finding::real;

// The change of a body's velocity in 1 s, relative to the first.
double change(const char* name, btCollisionShape& shape) {
  finding::FlatField field(0.3);
  finding::World world(-9.81);
  world.getSolverInfo().m_numIterations = 50;
  world.add_ground(field.shape, 0);

  btVector3 inertia;
  shape.calculateLocalInertia(1, inertia);
  btRigidBody& body = world.add_body(1, shape, inertia, finding::at(-1.2, 0.07, 0.051));
  const btVector3 velocity(1, real(0.3), 0);
  body.setLinearVelocity(velocity);
  body.setFriction(0);
  for (int i = 0; i < 1000; ++i) world.stepSimulation(real(1e-3), 0);
  const double found = static_cast<double>((body.getLinearVelocity() - velocity).length() / velocity.length());
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
