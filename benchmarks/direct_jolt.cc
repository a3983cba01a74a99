// Jolt as its user would write it: three layers, a hinge constraint each, PhysicsSystem::Update, and the turns that it
// drops.
#include <numbers>
#include <utility>
#include <vector>

// clang-format off: Jolt wants this one before its others
#include <Jolt/Jolt.h>
// clang-format on

#include <Jolt/Core/Factory.h>
#include <Jolt/Core/JobSystemSingleThreaded.h>
#include <Jolt/Core/TempAllocator.h>
#include <Jolt/Physics/Body/BodyCreationSettings.h>
#include <Jolt/Physics/Collision/Shape/CapsuleShape.h>
#include <Jolt/Physics/Collision/Shape/PlaneShape.h>
#include <Jolt/Physics/Constraints/HingeConstraint.h>
#include <Jolt/Physics/PhysicsSystem.h>
#include <Jolt/RegisterTypes.h>

#include "direct.h"
#include "model/kinematics.h"

namespace assay::benchmarks {
namespace {

constexpr JPH::ObjectLayer kUntouchable = 0, kFloor = 1, kBody = 2;

class BroadPhaseLayers final : public JPH::BroadPhaseLayerInterface, public JPH::ObjectVsBroadPhaseLayerFilter {
 public:
  JPH::uint GetNumBroadPhaseLayers() const override { return 2; }
  JPH::BroadPhaseLayer GetBroadPhaseLayer(JPH::ObjectLayer layer) const override {
    return JPH::BroadPhaseLayer(layer == kFloor ? 0 : 1);
  }
  bool ShouldCollide(JPH::ObjectLayer layer, JPH::BroadPhaseLayer /*other*/) const override {
    return layer != kUntouchable;
  }
};

class ObjectLayers final : public JPH::ObjectLayerPairFilter {
 public:
  bool ShouldCollide(JPH::ObjectLayer a, JPH::ObjectLayer b) const override { return a != 0 && b != 0 && a + b != 2; }
};

void initialise_library() {
  static const bool done = [] {
    JPH::RegisterDefaultAllocator();
    JPH::Factory::sInstance = new JPH::Factory();
    JPH::RegisterTypes();
    return true;
  }();
  (void)done;
}

float real(double x) { return static_cast<float>(x); }
JPH::Vec3 vec(const Vec3& v) { return {real(v.x()), real(v.y()), real(v.z())}; }
JPH::RVec3 position(const Vec3& p) {
  return {static_cast<JPH::Real>(p.x()), static_cast<JPH::Real>(p.y()), static_cast<JPH::Real>(p.z())};
}
JPH::Quat quat(const Quat& q) { return {real(q.x()), real(q.y()), real(q.z()), real(q.w())}; }

class DirectJolt final : public Direct {
 public:
  DirectJolt(const Scene& scene, const State& start, const Settings& settings)
      : h_(real(settings.timestep)), memory_(10 << 20), jobs_(JPH::cMaxPhysicsJobs) {
    const Model& model = scene.model;
    system_.Init(1024, 1, 1024, 1024, broad_phase_layers_, broad_phase_layers_, object_layers_);
    JPH::PhysicsSettings physics;
    physics.mNumVelocitySteps = static_cast<JPH::uint>(settings.get<long long>("velocity_steps"));
    physics.mNumPositionSteps = static_cast<JPH::uint>(settings.get<long long>("position_steps"));
    physics.mPenetrationSlop = real(settings.get<double>("penetration_slop"));
    physics.mSpeculativeContactDistance = real(settings.get<double>("speculative_distance"));
    physics.mUseBodyPairContactCache = settings.get<bool>("pair_cache");
    physics.mUseLargeIslandSplitter = false;
    physics.mAllowSleeping = false;
    system_.SetPhysicsSettings(physics);
    system_.SetGravity(vec(model.gravity));
    make_bodies(model, start);
    make_hinges(model);
    system_.OptimizeBroadPhase();
  }

