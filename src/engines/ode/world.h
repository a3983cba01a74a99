// One running ODE world: bodies in maximal coordinates, joints and contacts as constraints.
#pragma once

#include <vector>

#include "collision.h"
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

 private:
  void set_up_world();
  void create_bodies();
  void create_hinges();
  void make_spring_stop(dxJoint* joint, const Joint& hinge) const;
  void set_state(const State& state);
  dxBody* ode_body(int body) const { return body == kWorld ? nullptr : bodies_[body]; }

  Options options_;
  Clock clock_;
  long long first_step_ = 0;
  Model model_;  // our own copy: the caller's need not live on
  bool failed_ = false;
  World world_;
  Collision collision_;
  std::vector<dxBody*> bodies_;   // owned by the world
  std::vector<dxJoint*> joints_;  // owned by the world
  bool has_explicit_springs_ = false;
  bool torques_set_ = false;  // since the last step
  State scratch_;
  mutable std::vector<double> last_angle_;  // what the next read unwraps against
};

}  // namespace assay::ode
