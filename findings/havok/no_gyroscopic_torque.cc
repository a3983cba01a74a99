// Havok 1.3.14 (npm @babylonjs/havok): no gyroscopic torque, at no timestep.
//
// A free body with moments of inertia 1, 2 and 4 turns about an axis that is none of its principal ones. Its angular
// velocity has to precess while the angular momentum R I R^T w is kept; here the angular velocity is kept, and the
// momentum changes with the body's orientation. (All three inverse moments have few bits, so that their rounding plays
// no part.)
//
// Ends with status 0 while Havok behaves so: then whatever turns about changing axes has another limit for h -> 0.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "world.h"

namespace {

using finding::Double3;
constexpr Double3 kInertia = {1, 2, 4};

Double3 rotated(const havok::Quaternion& q, const Double3& v, double sign) {
  const Double3 u = {sign * q.x, sign * q.y, sign * q.z};
  const auto cross = [](const Double3& a, const Double3& b) -> Double3 {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const Double3 t = cross(u, v), s = cross(u, t);
  return {v[0] + 2 * (q.w * t[0] + s[0]), v[1] + 2 * (q.w * t[1] + s[1]), v[2] + 2 * (q.w * t[2] + s[2])};
}

Double3 momentum(const havok::Quaternion& q, const havok::Vector3& w) {
  Double3 in_body = rotated(q, {w.x, w.y, w.z}, -1);
  for (int i = 0; i < 3; ++i) in_body[i] *= kInertia[i];
  return rotated(q, in_body, 1);
}

double distance(const Double3& a, const Double3& b) {
  return std::sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

}  // namespace

int main() {
  constexpr Double3 kStart = {1, 2, 3};
  bool without = true;
  for (const float h : {4e-3f, 1e-3f, 0.25e-3f}) {
    finding::World world;
    const havok::Id body = world.add_body(1, {1, 2, 4});
    world.set_angular_velocity(body, {1, 2, 3});
    const Double3 before = momentum(world.transform(body).rotation, world.angular_velocity(body));
    world.step(h, std::lround(1 / h));
    const havok::Vector3 w = world.angular_velocity(body);
    const Double3 after = momentum(world.transform(body).rotation, w);
    const double turned = distance({w.x, w.y, w.z}, kStart) / distance(kStart, {});
    const double lost = distance(after, before) / distance(before, {});
    std::printf(
        "h = %.2f ms: within 1 s the angular velocity changes by %.1e, the angular momentum by %.3f (relative)\n",
        1e3 * h, turned, lost);
    without = without && turned < 1e-4 && lost > 0.1;
  }
  return without ? 0 : 1;
}
