// Rapier 0.36.1, ContactConstraintTangentPart::solve: friction of a contact point that slides is not against its slip.
//
// With the Coulomb model a point's two friction rows are solved together: the impulse that would stop the slip v is
// K^-1 v, with K the point's inverse mass across the normal, and that vector is cut to the friction's size. At a corner
// of a box K couples both directions, K12 = rx ry / Iz, so the cut vector stands at an angle to v. Over the corners the
// parts across the slip cancel: a face slides with mu K22 / sqrt(K22^2 + K12^2), at any timestep and with any number of
// iterations. The simplified model, which has one friction force a manifold, is right. The C functions of
// assay_rapier.h do nothing but hand their numbers to the crate.
//
// Ends with status 0 while Rapier behaves so, 1 when it does not: then the deviations in engine.cc can go.
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include "world.h"

namespace {

constexpr double kFriction = 0.5, kTimestep = 1e-3, kDown = 8, kAlong = 6;  // m/s^2
constexpr int kSettle = 100, kSteps = 500;

struct Box {
  double x, y, z;  // half sizes, m; 1 kg
};

double square(double number) { return number * number; }

// Friction over normal impulse of a box that slides along x, or -1 when Rapier failed.
double measured(const Box& box, bool coulomb) {
  RapierOptions options = finding::rapiers_own(kTimestep);
  options.gravity[0] = kAlong;
  options.gravity[2] = -kDown;
  options.contact_recycling = options.gyroscopic = 0;
  options.coulomb = coulomb ? 1 : 0;
  finding::World world(options);
  RapierBody body = finding::upright_body(1);
  body.inertia[0] = (square(box.y) + square(box.z)) / 3;
  body.inertia[1] = (square(box.x) + square(box.z)) / 3;
  body.inertia[2] = (square(box.x) + square(box.y)) / 3;
  body.p_world_com[2] = box.z;
  world.add(body);
  const RapierShape plane = finding::ground_plane(kFriction);
  RapierShape shape = plane;
  shape.type = RAPIER_BOX;
  shape.body = 0;
  shape.half_size[0] = box.x;
  shape.half_size[1] = box.y;
  shape.half_size[2] = box.z;
  world.add(plane);
  world.add(shape);
  world.start();
  RapierState from{}, to{};
  world.step(kSettle);
  world.read(&from);
  world.step(kSteps);
  world.read(&to);
  if (!world.good()) return -1;
  const double time = kSteps * kTimestep;
  const double friction = (kAlong * time) - (to.v_world_com[0] - from.v_world_com[0]);
  const double normal = (kDown * time) + (to.v_world_com[2] - from.v_world_com[2]);
  return friction / normal;
}

}  // namespace

int main() {
  bool so = true;
  for (const Box box : {Box{0.1, 0.1, 0.05}, {0.1, 0.1, 0.005}, {0.1, 0.02, 0.02}, {0.02, 0.1, 0.005}}) {
    const double Ix = (square(box.y) + square(box.z)) / 3, Iz = (square(box.x) + square(box.y)) / 3;
    const double K12 = box.x * box.y / Iz, K22 = 1 + (square(box.z) / Ix) + (square(box.x) / Iz);
    const double expected = kFriction * K22 / std::hypot(K22, K12);
    const double coulomb = measured(box, true), simplified = measured(box, false);
    std::printf("box of %g x %g x %g m: friction coefficient %.4f, expected %.4f; simplified %.4f, the model's is %g\n",
                2 * box.x, 2 * box.y, 2 * box.z, coulomb, expected, simplified, kFriction);
    so = so && std::abs(coulomb / expected - 1) < 5e-3 && std::abs(simplified / kFriction - 1) < 5e-3;
  }
  return so ? 0 : 1;
}
