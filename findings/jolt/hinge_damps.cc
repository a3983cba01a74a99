// A hinge takes energy out. Jolt solves velocities against the joint's directions at the step's start, moves the
// bodies, and corrects their positions without turning the velocities: the next step takes away what then points along
// the arm. A body of mass m and inertia I, pinned at the distance r from its centre of mass and spun in weightlessness,
// should turn for ever. It slows by w' = -k h w^3 / 2 with k = m r^2 / (I + m r^2), that is to w0 / sqrt(1 + k h w0^2
// t), whatever the iterations.
#include <cmath>
#include <cstdio>

// clang-format off: Jolt wants this one before its others
#include <Jolt/Jolt.h>
// clang-format on

#include <Jolt/Core/Factory.h>
#include <Jolt/Core/JobSystemSingleThreaded.h>
#include <Jolt/Core/TempAllocator.h>
#include <Jolt/Physics/Body/BodyCreationSettings.h>
#include <Jolt/Physics/Collision/Shape/SphereShape.h>
#include <Jolt/Physics/Constraints/HingeConstraint.h>
#include <Jolt/Physics/PhysicsSystem.h>
#include <Jolt/RegisterTypes.h>

namespace {

constexpr float kMass = 1, kInertia = 0.02f, kArm = 0.25f;  // kg, kg m^2, m
constexpr float kRate = 10;                                 // rad/s
constexpr double kDuration = 1;                             // s

class Layers final : public JPH::BroadPhaseLayerInterface {
 public:
  JPH::uint GetNumBroadPhaseLayers() const override { return 1; }
  JPH::BroadPhaseLayer GetBroadPhaseLayer(JPH::ObjectLayer /*layer*/) const override { return JPH::BroadPhaseLayer(0); }
};

// What is left of the rate after a second.
double rate_left(double timestep, JPH::uint velocity_steps, JPH::uint position_steps) {
  const Layers layers;
  const JPH::ObjectVsBroadPhaseLayerFilter broad_filter;
  const JPH::ObjectLayerPairFilter pair_filter;
  JPH::TempAllocatorImpl memory(10 << 20);
  JPH::JobSystemSingleThreaded jobs(JPH::cMaxPhysicsJobs);
  JPH::PhysicsSystem system;
  system.Init(8, 1, 1024, 1024, layers, broad_filter, pair_filter);
  system.SetGravity(JPH::Vec3::sZero());
  JPH::PhysicsSettings settings;
  settings.mNumVelocitySteps = velocity_steps;
  settings.mNumPositionSteps = position_steps;
  settings.mAllowSleeping = false;
  system.SetPhysicsSettings(settings);

  JPH::BodyCreationSettings made(new JPH::SphereShape(0.05f), JPH::RVec3(kArm, 0, 0), JPH::Quat::sIdentity(),
                                 JPH::EMotionType::Dynamic, 0);
  made.mLinearDamping = made.mAngularDamping = 0;
  made.mAllowSleeping = false;
  made.mApplyGyroscopicForce = true;
  made.mAngularVelocity = JPH::Vec3(0, 0, kRate);
  made.mLinearVelocity = JPH::Vec3(0, kRate * kArm, 0);
  made.mOverrideMassProperties = JPH::EOverrideMassProperties::MassAndInertiaProvided;
  made.mMassPropertiesOverride.mMass = kMass;
  made.mMassPropertiesOverride.mInertia = JPH::Mat44::sScale(kInertia);
  JPH::BodyInterface& bodies = system.GetBodyInterfaceNoLock();
  JPH::Body* body = bodies.CreateBody(made);
  bodies.AddBody(body->GetID(), JPH::EActivation::Activate);

  JPH::HingeConstraintSettings hinge;
  hinge.mHingeAxis1 = hinge.mHingeAxis2 = JPH::Vec3::sAxisZ();
  hinge.mNormalAxis1 = hinge.mNormalAxis2 = JPH::Vec3::sAxisX();
  const JPH::Ref<JPH::TwoBodyConstraint> joint = hinge.Create(JPH::Body::sFixedToWorld, *body);
  system.AddConstraint(joint);

  const long steps = std::lround(kDuration / timestep);
  for (long i = 0; i < steps; ++i) system.Update(static_cast<float>(timestep), 1, &memory, &jobs);
  const double left = double{body->GetAngularVelocity().GetZ()} / kRate;
  system.RemoveConstraint(joint);
  bodies.RemoveBody(body->GetID());
  bodies.DestroyBody(body->GetID());
  return left;
}

}  // namespace

int main() {
  JPH::RegisterDefaultAllocator();
  JPH::Factory::sInstance = new JPH::Factory();
  JPH::RegisterTypes();

  const double k = kMass * kArm * kArm / (kInertia + kMass * kArm * kArm);
  bool as_said = true;
  for (const double h : {4e-3, 2e-3, 1e-3}) {
    const double predicted = 1 - 1 / std::sqrt(1 + k * h * kRate * kRate * kDuration);
    const double few = 1 - rate_left(h, 10, 2), many = 1 - rate_left(h, 200, 20);
    std::printf("%g ms: lost within 1 s %.4f with 10 and 2 iterations, %.4f with 200 and 20, predicted %.4f\n", h * 1e3,
                few, many, predicted);
    as_said = as_said && std::abs(few / predicted - 1) < 0.1 && std::abs(many / predicted - 1) < 0.1;
  }
  return as_said ? 0 : 1;
}
