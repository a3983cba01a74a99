// PhysX as its user would write it: simulate, fetchResults. Bodies with D6 joints, or one articulation.
#include <algorithm>
#include <memory>

#include <PxPhysicsAPI.h>

#include "direct.h"
#include "model/kinematics.h"

namespace assay::benchmarks {
namespace {

using namespace physx;

float f(double x) { return static_cast<float>(x); }
PxVec3 px(const Vec3& v) { return {f(v.x()), f(v.y()), f(v.z())}; }
PxTransform px(const Pose& X) { return {px(X.p), PxQuat(f(X.q.x()), f(X.q.y()), f(X.q.z()), f(X.q.w()))}; }
Quat x_to(const Vec3& axis) { return Quat(Eigen::Quaterniond::FromTwoVectors(Vec3::UnitX(), axis)); }

PxPhysics& physics() {
  static PxDefaultAllocator allocator;
  static PxDefaultErrorCallback errors;
  static PxPhysics* const instance = [] {
    PxFoundation* foundation = PxCreateFoundation(PX_PHYSICS_VERSION, allocator, errors);
    PxPhysics* made = PxCreatePhysics(PX_PHYSICS_VERSION, *foundation, PxTolerancesScale());
    PxInitExtensions(*made, nullptr);
    return made;
  }();
  return *instance;
}

// After PhysX itself.
PxDefaultCpuDispatcher* make_dispatcher() {
  physics();
  return PxDefaultCpuDispatcherCreate(0);
}

class DirectPhysx final : public Direct {
 public:
  DirectPhysx(const Scene& scene, const State& start, const Settings& settings)
      : h_(f(settings.timestep)),
        position_iterations_(static_cast<PxU32>(settings.get<long long>("position_iterations"))),
        velocity_iterations_(static_cast<PxU32>(settings.get<long long>("velocity_iterations"))),
        dispatcher_(make_dispatcher()) {
    const Model& model = scene.model;
    double size = 1;  // of a shape: all are the same
    for (const Shape& shape : model.shapes) {
      if (!model.contacts.empty() && shape.type == ShapeType::kCapsule) size = 2 * (shape.radius + shape.half_length);
    }
    contact_offset_ = f(settings.get<double>("contact_offset") * size);
    PxSceneDesc description(physics().getTolerancesScale());
    description.gravity = px(model.gravity);
    description.cpuDispatcher = dispatcher_;
    description.filterShader = PxDefaultSimulationFilterShader;
    if (settings.get<std::string>("solver") == "tgs") description.solverType = PxSolverType::eTGS;
    description.frictionOffsetThreshold *= f(size);
    description.frictionCorrelationDistance *= f(size);
    scene_ = physics().createScene(description);

    const float mu = model.contacts.empty() ? 0 : f(model.contacts.front().friction);
    material_ = physics().createMaterial(mu, mu, 0);
    if (!model.contacts.empty()) make_ground();
    if (!model.joints.empty() && settings.get<std::string>("joints") == "articulation") {
      make_articulation(model, start);
    } else {
      for (size_t b = 0; b < model.bodies.size(); ++b) make_body(model, static_cast<int>(b), start.bodies[b]);
      for (const Joint& hinge : model.joints) make_joint(model, hinge);
    }
  }

  ~DirectPhysx() override {
    for (PxJoint* joint : joints_) joint->release();
    if (cache_ != nullptr) cache_->release();
    if (articulation_ != nullptr) {
      articulation_->release();
    } else {
      for (PxRigidBody* body : bodies_) body->release();
    }
    if (ground_ != nullptr) ground_->release();
    scene_->release();
    dispatcher_->release();
    material_->release();
  }
  DirectPhysx(const DirectPhysx&) = delete;
  DirectPhysx& operator=(const DirectPhysx&) = delete;

  void run(int count) override {
    for (int i = 0; i < count; ++i) {
      scene_->simulate(h_);
      scene_->fetchResults(true);
    }
  }

