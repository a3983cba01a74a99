#include "world.h"

#include <array>
#include <cstdarg>
#include <cstdio>
#include <limits>
#include <mutex>
#include <string>
#include <utility>

#include <dart/collision/ode/OdeCollisionDetector.hpp>
#include <dart/constraint/BoxedLcpConstraintSolver.hpp>
#include <dart/constraint/ContactConstraint.hpp>
#include <dart/constraint/DantzigBoxedLcpSolver.hpp>
#include <dart/constraint/JointConstraint.hpp>
#include <dart/constraint/PgsBoxedLcpSolver.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/RevoluteJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/WeldJoint.hpp>
#include <fmt/format.h>
#include <ode/ode.h>

#include "collision.h"
#include "engines/adapter.h"

namespace assay::dartsim {
namespace {

using dart::dynamics::BodyNode;
using dart::dynamics::FreeJoint;
using dart::dynamics::RevoluteJoint;
using Vec6 = Eigen::Matrix<double, 6, 1>;

Eigen::Isometry3d isometry(const Vec3& p, const Quat& q) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = q.toRotationMatrix();
  X.translation() = p;
  return X;
}

// ODE, which finds the contacts, ends the process when one of its assertions fails, unless a handler is set. There is
// one set of handlers per process, so those of another user of the library stay.
[[noreturn]] void on_ode_error(int number, const char* text, va_list arguments) {
  std::array<char, 512> buffer{};
  std::vsnprintf(buffer.data(), buffer.size(), text, arguments);
  throw EngineError(fmt::format("ODE error {} in DART's collision detection: {}", number, buffer.data()));
}

void initialise_library() {
  static std::once_flag once;
  std::call_once(once, [] {
    if (dGetErrorHandler() == nullptr) dSetErrorHandler(on_ode_error);
    if (dGetDebugHandler() == nullptr) dSetDebugHandler(on_ode_error);
  });
}

// After an error inside DART or ODE, lists may be half-changed: such a world is never freed.
void keep(const dart::simulation::WorldPtr& world) {
  static auto& kept = *new std::vector<dart::simulation::WorldPtr>;  // outlives static destructors
  kept.push_back(world);
}

// DART keeps these numbers once per process. `owner` is the instance that set them last.
const DartSimulation* owner = nullptr;
void set_globals(const Options& options) {
  using dart::constraint::ContactConstraint;
  ContactConstraint::setErrorAllowance(0);
  ContactConstraint::setErrorReductionParameter(options.contact_erp);
  const double cap = options.contact_max_correcting_velocity;
  ContactConstraint::setMaxErrorReductionVelocity(cap > 0 ? cap : std::numeric_limits<double>::infinity());
  ContactConstraint::setConstraintForceMixing(options.contact_cfm);
  dart::constraint::JointConstraint::setErrorAllowance(0);
  dart::constraint::JointConstraint::setConstraintForceMixing(options.limit_cfm);
}

}  // namespace

DartSimulation::DartSimulation(Model model, const State& state, const Options& options)
    : options_(options),
      clock_{state.time, options.timestep},
      model_(std::move(model)),
      explicit_springs_(model_.has_springs() && !options_.native_pd) {
  model_.keyframes.clear();
  initialise_library();
  owner = this;
  set_globals(options_);
  make_world();
  make_bodies();
  if (!model_.contacts.empty()) make_contacts();
  // with their shapes: the collision detector finds shapes that are added later in the order of their addresses
  for (const dart::dynamics::SkeletonPtr& tree : trees_) world_->addSkeleton(tree);
  set_state(with_joint_coordinates(model_, state));
}

void DartSimulation::make_world() {
  using namespace dart::constraint;
  world_ = dart::simulation::World::create("assay");
  world_->setTimeStep(options_.timestep);
  world_->setGravity(model_.gravity);
  const auto pgs = std::make_shared<PgsBoxedLcpSolver>();
  PgsBoxedLcpSolver::Option option = pgs->getOption();
  option.mMaxIteration = options_.pgs_iterations;
  option.mRelativeDeltaXTolerance = options_.pgs_tolerance;
  pgs->setOption(option);
  world_->setConstraintSolver(
      options_.pgs ? std::make_unique<BoxedLcpConstraintSolver>(pgs, nullptr)
                   : std::make_unique<BoxedLcpConstraintSolver>(std::make_shared<DantzigBoxedLcpSolver>(), pgs));
  world_->getConstraintSolver()->setCollisionDetector(dart::collision::OdeCollisionDetector::create());
}

