// DART 6.13.2, dart::math::expMapRot below an angle of 1e-3: the matrix is not a rotation, so a free body that spins
// slowly gains or loses linear speed without any force.
//
// A body flies at 1 m/s and spins at right angles to its flight, without gravity. FreeJoint::integratePositions turns
// the velocity into the next body frame with the exponential map of w h. For w h < 1e-3 that map is I + W + W^2 / 2,
// whose columns are longer than 1 by (w h)^4 / 8: the speed grows by as much in every step, whatever the timestep. Just
// above 1e-3 it is Rodrigues' formula, and the speed stays.
//
// Ends with status 0 while DART behaves so, 1 when it does not: then the deviation in engine.cc can go.
#include <cmath>
#include <cstdio>

#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/simulation/World.hpp>

namespace {

constexpr double kTimestep = 1e-3;
constexpr int kSteps = 2000;

// What the speed has grown by after kSteps, relative.
double growth(double spin) {
  const auto world = dart::simulation::World::create();
  world->setGravity(Eigen::Vector3d::Zero());
  world->setTimeStep(kTimestep);
  const auto skeleton = dart::dynamics::Skeleton::create();
  dart::dynamics::Joint* joint = skeleton->createJointAndBodyNodePair<dart::dynamics::FreeJoint>().first;
  Eigen::VectorXd twist(6);
  twist << 0, 0, spin, 1, 0, 0;  // angular, then linear
  joint->setVelocities(twist);
  world->addSkeleton(skeleton);
  for (int i = 0; i < kSteps; ++i) world->step();
  return joint->getVelocities().tail<3>().norm() - 1;
}

}  // namespace

int main() {
  bool so = true;
  for (const double spin : {0.3, 0.5, 0.7, 0.99, 1.01, 3.0}) {
    const double angle = spin * kTimestep, measured = growth(spin);
    const double expected = angle < 1e-3 ? kSteps * std::pow(angle, 4) / 8 : 0;
    std::printf("%.3g mrad a step: speed grows by %.4g in %d steps, expected %.4g\n", 1e3 * angle, measured, kSteps,
                expected);
    so = so && std::abs(measured - expected) < 1e-12 + (0.02 * expected);
  }
  return so ? 0 : 1;
}
