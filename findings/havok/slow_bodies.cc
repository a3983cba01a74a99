// Havok 1.3.14 (npm @babylonjs/havok): a free body that is slower than 0.1 m/s is braked.
//
// Below 0.1 m/s a body loses 3 % of gravity's acceleration of its speed, in every direction and whatever its mass,
// until it stands still; without gravity the braking is that of 10 m/s^2. Damping is 0, the body always active, nothing
// touches it. Turning is not braked. A body that falls from rest so starts with 0.97 g.
//
// Ends with status 0 while Havok behaves so.
#include <cmath>
#include <cstdio>

#include "world.h"

namespace {

// Deceleration (m/s^2) of a body that moves sideways at `speed`, without gravity.
double braking(float speed, float mass, float h) {
  finding::World world;
  const havok::Id body = world.add_body(mass, {mass, mass, mass});
  world.set_velocity(body, {speed, 0, 0});
  const long steps = std::lround(0.02 / h);
  world.step(h, steps);
  return (speed - world.velocity(body).x) / (steps * static_cast<double>(h));
}

// What is missing of the acceleration of a body that is let go, relative.
double missing(float gravity) {
  finding::World world(-gravity);
  const havok::Id body = world.add_body(1, {1, 1, 1});
  const float h = 0.01f / gravity / 4;
  world.step(h, 4);
  return 1 + world.velocity(body).z / (4 * h) / gravity;
}

}  // namespace

int main() {
  bool braked = true;
  for (const float h : {1e-3f, 0.1e-3f}) {
    for (const float mass : {0.01f, 100.0f}) {
      const double below = braking(0.09f, mass, h), above = braking(0.12f, mass, h);
      std::printf("h = %.1f ms, %6.2f kg: braked at %.3f m/s^2 from 0.09 m/s, at %.3f m/s^2 from 0.12 m/s\n", 1e3 * h,
                  mass, below, above);
      braked = braked && std::abs(below - 0.306) < 0.01 && std::abs(above) < 1e-3;
    }
  }
  for (const float gravity : {1.0f, 9.81f}) {
    const double lacking = missing(gravity);
    std::printf("let go under %.2f m/s^2: %.2f %% of the acceleration is missing\n", gravity, 100 * lacking);
    braked = braked && std::abs(lacking - 0.0306) < 0.003;
  }
  return braked ? 0 : 1;
}
