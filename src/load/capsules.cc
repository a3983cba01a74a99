#include "load/capsules.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include <fmt/format.h>

namespace assay {
namespace {

constexpr double kRadius = 0.05, kHalfLength = 0.1;  // m; half of the cylinder
constexpr double kSpacing = 0.31;  // m: just above the capsule's length, so that no two touch in any orientation
constexpr double kLowest = 0.3;    // m: height of the lowest layer

// Matsumoto and Nishimura's MT19937 with the initialization by array of 2002 and 53-bit doubles. The standard library's
// generator lacks this initialization, and its distributions differ between implementations.
class MersenneTwister {
 public:
  explicit MersenneTwister(std::uint32_t seed) {
    fill(19650218U);
    std::uint32_t i = 1;
    for (std::uint32_t k = 0; k < kSize; ++k) {
      state_[i] = (state_[i] ^ ((state_[i - 1] ^ (state_[i - 1] >> 30U)) * 1664525U)) + seed;
      next(i);
    }
    for (std::uint32_t k = 1; k < kSize; ++k) {
      state_[i] = (state_[i] ^ ((state_[i - 1] ^ (state_[i - 1] >> 30U)) * 1566083941U)) - i;
      next(i);
    }
    state_[0] = 0x80000000U;
  }

  // Uniform in [0, 1).
  double uniform() {
    const std::uint32_t high = word() >> 5U, low = word() >> 6U;
    return (high * 67108864.0 + low) / 9007199254740992.0;
  }

 private:
  static constexpr std::uint32_t kSize = 624, kShift = 397;

  void fill(std::uint32_t seed) {
    state_[0] = seed;
    for (std::uint32_t i = 1; i < kSize; ++i) state_[i] = 1812433253U * (state_[i - 1] ^ (state_[i - 1] >> 30U)) + i;
  }

  void next(std::uint32_t& i) {
    if (++i < kSize) return;
    state_[0] = state_[kSize - 1];
    i = 1;
  }

  std::uint32_t word() {
    if (used_ == kSize) {
      for (std::uint32_t i = 0; i < kSize; ++i) {
        const std::uint32_t y = (state_[i] & 0x80000000U) | (state_[(i + 1) % kSize] & 0x7fffffffU);
        state_[i] = state_[(i + kShift) % kSize] ^ (y >> 1U) ^ ((y & 1U) != 0 ? 0x9908b0dfU : 0U);
      }
      used_ = 0;
    }
    std::uint32_t y = state_[used_++];
    y ^= y >> 11U;
    y ^= (y << 7U) & 0x9d2c5680U;
    y ^= (y << 15U) & 0xefc60000U;
    return y ^ (y >> 18U);
  }

  std::array<std::uint32_t, kSize> state_ = {};
  std::uint32_t used_ = kSize;
};

}  // namespace

std::string capsules_mjcf(const CapsulesName& name) {
  const int count = name.count;
  const int a_layer = name.layers > 0 ? (count + name.layers - 1) / name.layers : 0;
  const int side = static_cast<int>(std::ceil((a_layer > 0 ? std::sqrt(a_layer) : std::cbrt(count)) - 1e-9));
  const int slots = a_layer > 0 ? a_layer : side * side;  // of a layer
  std::string parts;
  if (name.layers > 0) parts += fmt::format("-layers-{}", name.layers);
  if (name.seed != CapsulesName().seed) parts += fmt::format("-seed-{}", name.seed);
  MersenneTwister random(static_cast<std::uint32_t>(name.seed));
  std::string bodies, states;
  for (int i = 0; i < count; ++i) {
    const std::array<int, 3> cell = {i % slots % side, i % slots / side, i / slots};  // column, row, layer
    const double x = kSpacing * (cell[0] - (side - 1) / 2.0), y = kSpacing * (cell[1] - (side - 1) / 2.0);
    const double z = kLowest + kSpacing * cell[2];
    const auto shade = [&](int k) { return 0.35 + 0.5 * cell[k] / std::max(side - 1, 1); };
    bodies += fmt::format(
        "    <body name=\"capsule{0}\" pos=\"{1:g} {2:g} {3:g}\">\n"
        "      <freejoint/>\n"
        "      <geom name=\"shape{0}\" rgba=\"{4:.2f} {5:.2f} {6:.2f} 1\"/>\n"
        "    </body>\n",
        i + 1, x, y, z, shade(0), shade(1), shade(2));
    // a uniformly distributed unit quaternion after Shoemake, Graphics Gems III (1992), p. 124
    const double u = random.uniform();
    const double a = 2 * std::numbers::pi * random.uniform(), b = 2 * std::numbers::pi * random.uniform();
    const double inner = std::sqrt(1 - u), outer = std::sqrt(u);
    states += fmt::format("\n      {:g} {:g} {:g} {:.6f} {:.6f} {:.6f} {:.6f}", x, y, z, outer * std::cos(b),
                          inner * std::sin(a), inner * std::cos(a), outer * std::sin(b));
  }
  return fmt::format(R"(<!--
  {0} capsules: {1} DOF. Free capsules in random orientations (uniform, fixed seed) fall from a grid onto a plane and pile up:
  many contacts between unconnected bodies, the task for which game engines are made. No two touch at the start. The
  keyframe holds the random orientations; the bodies' own poses are the upright grid. A capsule has radius
  {2} m, cylinder {3} m, 1 kg and the exact inertia of that capsule; friction 0.7 everywhere.

  System of Erez, Tassa and Todorov (ICRA 2015), section IV.A; the paper gives no dimensions. Written by src/load/capsules.cc.
-->
<mujoco model="capsules-{0}{7}">
  <option gravity="0 0 -9.81"/>
  <default>
    <geom type="capsule" size="{2} {4}" mass="1" condim="3" friction="0.7"/>
  </default>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 0.1" rgba="0.9 0.9 0.9 1"/>
{5}  </worldbody>
  <keyframe>
    <key name="start" qpos="{6}"/>
  </keyframe>
</mujoco>
)",
                     count, 6 * count, kRadius, 2 * kHalfLength, kHalfLength, bodies, states, parts);
}

}  // namespace assay