  void run_with_torques(std::span<const double> torques, int count) override {
    for (int i = 0; i < count; ++i) {
      for (size_t j = 0; j < torques.size(); ++j) {
        if (articulation_ != nullptr) {
          cache_->jointForce[j] = f(torques[j]);
          continue;
        }
        const PxTransform X_BJ = joints_[j]->getLocalPose(PxJointActorIndex::eACTOR1);
        const PxVec3 torque = bodies_[j]->getGlobalPose().q.rotate(X_BJ.q.getBasisVector0()) * f(torques[j]);
        bodies_[j]->addTorque(torque);
        if (j > 0) bodies_[j - 1]->addTorque(-torque);
      }
      if (articulation_ != nullptr) articulation_->applyCache(*cache_, PxArticulationCacheFlag::eFORCE);
      scene_->simulate(h_);
      scene_->fetchResults(true);
    }
  }

  std::vector<Vec3> positions() const override {
    std::vector<Vec3> result;
    if (articulation_ != nullptr) {
      articulation_->copyInternalStateToCache(*cache_, PxArticulationCacheFlag::ePOSITION);
      State state;
      state.bodies.resize(chain_.bodies.size());
      state.velocity.assign(chain_.joints.size(), 0);
      for (size_t j = 0; j < chain_.joints.size(); ++j) {
        state.position.push_back(cache_->jointPosition[j] + chain_.joints[j].reference);
      }
      bodies_from_joints(chain_, state);
      for (const BodyState& body : state.bodies) result.push_back(body.p_WBcm);
      return result;
    }
    for (const PxRigidBody* body : bodies_) {
      const PxVec3 p = body->getGlobalPose().p;
      result.emplace_back(p.x, p.y, p.z);
    }
    return result;
  }

 private:
  void make_ground() {
    ground_ = physics().createRigidStatic(PxTransform(PxIdentity));
    PxShape* plane =
        PxRigidActorExt::createExclusiveShape(*ground_, PxPlaneGeometry(), *material_, PxShapeFlag::eSIMULATION_SHAPE);
    plane->setLocalPose(px(Pose{Vec3::Zero(), x_to(Vec3::UnitZ())}));
    plane->setContactOffset(contact_offset_);
    scene_->addActor(*ground_);
  }

  // Bodies whose inertia is diagonal in their own axes, and whose capsule lies along z through the centre of mass.
  void prepare(PxRigidBody& actor, const Model& model, int b) {
    actor.setMass(f(model.bodies[b].mass));
    actor.setMassSpaceInertiaTensor(px(Vec3(model.bodies[b].I_BBcm_B.diagonal())));
    actor.setLinearDamping(0);
    actor.setAngularDamping(0);
    actor.setMaxLinearVelocity(1e16F);
    actor.setMaxAngularVelocity(1e16F);
    actor.setRigidBodyFlag(PxRigidBodyFlag::eENABLE_GYROSCOPIC_FORCES, true);
    bodies_.push_back(&actor);
    if (model.contacts.empty()) return;
    for (const Shape& shape : model.shapes) {
      if (shape.body != b) continue;
      PxShape* capsule = PxRigidActorExt::createExclusiveShape(
          actor, PxCapsuleGeometry(f(shape.radius), f(shape.half_length)), *material_, PxShapeFlag::eSIMULATION_SHAPE);
      capsule->setLocalPose(px(Pose{Vec3::Zero(), x_to(Vec3::UnitZ())}));
      capsule->setContactOffset(contact_offset_);
    }
  }

  void make_body(const Model& model, int b, const BodyState& s) {
    PxRigidDynamic* actor = physics().createRigidDynamic(px(Pose{s.p_WBcm, s.q_WB}));
    prepare(*actor, model, b);
    actor->setSolverIterationCounts(position_iterations_, velocity_iterations_);
    actor->setSleepThreshold(0);
    actor->setStabilizationThreshold(0);
    scene_->addActor(*actor);
    actor->setLinearVelocity(px(s.v_WBcm));
    actor->setAngularVelocity(px(s.w_WB));
    actor->setWakeCounter(PX_MAX_F32);
  }

  // The hinge's frame in the parent's and in the child's centre of mass.
  struct Frames {
    PxTransform in_parent, in_child;
  };
  static Frames frames(const Model& model, const Joint& hinge) {
    const Body& body = model.bodies[hinge.body];
    const Pose X_BJ{hinge.p_BJ, x_to(hinge.axis_B)};
    Pose X_PJ = body.X_PB * X_BJ;
    if (body.parent != kWorld) X_PJ = Pose{model.bodies[body.parent].p_BBcm, Quat::Identity()}.inverse() * X_PJ;
    return {px(X_PJ), px(Pose{body.p_BBcm, Quat::Identity()}.inverse() * X_BJ)};
  }

