// DART 6.13.2, dart::constraint::ContactConstraint: friction is a pyramid whose directions the contact's normal fixes,
// and up to 1.41 times too strong between them.
//
// A box slides at 3 m/s on the ground, along a direction of its contacts and at 45 degrees to it, and lies on a slope
// of 1.2 times its friction. Each of the two directions is bounded by itself, so that both together give 1.41 times the
// friction. With a ContactSurfaceHandler that sets the slip as the first direction the box slides as it should.
//
// Ends with status 0 while DART behaves so, 1 when it does not: then the setting friction_direction can go.
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <memory>

#include <dart/collision/CollisionObject.hpp>
#include <dart/collision/ode/OdeCollisionDetector.hpp>
#include <dart/constraint/ConstraintSolver.hpp>
#include <dart/constraint/ContactSurface.hpp>
#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/WeldJoint.hpp>
#include <dart/simulation/World.hpp>

namespace {

using dart::dynamics::BodyNode;
using dart::dynamics::FreeJoint;
using Eigen::Vector3d;

constexpr double kFriction = 0.5, kGravity = 9.81, kTimestep = 1e-3, kPi = 3.14159265358979323846;

// The box is the only body that moves.
class AlongSlip final : public dart::constraint::DefaultContactSurfaceHandler {
 public:
  explicit AlongSlip(BodyNode* box) : box_(box) {}
  dart::constraint::ContactSurfaceParams createParams(const dart::collision::Contact& contact,
                                                      size_t count) const override {
    auto params = DefaultContactSurfaceHandler::createParams(contact, count);
    const Vector3d velocity = box_->getLinearVelocity(box_->getWorldTransform().inverse() * contact.point);
    const Vector3d slip = velocity - velocity.dot(contact.normal) * contact.normal;
    if (slip.norm() > 1e-9) params.mFirstFrictionalDirection = slip.normalized();
    return params;
  }

 private:
  BodyNode* box_;
};

void add_shape(BodyNode* body, const Vector3d& size) {
  body->createShapeNodeWith<dart::dynamics::CollisionAspect, dart::dynamics::DynamicsAspect>(
          std::make_shared<dart::dynamics::BoxShape>(size))
      ->getDynamicsAspect()
      ->setFrictionCoeff(kFriction);
}

// Friction over normal impulse between 0.1 and 0.3 s, over the coefficient, from `speed` towards `degrees` on a slope
// that falls the same way.
double friction(double degrees, double speed, double slope, bool along_slip) {
  const Vector3d towards(std::cos(degrees * kPi / 180), std::sin(degrees * kPi / 180), 0);
  const double angle = std::atan(slope);
  const Vector3d gravity = kGravity * (std::sin(angle) * towards - std::cos(angle) * Vector3d::UnitZ());
  const auto world = dart::simulation::World::create();
  world->setTimeStep(kTimestep);
  world->setGravity(gravity);
  world->getConstraintSolver()->setCollisionDetector(dart::collision::OdeCollisionDetector::create());
  const auto ground = dart::dynamics::Skeleton::create("ground");
  dart::dynamics::WeldJoint::Properties weld;
  weld.mT_ParentBodyToJoint.translation() = Vector3d(0, 0, -0.5);
  add_shape(ground->createJointAndBodyNodePair<dart::dynamics::WeldJoint>(nullptr, weld).second, {10, 10, 1});
  ground->setMobile(false);
  const auto sliding = dart::dynamics::Skeleton::create("box");
  const auto [joint, box] = sliding->createJointAndBodyNodePair<FreeJoint>();
  box->setInertia(dart::dynamics::Inertia(1, Vector3d::Zero(), Vector3d(0.024, 0.024, 0.042).asDiagonal()));
  add_shape(box, {0.5, 0.5, 0.2});
  Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
  place.translation() = Vector3d(0, 0, 0.1);
  joint->setPositions(FreeJoint::convertToPositions(place));
  Eigen::Matrix<double, 6, 1> velocity = Eigen::Matrix<double, 6, 1>::Zero();
  velocity.tail<3>() = speed * towards;
  joint->setVelocities(velocity);
  world->addSkeleton(ground);
  world->addSkeleton(sliding);
  if (along_slip) world->getConstraintSolver()->addContactSurfaceHandler(std::make_shared<AlongSlip>(box));
  Vector3d before = Vector3d::Zero();
  for (int i = 0; i < 300; ++i) {
    if (i == 100) before = box->getLinearVelocity();
    world->step();
  }
  const Vector3d impulse = box->getLinearVelocity() - before - 200 * kTimestep * gravity;
  return std::hypot(impulse.x(), impulse.y()) / impulse.z() / kFriction;
}

}  // namespace

int main() {
  const double along = friction(0, 3, 0, false), between = friction(45, 3, 0, false), slip = friction(45, 3, 0, true);
  std::printf("sliding: %.3f of the friction along a direction, %.3f at 45 degrees, %.3f there along the slip\n", along,
              between, slip);
  const double holds = friction(45, 0, 1.2 * kFriction, false), slides = friction(45, 0, 1.2 * kFriction, true);
  std::printf("on a slope of 1.2 times the friction, 45 degrees: %.3f, where it holds, %.3f along the slip\n", holds,
              slides);
  const bool so = std::abs(along - 1) < 0.02 && std::abs(between - std::sqrt(2)) < 0.02 && std::abs(slip - 1) < 0.02 &&
                  std::abs(holds - 1.2) < 0.02 && std::abs(slides - 1) < 0.02;
  return so ? 0 : 1;
}