  ~DirectJolt() override {
    for (const auto& hinge : hinges_) system_.RemoveConstraint(hinge);
    JPH::BodyInterface& interface = system_.GetBodyInterfaceNoLock();
    if (floor_ != nullptr) bodies_.push_back(floor_);
    for (const JPH::Body* body : bodies_) {
      interface.RemoveBody(body->GetID());
      interface.DestroyBody(body->GetID());
    }
  }
  DirectJolt(const DirectJolt&) = delete;
  DirectJolt& operator=(const DirectJolt&) = delete;

  void run(int count) override {
    for (int i = 0; i < count; ++i) step();
  }

  void run_with_torques(std::span<const double> torques, int count) override {
    for (int i = 0; i < count; ++i) {
      for (size_t j = 0; j < torques.size(); ++j) {
        JPH::Body* child = hinges_[j]->GetBody2();
        JPH::Body* parent = hinges_[j]->GetBody1();
        const JPH::Vec3 torque = real(torques[j]) * (child->GetRotation() * hinges_[j]->GetLocalSpaceHingeAxis2());
        child->AddTorque(torque);
        if (parent->IsDynamic()) parent->AddTorque(-torque);
      }
      step();
    }
  }

  std::vector<Vec3> positions() const override {
    std::vector<Vec3> result;
    for (const JPH::Body* body : bodies_) {
      const JPH::RVec3 p = body->GetCenterOfMassPosition();
      result.emplace_back(p.GetX(), p.GetY(), p.GetZ());
    }
    return result;
  }

 private:
  void step() {
    constexpr float kLeast = 1e-6f;  // rad: Jolt makes larger turns only
    system_.Update(h_, 1, &memory_, &jobs_);
    sums_.resize(bodies_.size(), Vec3::Zero());
    for (size_t b = 0; b < bodies_.size(); ++b) {
      const JPH::Vec3 turn = bodies_[b]->GetAngularVelocity() * h_;
      if (turn.Length() > kLeast || turn == JPH::Vec3::sZero()) continue;
      sums_[b] += Vec3(turn.GetX(), turn.GetY(), turn.GetZ());
      if (sums_[b].squaredNorm() <= double{kLeast} * double{kLeast}) continue;
      const Quat from = orientation(*bodies_[b]);
      bodies_[b]->AddRotationStep(vec(sums_[b]));
      sums_[b] -= 2 * (orientation(*bodies_[b]) * from.conjugate()).vec();
    }
  }

  static Quat orientation(const JPH::Body& body) {
    const JPH::Quat q = body.GetRotation();
    return {q.GetW(), q.GetX(), q.GetY(), q.GetZ()};
  }

  // Jolt's capsules lie along y, the model's along z, and so do the bodies that collide.
  static Quat body_axes(const Model& model) {
    if (model.contacts.empty()) return Quat::Identity();
    return {std::numbers::sqrt2 / 2, std::numbers::sqrt2 / 2, 0, 0};
  }

