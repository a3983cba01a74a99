// Havok 1.3.14 (npm @babylonjs/havok): inverse masses and inverse inertias are kept in eight significant bits, and are
// rounded upwards more often than downwards.
//
// A unit impulse gives a body of mass m the velocity 1/m, and a unit angular impulse one of inertia I the rate 1/I.
// This program measures both for 200 masses between 0.5 and 5. All of them equal the upper 16 bits (bfloat16) of the
// 32-bit float 1/m (1 + 2^-8). Rounding to nearest would be wrong by at most 0.2 %; this is wrong by up to 0.39 %, and
// by +0.14 % in the mean. HP_Body_GetMassProperties reports the mass that was asked for.
//
// Ends with status 0 while Havok behaves so: then joint torques and springs have this error at every timestep.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>

#include "world.h"

namespace {

float as_kept(float inverse) {
  const auto bits = std::bit_cast<std::uint32_t>(inverse * (1.0f + 1.0f / 256));
  return std::bit_cast<float>(bits & 0xffff0000U);
}

}  // namespace

int main() {
  int exact = 0, expected = 0, count = 0;
  double largest = 0, mean = 0;
  for (int i = 0; i < 200; ++i) {
    const auto m = static_cast<float>(0.5 * std::pow(10.0, i / 199.0));
    finding::World world;
    const havok::Id body = world.add_body(m, {m, m, m});
    world.apply_impulse(body, {0, 0, 0}, {1, 0, 0});
    world.apply_angular_impulse(body, {1, 0, 0});
    for (const float got : {world.velocity(body).x, world.angular_velocity(body).x}) {
      const double error = static_cast<double>(got) * m - 1;
      ++count;
      exact += std::abs(error) < 1e-6 ? 1 : 0;
      expected += std::abs(got / as_kept(1 / m) - 1) < 1e-6f ? 1 : 0;
      largest = std::max(largest, std::abs(error));
      mean += error;
    }
  }
  mean /= count;
  std::printf(
      "of %d velocities after a unit impulse %d are right and %d as described; error up to %.3f %%, mean %+.3f %%\n",
      count, exact, expected, 100 * largest, 100 * mean);
  return expected == count && exact < count / 10 && largest > 3e-3 ? 0 : 1;
}
