#include "world.h"

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <iostream>
#include <limits>
#include <mutex>
#include <string>
#include <utility>

#include <dart/collision/CollisionObject.hpp>
#include <dart/collision/ode/OdeCollisionDetector.hpp>
#include <dart/constraint/BoxedLcpConstraintSolver.hpp>
#include <dart/constraint/ConstraintBase.hpp>
#include <dart/constraint/ContactConstraint.hpp>
#include <dart/constraint/ContactSurface.hpp>
#include <dart/constraint/DantzigBoxedLcpSolver.hpp>
#include <dart/constraint/JointConstraint.hpp>
#include <dart/constraint/PgsBoxedLcpSolver.hpp>
#include <dart/dynamics/BallJoint.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/PrismaticJoint.hpp>
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
using dart::dynamics::PrismaticJoint;
using dart::dynamics::RevoluteJoint;
using Vec6 = Eigen::Matrix<double, 6, 1>;

// Of a massless body, kg and kg m^2: DART's algorithm takes 0, but DART warns of it. Beside any other mass it rounds
// away.
constexpr double kNoMass = 1e-100;

Eigen::Isometry3d isometry(const Vec3& p, const Quat& q) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = q.toRotationMatrix();
  X.translation() = p;
  return X;
}

// ODE, which finds the contacts, ends the process after an error, unless a handler is set. The plugin has a copy of ODE
// of its own.
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
  const auto cap = [](double speed) { return speed > 0 ? speed : std::numeric_limits<double>::infinity(); };
  ContactConstraint::setMaxErrorReductionVelocity(cap(options.contact_max_correcting_velocity));
  ContactConstraint::setConstraintForceMixing(options.contact_cfm);
  dart::constraint::JointConstraint::setErrorAllowance(0);
  dart::constraint::JointConstraint::setMaxErrorReductionVelocity(cap(options.limit_max_correcting_velocity));
  dart::constraint::JointConstraint::setConstraintForceMixing(options.limit_cfm);
}

// Whether DART's constraints act on a model: with inverse inertias of their own, which hold no implicit terms
// (findings/dart/constraints_skip_damping.cc).
bool has_impulses(const Model& model) {
  return !model.contacts.empty() || model.has_limits() ||
         std::ranges::any_of(model.joints, [](const Joint& joint) { return joint.dry_friction != 0; }) ||
         std::ranges::any_of(model.balls, [](const BallJoint& ball) { return ball.dry_friction != 0; });
}

bool has_any_armature(const Model& model) {
  return model.has_armature() || std::ranges::any_of(model.balls, [](const BallJoint& b) { return b.armature != 0; });
}

// Turns the pyramid of a contact's friction to the slip. DART makes contacts once the step's other forces have acted,
// so that the slip of a body at rest is what friction has to take away.
class AlongSlip final : public dart::constraint::DefaultContactSurfaceHandler {
 public:
  dart::constraint::ContactSurfaceParams createParams(const dart::collision::Contact& contact,
                                                      size_t count) const override {
    constexpr double kLeast = 1e-9;  // m/s
    dart::constraint::ContactSurfaceParams params = DefaultContactSurfaceHandler::createParams(contact, count);
    const Vec3 relative =
        velocity(contact.collisionObject1, contact.point) - velocity(contact.collisionObject2, contact.point);
    const Vec3 slip = relative - relative.dot(contact.normal) * contact.normal;
    if (slip.norm() > kLeast) params.mFirstFrictionalDirection = slip.normalized();
    return params;
  }

 private:
  static Vec3 velocity(const dart::collision::CollisionObject* object, const Vec3& point) {
    const auto body = object->getShapeFrame()->asShapeNode()->getBodyNodePtr();
    return body->getLinearVelocity(body->getWorldTransform().inverse() * point);
  }
};

}  // namespace

