// DART 6.13.2, GenericJoint::updateVelocityChangeDynamic: constraints act on another inertia than the rest of the step.
//
// A damper D is implicit in DART: the step divides forces by M + h D. What contacts, limits and dry friction change is
// computed with M alone. So h D cannot stand for armature where any of them acts. A mass slides on a rail with a
// damper, whose force D v an equal force of the joint takes back, and with dry friction f: the step would have to brake
// it by f h / (m + h D), and brakes it by f h / m.
//
// Ends with status 0 while DART behaves so, 1 when it does not: then the refusal in engine.cc can go.
#include <cmath>
#include <cstdio>

#include <dart/dynamics/PrismaticJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/simulation/World.hpp>

namespace {

constexpr double kTimestep = 1e-3, kMass = 2, kAdded = 18;  // kg; the damper's h D
constexpr int kSteps = 100;

// What the mass loses of its speed of 1 m/s in a step, m/s.
double braked(double friction, double force) {
  const auto world = dart::simulation::World::create();
  world->setGravity(Eigen::Vector3d::Zero());
  world->setTimeStep(kTimestep);
  const auto skeleton = dart::dynamics::Skeleton::create();
  dart::dynamics::PrismaticJoint::Properties rail;
  rail.mDampingCoefficients[0] = kAdded / kTimestep;
  rail.mFrictions[0] = friction;
  dart::dynamics::BodyNode::Properties body;
  body.mInertia = dart::dynamics::Inertia(kMass, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity());
  dart::dynamics::Joint* joint =
      skeleton->createJointAndBodyNodePair<dart::dynamics::PrismaticJoint>(nullptr, rail, body).first;
  joint->setVelocity(0, 1);
  world->addSkeleton(skeleton);
  for (int i = 0; i < kSteps; ++i) {
    joint->setForce(0, (kAdded / kTimestep * joint->getVelocity(0)) + force);
    world->step();
  }
  return (1 - joint->getVelocity(0)) / kSteps;
}

}  // namespace

int main() {
  constexpr double kForce = 0.5;
  const double by_force = braked(0, -kForce), by_friction = braked(kForce, 0);
  const double with = kForce * kTimestep / (kMass + kAdded), without = kForce * kTimestep / kMass;
  std::printf(
      "%g N brake by %.4g m/s a step as a force and by %.4g m/s as dry friction; (m + h D) says %.4g, m says %.4g\n",
      kForce, by_force, by_friction, with, without);
  return std::abs(by_force / with - 1) < 1e-6 && std::abs(by_friction / without - 1) < 1e-6 ? 0 : 1;
}
