// One running MuJoCo simulation.
#pragma once

#include <memory>

#include "compiled.h"
#include "engines/adapter.h"
#include "library.h"

namespace assay::mujoco {

class MujocoSimulation final : public Simulation {
 public:
  MujocoSimulation(std::shared_ptr<const Compiled> compiled, const State& state, double timestep);

  void set_torques(std::span<const double> torques) override;
  void advance(int count) override;
  void read_state(State& out) const override;
  EngineView view() const override;
  bool keep_contacts() override;
  void read_contacts(std::vector<ContactForce>& out) const override;

 private:
  void set_state(const State& state);
  BallCoordinates ball_motion(const BallAddress& address) const;
  void add_springs(std::span<const double> torques);
  void set_controls(double time);
  void clear_torques();
  void check_warnings() const;
  [[noreturn, gnu::cold, gnu::noinline]] void throw_failure() const;

  std::shared_ptr<const Compiled> compiled_;
  ModelPtr model_;
  DataPtr data_;
  Clock clock_;
  bool controls_follow_time_ = false;
  mutable std::vector<BallCoordinates> balls_;  // of the last read
  bool contacts_kept_ = false;
  bool torques_set_ = false;    // qfrc_applied is not zero
  bool torques_fresh_ = false;  // ... and no step has used it yet
};

}  // namespace assay::mujoco
