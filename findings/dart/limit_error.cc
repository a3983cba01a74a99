// DART 6.12.1, dart::constraint::JointConstraint: a joint that is beyond its limit is not moved back, whatever the
// error reduction parameter. The error allowance, which should be what is left uncorrected, takes its place.
//
// A hinge starts at rest 0.08 rad beyond its limit. With allowance 0 it stays there for any error reduction parameter;
// with allowance a it comes back at a times the excess over the timestep, the speed of its first step.
//
// Ends with status 0 while DART behaves so, 1 when it does not: then the deviation in engine.cc can go.
#include <cmath>
#include <cstdio>

#include <dart/constraint/JointConstraint.hpp>
#include <dart/dynamics/RevoluteJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/simulation/World.hpp>

namespace {

using dart::constraint::JointConstraint;

constexpr double kTimestep = 1e-3, kLimit = 0.6, kExcess = 0.08;

// The speed of the hinge after a step, rad/s towards the limit.
double speed_back(double allowance, double error_reduction) {
  JointConstraint::setErrorAllowance(allowance);
  JointConstraint::setErrorReductionParameter(error_reduction);
  const auto world = dart::simulation::World::create();
  world->setGravity(Eigen::Vector3d::Zero());
  world->setTimeStep(kTimestep);
  const auto skeleton = dart::dynamics::Skeleton::create();
  dart::dynamics::RevoluteJoint::Properties properties;
  properties.mPositionLowerLimits[0] = -1;
  properties.mPositionUpperLimits[0] = kLimit;
  properties.mIsPositionLimitEnforced = true;
  dart::dynamics::Joint* joint =
      skeleton->createJointAndBodyNodePair<dart::dynamics::RevoluteJoint>(nullptr, properties).first;
  joint->setPosition(0, kLimit + kExcess);
  world->addSkeleton(skeleton);
  world->step();
  return -joint->getVelocity(0);
}

}  // namespace

int main() {
  bool so = true;
  for (const double error_reduction : {0.01, 0.2, 1.0}) {
    const double speed = speed_back(0, error_reduction);
    std::printf("allowance 0, error reduction %.2f: %.4g rad/s back\n", error_reduction, speed);
    so = so && std::abs(speed) < 1e-6;
  }
  const double speed = speed_back(0.01, 0.2);
  std::printf("allowance 0.01, error reduction 0.20: %.4g rad/s back, 0.01 of the excess over the step is %.4g\n",
              speed, 0.01 * kExcess / kTimestep);
  so = so && std::abs(speed / (0.01 * kExcess / kTimestep) - 1) < 0.01;
  return so ? 0 : 1;
}
