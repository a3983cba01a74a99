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

#include "world.h"

namespace {

constexpr double kHalf = 0.05, kAside = 1e-3, kDuration = 4;  // m, s

// The largest way of a box aside, m, or -1 when Rapier failed.
double way(int boxes, double frequency, bool recycling, double timestep) {
  RapierOptions options = finding::rapiers_own(timestep);
  options.contact_frequency = frequency;
  options.static_contact_frequency = std::max(frequency, options.static_contact_frequency);
  options.contact_recycling = recycling ? 1 : 0;
  finding::World world(options);
  for (int i = 0; i < boxes; ++i) {
    RapierBody body = finding::upright_body(1);
    for (double& moment : body.inertia) moment = 2 * kHalf * kHalf / 3;
    body.p_world_com[0] = i % 2 == 0 ? kAside : -kAside;
    body.p_world_com[2] = kHalf * (2 * i + 1);
    world.add(body);
  }
  RapierShape shape = finding::ground_plane(1);
  world.add(shape);
  for (int i = 0; i < boxes; ++i) {
    shape.type = RAPIER_BOX;
    shape.body = i;
    for (double& half : shape.half_size) half = kHalf;
    world.add(shape);
  }
  std::vector<RapierState> states(static_cast<size_t>(boxes));
  world.start();
  world.step(static_cast<int>(std::lround(kDuration / timestep)));
  world.read(states.data());
  if (!world.good()) return -1;
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
