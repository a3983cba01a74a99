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

#include "assay_rapier.h"

namespace {

constexpr double kFriction = 0.5, kTimestep = 1e-3, kDown = 8, kAlong = 6;  // m/s^2
constexpr int kSettle = 100, kSteps = 500;

struct Box {
  double x, y, z;  // half sizes, m; 1 kg
};

double square(double number) { return number * number; }

// Friction over normal impulse of a box that slides along x, or -1 when Rapier failed.
double measured(const Box& box, bool coulomb) {
  const RapierApi& api = assay_rapier_f64;
  RapierOptions options{};
  options.timestep = kTimestep;
  options.gravity[0] = kAlong;
  options.gravity[2] = -kDown;
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
  options.contact_coherence = 1;
  options.coulomb = coulomb ? 1 : 0;
  RapierWorld* world = api.create(&options);
  if (world == nullptr) return -1;
  RapierBody body{};
  body.mass = 1;
  body.inertia[0] = (square(box.y) + square(box.z)) / 3;
  body.inertia[1] = (square(box.x) + square(box.z)) / 3;
  body.inertia[2] = (square(box.x) + square(box.y)) / 3;
  body.q_body_principal[3] = body.q_world_body[3] = 1;
  body.p_world_com[2] = box.z;
  bool good = api.add_body(world, &body) == 0;
  RapierShape plane{};
  plane.type = RAPIER_PLANE;
  plane.body = -1;
  plane.q[3] = 1;
  plane.friction = kFriction;
  plane.groups = plane.collides_with = 1;
  RapierShape shape = plane;
  shape.type = RAPIER_BOX;
  shape.body = 0;
  shape.half_size[0] = box.x;
  shape.half_size[1] = box.y;
  shape.half_size[2] = box.z;
  RapierState from{}, to{};
  good = good && api.add_shape(world, &plane) == 0 && api.add_shape(world, &shape) == 0 && api.start(world) == 0 &&
         api.step(world, kSettle) == 0 && api.read_bodies(world, &from) == 0 && api.step(world, kSteps) == 0 &&
         api.read_bodies(world, &to) == 0;
  api.destroy(world);
  if (!good) return -1;
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
