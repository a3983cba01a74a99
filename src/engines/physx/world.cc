#include "world.h"

#include <algorithm>
#include <utility>

#include "convert.h"
#include "model/kinematics.h"
#include "model/weld_frames.h"

namespace assay::px {

using namespace physx;

namespace {

// Beyond what any motion reaches; its square is still a float.
constexpr float kNoLimit = 1e16F;

PxFrictionType::Enum friction_type([[maybe_unused]] Friction friction) {
#if PX_PHYSICS_VERSION_MAJOR == 5 && PX_PHYSICS_VERSION_MINOR < 6  // later ones have patches only
  if (friction == Friction::kOneDirectional) return PxFrictionType::eONE_DIRECTIONAL;
  if (friction == Friction::kTwoDirectional) return PxFrictionType::eTWO_DIRECTIONAL;
#endif
  return PxFrictionType::ePATCH;
}

}  // namespace

PhysxSimulation::PhysxSimulation(const Model& model, const State& state, const Options& options)
    : rows_(model, options.timestep, {.wide_ranges = options.joints != Joints::kArticulation}),
      lent_(
          lend_mass(options.joints == Joints::kArticulation ? model : without_wide_ranges(model), options.lent_share)),
      model_(lent_.model),
      options_(options),
      start_(lent_.of_copy(with_joint_coordinates(model, state))),
      collision_(model_, options),
      actors_(model.bodies.size(), nullptr),
      ball_springs_(std::ranges::any_of(model.balls, &BallJoint::has_spring)),
      tendon_springs_(std::ranges::any_of(model.tendons, &Tendon::has_spring)),
      last_(start_),
      clock_{state.time, options.timestep} {
  take_complaint();
  make_scene();
  make_world_shapes();
}

void PhysxSimulation::make_scene() {
  PxPhysics& physics = sdk();
  dispatcher_.reset(PxDefaultCpuDispatcherCreate(0));
  PxSceneDesc description(physics.getTolerancesScale());
  description.gravity = to_px(model_.gravity);
  description.cpuDispatcher = dispatcher_.get();
  description.solverType = options_.tgs ? PxSolverType::eTGS : PxSolverType::ePGS;
  description.frictionType = friction_type(options_.friction);
  description.frictionOffsetThreshold *= real(collision_.size());
  description.frictionCorrelationDistance *= real(collision_.size());
  description.bounceThresholdVelocity = real(options_.restitution.threshold);
  description.filterShader = &Collision::filter;
  if (!collision_.table().empty()) {
    description.filterShaderData = collision_.table().data();
    description.filterShaderDataSize = static_cast<PxU32>(collision_.table().size());
  }
  if (collision_.modifies()) description.contactModifyCallback = &collision_;
  if (options_.friction_every_iteration) description.flags |= PxSceneFlag::eENABLE_FRICTION_EVERY_ITERATION;
  scene_.reset(physics.createScene(description));
  if (scene_ == nullptr) throw EngineError("PhysX made no scene: " + take_complaint());
}

void PhysxSimulation::make_world_shapes() {
  Owned<PxRigidActor> ground(sdk().createRigidStatic(PxTransform(PxIdentity)));
  if (!collision_.attach(*ground, kWorld)) return;
  scene_->addActor(*ground);
  owned_.push_back(std::move(ground));
}

void PhysxSimulation::prepare(PxRigidBody& actor, int body) const {
  actor.setMass(real(model_.bodies[body].mass));
  actor.setMassSpaceInertiaTensor(to_px(collision_.frame(body).inertia));
  actor.setLinearDamping(0);
  actor.setAngularDamping(0);
  actor.setMaxLinearVelocity(kNoLimit);
  actor.setMaxAngularVelocity(kNoLimit);
  actor.setMaxDepenetrationVelocity(kNoLimit);
  actor.setRigidBodyFlag(PxRigidBodyFlag::eENABLE_GYROSCOPIC_FORCES, options_.gyroscopic);
  collision_.attach(actor, body);
}

PxRigidDynamic& PhysxSimulation::make_dynamic(int body) {
  const BodyState& s = start_.bodies[body];
  PxRigidDynamic* actor = sdk().createRigidDynamic(to_px(Pose{s.p_WBcm, s.q_WB * collision_.frame(body).X_BI.q}));
  if (actor == nullptr) throw EngineError("PhysX made no body: " + take_complaint());
  owned_.emplace_back(actor);
  actors_[body] = actor;
  prepare(*actor, body);
  actor->setSolverIterationCounts(options_.position_iterations, options_.velocity_iterations);
  actor->setSleepThreshold(0);
  actor->setStabilizationThreshold(0);
  scene_->addActor(*actor);
  actor->setLinearVelocity(to_px(s.v_WBcm));
  actor->setAngularVelocity(to_px(s.w_WB));
  actor->setWakeCounter(PX_MAX_F32);
  return *actor;
}

PxTransform PhysxSimulation::in_actor(int body, const Pose& X_BF) const {
  return to_px(body == kWorld ? X_BF : collision_.frame(body).X_BI.inverse() * X_BF);
}

void PhysxSimulation::hold_together(int body_a, const Pose& X_AF, int body_b, const Pose& X_BF, bool weld) {
  PxD6Joint* joint = PxD6JointCreate(sdk(), body_a == kWorld ? nullptr : actors_[body_a], in_actor(body_a, X_AF),
                                     body_b == kWorld ? nullptr : actors_[body_b], in_actor(body_b, X_BF));
  if (joint == nullptr) throw EngineError("PhysX made no joint: " + take_complaint());
  constraints_.emplace_back(joint);
  joint->setConstraintFlag(PxConstraintFlag::eCOLLISION_ENABLED, true);
  if (weld) return;
  for (const PxD6Axis::Enum axis : {PxD6Axis::eTWIST, PxD6Axis::eSWING1, PxD6Axis::eSWING2}) {
    joint->setMotion(axis, PxD6Motion::eFREE);
  }
}

void PhysxSimulation::make_constraints() {
  for (const Connect& connect : model_.connects) {
    hold_together(connect.body_a, {connect.p_A, Quat::Identity()}, connect.body_b, {connect.p_B, Quat::Identity()},
                  /*weld=*/false);
  }
  for (const Weld& weld : model_.welds) {
    const WeldFrames frames = weld_frames(model_, weld);
    hold_together(weld.body_a, frames.X_AS, weld.body_b, frames.X_BS, /*weld=*/true);
  }
}

void PhysxSimulation::finish_set_up() {
  if (has_complaint()) throw EngineError("PhysX: " + take_complaint());
}

void PhysxSimulation::advance(int count) {
  const float h = real(options_.timestep);
  for (int i = 0; i < count; ++i) {
    if (torques_behind_) withdraw();
    torques_behind_ = torques_ahead_;
    torques_ahead_ = false;
    if (contacts_kept_) collision_.clear_contacts();
    scene_->simulate(h);
    scene_->fetchResults(true);
  }
  clock_.steps += count;
  if (has_complaint()) throw EngineError("PhysX: " + take_complaint());
}

bool PhysxSimulation::keep_contacts() {
  collision_.report_contacts(*scene_);
  contacts_kept_ = true;
  return true;
}

void PhysxSimulation::set_torques(std::span<const double> torques) {
  const bool springs = model_.has_springs() && !options_.native_pd;
  if (springs || ball_springs_ || tendon_springs_ || rows_.any()) read(last_);
  collect_torques(model_, torques, springs ? &last_ : nullptr, torques_);
  if (tendon_springs_) add_tendon_tensions(model_, last_, torques_);
  if (rows_.any()) rows_.add(model_, last_, torques_);
  if (ball_springs_) {
    ball_torques_.clear();
    for (int b = 0; std::cmp_less(b, model_.balls.size()); ++b) {
      ball_torques_.push_back(
          ball_spring_torque(model_.balls[b], ball_rotation(model_, last_, b), ball_velocity(model_, last_, b)));
    }
  }
  apply(torques_, ball_torques_);
  torques_ahead_ = true;
  torques_behind_ = false;
}

void PhysxSimulation::read_state(State& out) const {
  read(last_);
  last_.time = clock_.time();
  out = last_;
  lent_.to_original(out);
}

Pose PhysxSimulation::body_frame(int body) const { return from_px(actors_[body]->getGlobalPose()); }

void PhysxSimulation::read_dynamic(int body, BodyState& out) const {
  const Pose X_WI = body_frame(body);
  out = {X_WI.p, (X_WI.q * collision_.frame(body).X_BI.q.conjugate()).normalized(),
         from_px(actors_[body]->getLinearVelocity()), from_px(actors_[body]->getAngularVelocity())};
}

EngineView PhysxSimulation::view() const {
  EngineView out;
  out.gravity = from_px(scene_->getGravity());
  for (size_t b = 0; b < actors_.size(); ++b) {
    const Pose X_WI = body_frame(static_cast<int>(b));
    const Mat3 R = X_WI.q.toRotationMatrix();
    out.bodies.push_back(
        {.mass = actors_[b]->getMass(),
         .p_WBcm = X_WI.p,
         .I_BBcm_W = R * from_px(actors_[b]->getMassSpaceInertiaTensor()).asDiagonal() * R.transpose()});
  }
  for (size_t j = 0; j < model_.joints.size(); ++j) out.joints.push_back(view_joint(static_cast<int>(j)));
  return_lent_mass(lent_, out);
  return out;
}

}  // namespace assay::px