// A joint's armature a, damper D and spring K as rows of DART's LCP, so that contacts, limits and dry friction feel
// them. A row's impulse is -(a + h D + h^2 K) v_end + a v_start - h K (q_start - rest): the torques at the step's end,
// over the step.
class ArmatureRow final : public dart::constraint::ConstraintBase {
 public:
  ArmatureRow(dart::dynamics::Joint* joint, double armature, double stiffness, double damping, double rest, double h)
      : joint_(joint),
        body_(joint->getChildBodyNode()),
        armature_(armature),
        pull_(h * stiffness),
        rest_(rest),
        compliance_(1 / (armature + (h * damping) + (h * h * stiffness))) {
    mDim = joint->getNumDofs();
  }

  // Before each step, while the joint has the state of the step's start.
  void begin_step() {
    for (size_t i = 0; i < mDim; ++i) {
      target_[i] = armature_ * joint_->getVelocity(i);
      if (pull_ != 0) target_[i] -= pull_ * (joint_->getPosition(i) - rest_);
      target_[i] *= compliance_;
    }
  }

  void update() override {}
  void getInformation(dart::constraint::ConstraintInfo* info) override {
    for (size_t i = 0; i < mDim; ++i) {
      info->b[i] = target_[i] - joint_->getVelocity(i);
      info->lo[i] = -std::numeric_limits<double>::infinity();
      info->hi[i] = std::numeric_limits<double>::infinity();
      info->x[i] = info->w[i] = 0;
      info->findex[i] = -1;
    }
  }
  void applyUnitImpulse(std::size_t index) override {
    const dart::dynamics::SkeletonPtr skeleton = joint_->getSkeleton();
    skeleton->clearConstraintImpulses();
    joint_->setConstraintImpulse(index, 1);
    skeleton->updateBiasImpulse(body_);
    skeleton->updateVelocityChange();
    joint_->setConstraintImpulse(index, 0);
    applied_ = index;
  }
  void getVelocityChange(double* change, bool with_cfm) override {
    const bool moved = joint_->getSkeleton()->isImpulseApplied();
    for (size_t i = 0; i < mDim; ++i) change[i] = moved ? joint_->getVelocityChange(i) : 0;
    if (with_cfm) change[applied_] += compliance_;
  }
  void excite() override { joint_->getSkeleton()->setImpulseApplied(true); }
  void unexcite() override { joint_->getSkeleton()->setImpulseApplied(false); }
  void applyImpulse(double* impulse) override {
    for (size_t i = 0; i < mDim; ++i) {
      joint_->setConstraintImpulse(i, joint_->getConstraintImpulse(i) + impulse[i]);
    }
  }
  bool isActive() const override { return true; }
  dart::dynamics::SkeletonPtr getRootSkeleton() const override {
    return ConstraintBase::getRootSkeleton(joint_->getSkeleton());
  }

 private:
  dart::dynamics::Joint* joint_;
  BodyNode* body_;
  double armature_, pull_, rest_, compliance_;
  std::array<double, 3> target_{};  // velocity at the step's end without an impulse of the row
  std::size_t applied_ = 0;
};

DartSimulation::DartSimulation(Model model, const State& state, const Options& options)
    : options_(options),
      clock_{state.time, options.timestep},
      rows_(model, options.timestep, {.wide_ranges = false}),
      model_(std::move(model)),
      explicit_springs_(model_.has_springs() && !options_.native_pd),
      armature_in_rows_(has_impulses(model_) && has_any_armature(model_)),
      armature_in_joints_(!armature_in_rows_ && has_any_armature(model_)),
      reads_state_(explicit_springs_ || std::ranges::any_of(model_.balls, &BallJoint::has_spring) ||
                   std::ranges::any_of(model_.tendons, &Tendon::has_spring) || rows_.any()) {
  model_.keyframes.clear();
  initialise_library();
  owner = this;
  set_globals(options_);
  make_world();
  make_bodies();
  if (armature_in_rows_) make_armature_rows();
  if (!model_.contacts.empty()) make_contacts();
  // with their shapes: the collision detector finds shapes that are added later in the order of their addresses
  std::streambuf* const output = std::cout.rdbuf();
  if (!model_.height_fields.empty()) std::cout.rdbuf(nullptr);  // DART prints the bounds of each field
  for (const dart::dynamics::SkeletonPtr& tree : trees_) world_->addSkeleton(tree);
  if (!model_.height_fields.empty()) std::cout.rdbuf(output);
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
  if (options_.along_slip) world_->getConstraintSolver()->addContactSurfaceHandler(std::make_shared<AlongSlip>());
}

