// Bullet 3.2.7, btSequentialImpulseConstraintSolver: with its own 10 iterations a stack does not bear a load of a
// thousand times the mass below it.
//
// A bar lies across two bars on the ground, all at rest where they touch; the upper one has r times the mass of each
// lower one. It should stay. A sweep of Gauss-Seidel passes on about 1 / r of the load that is still missing, so with
// few sweeps the upper bar sinks into the lower ones until the impulses that Bullet keeps from step to step have grown
// to its weight; with many sweeps it stays.
//
// Ends with status 0 while Bullet behaves so, 1 when it does not: then the deviation in engine.cc can go.
#include <cstdio>
#include <initializer_list>

#include "world.h"

namespace {

using finding::real;

constexpr double kRadius = 0.1, kHalf = 0.5, kTimestep = 1e-3;
constexpr int kSteps = 500;

// Way of the upper bar within 0.5 s over its radius.
double way(double ratio, int iterations) {
  finding::World world(-9.81);
  btContactSolverInfo& info = world.getSolverInfo();
  info.m_numIterations = iterations;
  info.m_splitImpulsePenetrationThreshold = 0;
  info.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  btStaticPlaneShape plane(btVector3(0, 0, 1), 0);
  world.add_ground(plane, 1);
  btCapsuleShapeX along(real(kRadius), real(2 * kHalf));
  btCapsuleShape across(real(kRadius), real(2 * kHalf));  // along y
  const auto add = [&](btCollisionShape& shape, double mass, const btTransform& place, bool is_along) -> btRigidBody& {
    // a capsule of this size, relative to its mass
    const double ends = mass * 0.1, turning = mass * 0.005;
    const btVector3 inertia =
        is_along ? btVector3(real(turning), real(ends), real(ends)) : btVector3(real(ends), real(turning), real(ends));
    btRigidBody& bar = world.add_body(mass, shape, inertia, place);
    bar.setFriction(1);
    return bar;
  };
  const btTransform start = finding::at(0, 0, 3 * kRadius);
  const btRigidBody& top = add(along, ratio, start, true);
  for (const double x : {-0.3, 0.3}) add(across, 1, finding::at(x, 0, kRadius), false);
  for (int i = 0; i < kSteps; ++i) world.stepSimulation(real(kTimestep), 0);
  const double moved = (top.getWorldTransform().getOrigin() - start.getOrigin()).length();
  return moved / kRadius;
}

}  // namespace

int main() {
  const double light = way(1, 10), few = way(1000, 10), some = way(1000, 50), many = way(1000, 200);
  std::printf(
      "way of the upper bar in radii: %.4f at equal masses, 10 iterations; at 1 : 1000 %.4f with 10, %.4f with "
      "50, %.4f with 200\n",
      light, few, some, many);
  return light < 0.05 && few > 0.1 && many < 0.05 ? 0 : 1;
}
