// DART as its user would write it: World::step, the ODE collision detector, DART's own filter.
#include <dart/collision/ode/OdeCollisionDetector.hpp>
#include <dart/constraint/BoxedLcpConstraintSolver.hpp>
#include <dart/constraint/ContactConstraint.hpp>
#include <dart/constraint/DantzigBoxedLcpSolver.hpp>
#include <dart/constraint/PgsBoxedLcpSolver.hpp>
#include <dart/dynamics/CapsuleShape.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/PlaneShape.hpp>
#include <dart/dynamics/RevoluteJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/WeldJoint.hpp>
#include <dart/simulation/World.hpp>

#include "direct.h"
#include "model/kinematics.h"

namespace assay::benchmarks {
namespace {

using namespace dart::dynamics;  // NOLINT(google-build-using-namespace): its Body and Shape have other names

class DirectDart final : public Direct {
 public:
  DirectDart(const Scene& scene, const State& start, const Settings& settings)
      : model_(scene.model), world_(make_world(settings)) {
    const Model& model = model_;
    world_->setGravity(model.gravity);
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      if (model.bodies[i].is_free()) {
        add_free(model, start, static_cast<int>(i));
      } else {
        add_hinged(model, start, static_cast<int>(i));
      }
    }
    if (!model.contacts.empty()) add_floor(model.contacts.front().friction);
    if (chain_) world_->addSkeleton(chain_);
  }

  void run(int count) override {
    for (int i = 0; i < count; ++i) world_->step();
  }

  void run_with_torques(std::span<const double> torques, int count) override {
    for (int i = 0; i < count; ++i) {
      for (size_t j = 0; j < torques.size(); ++j) hinges_[j]->setForce(0, torques[j]);
      world_->step();
    }
  }

  // from the joints, as the adapter does it: DART's own poses of hinged bodies differ by a rounding
  std::vector<Vec3> positions() const override {
    State state;
    state.bodies.resize(bodies_.size());
    state.position.reserve(hinges_.size());
    state.velocity.reserve(hinges_.size());
    for (size_t i = 0; i < bodies_.size(); ++i) state.bodies[i].p_WBcm = bodies_[i]->getCOM();
    for (size_t j = 0; j < hinges_.size(); ++j) {
      state.position.push_back(hinges_[j]->getPosition(0) + model_.joints[j].reference);
      state.velocity.push_back(hinges_[j]->getVelocity(0));
    }
    bodies_from_joints(model_, state);
    std::vector<Vec3> result;
    result.reserve(bodies_.size());
    for (const BodyState& body : state.bodies) result.push_back(body.p_WBcm);
    return result;
  }

 private:
  static dart::simulation::WorldPtr make_world(const Settings& settings) {
    using namespace dart::constraint;  // NOLINT(google-build-using-namespace)
    const auto world = dart::simulation::World::create();
    world->setTimeStep(settings.timestep);
    const auto pgs = std::make_shared<PgsBoxedLcpSolver>();
    pgs->setOption({static_cast<int>(settings.get<long long>("pgs_iterations")), 1e-6,
                    settings.get<double>("pgs_tolerance"), 1e-9, false});
    world->setConstraintSolver(
        std::make_unique<BoxedLcpConstraintSolver>(std::make_shared<DantzigBoxedLcpSolver>(), pgs));
    world->getConstraintSolver()->setCollisionDetector(dart::collision::OdeCollisionDetector::create());
    ContactConstraint::setErrorReductionParameter(settings.get<double>("contact_erp"));
    const double cap = settings.get<double>("contact_max_correcting_velocity");
    ContactConstraint::setMaxErrorReductionVelocity(cap > 0 ? cap : 1e300);
    ContactConstraint::setConstraintForceMixing(settings.get<double>("contact_cfm"));
    return world;
  }

  static Eigen::Isometry3d isometry(const Vec3& p, const Quat& q) {
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    X.linear() = q.toRotationMatrix();
    X.translation() = p;
    return X;
  }

  static BodyNode::Properties properties(const Body& body) {
    BodyNode::Properties properties;
    properties.mName = body.name;
    properties.mInertia = Inertia(body.mass, body.p_BBcm, body.I_BBcm_B);
    return properties;
  }

  void add_free(const Model& model, const State& start, int index) {
    const Body& body = model.bodies[index];
    const BodyState& s = start.bodies[index];
    const auto skeleton = Skeleton::create("capsule " + std::to_string(index));
    FreeJoint::Properties free;
    free.mT_ChildBodyToJoint.translation() = body.p_BBcm;
    const auto [joint, node] = skeleton->createJointAndBodyNodePair<FreeJoint>(nullptr, free, properties(body));
    Eigen::Matrix<double, 6, 1> twist;
    twist << s.q_WB.conjugate() * s.w_WB, s.q_WB.conjugate() * s.v_WBcm;
    joint->setPositions(FreeJoint::convertToPositions(isometry(s.p_WBcm, s.q_WB)));
    joint->setVelocities(twist);
    for (const Shape& shape : model.shapes) {
      if (shape.body != index) continue;
      ShapeNode* part = node->createShapeNodeWith<CollisionAspect, DynamicsAspect>(
          std::make_shared<CapsuleShape>(shape.radius, 2 * shape.half_length));
      part->setRelativeTransform(isometry(shape.X_BS.p, shape.X_BS.q));
      part->getDynamicsAspect()->setFrictionCoeff(model.contacts.front().friction);
    }
    bodies_.push_back(node);
    world_->addSkeleton(skeleton);
  }

  void add_hinged(const Model& model, const State& start, int index) {
    const Body& body = model.bodies[index];
    const Joint& hinge = model.joints[body.joint];
    if (!chain_) chain_ = Skeleton::create("chain");
    RevoluteJoint::Properties revolute;
    revolute.mName = hinge.name;
    revolute.mAxis = hinge.axis_B;
    revolute.mT_ChildBodyToJoint.translation() = hinge.p_BJ;
    revolute.mT_ParentBodyToJoint = isometry(body.X_PB.p, body.X_PB.q) * revolute.mT_ChildBodyToJoint;
    BodyNode* parent = body.parent == kWorld ? nullptr : bodies_[body.parent];
    const auto [joint, node] = chain_->createJointAndBodyNodePair<RevoluteJoint>(parent, revolute, properties(body));
    joint->setPosition(0, start.position[body.joint] - hinge.reference);
    joint->setVelocity(0, start.velocity[body.joint]);
    hinges_.push_back(joint);
    bodies_.push_back(node);
  }

  void add_floor(double friction) {
    const auto floor = Skeleton::create("floor");
    BodyNode* body = floor->createJointAndBodyNodePair<WeldJoint>().second;
    body->createShapeNodeWith<CollisionAspect, DynamicsAspect>(std::make_shared<PlaneShape>(Vec3(0, 0, 1), 0.0))
        ->getDynamicsAspect()
        ->setFrictionCoeff(friction);
    floor->setMobile(false);
    world_->addSkeleton(floor);
  }

  Model model_;
  dart::simulation::WorldPtr world_;
  SkeletonPtr chain_;
  std::vector<BodyNode*> bodies_;
  std::vector<dart::dynamics::Joint*> hinges_;
};

std::unique_ptr<Direct> make(const Scene& scene, const State& start, const Settings& settings) {
  return std::make_unique<DirectDart>(scene, start, settings);
}

}  // namespace
}  // namespace assay::benchmarks

// with DART's own directions of friction
ASSAY_DIRECT_LOOP(assay::benchmarks::make, "dart-default")
