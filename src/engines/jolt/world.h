// One running Jolt world, behind jolt_world.h.
#pragma once

#include <vector>

#include "engines/adapter.h"
#include "options.h"
#include "scene.h"

namespace assay::jolt {

class JoltSimulation final : public Simulation {
 public:
  JoltSimulation(const Model& model, const State& state, const Options& options);

  void set_torques(std::span<const double> torques) override;
  void advance(int count) override;
  void read_state(State& out) const override;
  EngineView view() const override;
  bool keep_contacts() override;
  void read_contacts(std::vector<ContactForce>& out) const override;

 private:
  // Fills last_, whose angles before unwrap the new ones.
  void read() const;
  void add_ball_springs();

  JointRows rows_;      // of the model
  Lent lent_;           // our own copy: the caller's need not live on
  const Model& model_;  // lent_'s: every body has mass
  const Options options_;
  Clock clock_;
  const std::vector<Pose> frames_;
  bool joint_springs_;  // explicit ones of hinges and slides
  bool springs_;        // explicit ones of any kind
  World world_;
  std::vector<double> torques_;
  mutable std::vector<jolt_body_state> bodies_;  // scratch
  bool contacts_kept_ = false;
  mutable std::vector<jolt_contact> contacts_;  // scratch
  mutable State last_;                          // of the last read, lent_'s model's
};

}  // namespace assay::jolt
