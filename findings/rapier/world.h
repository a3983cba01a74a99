// What the programs of this folder share: Rapier's own settings, a world, the ground and a body, by the C functions of
// assay_rapier.h, which do nothing but hand their numbers to the crate.
#pragma once

#include "assay_rapier.h"

namespace finding {

// As Rapier has them, with Coulomb's friction at each contact point.
inline RapierOptions rapiers_own(double timestep) {
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

// The plane z = 0; the program's other shapes are made from it.
inline RapierShape ground_plane(double friction) {
  RapierShape plane{};
  plane.type = RAPIER_PLANE;
  plane.body = -1;
  plane.q[3] = 1;
  plane.friction = friction;
  plane.groups = plane.collides_with = 1;
  return plane;
}

// At rest, its axes those of the world and its principal ones.
inline RapierBody upright_body(double mass) {
  RapierBody body{};
  body.mass = mass;
  body.q_body_principal[3] = body.q_world_body[3] = 1;
  return body;
}

// After a call that failed, no other one is made and good() is false.
class World {
 public:
  explicit World(const RapierOptions& options, const RapierApi& api = assay_rapier_f64)
      : api_(api), world_(api.create(&options)), good_(world_ != nullptr) {}
  ~World() {
    if (world_ != nullptr) api_.destroy(world_);
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  void add(const RapierBody& body) { good_ = good_ && api_.add_body(world_, &body) == 0; }
  void add(const RapierShape& shape) { good_ = good_ && api_.add_shape(world_, &shape) == 0; }
  void start() { good_ = good_ && api_.start(world_) == 0; }
  void step(int count) { good_ = good_ && api_.step(world_, count) == 0; }
  // All bodies.
  void read(RapierState* states) { good_ = good_ && api_.read_bodies(world_, states) == 0; }
  bool good() const { return good_; }

 private:
  const RapierApi& api_;
  RapierWorld* world_;
  bool good_;
};

}  // namespace finding
