// Rapier 0.36.1: Parry keeps the contact points of two shapes while they move by less than 1 mm and 1 degree
// (ContactManifold::try_update_contacts). On points that turn with it, a capsule at rest on a box is an inverted
// pendulum: it gains speed until its points are found anew, and then again. On a plane, whose contacts with it are not
// kept, it stays.
//
// With the points found anew in each step (ContactManifold::mark_shapes_deformed) it stays on the box as well. In
// single precision a lying cylinder still moves there, because rounding decides where along its edge the points are.
// The C functions of assay_rapier.h do nothing but hand their numbers to the crate.
//
// Ends with status 0 while Rapier behaves so, 1 when it does not: then the adapter's contact_coherence can be Rapier's
// own.
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include "world.h"

namespace {

constexpr double kRadius = 0.05, kHalf = 0.3, kDuration = 20;  // m, s

// The way aside of a capsule that is put down without any velocity, m, or -1 when Rapier failed.
double way(bool on_box, bool coherence, double timestep, double duration, const RapierApi& api = assay_rapier_f64,
           bool cylinder = false) {
  RapierOptions options = finding::rapiers_own(timestep);
  options.contact_recycling = 0;
  options.contact_coherence = coherence ? 1 : 0;
  RapierShape ground = finding::ground_plane(1);
  if (on_box) {
    ground.type = RAPIER_BOX;
    ground.p[0] = ground.p[2] = -0.1;
    ground.p[1] = 0.07;
    ground.half_size[0] = ground.half_size[1] = 1;
    ground.half_size[2] = 0.1;
  }
  RapierBody body = finding::upright_body(1);
  body.inertia[0] = body.inertia[1] = 0.036;
  body.inertia[2] = 0.00125;
  body.q_world_body[1] = body.q_world_body[3] = std::sqrt(0.5);  // its z axis along x
  body.p_world_com[2] = kRadius;
  RapierShape capsule = ground;
  capsule.type = cylinder ? RAPIER_CYLINDER : RAPIER_CAPSULE;
  capsule.body = 0;
  for (double& x : capsule.p) x = 0;
  capsule.radius = kRadius;
  capsule.half_length = kHalf;
  finding::World world(options, api);
  world.add(body);
  world.add(ground);
  world.add(capsule);
  world.start();
  world.step(static_cast<int>(std::lround(duration / timestep)));
  RapierState state{};
  world.read(&state);
  return world.good() ? std::hypot(state.p_world_com[0], state.p_world_com[1]) : -1;
}

}  // namespace

int main() {
  bool so = true;
  for (const double timestep : {4e-3, 1e-3}) {
    const double kept = way(true, true, timestep, kDuration), found = way(true, false, timestep, kDuration),
                 plane = way(false, true, timestep, kDuration);
    std::printf(
        "%g ms: within %g s a capsule at rest on a box rolls %.4f m with kept contact points, %.6f m with points found "
        "anew, on a plane %.6f m\n",
        1e3 * timestep, kDuration, kept, found, plane);
    so = so && kept > 0.1 && found >= 0 && found < 2e-3 && plane >= 0 && plane < 2e-3;
  }
  const double single = way(true, false, 4e-3, kDuration, assay_rapier_f32, true),
               twice = way(true, false, 4e-3, kDuration, assay_rapier_f64, true);
  std::printf("a lying cylinder on a box, points found anew, 4 ms: %.4f m in single, %.6f m in double precision\n",
              single, twice);
  so = so && single > 2e-3 && twice >= 0 && twice < 2e-3;
  return so ? 0 : 1;
}
