// Havok 1.3.14 (npm @babylonjs/havok): a frictionless hinge takes energy out.
//
// A body of 1 kg hangs on a hinge 0.25 m from its centre of mass and is let go level; its moments of inertia and masses
// have few bits, and it is faster than 0.1 m/s but for its points of return. Energy has to stay; it falls all the time,
// at a rate proportional to the timestep: an error of integration, with the sign of a damper.
//
// Ends with status 0 while Havok behaves so.
#include <cmath>
#include <cstdio>
#include <vector>

#include "world.h"

namespace {

constexpr float kArm = 0.25f, kInertia = 0.015625f, kGravity = 9.8125f;

// Energy lost within 10 s, in units of m g l.
double lost(float h) {
  finding::World world(-kGravity);
  const havok::Id fixed = world.add_fixed_body();
  const havok::Id body = world.add_body(1, {kInertia, kInertia, kInertia}, {kArm, 0, 0});
  world.add_hinge(fixed, {0, 0, 0}, body, {-kArm, 0, 0});
  world.step(h, std::lround(10 / h));
  const double z = world.transform(body).translation.z;
  const havok::Vector3 v = world.velocity(body), w = world.angular_velocity(body);
  const auto square = [](const havok::Vector3& u) {
    return static_cast<double>(u.x) * u.x + static_cast<double>(u.y) * u.y + static_cast<double>(u.z) * u.z;
  };
  return -(kGravity * z + square(v) / 2 + kInertia * square(w) / 2) / (kGravity * kArm);
}

}  // namespace

int main() {
  const double at_4 = lost(4e-3f), at_1 = lost(1e-3f), at_quarter = lost(0.25e-3f);
  std::printf("lost within 10 s, of m g l: %.4f at 4 ms, %.4f at 1 ms, %.4f at 1/4 ms\n", at_4, at_1, at_quarter);
  const double order = std::log2(at_1 / at_quarter) / 2;
  std::printf("observed order %.2f\n", order);
  return at_1 > 0.05 && order > 0.7 && order < 1.3 ? 0 : 1;
}