// One skeleton a tree. A body's frame is the MJCF body's.
void DartSimulation::make_bodies() {
  std::vector<dart::dynamics::SkeletonPtr> skeleton_of(model_.bodies.size());
  joints_.resize(model_.joints.size());
  balls_.resize(model_.balls.size());
  for (size_t i = 0; i < model_.bodies.size(); ++i) {
    const Body& body = model_.bodies[i];
    if (body.parent == kWorld) trees_.push_back(dart::dynamics::Skeleton::create(fmt::format("tree {}", i)));
    skeleton_of[i] = body.parent == kWorld ? trees_.back() : skeleton_of[body.parent];
    make_body(static_cast<int>(i), skeleton_of[i]);
  }
}

void DartSimulation::make_body(int index, const dart::dynamics::SkeletonPtr& skeleton) {
  const Body& body = model_.bodies[index];
  BodyNode::Properties node;
  node.mName = fmt::format("body {}", index);
  node.mInertia = body.is_massless() ? dart::dynamics::Inertia(kNoMass, Vec3::Zero(), kNoMass * Mat3::Identity())
                                     : dart::dynamics::Inertia(body.mass, body.p_BBcm, body.I_BBcm_B);
  const std::string name = fmt::format("joint {}", index);
  if (body.is_free()) {
    // the joint's frame lies in the centre of mass: DART moves that point with the velocity of the step's end
    FreeJoint::Properties joint;
    joint.mName = name;
    joint.mT_ChildBodyToJoint.translation() = body.p_BBcm;
    bodies_.push_back(skeleton->createJointAndBodyNodePair<FreeJoint>(nullptr, joint, node).second);
    return;
  }
  BodyNode* parent = body.parent == kWorld ? nullptr : bodies_[body.parent];
  const Eigen::Isometry3d X_PB = isometry(body.X_PB.p, body.X_PB.q);
  if (body.ball >= 0) {
    dart::dynamics::BallJoint::Properties joint;
    joint.mName = name;
    joint.mT_ChildBodyToJoint.translation() = model_.balls[body.ball].p_BJ;
    joint.mT_ParentBodyToJoint = X_PB * joint.mT_ChildBodyToJoint;
    joint.mFrictions.setConstant(model_.balls[body.ball].dry_friction);
    if (armature_in_joints_) {
      joint.mDampingCoefficients.setConstant(model_.balls[body.ball].armature / options_.timestep);
    }
    const auto [made, child] = skeleton->createJointAndBodyNodePair<dart::dynamics::BallJoint>(parent, joint, node);
    balls_[body.ball] = made;
    bodies_.push_back(child);
    return;
  }
  const auto add = [&]<typename JointClass>(JointClass* /*type*/) {
    typename JointClass::Properties joint;
    joint.mName = name;
    set_properties(joint, model_.joints[body.joint], X_PB);
    const auto [made, child] = skeleton->createJointAndBodyNodePair<JointClass>(parent, joint, node);
    joints_[body.joint] = made;
    bodies_.push_back(child);
  };
  if (model_.joints[body.joint].is_slide()) {
    add(static_cast<PrismaticJoint*>(nullptr));
  } else {
    add(static_cast<RevoluteJoint*>(nullptr));
  }
}

template <typename Properties>
void DartSimulation::set_properties(Properties& joint, const Joint& model, const Eigen::Isometry3d& X_PB) const {
  joint.mAxis = model.axis_B;
  joint.mT_ChildBodyToJoint.translation() = model.p_BJ;
  joint.mT_ParentBodyToJoint = X_PB * joint.mT_ChildBodyToJoint;
  if (model.limited) {
    joint.mPositionLowerLimits[0] = model.lower - model.reference;
    joint.mPositionUpperLimits[0] = model.upper - model.reference;
  }
  joint.mIsPositionLimitEnforced = model.limited;
  joint.mFrictions[0] = model.dry_friction;
  if (options_.native_pd && (!armature_in_rows_ || model.armature == 0)) {
    joint.mSpringStiffnesses[0] = model.stiffness;
    joint.mRestPositions[0] = model.spring_reference - model.reference;
    joint.mDampingCoefficients[0] = model.damping;
  }
  if (armature_in_joints_) joint.mDampingCoefficients[0] += model.armature / options_.timestep;  // see push_armature()
}

