// Bullet 3.2.7, btSequentialImpulseConstraintSolver and btMLCPSolver: a box that slides straight down a slope turns.
//
// A box of 2 : 2 : 1, flat on a plane, slides along one of its sides with friction 0.5. All is symmetric about the
// vertical plane of the motion, so that it cannot turn. In Bullet it turns about the plane's normal by some hundredths
// of a radian within 0.6 s, one way or the other by the timestep, the number of iterations and the shape (btBoxShape
// or btConvexHullShape), also where the solver has converged.
//
// Cause: a contact's two friction rows are bounded each, along the point's slip and across it, and are solved one
// after the other; the points of the manifold are found one a step and replaced one by one, so that the corners do not
// bear alike. What the corners' friction leaves across the motion turns the box, and nothing turns it back.
//
// Ends with status 0 while Bullet behaves so, 1 when it does not: then the deviations in engine.cc can go.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include <BulletDynamics/MLCPSolvers/btDantzigSolver.h>
#include <BulletDynamics/MLCPSolvers/btMLCPSolver.h>

#include "world.h"

namespace {

using finding::real;

constexpr double kFriction = 0.5, kDuration = 0.6;
constexpr int kDantzig = 0;

// Turn of the box (rad); `iterations` of sequential impulse, or Dantzig's method.
double turn(bool hull, int iterations, double timestep) {
  btDantzigSolver lcp;
  btMLCPSolver dantzig(&lcp);
  finding::World world(0, iterations == kDantzig ? &dantzig : nullptr);
  world.configuration.setPlaneConvexMultipointIterations();
  const double angle = std::atan(0.7);
  world.setGravity(btVector3(real(9.81 * std::sin(angle)), 0, real(-9.81 * std::cos(angle))));
  btContactSolverInfo& info = world.getSolverInfo();
  if (iterations != kDantzig) info.m_numIterations = iterations;
  info.m_splitImpulsePenetrationThreshold = 0;
  info.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  btStaticPlaneShape plane(btVector3(0, 0, 1), 0);
  world.add_ground(plane, 1);

  const btVector3 half(real(0.1), real(0.1), real(0.05));
  btBoxShape box(half);
  btConvexHullShape corners;
  corners.setMargin(0);
  for (const int x : {-1, 1}) {
    for (const int y : {-1, 1}) {
      for (const int z : {-1, 1}) corners.addPoint(half * btVector3(real(x), real(y), real(z)));
    }
  }
  const btVector3 inertia(real(0.0125 / 3), real(0.0125 / 3), real(0.02 / 3));
  btRigidBody& body =
      world.add_body(1, hull ? static_cast<btCollisionShape&>(corners) : box, inertia, finding::at(0, 0, half.z()));
  body.setFriction(real(kFriction));
  const long steps = std::lround(kDuration / timestep);
  double largest = 0;
  for (long i = 0; i < steps; ++i) {
    world.stepSimulation(real(timestep), 0);
    const btVector3 x = body.getWorldTransform().getBasis().getColumn(0);
    largest = std::max(largest, std::abs(std::atan2(static_cast<double>(x.y()), static_cast<double>(x.x()))));
  }
  return largest;
}

}  // namespace

int main() {
  double few = 1, converged = 1;
  for (const bool hull : {false, true}) {
    double turn_10 = 0, turn_1000 = 0, turn_dantzig = 0;
    for (const double timestep : {4e-3, 2e-3, 1e-3, 5e-4}) {
      turn_10 = std::max(turn_10, turn(hull, 10, timestep));
      turn_1000 = std::max(turn_1000, turn(hull, 1000, timestep));
      turn_dantzig = std::max(turn_dantzig, turn(hull, kDantzig, timestep));
    }
    std::printf("%s: turns about the normal by up to %.4f rad with 10 iterations, %.4f with 1000, %.4f with Dantzig\n",
                hull ? "hull" : "box", turn_10, turn_1000, turn_dantzig);
    few = std::min(few, turn_10);
    converged = std::min({converged, turn_1000, turn_dantzig});
  }
  return few > 0.01 && converged > 2e-3 ? 0 : 1;
}
