// What both formulations share: scene, free bodies, shapes, clock, angles.
#pragma once

#include <memory>
#include <vector>

#include "collision.h"
#include "engines/adapter.h"
#include "library.h"
#include "model/massless.h"
#include "options.h"

namespace assay::px {

class PhysxSimulation : public Simulation {
 public:
  void advance(int count) final;
  void read_state(State& out) const final;
  EngineView view() const final;
  void set_torques(std::span<const double> torques) final;
  bool keep_contacts() final;
  void read_contacts(std::vector<ContactForce>& out) const final { out = collision_.contacts(); }

 protected:
  PhysxSimulation(const Model& model, const State& state, const Options& options);

  // A body of its own, in the start's state, in the scene.
  physx::PxRigidDynamic& make_dynamic(int body);
  // Mass, inertia, shapes and what PhysX would do to a body that is in no model. Before it gets into the scene.
  void prepare(physx::PxRigidBody& actor, int body) const;
  // Connect and weld constraints, as D6 joints between the actors of both bodies.
  void make_constraints();
  // To be called when the scene has everything: throws what PhysX complained about.
  static void finish_set_up();

  void read_dynamic(int body, BodyState& out) const;
  Pose body_frame(int body) const;  // where PhysX has the body's frame, X_WI

  JointRows rows_;      // of the model
  const Lent lent_;     // massless bodies have a share of mass
  const Model& model_;  // the copy that PhysX gets
  const Options options_;
  const State start_;  // of the copy; joint coordinates always filled
  Collision collision_;

  // Released in the opposite order.
  Owned<physx::PxDefaultCpuDispatcher> dispatcher_;
  Owned<physx::PxScene> scene_;
  std::vector<Owned<physx::PxRigidActor>> owned_;
  std::vector<physx::PxRigidBody*> actors_;  // by Model::bodies

 private:
  // A frame of a body, or of the world, in its actor.
  physx::PxTransform in_actor(int body, const Pose& X_BF) const;
  void hold_together(int body_a, const Pose& X_AF, int body_b, const Pose& X_BF, bool weld);

  std::vector<Owned<physx::PxJoint>> constraints_;  // by connect, then by weld

  // Fills bodies, angles and rates of `out`, whose angles on entry are the last ones.
  virtual void read(State& out) const = 0;
  virtual EngineJoint view_joint(int joint) const = 0;
  // Replaces the torques and forces of hinges and slides in the next step, and the torques of ball joints (on the
  // child, in its axes); without ball torques of the adapter's own, `balls` is empty.
  virtual void apply(const std::vector<double>& torques, const std::vector<Vec3>& balls) = 0;
  // Takes back torques that PhysX would apply again.
  virtual void withdraw() = 0;

  void make_scene();
  void make_world_shapes();

  bool contacts_kept_ = false;
  bool torques_ahead_ = false, torques_behind_ = false;  // to act in the next step; acted in the last
  bool ball_springs_ = false, tendon_springs_ = false;   // some ball joint, some tendon has a spring or damper
  std::vector<double> torques_;                          // scratch
  std::vector<Vec3> ball_torques_;                       // scratch
  mutable State last_;                                   // of the last read: unwraps angles
  Clock clock_;
};

std::unique_ptr<Simulation> make_maximal(const Model& model, const State& state, const Options& options);
std::unique_ptr<Simulation> make_articulated(const Model& model, const State& state, const Options& options);

}  // namespace assay::px
