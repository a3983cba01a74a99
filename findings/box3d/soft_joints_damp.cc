// A frictionless hinge of Box3D's own stiffness, 60 Hz, takes energy out of a pendulum at every timestep: the loss does
// not go to zero with it. With a stiffness that follows the sub-steps (Box3D lowers a higher one to a quarter of their
// rate) it is of first order. Status 0 while Box3D behaves so.
#include <cmath>
#include <cstdio>

#include "world.h"

namespace {

constexpr double kArm = 0.25, kGravity = 9.81, kInertia = 0.01;  // m, m/s^2, kg m^2; the mass is 1 kg

// Energy (J) that a pendulum has lost 2 s after it was let go at 2.5 rad.
double loss(float hertz, float timestep) {
  const finding::World world(kGravity, false);
  const b3BodyId pendulum = world.add_pendulum(hertz, kArm, kInertia, 2.5f);
  const auto energy = [&] {
    const b3Pos p = b3Body_GetWorldCenter(pendulum);
    const b3Vec3 v = b3Body_GetLinearVelocity(pendulum), w = b3Body_GetAngularVelocity(pendulum);
    return 0.5 * (v.x * v.x + v.y * v.y + v.z * v.z) + 0.5 * kInertia * w.y * w.y + kGravity * p.z;
  };
  const double before = energy();
  for (int i = 0; i < std::lround(2 / timestep); ++i) b3World_Step(world.id(), timestep, 4);
  return before - energy();
}

}  // namespace

int main() {
  double soft = 0, stiff = 0, stiff_before = 0;
  for (const float ms : {4.f, 2.f, 1.f, 0.5f, 0.25f}) {
    stiff_before = stiff;
    soft = loss(60, ms / 1000);
    stiff = loss(1e6f, ms / 1000);
    std::printf("%g ms: %.2f mJ with 60 Hz, %.2f mJ with a quarter of the rate of sub-steps\n", ms, 1e3 * soft,
                1e3 * stiff);
  }
  return soft > 5e-3 && stiff < 1e-3 && stiff < 0.65 * stiff_before ? 0 : 1;
}