  void make_joint(const Model& model, const Joint& hinge) {
    const int parent = model.bodies[hinge.body].parent;
    const Frames X = frames(model, hinge);
    PxD6Joint* joint = PxD6JointCreate(physics(), parent == kWorld ? nullptr : bodies_[parent], X.in_parent,
                                       bodies_[hinge.body], X.in_child);
    joint->setMotion(PxD6Axis::eTWIST, PxD6Motion::eFREE);
    joints_.push_back(joint);
  }

  // A chain on the world: every body has a hinge, in order.
  void make_articulation(const Model& model, const State& start) {
    chain_ = model;
    articulation_ = physics().createArticulationReducedCoordinate();
    articulation_->setArticulationFlag(PxArticulationFlag::eFIX_BASE, true);
    articulation_->setSolverIterationCounts(position_iterations_, velocity_iterations_);
    articulation_->setSleepThreshold(0);
    articulation_->setStabilizationThreshold(0);
#if PX_PHYSICS_VERSION_MAJOR == 5 && PX_PHYSICS_VERSION_MINOR < 6
    articulation_->setMaxCOMLinearVelocity(PX_MAX_F32);
    articulation_->setMaxCOMAngularVelocity(PX_MAX_F32);
#endif
    PxArticulationLink* parent = articulation_->createLink(nullptr, PxTransform(PxIdentity));
    for (size_t b = 0; b < model.bodies.size(); ++b) {
      const BodyState& s = start.bodies[b];
      PxArticulationLink* link = articulation_->createLink(parent, px(Pose{s.p_WBcm, s.q_WB}));
      prepare(*link, model, static_cast<int>(b));
      link->setCfmScale(0);
      const Frames X = frames(model, model.joints[model.bodies[b].joint]);
      PxArticulationJointReducedCoordinate* joint = link->getInboundJoint();
      joint->setParentPose(X.in_parent);
      joint->setChildPose(X.in_child);
      joint->setJointType(PxArticulationJointType::eREVOLUTE_UNWRAPPED);
      joint->setMotion(PxArticulationAxis::eTWIST, PxArticulationMotion::eFREE);
      joint->setFrictionCoefficient(0);
      joint->setMaxJointVelocity(PX_MAX_F32);
      parent = link;
    }
    scene_->addArticulation(*articulation_);
    articulation_->setWakeCounter(PX_MAX_F32);
    cache_ = articulation_->createCache();
    articulation_->zeroCache(*cache_);
    for (size_t j = 0; j < model.joints.size(); ++j) {
      cache_->jointPosition[j] = f(start.position[j] - model.joints[j].reference);
      cache_->jointVelocity[j] = f(start.velocity[j]);
    }
    articulation_->applyCache(*cache_, PxArticulationCacheFlag::ePOSITION | PxArticulationCacheFlag::eVELOCITY);
  }

  float h_;
  float contact_offset_ = 0;
  PxU32 position_iterations_, velocity_iterations_;
  PxDefaultCpuDispatcher* dispatcher_;
  PxScene* scene_ = nullptr;
  PxMaterial* material_ = nullptr;
  PxRigidStatic* ground_ = nullptr;
  std::vector<PxRigidBody*> bodies_;
  std::vector<PxJoint*> joints_;
  PxArticulationReducedCoordinate* articulation_ = nullptr;
  PxArticulationCache* cache_ = nullptr;
  Model chain_;
};

std::unique_ptr<Direct> make(const Scene& scene, const State& start, const Settings& settings) {
  return std::make_unique<DirectPhysx>(scene, start, settings);
}

}  // namespace
}  // namespace assay::benchmarks

#if PX_PHYSICS_VERSION_MAJOR == 5 && PX_PHYSICS_VERSION_MINOR < 6
ASSAY_DIRECT_LOOP(assay::benchmarks::make, "physx-d6-pgs", "physx-d6-tgs", "physx-art-pgs", "physx-art-tgs")
#else
ASSAY_DIRECT_LOOP(assay::benchmarks::make, "physx56-d6-pgs", "physx56-d6-tgs", "physx56-art-pgs", "physx56-art-tgs")
#endif
