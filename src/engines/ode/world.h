// One running ODE world: bodies in maximal coordinates, joints and contacts as constraints.
#pragma once

#include <vector>

#include "collision.h"
#include "drives.h"
#include "engines/adapter.h"
#include "library.h"
#include "options.h"

namespace assay::ode {

class OdeSimulation final : public Simulation {
 public:
  OdeSimulation(Model model, const State& state, const Options& options);

  void set_torques(std::span<const double> torques) override;
  void advance(int count) override;
  void read_state(State& out) const override;
  EngineView view() const override;
  bool keep_contacts() override {
    collision_.keep_forces();
    return true;
  }
  void read_contacts(std::vector<ContactForce>& out) const override { collision_.read_forces(options_.timestep, out); }

 private:
  void set_up_world();
  void create_bodies();
  void create_joints();
  dxJoint* create_hinge(const State& zero, int index);
  dxJoint* create_slider(const State& zero, int index);
  void create_balls(const State& zero);
  void create_connects(const State& zero);
  void create_welds();
  void set_stops(dxJoint* joint, const Joint& hinge) const;
  void make_spring_stop(dxJoint* joint, const Joint& hinge) const;
  void set_pose(int body, const Pose& X_WB);
  void set_state(const State& state);
  void read_copy(State& out) const;  // as lent_'s model has it
  void add_ball_springs();
  dxBody* ode_body(int body) const { return body == kWorld ? nullptr : bodies_[body]; }

  Options options_;
  Clock clock_;
  long long first_step_ = 0;
  JointRows rows_;      // of the model
  Lent lent_;           // our own copy: the caller's need not live on
  const Model& model_;  // lent_'s: every body has mass
  bool failed_ = false;
  World world_;
  Collision collision_;
  std::vector<dxBody*> bodies_;   // owned by the world
  std::vector<dxJoint*> joints_;  // owned by the world
  Drives drives_;
  bool has_explicit_springs_ = false;  // of any kind
  bool torques_set_ = false;           // since the last step
  State scratch_;
  std::vector<double> torques_;
  mutable std::vector<double> last_angle_;  // what the next read unwraps against
};

}  // namespace assay::ode
