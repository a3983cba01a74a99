// Jolt 5.6.0 drops turns of at most 1e-6 rad a step (Body::AddRotationStep), so that a body slower than 1e-6 rad / h
// does not turn at all, and the slower a motion is the longer a step it needs: halving the timestep makes it worse.
//
// A body with 10 mrad/s turns for a second without any force. A rod falls over from 0.1 mrad beside upright, where its
// angle grows as cosh(t sqrt(3 g / (2 L))): it begins too slowly for Jolt.
//
// Ends with status 0 while Jolt behaves so, 1 when it does not: then the adapter's setting slow_turns can go.
#include <cmath>
#include <cstdio>

// clang-format off: Jolt wants this one before its others
#include <Jolt/Jolt.h>
// clang-format on

#include <Jolt/Core/Factory.h>
#include <Jolt/Core/JobSystemSingleThreaded.h>
#include <Jolt/Core/TempAllocator.h>
#include <Jolt/Physics/Body/BodyCreationSettings.h>
#include <Jolt/Physics/Collision/Shape/EmptyShape.h>
#include <Jolt/Physics/Constraints/HingeConstraint.h>
#include <Jolt/Physics/PhysicsSystem.h>
#include <Jolt/RegisterTypes.h>

namespace {

constexpr float kRate = 0.01f;                  // rad/s
constexpr float kLength = 0.5f, kTilt = 1e-4f;  // m, rad
constexpr double kGravity = 9.81;

class Layers final : public JPH::BroadPhaseLayerInterface {
 public:
  JPH::uint GetNumBroadPhaseLayers() const override { return 1; }
  JPH::BroadPhaseLayer GetBroadPhaseLayer(JPH::ObjectLayer /*layer*/) const override { return JPH::BroadPhaseLayer(0); }
};

// The angle about y, rad, after one second: of a free body with kRate, or of a rod on a hinge from kTilt.
double angle(bool rod, double timestep) {
  const Layers layers;
  const JPH::ObjectVsBroadPhaseLayerFilter broad_filter;
  const JPH::ObjectLayerPairFilter pair_filter;
  JPH::TempAllocatorImpl memory(10 << 20);
  JPH::JobSystemSingleThreaded jobs(JPH::cMaxPhysicsJobs);
  JPH::PhysicsSystem system;
  system.Init(8, 1, 1024, 1024, layers, broad_filter, pair_filter);
  system.SetGravity(JPH::Vec3(0, 0, rod ? static_cast<float>(-kGravity) : 0));
  JPH::PhysicsSettings settings;
  settings.mAllowSleeping = false;
  system.SetPhysicsSettings(settings);

  const float half = kLength / 2;
  const JPH::Quat tilted = JPH::Quat::sRotation(JPH::Vec3::sAxisY(), rod ? kTilt : 0);
  JPH::BodyCreationSettings made(new JPH::EmptyShape, JPH::RVec3(tilted * JPH::Vec3(0, 0, half)), tilted,
                                 JPH::EMotionType::Dynamic, 0);
  made.mLinearDamping = made.mAngularDamping = 0;
  made.mAllowSleeping = false;
  made.mOverrideMassProperties = JPH::EOverrideMassProperties::MassAndInertiaProvided;
  made.mMassPropertiesOverride.mMass = 1;
  made.mMassPropertiesOverride.mInertia = JPH::Mat44::sScale(kLength * kLength / 12);
  if (!rod) made.mAngularVelocity = JPH::Vec3(0, kRate, 0);
  JPH::BodyInterface& bodies = system.GetBodyInterfaceNoLock();
  JPH::Body* body = bodies.CreateBody(made);
  bodies.AddBody(body->GetID(), JPH::EActivation::Activate);
  JPH::Ref<JPH::TwoBodyConstraint> joint;
  if (rod) {
    JPH::HingeConstraintSettings hinge;
    hinge.mSpace = JPH::EConstraintSpace::LocalToBodyCOM;
    hinge.mPoint2 = JPH::RVec3(0, 0, -half);
    hinge.mHingeAxis1 = hinge.mHingeAxis2 = JPH::Vec3::sAxisY();
    hinge.mNormalAxis1 = hinge.mNormalAxis2 = JPH::Vec3::sAxisX();
    joint = hinge.Create(JPH::Body::sFixedToWorld, *body);
    system.AddConstraint(joint);
  }
  const long steps = std::lround(1 / timestep);
  for (long i = 0; i < steps; ++i) system.Update(static_cast<float>(timestep), 1, &memory, &jobs);
  const JPH::Quat q = body->GetRotation();
  const double turned = 2 * std::atan2(double{q.GetY()}, double{q.GetW()});
  if (joint != nullptr) system.RemoveConstraint(joint);
  bodies.RemoveBody(body->GetID());
  bodies.DestroyBody(body->GetID());
  return turned;
}

}  // namespace

int main() {
  JPH::RegisterDefaultAllocator();
  JPH::Factory::sInstance = new JPH::Factory();
  JPH::RegisterTypes();
  const double fallen = double{kTilt} * std::cosh(std::sqrt(3 * kGravity / (2 * double{kLength})));
  bool as_said = true;
  for (const double h : {4e-3, 1e-3, 0.25e-3, 1e-3 / 16}) {
    const double turned = angle(false, h) / double{kRate}, tipped = angle(true, h) / fallen;
    std::printf("%g ms: 10 mrad/s turn %.4f of their angle within 1 s, the rod %.4f\n", 1e3 * h, turned, tipped);
    if (h > 3e-3) as_said = as_said && std::abs(turned - 1) < 0.01 && std::abs(tipped - 1) < 0.15;
    if (h < 0.3e-3) as_said = as_said && tipped < 0.1;
    if (h < 0.1e-3) as_said = as_said && turned == 0;
  }
  return as_said ? 0 : 1;
}
