// A hinge takes energy out. Jolt solves velocities against the joint's directions at the step's start, moves the
// bodies, and corrects their positions without turning the velocities: the next step takes away what then points along
// the arm. A body of mass m and inertia I, pinned at the distance r from its centre of mass and spun in weightlessness,
// should turn for ever. It slows by w' = -k h w^3 / 2 with k = m r^2 / (I + m r^2), that is to w0 / sqrt(1 + k h w0^2
// t), whatever the iterations.
#include <cmath>
#include <cstdio>

#include "world.h"

namespace {

constexpr float kMass = 1, kInertia = 0.02f, kArm = 0.25f;  // kg, kg m^2, m
constexpr float kRate = 10;                                 // rad/s
constexpr double kDuration = 1;                             // s

// What is left of the rate after a second.
double rate_left(double timestep, JPH::uint velocity_steps, JPH::uint position_steps) {
  JPH::PhysicsSettings settings;
  settings.mNumVelocitySteps = velocity_steps;
  settings.mNumPositionSteps = position_steps;
  finding::World world(JPH::Vec3::sZero(), settings);

  JPH::BodyCreationSettings made = finding::free_body(new JPH::SphereShape(0.05f), JPH::RVec3(kArm, 0, 0),
                                                      JPH::Quat::sIdentity(), kMass, JPH::Vec3::sReplicate(kInertia));
  made.mApplyGyroscopicForce = true;
  made.mAngularVelocity = JPH::Vec3(0, 0, kRate);
  made.mLinearVelocity = JPH::Vec3(0, kRate * kArm, 0);
  JPH::Body* body = world.add(made);
  world.add_hinge(*body, JPH::Vec3(-kArm, 0, 0), JPH::Vec3::sAxisZ(), JPH::Vec3::sAxisX());
  const long steps = std::lround(kDuration / timestep);
  world.run(timestep, steps);
  return double{body->GetAngularVelocity().GetZ()} / kRate;
}

}  // namespace

int main() {
  finding::begin();

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
