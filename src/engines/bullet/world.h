// What both formulations share: collision pipeline, solver, world, clock, angles.
#pragma once

#include <memory>
#include <vector>

#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/MLCPSolvers/btMLCPSolverInterface.h>
#include <btBulletDynamicsCommon.h>

#include "collision.h"
#include "engines/adapter.h"
#include "options.h"

namespace assay::bullet {

class BulletSimulation : public Simulation {
 public:
  void advance(int count) final;
  void read_state(State& out) const final;
  EngineView view() const final;
  void set_torques(std::span<const double> torques) final;
  bool keep_contacts() final;
  void read_contacts(std::vector<ContactForce>& out) const final;

 protected:
  BulletSimulation(const Model& model, const State& state, const Options& options);

  btDiscreteDynamicsWorld& world() const { return *world_; }
  // For the world's destructor to run while what it points to is still there.
  void destroy_world() { world_.reset(); }

  JointRows rows_;  // of the model
  const Model model_;
  const Options options_;
  const State start_;  // joint coordinates always filled
  const Collision collision_;

 private:
  // Fills bodies, angles and rates of `out`, whose angles on entry are the last ones.
  virtual void read(State& out) const = 0;
  // Makes what was read a state of the caller's model, where the simulation's is a copy.
  virtual void finish(State& /*out*/) const {}
  virtual void view_parts(EngineView& out) const = 0;
  // Replaces the joint torques of the next step: of hinges and slides, and of ball joints (in child axes, on the
  // child).
  virtual void apply(const std::vector<double>& torques, const std::vector<Vec3>& ball_torques) = 0;

  void make_world();

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  std::unique_ptr<btMLCPSolverInterface> lcp_;
  std::unique_ptr<btConstraintSolver> solver_;
  std::unique_ptr<btDiscreteDynamicsWorld> world_;
  mutable State last_;  // of the last read: unwraps angles
  bool contacts_kept_ = false;
  bool springs_;                          // of any kind: torques from the state at the step's start
  std::vector<double> torques_, scaled_;  // scratch
  std::vector<Vec3> ball_torques_;        // by Model::balls; zero without springs
  Clock clock_;
};

std::unique_ptr<Simulation> make_rigid(const Model& model, const State& state, const Options& options);
std::unique_ptr<Simulation> make_multibody(const Model& model, const State& state, const Options& options);

// A limit as Bullet gives it back, turned by whole turns to the model's.
double nearest_turn(double angle, double guess);

}  // namespace assay::bullet
