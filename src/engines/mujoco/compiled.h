// A model as MuJoCo has compiled it.
#pragma once

#include <memory>
#include <vector>

#include "engines/engine.h"
#include "library.h"

namespace assay::mujoco {

// Where a ball joint is in MuJoCo's vectors. MuJoCo's quaternion and angular velocity have the axes of the joint's
// MuJoCo body, which carries the massless bodies of the joint's chain.
struct BallAddress {
  int qpos = 0, dof = 0;
  Quat q_BC = Quat::Identity();  // those axes to the child's
};

// What create() needs again for every timestep and state.
struct Compiled {
  Model model;
  ModelPtr mujoco;
  bool explicit_springs = false;           // MuJoCo has none of the model's, they are torques
  std::vector<int> body_id;                // MuJoCo's ids in the model's order (MuJoCo sorts depth first); -1: massless
  std::vector<int> joint_id;               // per hinge or slide
  std::vector<int> body_qpos, body_dof;    // per body: the free joint's first address, else -1
  std::vector<int> joint_qpos, joint_dof;  // per hinge or slide
  std::vector<BallAddress> balls;
  std::vector<int> actuator_control;  // of each of the model's actuators, in ctrl; empty: none is MuJoCo's own
  std::vector<int> shape_of_geom;     // by MuJoCo's geom ids; -1: none of the model's
};

// Throws EngineError with MuJoCo's words when it refuses the model.
std::shared_ptr<const Compiled> compile(const Model& model, const Settings& settings);

}  // namespace assay::mujoco
