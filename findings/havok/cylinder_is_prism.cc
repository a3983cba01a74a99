// Havok 1.3.14 (npm @babylonjs/havok): a cylinder is a prism of 16 sides.
//
// A cylinder rolls down a slope. Its centre moves up and down between R and R cos(pi / 16), and is highest each 2 pi /
// 16 of a turn. So it loses speed at every edge: after 0.8 s it is 3 % slower than a cylinder. A capsule of the same
// mass and inertia, which is round, loses only what Havok brakes below 0.1 m/s (slow_bodies.cc), 1.8 %.
//
// Ends with status 0 while Havok behaves so, 1 when it does not: then the deviation in engine.cc can go.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "world.h"

namespace {

using havok::Vector3;

constexpr float kRadius = 0.1f, kHalf = 0.15f, kTimestep = 0.25e-3f;
constexpr double kDuration = 0.8, kSides = 16;
const double kSlope = std::atan(0.2);

struct Rolled {
  double speed;                                 // over that of a cylinder
  double lowest;                                // height of the centre over the radius
  double first_peak, last_peak, peaks_between;  // turns at which the centre is highest, rad
};

Rolled roll(bool capsule) {
  finding::World world(
      Vector3{static_cast<float>(9.81 * std::sin(kSlope)), 0, static_cast<float>(-9.81 * std::cos(kSlope))}, 0);
  world.add_ground(1);
  const Vector3 from{0, -kHalf, 0}, to{0, kHalf, 0};
  const havok::Id shape = capsule ? world.capsule(from, to, kRadius, 1) : world.cylinder(from, to, kRadius, 1);
  const float across = (3 * kRadius * kRadius + 4 * kHalf * kHalf) / 12, along = kRadius * kRadius / 2;
  const havok::Id body = world.add_solid(shape, 1, {across, along, across}, {0, 0, kRadius});
  Rolled result{0, 1, 0, 0, 0};
  double turn = 0, height[3] = {1, 1, 1};
  bool low = false;  // since the last peak
  const long steps = std::lround(kDuration / static_cast<double>(kTimestep));
  for (long i = 0; i < steps; ++i) {
    world.step(kTimestep);
    turn += static_cast<double>(world.angular_velocity(body).y) * static_cast<double>(kTimestep);
    height[0] = height[1];
    height[1] = height[2];
    height[2] = static_cast<double>(world.transform(body).translation.z) / static_cast<double>(kRadius);
    result.lowest = std::min(result.lowest, height[2]);
    low = low || height[2] < 0.99;
    if (low && height[1] > 0.998 && height[1] >= height[0] && height[1] > height[2]) {
      low = false;
      if (result.first_peak == 0) {
        result.first_peak = turn;
      } else {
        ++result.peaks_between;
      }
      result.last_peak = turn;
    }
  }
  result.speed = static_cast<double>(world.velocity(body).x) / (2 * 9.81 * std::sin(kSlope) * kDuration / 3);
  return result;
}

}  // namespace

int main() {
  const Rolled cylinder = roll(false), capsule = roll(true);
  const double spacing = (cylinder.last_peak - cylinder.first_peak) / std::max(1.0, cylinder.peaks_between);
  const double side = 2 * std::numbers::pi / kSides, flat = std::cos(std::numbers::pi / kSides);
  std::printf(
      "cylinder: highest every %.4f rad (2 pi / 16 = %.4f), lowest at %.4f of the radius (cos(pi / 16) = %.4f), "
      "speed %.4f of a cylinder's\ncapsule: lowest at %.4f, speed %.4f\n",
      spacing, side, cylinder.lowest, flat, cylinder.speed, capsule.lowest, capsule.speed);
  const bool prism = std::abs(spacing / side - 1) < 0.03 && std::abs(cylinder.lowest - flat) < 0.004;
  return prism && cylinder.speed < 0.98 && capsule.speed > 0.98 && capsule.lowest > 0.999 ? 0 : 1;
}
