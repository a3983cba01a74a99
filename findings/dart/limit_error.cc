// DART 6.13.2, dart::constraint::JointConstraint: a joint that is beyond its limit is moved back by the whole excess in
// one step, for any error reduction parameter, which has no effect, and within the error allowance too. It keeps that
// speed.
//
// A hinge starts at rest 0.08 rad beyond its limit, without gravity. After a step of 1 ms it turns back at 80 rad/s.
// Only the cap on that speed slows it; DART's own is 10 rad/s.
//
// Ends with status 0 while DART behaves so, 1 when it does not: then limit_max_correcting_velocity in options.cc can
// go.
#include <cmath>
#include <cstdio>
#include <limits>

#include <dart/constraint/JointConstraint.hpp>
#include <dart/dynamics/RevoluteJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/simulation/World.hpp>

namespace {

using dart::constraint::JointConstraint;

constexpr double kTimestep = 1e-3, kLimit = 0.6, kExcess = 0.08;
constexpr double kNoCap = std::numeric_limits<double>::infinity();

// The speed of the hinge after some steps, rad/s towards the limit.
double speed_back(double allowance, double error_reduction, double cap, int steps = 1) {
  JointConstraint::setErrorAllowance(allowance);
  JointConstraint::setErrorReductionParameter(error_reduction);
  JointConstraint::setMaxErrorReductionVelocity(cap);
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
  for (int i = 0; i < steps; ++i) world->step();
  return -joint->getVelocity(0);
}

}  // namespace

int main() {
  constexpr double kWhole = kExcess / kTimestep;
  bool so = true;
  const auto expect = [&so](const char* text, double value, double speed, double expected) {
    std::printf("%s %g: %.4g rad/s back, %.4g expected\n", text, value, speed, expected);
    so = so && std::abs(speed / expected - 1) < 1e-6;
  };
  for (const double erp : {0.01, 0.2, 1.0}) expect("error reduction", erp, speed_back(0, erp, kNoCap), kWhole);
  expect("excess within the allowance", 0.1, speed_back(0.1, 0.2, kNoCap), kWhole);
  expect("ten steps later, error reduction", 0.2, speed_back(0, 0.2, kNoCap, 11), kWhole);
  expect("cap", 10, speed_back(0, 0.2, 10), 10);
  return so ? 0 : 1;
}
