// Havok 1.3.14 (npm @babylonjs/havok): a lying cylinder that rolls at a tenth of a millimetre a second on a flat mesh
// of triangles gains speed and rolls away, at any timestep. It is a prism of 16 sides (cylinder_is_prism.cc): on a box
// it stays on one of them.
//
// Ends with status 0 while Havok behaves so, 1 when it does not: then the deviation in engine.cc can go.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <initializer_list>
#include <vector>

#include "world.h"

namespace {

using havok::Vector3;

constexpr float kRadius = 0.1f, kHalf = 0.15f, kCell = 0.05f;  // m
constexpr std::uint32_t kPoints = 61;                          // a side, of 3 m
constexpr double kDuration = 1.2;                              // s

havok::Id flat_mesh(finding::World& world) {
  std::vector<Vector3> points;
  std::vector<std::uint32_t> corners;
  constexpr float kWide = kCell * (kPoints - 1) / 2;
  for (std::uint32_t row = 0; row < kPoints; ++row) {
    for (std::uint32_t column = 0; column < kPoints; ++column) {
      points.push_back({kCell * static_cast<float>(column) - kWide, kCell * static_cast<float>(row) - kWide, 0});
      if (row + 1 == kPoints || column + 1 == kPoints) continue;
      const std::uint32_t a = row * kPoints + column, c = a + kPoints;
      corners.insert(corners.end(), {a, a + 1, c, a + 1, c + 1, c});
    }
  }
  return world.mesh(points, corners, 1);
}

// m, aside; the cylinder's centre is where it lies on a side.
double way(bool on_mesh, float timestep) {
  finding::World world(Vector3{0, 0, -9.81f}, 0);
  if (on_mesh) {
    world.add_fixed(flat_mesh(world));
  } else {
    world.add_ground(1);
  }
  const float c = std::cos(0.3f), s = std::sin(0.3f);
  const havok::Id shape = world.cylinder({0, 0, -kHalf}, {0, 0, kHalf}, kRadius, 1);
  const float across = (3 * kRadius * kRadius + 4 * kHalf * kHalf) / 12;
  const Vector3 start{0.03f, 0.01f, kRadius};
  // its z axis along (c, s, 0)
  constexpr float kHalfRoot = 0.70710678f;
  const havok::Id body = world.add_solid(shape, 1, {across, across, kRadius * kRadius / 2}, start,
                                         {-kHalfRoot * s, kHalfRoot * c, 0, kHalfRoot});
  constexpr float kSlow = 1e-4f;
  world.set_velocity(body, {kSlow * s, -kSlow * c, 0});
  world.set_angular_velocity(body, {kSlow / kRadius * c, kSlow / kRadius * s, 0});
  world.step(timestep, std::lround(kDuration / static_cast<double>(timestep)));
  const Vector3 end = world.transform(body).translation;
  return std::hypot(static_cast<double>(end.x - start.x), static_cast<double>(end.y - start.y));
}

}  // namespace

int main() {
  bool so = true;
  for (const float timestep : {4e-3f, 2e-3f, 1e-3f}) {
    const double mesh = way(true, timestep), box = way(false, timestep);
    std::printf("%g ms: a lying cylinder rolls %.4f m within %g s on a mesh, %.5f m on a box\n",
                1e3 * static_cast<double>(timestep), mesh, kDuration, box);
    so = so && mesh > 0.1 && box < 0.03;
  }
  return so ? 0 : 1;
}
