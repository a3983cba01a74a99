// A model as MuJoCo has compiled it.
#pragma once

#include <memory>
#include <vector>

#include "engines/engine.h"
#include "library.h"

namespace assay::mujoco {

// What create() needs again for every timestep and state.
struct Compiled {
  Model model;
  ModelPtr mujoco;
  bool explicit_springs = false;           // MuJoCo has none of the model's, they are torques
  std::vector<int> body_id;                // MuJoCo's ids in the model's order (MuJoCo sorts depth first)
  std::vector<int> hinge_joint;            // per hinge
  std::vector<int> body_qpos, body_dof;    // per body: the free joint's first address, -1 for hinged bodies
  std::vector<int> hinge_qpos, hinge_dof;  // per hinge
};

// Throws EngineError with MuJoCo's words when it refuses the model.
std::shared_ptr<const Compiled> compile(const Model& model, const Settings& settings);

}  // namespace assay::mujoco
