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

#include "assay_rapier.h"

namespace {

constexpr double kRadius = 0.05, kHalf = 0.3, kDuration = 20;  // m, s

RapierOptions rapiers_own(double timestep) {
  RapierOptions options{};
  options.timestep = timestep;
  options.gravity[2] = -9.81;
  options.solver_iterations = 4;
  options.pgs_iterations = options.stabilization_iterations = 1;
  options.contact_frequency = 30;
  options.static_contact_frequency = 60;
  options.contact_damping_ratio = options.static_contact_damping_ratio = 10;
  options.joint_frequency = 1e6;
  options.joint_damping_ratio = 1;
  options.max_corrective_speed = 3;
  options.prediction_distance = 0.02;
  options.warmstart = 1;
  options.contact_coherence = options.contact_recycling = 1;
  options.coulomb = 1;
  options.gyroscopic = 1;
  return options;
}

// The way aside of a capsule that is put down without any velocity, m, or -1 when Rapier failed.
double way(bool on_box, bool coherence, double timestep, double duration, const RapierApi& api = assay_rapier_f64,
           bool cylinder = false) {
  RapierOptions options = rapiers_own(timestep);
  options.contact_recycling = 0;
  options.contact_coherence = coherence ? 1 : 0;
  RapierWorld* world = api.create(&options);
  if (world == nullptr) return -1;
  RapierShape ground{};
  ground.type = on_box ? RAPIER_BOX : RAPIER_PLANE;
  ground.body = -1;
  ground.q[3] = 1;
  ground.friction = 1;
  ground.groups = ground.collides_with = 1;
  if (on_box) {
    ground.p[0] = ground.p[2] = -0.1;
    ground.p[1] = 0.07;
    ground.half_size[0] = ground.half_size[1] = 1;
    ground.half_size[2] = 0.1;
  }
  RapierBody body{};
  body.mass = 1;
  body.inertia[0] = body.inertia[1] = 0.036;
  body.inertia[2] = 0.00125;
  body.q_body_principal[3] = 1;
  body.q_world_body[1] = body.q_world_body[3] = std::sqrt(0.5);  // its z axis along x
  body.p_world_com[2] = kRadius;
  RapierShape capsule = ground;
  capsule.type = cylinder ? RAPIER_CYLINDER : RAPIER_CAPSULE;
  capsule.body = 0;
  for (double& x : capsule.p) x = 0;
  capsule.radius = kRadius;
  capsule.half_length = kHalf;
  RapierState state{};
  const bool good = api.add_body(world, &body) == 0 && api.add_shape(world, &ground) == 0 &&
                    api.add_shape(world, &capsule) == 0 && api.start(world) == 0 &&
                    api.step(world, static_cast<int>(std::lround(duration / timestep))) == 0 &&
                    api.read_bodies(world, &state) == 0;
  api.destroy(world);
  return good ? std::hypot(state.p_world_com[0], state.p_world_com[1]) : -1;
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
