// One running Box3D world: bodies in maximal coordinates, joints and contacts as constraints.
#pragma once

#include <vector>

#include "collision.h"
#include "engines/adapter.h"
#include "library.h"
#include "options.h"

namespace assay::box3d {

class Box3dSimulation final : public Simulation {
 public:
  Box3dSimulation(const Model& model, const State& state, const Options& options);

  void set_torques(std::span<const double> torques) override;
  void advance(int count) override;
  void read_state(State& out) const override;
  EngineView view() const override;
  bool keep_contacts() override;
  void read_contacts(std::vector<ContactForce>& out) const override;

 private:
  // What is applied to a body until the next step.
  struct Load {
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  };

  b3WorldDef world_definition() const;
  void create_bodies(const State& start);
  void create_joints();
  void create_hinge(int index);
  void create_slide(int index);
  // The definition that all joints share: the two bodies, frames in them, stiffness. A joint with the world gets a
  // fixed body of its own at `X_parent`, whose position may be double.
  void connect(b3JointDef& definition, int parent, const Pose& X_parent, int child, const Pose& X_child);
  void add_ball_springs();
  void apply(double sign) const;  // loads_, or with -1 the opposite
  void read() const;              // fills last_, whose angles before unwrap the new ones
  Vec3 centre_of(size_t body) const { return vec3(b3Body_GetWorldCenter(bodies_[body])); }

  Options options_;
  Clock clock_;
  JointRows rows_;      // of the model
  Lent lent_;           // our own copy: the caller's need not live on
  const Model& model_;  // lent_'s: every body has mass
  bool joint_springs_;  // explicit ones of hinges and slides
  bool springs_;        // explicit ones of any kind
  State start_;         // of model_
  Collision collision_;
  World world_;
  std::vector<b3BodyId> bodies_;
  std::vector<b3JointId> joints_;  // hinges and slides, in the model's order
  std::vector<double> torques_;
  std::vector<Load> loads_;  // by body
  bool loaded_ = false;      // since the last step
  bool contacts_kept_ = false;
  std::vector<Vec3> centres_;  // when the last step began, where contacts are kept
  mutable State last_;         // of the last read, model_'s
};

}  // namespace assay::box3d
