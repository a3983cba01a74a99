// The deployment file of unitree_rl_lab as a policy's configuration (policy_config.h).
//
// Trainings of unitree_rl_lab (Isaac Lab for Unitree's robots) write params/deploy.yaml, which the program on the robot
// reads beside exported/policy.onnx. It names no joint: `joint_ids_map` gives for each of the policy's joints the
// number of its motor; stiffness and damping count by motor, default_joint_pos, actions and observations by the
// policy's joints. Source: export_deploy_cfg.py and deploy/include/isaaclab of that project.
#pragma once

#include <string>

#include "controls/policy_import.h"
#include "controls/yaml_tree.h"
#include "model/model.h"

namespace assay {

bool is_deploy_file(const YamlTree& tree);

// The motors are the robot's actuators in the file's order where each acts on one joint of its own, else its joints.
// Errors as import_isaac_env(); the robot has to have as many motors as the file.
PolicyImport import_deploy_file(const Model& model, const YamlTree& tree, const std::string& path,
                                const PolicyImportOptions& options);

}  // namespace assay
