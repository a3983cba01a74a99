// Jolt 5.6.0 drops turns of at most 1e-6 rad a step (Body::AddRotationStep), so that a body slower than 1e-6 rad / h
// does not turn at all, and the slower a motion is the longer a step it needs: halving the timestep makes it worse.
//
// A body with 10 mrad/s turns for a second without any force. A rod falls over from 0.1 mrad beside upright, where its
// angle grows as cosh(t sqrt(3 g / (2 L))): it begins too slowly for Jolt.
//
// Ends with status 0 while Jolt behaves so, 1 when it does not: then the adapter's setting slow_turns can go.
#include <cmath>
#include <cstdio>

#include "world.h"

namespace {

constexpr float kRate = 0.01f;                  // rad/s
constexpr float kLength = 0.5f, kTilt = 1e-4f;  // m, rad
constexpr double kGravity = 9.81;

// The angle about y, rad, after one second: of a free body with kRate, or of a rod on a hinge from kTilt.
double angle(bool rod, double timestep) {
  finding::World world(JPH::Vec3(0, 0, rod ? static_cast<float>(-kGravity) : 0));
  const float half = kLength / 2;
  const JPH::Quat tilted = JPH::Quat::sRotation(JPH::Vec3::sAxisY(), rod ? kTilt : 0);
  JPH::BodyCreationSettings made = finding::free_body(new JPH::EmptyShape, JPH::RVec3(tilted * JPH::Vec3(0, 0, half)),
                                                      tilted, 1, JPH::Vec3::sReplicate(kLength * kLength / 12));
  if (!rod) made.mAngularVelocity = JPH::Vec3(0, kRate, 0);
  JPH::Body* body = world.add(made);
  if (rod) world.add_hinge(*body, JPH::Vec3(0, 0, -half), JPH::Vec3::sAxisY(), JPH::Vec3::sAxisX());
  const long steps = std::lround(1 / timestep);
  world.run(timestep, steps);
  const JPH::Quat q = body->GetRotation();
  return 2 * std::atan2(double{q.GetY()}, double{q.GetW()});
}

}  // namespace

int main() {
  finding::begin();
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
