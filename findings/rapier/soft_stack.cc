// Rapier 0.36.1: contacts between moving bodies are springs of 30 Hz by default, so soft that a stack of ten boxes
// buckles.
//
// Boxes of 0.1 m stand on each other, each a millimetre aside of the one below, in turns. They should stay. As a column
// on springs under its own weight they do so up to a height that grows with the contacts' stiffness. With Rapier's
// contact recycling ten stay after they have swayed by centimetres, because the contacts' levers are kept while the
// boxes lean, and twenty collapse; at 200 Hz both stay where they are, without it. The C functions of assay_rapier.h do
// nothing but hand their numbers to the crate.
//
// Ends with status 0 while Rapier behaves so, 1 when it does not: then the adapter's contact_natural_frequency can be
// Rapier's own.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <vector>

#include "assay_rapier.h"

namespace {

constexpr double kHalf = 0.05, kAside = 1e-3, kDuration = 4;  // m, s

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

// The largest way of a box aside, m, or -1 when Rapier failed.
double way(int boxes, double frequency, bool recycling, double timestep) {
  const RapierApi& api = assay_rapier_f64;
  RapierOptions options = rapiers_own(timestep);
  options.contact_frequency = frequency;
  options.static_contact_frequency = std::max(frequency, options.static_contact_frequency);
  options.contact_recycling = recycling ? 1 : 0;
  RapierWorld* world = api.create(&options);
  if (world == nullptr) return -1;
  RapierShape shape{};
  shape.type = RAPIER_PLANE;
  shape.body = -1;
  shape.q[3] = 1;
  shape.friction = 1;
  shape.groups = shape.collides_with = 1;
  bool good = true;
  for (int i = 0; i < boxes; ++i) {
    RapierBody body{};
    body.mass = 1;
    for (double& moment : body.inertia) moment = 2 * kHalf * kHalf / 3;
    body.q_body_principal[3] = body.q_world_body[3] = 1;
    body.p_world_com[0] = i % 2 == 0 ? kAside : -kAside;
    body.p_world_com[2] = kHalf * (2 * i + 1);
    good = good && api.add_body(world, &body) == 0;
  }
  good = good && api.add_shape(world, &shape) == 0;
  for (int i = 0; i < boxes; ++i) {
    shape.type = RAPIER_BOX;
    shape.body = i;
    for (double& half : shape.half_size) half = kHalf;
    good = good && api.add_shape(world, &shape) == 0;
  }
  std::vector<RapierState> states(static_cast<size_t>(boxes));
  good = good && api.start(world) == 0 && api.step(world, static_cast<int>(std::lround(kDuration / timestep))) == 0 &&
         api.read_bodies(world, states.data()) == 0;
  api.destroy(world);
  if (!good) return -1;
  double largest = 0;
  for (int i = 0; i < boxes; ++i) {
    const double* p = states[static_cast<size_t>(i)].p_world_com;
    largest = std::max(largest, std::hypot(p[0] - (i % 2 == 0 ? kAside : -kAside), p[1]));
  }
  return largest;
}

}  // namespace

int main() {
  bool so = true;
  for (const double timestep : {4e-3, 1e-3}) {
    const double own = way(10, 30, false, timestep), recycled = way(10, 30, true, timestep),
                 twenty = way(20, 30, true, timestep), stiff = way(10, 200, false, timestep),
                 stiff_twenty = way(20, 200, false, timestep);
    std::printf(
        "%g ms: ten boxes move aside by %.4f m at 30 Hz, %.4f m with recycling, %.4f m at 200 Hz; twenty by %.4f m "
        "with recycling, %.4f m at 200 Hz\n",
        1e3 * timestep, own, recycled, stiff, twenty, stiff_twenty);
    so = so && own > 0.3 && twenty > 0.02 && stiff >= 0 && stiff < 1e-3 && stiff_twenty >= 0 && stiff_twenty < 1e-2;
  }
  return so ? 0 : 1;
}
