// The environment of a training in Isaac Lab as a policy's configuration (policy_config.h).
//
// Isaac Lab writes what an environment was made from as params/env.yaml beside the checkpoints: a dump of Python
// objects by PyYAML. Its manager-based environments say there what observations, actions and drives are; those of the
// direct workflow compute them in Python, and no file says it. What maps one to one is taken over, the rest is listed
// with what it means for a run. What would give the policy other numbers than in training is an error until it is named
// in `ignore`.
//
// Joints: Isaac Lab's names are regular expressions of Python, of which one has to match the whole name. Its order is
// that of PhysX, breadth first: all joints of one depth of the tree before those of the next.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "model/model.h"

namespace assay {

struct IsaacImportOptions {
  std::string group = "policy";                  // of `observations`
  std::vector<std::string> joints;               // order in training; empty: breadth first in the robot's tree
  std::optional<std::array<double, 3>> command;  // forward, left (m/s), turning (rad/s)
  // Paths in the file, or their ends: what the policy runs without. PATH=COUNT of an observation: that many zeros.
  std::vector<std::string> ignore;
  std::string network;     // as the configuration is to name it; empty: not
  std::string trained_in;  // contender; empty: that of the file's engine
};

// What the configuration does not hold.
struct LeftOut {
  std::string path;     // in the file: "observations.policy.joint_pos.noise"
  std::string meaning;  // for a run
};

struct IsaacImport {
  std::string toml;
  std::vector<std::string> joints;  // in the policy's order
  std::string joint_order;          // where the order comes from, a sentence
  std::vector<LeftOut> left_out;
};

// `text` is the file's content, `path` its name for messages. Throws InputError with path and line: no YAML, another
// framework's, a part that is missing, a pattern that matches no joint of the robot, what has no equal here. The result
// still has to be read back with parse_policy_config().
IsaacImport import_isaac_env(const Model& model, std::string_view text, const std::string& path,
                             const IsaacImportOptions& options);

// Names of the robot's hinges and slides, breadth first: of bodies at one depth in the file's order.
std::vector<std::string> breadth_first_joints(const Model& model);

}  // namespace assay