void DartSimulation::make_armature_rows() {
  const auto add = [this](dart::dynamics::Joint* joint, double armature, double K, double D, double rest) {
    if (armature == 0) return;
    armature_rows_.push_back(std::make_shared<ArmatureRow>(joint, armature, K, D, rest, options_.timestep));
    world_->getConstraintSolver()->addConstraint(armature_rows_.back());
  };
  for (size_t j = 0; j < joints_.size(); ++j) {
    const Joint& model = model_.joints[j];
    const bool native = options_.native_pd;
    add(joints_[j], model.armature, native ? model.stiffness : 0, native ? model.damping : 0,
        model.spring_reference - model.reference);
  }
  for (size_t i = 0; i < balls_.size(); ++i) add(balls_[i], model_.balls[i].armature, 0, 0, 0);
}

void DartSimulation::make_contacts() {
  const auto ground = dart::dynamics::Skeleton::create("world");
  BodyNode* world = ground->createJointAndBodyNodePair<dart::dynamics::WeldJoint>().second;
  ground->setMobile(false);
  auto filter = add_shapes(model_, bodies_, world, options_.restitution);
  if (world->getNumShapeNodes() > 0) trees_.push_back(ground);
  dart::collision::CollisionOption& option = world_->getConstraintSolver()->getCollisionOption();
  filter_ = filter;
  option.collisionFilter = std::move(filter);
  option.maxNumContacts = 1U << 24;  // beyond DART's 1000 a pair has one contact point only
}

bool DartSimulation::keep_contacts() {
  contacts_kept_ = true;
  return true;
}

// DART leaves the forces of a step in the result of its collision detection, on the first body; the normal points to
// it.
void DartSimulation::read_contacts(std::vector<ContactForce>& out) const {
  out.clear();
  if (!contacts_kept_ || filter_ == nullptr || clock_.steps == 0) return;
  for (const dart::collision::Contact& contact : world_->getLastCollisionResult().getContacts()) {
    const int first = filter_->shape_of(contact.collisionObject1), second = filter_->shape_of(contact.collisionObject2);
    const double sign = first > second ? 1 : -1;
    out.push_back({.shape_a = std::min(first, second),
                   .shape_b = std::max(first, second),
                   .p_W = contact.point,
                   .n_W = sign * contact.normal,
                   .gap = -contact.penetrationDepth,
                   .impulse_W = sign * options_.timestep * contact.force});
  }
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
  for (size_t j = 0; j < joints_.size(); ++j) {
    joints_[j]->setPosition(0, state.position[j] - model_.joints[j].reference);
    joints_[j]->setVelocity(0, state.velocity[j]);
  }
  for (size_t i = 0; i < balls_.size(); ++i) {
    const int ball = static_cast<int>(i);
    const Mat3 rotation = ball_rotation(model_, state, ball).toRotationMatrix();
    balls_[i]->setPositions(dart::dynamics::BallJoint::convertToPositions(rotation));
    balls_[i]->setVelocities(ball_velocity(model_, state, ball));
  }
}

void DartSimulation::set_torques(std::span<const double> torques) {
  // DART forgets a joint's force after the step, and a second call replaces the first
  if (reads_state_) read_state(scratch_);
  collect_torques(model_, torques, explicit_springs_ ? &scratch_ : nullptr, torques_);
  if (reads_state_) {
    add_tendon_tensions(model_, scratch_, torques_);
    rows_.add(model_, scratch_, torques_);
  }
  for (size_t j = 0; j < joints_.size(); ++j) joints_[j]->setForce(0, torques_[j]);
  if (!reads_state_) return;
  for (size_t i = 0; i < balls_.size(); ++i) {
    const int ball = static_cast<int>(i);
    balls_[i]->setForces(ball_spring_torque(model_.balls[i], ball_rotation(model_, scratch_, ball),
                                            ball_velocity(model_, scratch_, ball)));
  }
}