  void make_bodies(const Model& model, const State& start) {
    const JPH::Ref<JPH::Shape> none = new JPH::CapsuleShape(0.1f, 0.01f);
    JPH::BodyInterface& interface = system_.GetBodyInterfaceNoLock();
    const float friction = model.contacts.empty() ? 0 : real(model.contacts.front().friction);
    for (size_t b = 0; b < model.bodies.size(); ++b) {
      const Body& body = model.bodies[b];
      const BodyState& s = start.bodies[b];
      JPH::Ref<JPH::Shape> shape = none;
      for (const Shape& capsule : model.shapes) {
        if (model.contacts.empty() || std::cmp_not_equal(capsule.body, b)) continue;
        shape = new JPH::CapsuleShape(real(capsule.half_length), real(capsule.radius));
      }
      JPH::BodyCreationSettings made(shape, position(s.p_WBcm), quat(s.q_WB * body_axes(model)).Normalized(),
                                     JPH::EMotionType::Dynamic, model.contacts.empty() ? kUntouchable : kBody);
      made.mLinearVelocity = vec(s.v_WBcm);
      made.mAngularVelocity = vec(s.w_WB);
      made.mLinearDamping = made.mAngularDamping = 0;
      made.mMaxLinearVelocity = made.mMaxAngularVelocity = 1e18f;
      made.mApplyGyroscopicForce = true;
      made.mAllowSleeping = false;
      made.mFriction = friction;
      made.mOverrideMassProperties = JPH::EOverrideMassProperties::MassAndInertiaProvided;
      made.mMassPropertiesOverride.mMass = real(body.mass);
      made.mMassPropertiesOverride.mInertia = JPH::Mat44::sIdentity();
      JPH::Body* created = interface.CreateBody(made);
      // the bodies of both systems have principal axes
      const Mat3 R = body_axes(model).toRotationMatrix();
      const Vec3 inertia = (R.transpose() * body.I_BBcm_B * R).diagonal();
      created->GetMotionProperties()->SetInverseMass(real(1 / body.mass));
      created->GetMotionProperties()->SetInverseInertia(vec(inertia.cwiseInverse()), JPH::Quat::sIdentity());
      interface.AddBody(created->GetID(), JPH::EActivation::Activate);
      bodies_.push_back(created);
    }
    if (model.contacts.empty()) return;
    const Quat up(std::numbers::sqrt2 / 2, std::numbers::sqrt2 / 2, 0, 0);
    JPH::BodyCreationSettings floor(new JPH::PlaneShape(JPH::Plane(JPH::Vec3::sAxisY(), 0), nullptr, 1e5f),
                                    JPH::RVec3::sZero(), quat(up).Normalized(), JPH::EMotionType::Static, kFloor);
    floor.mFriction = friction;
    floor_ = interface.CreateBody(floor);
    interface.AddBody(floor_->GetID(), JPH::EActivation::DontActivate);
  }

  void make_hinges(const Model& model) {
    for (size_t j = 0; j < model.joints.size(); ++j) {
      const Joint& hinge = model.joints[j];
      const Body& body = model.bodies[hinge.body];
      const auto point = [](const Vec3& v) { return JPH::RVec3(vec(v)); };
      JPH::HingeConstraintSettings made;
      made.mSpace = JPH::EConstraintSpace::LocalToBodyCOM;
      made.mPoint1 = point(anchor_in_parent(model, static_cast<int>(j)) -
                           (body.parent == kWorld ? Vec3::Zero() : model.bodies[body.parent].p_BBcm));
      made.mPoint2 = point(hinge.p_BJ - body.p_BBcm);
      made.mHingeAxis1 = made.mHingeAxis2 = vec(hinge.axis_B);
      made.mNormalAxis1 = made.mNormalAxis2 = made.mHingeAxis1.GetNormalizedPerpendicular();
      JPH::Body& parent = body.parent == kWorld ? JPH::Body::sFixedToWorld : *bodies_[body.parent];
      hinges_.emplace_back(static_cast<JPH::HingeConstraint*>(made.Create(parent, *bodies_[hinge.body])));
      system_.AddConstraint(hinges_.back());
    }
  }

  float h_;
  BroadPhaseLayers broad_phase_layers_;
  ObjectLayers object_layers_;
  JPH::TempAllocatorImpl memory_;
  JPH::JobSystemSingleThreaded jobs_;
  JPH::PhysicsSystem system_;
  std::vector<JPH::Body*> bodies_;
  std::vector<Vec3> sums_;  // of the turns that Jolt dropped, rad
  JPH::Body* floor_ = nullptr;
  std::vector<JPH::Ref<JPH::HingeConstraint>> hinges_;
};

std::unique_ptr<Direct> make(const Scene& scene, const State& start, const Settings& settings) {
  initialise_library();
  return std::make_unique<DirectJolt>(scene, start, settings);
}

}  // namespace
}  // namespace assay::benchmarks

#ifdef JPH_DOUBLE_PRECISION
ASSAY_DIRECT_LOOP(assay::benchmarks::make, "jolt-f64")
#else
ASSAY_DIRECT_LOOP(assay::benchmarks::make, "jolt-f32")
#endif
