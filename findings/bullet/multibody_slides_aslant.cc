// Bullet 3.2.7, btMultiBodyConstraintSolver::resolveConeFrictionConstraintRows: friction of a contact point that slides
// is not against its slip.
//
// A box slides over the ground at 37 degrees to its sides, as the base of a btMultiBody. A contact has friction along
// two fixed directions x and y. Each asks for the impulse that would stop its own slip by itself, v_x / k_x and
// v_y / k_y with k the inverse mass that the point shows in that direction; then both are scaled to mu times the normal
// impulse. So friction is along (v_x / k_x, v_y / k_y), not along v. At a corner of the box k depends on how far away
// the corner is: k_x = 1/m + z^2/I_y + y^2/I_z. The box bends away from its straight way, to the side of its longer
// edges, at any timestep and with any number of iterations; one with a square face does not.
//
// Ends with status 0 while Bullet behaves so, 1 when it does not: then the section in the adapter's README can go.
#include <cmath>
#include <cstdio>

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include "world.h"

namespace {

using finding::real;

constexpr double kFriction = 0.5, kGravity = 9.81, kSpeedX = 1.197953, kSpeedY = 0.902723;  // m/s

struct Box {
  double x, y, z;  // half sizes, m; 1 kg
};

struct Way {
  double x = 0, y = 0;
  double degrees() const { return std::atan2(y, x) * 180 / M_PI; }
  double length() const { return std::hypot(x, y); }
};

btVector3 inertia_of(const Box& box) {
  const auto about = [](double a, double b) { return real((a * a + b * b) / 3); };
  return {about(box.y, box.z), about(box.x, box.z), about(box.x, box.y)};
}

// Where it stops.
Way measured(const Box& size, double timestep, int iterations) {
  finding::MultiBodyWorld world(-kGravity);
  world.configuration.setPlaneConvexMultipointIterations();
  btContactSolverInfo& info = world.getSolverInfo();
  info.m_numIterations = iterations;
  info.m_splitImpulse = 0;
  info.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;  // and the implicit cone, which is Bullet's default
  btStaticPlaneShape plane(btVector3(0, 0, 1), 0);
  world.add_ground(plane, 1);
  btBoxShape shape(btVector3(real(size.x), real(size.y), real(size.z)));
  const btVector3 place(0, 0, real(size.z));
  btMultiBody base(0, 1, inertia_of(size), false, false);
  base.setLinearDamping(0);
  base.setAngularDamping(0);
  base.finalizeMultiDof();
  base.setBasePos(place);
  base.setBaseVel(btVector3(real(kSpeedX), real(kSpeedY), 0));
  world.addMultiBody(&base);
  btMultiBodyLinkCollider collider(&base, -1);
  collider.setCollisionShape(&shape);
  collider.setFriction(real(kFriction));
  collider.setWorldTransform(btTransform(btQuaternion::getIdentity(), place));
  collider.setActivationState(DISABLE_DEACTIVATION);
  base.setBaseCollider(&collider);
  world.addCollisionObject(&collider, btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::AllFilter);
  const long steps = std::lround(0.48 / timestep);
  for (long i = 0; i < steps; ++i) world.stepSimulation(real(timestep), 0);
  const btVector3 end = base.getBasePos();
  world.removeCollisionObject(&collider);
  world.removeMultiBody(&base);
  return {end.x(), end.y()};
}

// The same by the law above, in short steps.
Way by_law(const Box& size) {
  const btVector3 inertia = inertia_of(size);
  const double k_x = 1 + size.z * size.z / inertia.y() + size.y * size.y / inertia.z();
  const double k_y = 1 + size.z * size.z / inertia.x() + size.x * size.x / inertia.z();
  constexpr double kStep = 1e-6;
  Way way;
  double v_x = kSpeedX, v_y = kSpeedY;
  while (std::hypot(v_x, v_y) > 1e-4) {
    const double part = kFriction * kGravity * kStep / std::hypot(v_x / k_x, v_y / k_y);
    v_x -= part * v_x / k_x;
    v_y -= part * v_y / k_y;
    way.x += v_x * kStep;
    way.y += v_y * kStep;
  }
  return way;
}

}  // namespace

int main() {
  constexpr double kAlikeDegrees = 0.2, kAslantDegrees = 5;
  const double straight = Way{kSpeedX, kSpeedY}.degrees();
  bool as_said = true;
  for (const Box& box : {Box{0.1, 0.06, 0.04}, Box{0.1, 0.1, 0.04}}) {
    const Way law = by_law(box);
    const bool square = box.x == box.y;
    std::printf("a box of %g x %g x %g m, pushed at %.1f degrees; by the law of its corners it stops at %.1f\n",
                2 * box.x, 2 * box.y, 2 * box.z, straight, law.degrees());
    for (const double timestep : {4e-3, 1e-3, 2.5e-4}) {
      for (const int iterations : {10, 50, 500}) {
        const Way way = measured(box, timestep, iterations);
        std::printf("  %5.2f ms, %3d iterations: stops at %.2f degrees, after %.4f m\n", 1e3 * timestep, iterations,
                    way.degrees(), way.length());
        as_said = as_said && std::abs(way.degrees() - law.degrees()) < kAlikeDegrees;
      }
    }
    as_said = as_said && (square ? std::abs(law.degrees() - straight) < 1e-3
                                 : std::abs(law.degrees() - straight) > kAslantDegrees);
  }
  return as_said ? 0 : 1;
}
