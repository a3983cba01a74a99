// What the programs of this folder share, by Jolt's API alone: Jolt itself, a world in which all bodies may touch, a
// body that nothing slows down, a hinge. Nothing sleeps.
#pragma once

// clang-format off: Jolt wants this one before its others
#include <Jolt/Jolt.h>
// clang-format on

#include <Jolt/Core/Factory.h>
#include <Jolt/Core/JobSystemSingleThreaded.h>
#include <Jolt/Core/TempAllocator.h>
#include <Jolt/Physics/Body/BodyCreationSettings.h>
#include <Jolt/Physics/Collision/Shape/CapsuleShape.h>
#include <Jolt/Physics/Collision/Shape/CylinderShape.h>
#include <Jolt/Physics/Collision/Shape/EmptyShape.h>
#include <Jolt/Physics/Collision/Shape/HeightFieldShape.h>
#include <Jolt/Physics/Collision/Shape/MeshShape.h>
#include <Jolt/Physics/Collision/Shape/PlaneShape.h>
#include <Jolt/Physics/Collision/Shape/SphereShape.h>
#include <Jolt/Physics/Constraints/HingeConstraint.h>
#include <Jolt/Physics/PhysicsSystem.h>
#include <Jolt/RegisterTypes.h>

namespace finding {

inline void begin() {
  JPH::RegisterDefaultAllocator();
  JPH::Factory::sInstance = new JPH::Factory();
  JPH::RegisterTypes();
}

class Layers final : public JPH::BroadPhaseLayerInterface {
 public:
  JPH::uint GetNumBroadPhaseLayers() const override { return 1; }
  JPH::BroadPhaseLayer GetBroadPhaseLayer(JPH::ObjectLayer /*layer*/) const override { return JPH::BroadPhaseLayer(0); }
};

class World {
 public:
  explicit World(JPH::Vec3 gravity, JPH::PhysicsSettings settings = {}, JPH::uint bodies = 8) {
    system_.Init(bodies, 1, 1024, 1024, layers_, broad_filter_, pair_filter_);
    system_.SetGravity(gravity);
    settings.mAllowSleeping = false;
    system_.SetPhysicsSettings(settings);
  }

  JPH::Body* add(const JPH::BodyCreationSettings& settings) {
    JPH::BodyInterface& bodies = system_.GetBodyInterfaceNoLock();
    JPH::Body* body = bodies.CreateBody(settings);
    bodies.AddBody(body->GetID(), settings.mMotionType == JPH::EMotionType::Static ? JPH::EActivation::DontActivate
                                                                                   : JPH::EActivation::Activate);
    return body;
  }

  // From the world to the body, about an axis of both, with `side` across it.
  void add_hinge(JPH::Body& body, JPH::Vec3 point, JPH::Vec3 axis, JPH::Vec3 side) {
    JPH::HingeConstraintSettings hinge;
    hinge.mSpace = JPH::EConstraintSpace::LocalToBodyCOM;
    hinge.mPoint2 = JPH::RVec3(point);
    hinge.mHingeAxis1 = hinge.mHingeAxis2 = axis;
    hinge.mNormalAxis1 = hinge.mNormalAxis2 = side;
    system_.AddConstraint(hinge.Create(JPH::Body::sFixedToWorld, body));
  }

  void run(double timestep, long steps) {
    for (long i = 0; i < steps; ++i) system_.Update(static_cast<float>(timestep), 1, &memory_, &jobs_);
  }

  JPH::PhysicsSystem& system() { return system_; }

 private:
  Layers layers_;
  JPH::ObjectVsBroadPhaseLayerFilter broad_filter_;
  JPH::ObjectLayerPairFilter pair_filter_;
  JPH::TempAllocatorImpl memory_{10 << 20};
  JPH::JobSystemSingleThreaded jobs_{JPH::cMaxPhysicsJobs};
  JPH::PhysicsSystem system_;
};

inline JPH::BodyCreationSettings fixed_body(const JPH::Ref<JPH::Shape>& shape,
                                            JPH::Quat rotation = JPH::Quat::sIdentity()) {
  JPH::BodyCreationSettings made(shape, JPH::RVec3::sZero(), rotation, JPH::EMotionType::Static, 0);
  made.mFriction = 1;
  return made;
}

inline JPH::BodyCreationSettings free_body(const JPH::Ref<JPH::Shape>& shape, JPH::RVec3 position, JPH::Quat rotation,
                                           float mass, JPH::Vec3 moments) {
  JPH::BodyCreationSettings made(shape, position, rotation, JPH::EMotionType::Dynamic, 0);
  made.mLinearDamping = made.mAngularDamping = 0;
  made.mFriction = 1;
  made.mAllowSleeping = false;
  made.mOverrideMassProperties = JPH::EOverrideMassProperties::MassAndInertiaProvided;
  made.mMassPropertiesOverride.mMass = mass;
  made.mMassPropertiesOverride.mInertia = JPH::Mat44::sScale(moments);
  return made;
}

}  // namespace finding