// One skeleton a tree. A body's frame is the MJCF body's.
void DartSimulation::make_bodies() {
  std::vector<dart::dynamics::SkeletonPtr> skeleton_of(model_.bodies.size());
  hinges_.resize(model_.joints.size());
  for (size_t i = 0; i < model_.bodies.size(); ++i) {
    const Body& body = model_.bodies[i];
    if (body.parent == kWorld) trees_.push_back(dart::dynamics::Skeleton::create(fmt::format("tree {}", i)));
    skeleton_of[i] = body.parent == kWorld ? trees_.back() : skeleton_of[body.parent];
    make_joint(static_cast<int>(i), skeleton_of[i]);
  }
}

void DartSimulation::make_joint(int index, const dart::dynamics::SkeletonPtr& skeleton) {
  const Body& body = model_.bodies[index];
  BodyNode::Properties node;
  node.mName = fmt::format("body {}", index);
  node.mInertia = dart::dynamics::Inertia(body.mass, body.p_BBcm, body.I_BBcm_B);
  if (body.is_free()) {
    // the joint's frame lies in the centre of mass: DART moves that point with the velocity of the step's end
    FreeJoint::Properties joint;
    joint.mName = fmt::format("joint {}", index);
    joint.mT_ChildBodyToJoint.translation() = body.p_BBcm;
    bodies_.push_back(skeleton->createJointAndBodyNodePair<FreeJoint>(nullptr, joint, node).second);
    return;
  }
  const Joint& hinge = model_.joints[body.joint];
  RevoluteJoint::Properties joint;
  joint.mName = fmt::format("joint {}", index);
  joint.mAxis = hinge.axis_B;
  joint.mT_ChildBodyToJoint.translation() = hinge.p_BJ;
  joint.mT_ParentBodyToJoint = isometry(body.X_PB.p, body.X_PB.q) * joint.mT_ChildBodyToJoint;
  if (hinge.limited) {
    joint.mPositionLowerLimits[0] = hinge.lower - hinge.reference;
    joint.mPositionUpperLimits[0] = hinge.upper - hinge.reference;
  }
  joint.mIsPositionLimitEnforced = hinge.limited;
  if (options_.native_pd) {
    joint.mSpringStiffnesses[0] = hinge.stiffness;
    joint.mRestPositions[0] = hinge.spring_reference - hinge.reference;
    joint.mDampingCoefficients[0] = hinge.damping;
  }
  BodyNode* parent = body.parent == kWorld ? nullptr : bodies_[body.parent];
  const auto [made, child] = skeleton->createJointAndBodyNodePair<RevoluteJoint>(parent, joint, node);
  hinges_[body.joint] = made;
  bodies_.push_back(child);
}

void DartSimulation::make_contacts() {
  const auto ground = dart::dynamics::Skeleton::create("world");
  BodyNode* world = ground->createJointAndBodyNodePair<dart::dynamics::WeldJoint>().second;
  ground->setMobile(false);
  auto filter = add_shapes(model_, bodies_, world);
  if (world->getNumShapeNodes() > 0) trees_.push_back(ground);
  dart::collision::CollisionOption& option = world_->getConstraintSolver()->getCollisionOption();
  option.collisionFilter = std::move(filter);
  option.maxNumContacts = 1U << 24;  // beyond DART's 1000 a pair has one contact point only
}

void DartSimulation::set_state(const State& state) {
  for (size_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = model_.bodies[i];
    if (!body.is_free()) continue;
    const BodyState& s = state.bodies[i];
    Vec6 twist;
    twist << s.q_WB.conjugate() * s.w_WB, s.q_WB.conjugate() * s.v_WBcm;
    dart::dynamics::Joint* joint = bodies_[i]->getParentJoint();
    joint->setPositions(FreeJoint::convertToPositions(isometry(s.p_WBcm, s.q_WB)));
    joint->setVelocities(twist);
  }
  for (size_t j = 0; j < hinges_.size(); ++j) {
    hinges_[j]->setPosition(0, state.position[j] - model_.joints[j].reference);
    hinges_[j]->setVelocity(0, state.velocity[j]);
  }
}