// DART's implicit damper D adds h D to the joint-space inertia's diagonal, and -D q' to the forces. With D = a / h and
// the force put back, armature a is left. A joint's command is what set_torques() gave, and zero after a step. Where
// constraints act, which do not feel that damper, armature is a row beside them.
void DartSimulation::push_armature() {
  for (const auto& row : armature_rows_) row->begin_step();
  if (!armature_in_joints_) return;
  for (size_t j = 0; j < joints_.size(); ++j) {
    const double armature = model_.joints[j].armature;
    if (armature == 0) continue;
    joints_[j]->setForce(0, joints_[j]->getCommand(0) + (armature / options_.timestep * joints_[j]->getVelocity(0)));
  }
  for (size_t i = 0; i < balls_.size(); ++i) {
    const double armature = model_.balls[i].armature;
    if (armature == 0) continue;
    balls_[i]->setForces(balls_[i]->getCommands() + (armature / options_.timestep * balls_[i]->getVelocities()));
  }
}

void DartSimulation::advance(int count) {
  if (owner != this) {
    owner = this;
    set_globals(options_);
  }
  try {
    for (int i = 0; i < count; ++i) {
      push_armature();
      world_->step();
    }
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
  out.position.resize(joints_.size());
  out.velocity.resize(joints_.size());
  for (size_t j = 0; j < joints_.size(); ++j) {
    out.position[j] = joints_[j]->getPosition(0) + model_.joints[j].reference;
    out.velocity[j] = joints_[j]->getVelocity(0);
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
  std::vector<BallCoordinates> balls(balls_.size());
  for (size_t i = 0; i < balls_.size(); ++i) {
    const Mat3 rotation = dart::dynamics::BallJoint::convertToRotation(Vec3(balls_[i]->getPositions()));
    balls[i] = {Quat(rotation).normalized(), balls_[i]->getVelocities()};
  }
  bodies_from_joints(model_, balls, out);
}

EngineView DartSimulation::view() const {
  EngineView view;
  view.gravity = world_->getGravity();
  view.bodies.reserve(bodies_.size());
  for (const BodyNode* body : bodies_) {
    // the tensor that the dynamics uses is about the body frame's origin
    const Mat3 I_B = body->getSpatialInertia().topLeftCorner<3, 3>();
    const Vec3 com = body->getLocalCOM();
    const double held = body->getSpatialInertia()(5, 5);
    const double mass = held > kNoMass ? held : 0;
    const Mat3 I_Bcm = I_B - mass * (com.squaredNorm() * Mat3::Identity() - com * com.transpose());
    const Mat3 R_WB = body->getWorldTransform().linear();
    view.bodies.push_back({.mass = mass, .p_WBcm = body->getCOM(), .I_BBcm_W = R_WB * I_Bcm * R_WB.transpose()});
  }
  view.joints.reserve(joints_.size());
  for (size_t j = 0; j < joints_.size(); ++j) {
    const dart::dynamics::Joint* joint = joints_[j];
    const Eigen::Isometry3d X_WJ =
        joint->getChildBodyNode()->getWorldTransform() * joint->getTransformFromChildBodyNode();
    const Vec3& axis = model_.joints[j].is_slide() ? static_cast<const PrismaticJoint*>(joint)->getAxis()
                                                   : static_cast<const RevoluteJoint*>(joint)->getAxis();
    EngineJoint hinge{
        .p_WJ = X_WJ.translation(), .axis_W = X_WJ.linear() * axis, .limited = joint->areLimitsEnforced()};
    if (hinge.limited) {
      hinge.lower = joint->getPositionLowerLimit(0) + model_.joints[j].reference;
      hinge.upper = joint->getPositionUpperLimit(0) + model_.joints[j].reference;
    }
    view.joints.push_back(hinge);
  }
  return view;
}

}  // namespace assay::dartsim
