// One running DART world.
#pragma once

#include <memory>
#include <vector>

#include <dart/simulation/World.hpp>

#include "collision.h"
#include "engines/adapter.h"
#include "options.h"

namespace assay::dartsim {

class ArmatureRow;

class DartSimulation final : public Simulation {
 public:
  DartSimulation(Model model, const State& state, const Options& options);

  void set_torques(std::span<const double> torques) override;
  void advance(int count) override;
  void read_state(State& out) const override;
  EngineView view() const override;
  bool keep_contacts() override;
  void read_contacts(std::vector<ContactForce>& out) const override;

 private:
  void make_world();
  void make_bodies();
  void make_body(int index, const dart::dynamics::SkeletonPtr& skeleton);
  template <typename Properties>
  void set_properties(Properties& joint, const Joint& model, const Eigen::Isometry3d& X_PB) const;
  void make_armature_rows();
  void make_contacts();
  void set_state(const State& state);
  void push_armature();

  Options options_;
  Clock clock_;
  JointRows rows_;
  Model model_;            // our own copy: the caller's need not live on
  bool explicit_springs_;  // of hinges and slides; those of ball joints and tendons always are
  bool armature_in_rows_, armature_in_joints_;
  bool reads_state_;  // whether set_torques() needs the state
  bool contacts_kept_ = false;
  dart::simulation::WorldPtr world_;
  std::shared_ptr<const PairFilter> filter_;  // null without contacts
  std::vector<dart::dynamics::SkeletonPtr> trees_;
  std::vector<dart::dynamics::BodyNode*> bodies_;  // owned by the world's skeletons
  std::vector<dart::dynamics::Joint*> joints_;     // of each Model::joints
  std::vector<dart::dynamics::Joint*> balls_;      // of each Model::balls
  std::vector<std::shared_ptr<ArmatureRow>> armature_rows_;
  State scratch_;
  std::vector<double> torques_;
};

}  // namespace assay::dartsim
