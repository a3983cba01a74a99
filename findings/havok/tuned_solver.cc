// Havok 1.3.14 (npm @babylonjs/havok): the solver is tuned for the timestep that HP_World_SetIdealStepTime gives, 1/60
// s by default. At other timesteps joints and contacts are softer.
//
// 1. A pendulum of a rod swings for 1 s from the horizontal. Without a tuned timestep (0) its error falls with the
// timestep; with 1/60 s it stays several times larger.
// 2. Bars stacked across each other, the upper one of 1000 times the mass of each lower one: with 1/60 s it goes
// through them within 0.5 s at 1 ms.
// 3. Two balls fly at each other. With 1/60 s they push each other apart some centimetres before they touch.
//
// Ends with status 0 while Havok behaves so, 1 when it does not: then the deviations in engine.cc can go.
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include "world.h"

namespace {

using havok::Vector3;

constexpr float kRadius = 0.1f;
constexpr double kArm = 0.25, kInertia = 0.021;  // m, kg m^2

// Angle of the rod after 1 s, rad from the horizontal.
double swing(float ideal, double h) {
  finding::World world(Vector3{0, 0, -9.81f}, ideal);
  const havok::Id ground = world.add_fixed_body();
  const auto inertia = static_cast<float>(kInertia);
  const havok::Id rod = world.add_body(1, {inertia, inertia, inertia}, {static_cast<float>(kArm), 0, 0});
  world.add_hinge(ground, {0, 0, 0}, rod, {static_cast<float>(-kArm), 0, 0});
  world.step(static_cast<float>(h), std::lround(1 / h));
  const Vector3 at = world.transform(rod).translation;
  return std::atan2(-static_cast<double>(at.z), static_cast<double>(at.x));
}

double exact_swing() {
  constexpr double kStep = 1e-6;
  double angle = 0, rate = 0;
  for (int i = 0; i < 1'000'000; ++i) {
    rate += 9.81 * kArm * std::cos(angle) / (kInertia + kArm * kArm) * kStep;
    angle += rate * kStep;
  }
  return angle;
}

// Way of the upper bar within 0.5 s over its radius.
double way(float ideal, double h) {
  finding::World world(Vector3{0, 0, -9.81f}, ideal);
  world.add_ground(1);
  const auto bar = [&](float mass, Vector3 half, Vector3 place) {
    const havok::Id shape = world.capsule({-half.x, -half.y, 0}, half, kRadius, 1);
    const float across = 0.1f * mass, along = 0.005f * mass;
    const bool is_x = half.x > 0;
    return world.add_solid(shape, mass, {is_x ? along : across, is_x ? across : along, across}, place);
  };
  const havok::Id top = bar(1000, {0.5f, 0, 0}, {0, 0, 3 * kRadius});
  for (const float x : {-0.3f, 0.3f}) bar(1, {0, 0.5f, 0}, {x, 0, kRadius});
  world.step(static_cast<float>(h), std::lround(0.5 / h));
  const Vector3 at = world.transform(top).translation;
  return std::hypot(at.x, at.y, at.z - 3 * kRadius) / static_cast<double>(kRadius);
}

// Distance of two balls beyond their radii at which they first change their speeds, m.
double first_push(float ideal, double h) {
  finding::World world(Vector3{}, ideal);
  const float inertia = 0.4f * kRadius * kRadius;
  const Vector3 moments{inertia, inertia, inertia};
  const havok::Id a = world.add_solid(world.sphere(kRadius, 0), 1, moments, {-0.25f, 0, 0});
  const havok::Id b = world.add_solid(world.sphere(kRadius, 0), 1, moments, {0.25f, 0, 0});
  world.set_velocity(a, {0.5f, 0, 0});
  world.set_velocity(b, {-0.5f, 0, 0});
  const auto apart = [&] {
    return static_cast<double>(world.transform(b).translation.x - world.transform(a).translation.x);
  };
  double before = apart();
  for (long i = 0; i * h < 1; ++i) {
    world.step(static_cast<float>(h));
    if (std::abs(world.velocity(a).x - 0.5f) > 1e-3f) break;
    before = apart();
  }
  return before - 2 * static_cast<double>(kRadius);
}

}  // namespace

int main() {
  constexpr float kOwn = 1.0f / 60;
  const double exact = exact_swing();
  bool so = true;
  for (const double h : {2e-3, 1e-3, 0.5e-3}) {
    const double plain = std::abs(swing(0, h) - exact), tuned = std::abs(swing(kOwn, h) - exact);
    std::printf(
        "%g ms: error of a pendulum's angle after 1 s %.4f rad without a tuned timestep, %.4f with Havok's "
        "1/60 s\n",
        1e3 * h, plain, tuned);
    so = so && tuned > 2 * plain;
  }
  const double plain = way(0, 1e-3), tuned = way(kOwn, 1e-3);
  std::printf("way of a bar on bars of a thousandth of its mass, in radii: %.4f without, %.4f with 1/60 s\n", plain,
              tuned);
  const double touch = first_push(0, 1e-3), early = first_push(kOwn, 1e-3);
  std::printf("two balls first push each other %.4f m apart without, %.4f m with 1/60 s\n", touch, early);
  return so && plain < 0.05 && tuned > 1 && touch < 2e-3 && early > 5e-3 ? 0 : 1;
}