void DartSimulation::set_torques(std::span<const double> torques) {
  // DART forgets a joint's force after the step, and a second call replaces the first
  for (size_t j = 0; j < hinges_.size(); ++j) {
    double torque = torques.empty() ? 0.0 : torques[j];
    if (explicit_springs_) {
      const Joint& hinge = model_.joints[j];
      torque += spring_torque(hinge, hinges_[j]->getPosition(0) + hinge.reference, hinges_[j]->getVelocity(0));
    }
    hinges_[j]->setForce(0, torque);
  }
}

void DartSimulation::advance(int count) {
  if (owner != this) {
    owner = this;
    set_globals(options_);
  }
  try {
    for (int i = 0; i < count; ++i) world_->step();
  } catch (const EngineError&) {
    keep(world_);
    throw;
  } catch (const std::exception& error) {
    keep(world_);
    throw EngineError(fmt::format("DART: {}", error.what()));
  }
  clock_.steps += count;
}

void DartSimulation::read_state(State& out) const {
  out.time = clock_.time();
  out.bodies.resize(bodies_.size());
  out.position.resize(hinges_.size());
  out.velocity.resize(hinges_.size());
  for (size_t j = 0; j < hinges_.size(); ++j) {
    out.position[j] = hinges_[j]->getPosition(0) + model_.joints[j].reference;
    out.velocity[j] = hinges_[j]->getVelocity(0);
  }
  for (size_t i = 0; i < bodies_.size(); ++i) {
    if (!model_.bodies[i].is_free()) continue;
    const auto* joint = static_cast<const FreeJoint*>(bodies_[i]->getParentJoint());
    const Vec6 position = joint->getPositions(), twist = joint->getVelocities();
    const Eigen::Isometry3d X_WJ = FreeJoint::convertToTransform(position);
    out.bodies[i] = {.p_WBcm = X_WJ.translation(),
                     .q_WB = Quat(X_WJ.linear()).normalized(),
                     .v_WBcm = X_WJ.linear() * twist.tail<3>(),
                     .w_WB = X_WJ.linear() * twist.head<3>()};
  }
  bodies_from_joints(model_, out);
}

EngineView DartSimulation::view() const {
  EngineView view;
  view.gravity = world_->getGravity();
  view.bodies.reserve(bodies_.size());
  for (const BodyNode* body : bodies_) {
    // the tensor that the dynamics uses is about the body frame's origin
    const Mat3 I_B = body->getSpatialInertia().topLeftCorner<3, 3>();
    const Vec3 com = body->getLocalCOM();
    const double mass = body->getSpatialInertia()(5, 5);
    const Mat3 I_Bcm = I_B - mass * (com.squaredNorm() * Mat3::Identity() - com * com.transpose());
    const Mat3 R_WB = body->getWorldTransform().linear();
    view.bodies.push_back({.mass = mass, .p_WBcm = body->getCOM(), .I_BBcm_W = R_WB * I_Bcm * R_WB.transpose()});
  }
  view.joints.reserve(hinges_.size());
  for (size_t j = 0; j < hinges_.size(); ++j) {
    const auto* joint = static_cast<const RevoluteJoint*>(hinges_[j]);
    const Eigen::Isometry3d X_WJ =
        joint->getChildBodyNode()->getWorldTransform() * joint->getTransformFromChildBodyNode();
    EngineJoint hinge{
        .p_WJ = X_WJ.translation(), .axis_W = X_WJ.linear() * joint->getAxis(), .limited = joint->areLimitsEnforced()};
    if (hinge.limited) {
      hinge.lower = joint->getPositionLowerLimit(0) + model_.joints[j].reference;
      hinge.upper = joint->getPositionUpperLimit(0) + model_.joints[j].reference;
    }
    view.joints.push_back(hinge);
  }
  return view;
}

}  // namespace assay::dartsim
