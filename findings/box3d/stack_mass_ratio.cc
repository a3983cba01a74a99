// A bar lies across two bars of a thousandth of its mass. With contacts of 30 Hz, Box3D's own, it goes through them,
// with any number of sub-steps; with 200 Hz and the same 4 sub-steps they carry it. Status 0 while Box3D behaves so.
#include <cmath>
#include <cstdio>

#include "world.h"

namespace {

constexpr float kRadius = 0.1f, kHalf = 0.3f;  // m

// Radii that the upper bar has moved within 0.5 s at 1 ms.
double way(float ratio, float contact_hertz, int sub_steps) {
  const finding::World world(9.81, true, contact_hertz);
  world.add_bar(1, kRadius, {-0.2f, -kHalf, kRadius}, {-0.2f, kHalf, kRadius});
  world.add_bar(1, kRadius, {0.2f, -kHalf, kRadius}, {0.2f, kHalf, kRadius});
  const b3BodyId upper = world.add_bar(ratio, kRadius, {-kHalf, 0, 3 * kRadius}, {kHalf, 0, 3 * kRadius});
  for (int i = 0; i < 500; ++i) b3World_Step(world.id(), 1e-3f, sub_steps);
  const b3Pos p = b3Body_GetWorldCenter(upper);
  return std::hypot(p.x, p.y, p.z - 3 * kRadius) / kRadius;
}

}  // namespace

int main() {
  for (const float hertz : {30.f, 200.f}) {
    for (const int sub_steps : {4, 20, 100}) {
      std::printf("%g Hz, %d sub-steps: way of the upper bar in radii %.3f at equal masses, %.3f at 1 : 1000\n", hertz,
                  sub_steps, way(1, hertz, sub_steps), way(1000, hertz, sub_steps));
    }
  }
  return way(1000, 30, 4) > 0.5 && way(1000, 30, 100) > 0.15 && way(1000, 200, 4) < 0.1 ? 0 : 1;
}
