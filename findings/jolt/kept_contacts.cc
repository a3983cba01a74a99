// Jolt 5.6.0 keeps the contact points of two bodies while their relative pose changes by less than 1 mm and 2 degrees
// (PhysicsSettings::mUseBodyPairContactCache, on by default). A cylinder that rolls by less than that in a step keeps
// points that have turned away from where it touches, so it is pushed from beside its axis: it does not roll as it
// should. With the cache off, contacts are found anew in each step, and it does.
//
// A cylinder rolls down a slope from rest for 0.8 s, which a rigid one leaves with 2/3 g sin(angle) t and rolling.
//
// A ball at rest on a plane rolls away: on points that turn with it, it is an inverted pendulum, which gains speed
// until it has moved by 1 mm, and then again.
//
// Ends with status 0 while Jolt behaves so, 1 when it does not: then the deviation in engine.cc can go.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include "world.h"

namespace {

constexpr float kRadius = 0.1f, kHalf = 0.15f;
constexpr double kGravity = 9.81;
constexpr double kDuration = 0.8;   // s, of the cylinder
constexpr double kRest = 20;        // s, of the ball
constexpr double kRounding = 6e-8;  // a slope by which single precision cannot tell a level plane

// A body's velocities and way on a plane with friction 1, under a gravity that is inclined along x.
struct End {
  double speed, turning, way;
};
End run(const JPH::Ref<JPH::Shape>& shape, JPH::Vec3 moments, double slope, bool cache, double timestep,
        double duration) {
  JPH::PhysicsSettings settings;
  settings.mUseBodyPairContactCache = cache;
  settings.mPenetrationSlop = 0;
  finding::World world(
      JPH::Vec3(static_cast<float>(kGravity * std::sin(slope)), 0, static_cast<float>(-kGravity * std::cos(slope))),
      settings);
  world.add(finding::fixed_body(new JPH::PlaneShape(JPH::Plane(JPH::Vec3::sAxisZ(), 0))));

  const JPH::Body* body =
      world.add(finding::free_body(shape, JPH::RVec3(0, 0, kRadius), JPH::Quat::sIdentity(), 1, moments));
  const long steps = std::lround(duration / timestep);
  world.run(timestep, steps);
  const JPH::RVec3 p = body->GetPosition();
  const End end = {double{body->GetLinearVelocity().GetX()},
                   double{body->GetAngularVelocity().GetY()} * double{kRadius},
                   std::hypot(double{p.GetX()}, double{p.GetY()})};
  return end;
}

// Largest error of the speed and of the turning of a cylinder at the end of its way down, relative. It lies along its
// own y axis.
double cylinder_error(bool cache, double timestep) {
  const float across = (3 * kRadius * kRadius + 4 * kHalf * kHalf) / 12;
  const double slope = std::atan(0.2), rolling = 2 * kGravity * std::sin(slope) * kDuration / 3;
  const End end = run(new JPH::CylinderShape(kHalf, kRadius, 0), JPH::Vec3(across, kRadius * kRadius / 2, across),
                      slope, cache, timestep, kDuration);
  return std::max(std::abs(end.speed / rolling - 1), std::abs(end.turning / rolling - 1));
}

// m, of a ball that is put down without any velocity.
double way_of_ball(bool cache, double timestep) {
  const float moment = 0.4f * kRadius * kRadius;
  return run(new JPH::SphereShape(kRadius), JPH::Vec3::sReplicate(moment), kRounding, cache, timestep, kRest).way;
}

}  // namespace

int main() {
  finding::begin();
  double kept = 0, found = 0;
  for (const double timestep : {4e-3, 2e-3, 1e-3, 0.5e-3}) {
    const double with = cylinder_error(true, timestep), without = cylinder_error(false, timestep);
    std::printf("%g ms: speed or turning is wrong by %.4f with kept contact points, by %.4f without\n", 1e3 * timestep,
                with, without);
    kept = std::max(kept, with);
    found = std::max(found, without);
  }
  double rolled = 1e9, stayed = 0;
  for (const double timestep : {8e-3, 2e-3, 1e-3}) {
    const double with = way_of_ball(true, timestep), without = way_of_ball(false, timestep);
    std::printf("%g ms: a ball at rest rolls %.3f m within %g s with kept contact points, %.6f m without\n",
                1e3 * timestep, with, kRest, without);
    rolled = std::min(rolled, with);
    stayed = std::max(stayed, without);
  }
  return kept > 0.01 && found < 2e-3 && rolled > 0.3 && stayed < 1e-3 ? 0 : 1;
}
