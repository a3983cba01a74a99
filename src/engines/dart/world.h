// One running DART world.
#pragma once

#include <memory>
#include <vector>

#include <dart/simulation/World.hpp>

#include "engines/adapter.h"
#include "options.h"

namespace assay::dartsim {

class DartSimulation final : public Simulation {
 public:
  DartSimulation(Model model, const State& state, const Options& options);

  void set_torques(std::span<const double> torques) override;
  void advance(int count) override;
  void read_state(State& out) const override;
  EngineView view() const override;

 private:
  void make_world();
  void make_bodies();
  void make_joint(int index, const dart::dynamics::SkeletonPtr& skeleton);
  void make_contacts();
  void set_state(const State& state);

  Options options_;
  Clock clock_;
  Model model_;  // our own copy: the caller's need not live on
  bool explicit_springs_;
  dart::simulation::WorldPtr world_;
  std::vector<dart::dynamics::SkeletonPtr> trees_;
  std::vector<dart::dynamics::BodyNode*> bodies_;  // owned by the world's skeletons
  std::vector<dart::dynamics::Joint*> hinges_;     // of each Model::joints
};

}  // namespace assay::dartsim
