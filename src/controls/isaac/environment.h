// The env.yaml of a training in Isaac Lab while it is imported: its robot, the joints of its actions, its patterns of
// joints.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "controls/policy_import.h"

namespace assay {

class IsaacEnvironment : public PolicyImporter {
 public:
  IsaacEnvironment(const Model& model, const YamlTree& tree, const std::string& path,
                   const PolicyImportOptions& options)
      : PolicyImporter(model, tree, path, "environment of Isaac Lab", options) {}

  // Throws InputError for a file of another kind.
  void check_kind() const;
  void order_joints();
  // The term of actions that the policy has; its robot and joints.
  void read_action();
  // The robot's start, default_pos().
  void read_robot();

  const YamlPlace& action() const { return action_; }
  const YamlPlace& robot() const { return robot_; }
  const std::string& type() const { return type_; }                 // of actions, as configurations name it
  const std::vector<std::string>& acted() const { return acted_; }  // joints of the actions, in their order

  // Joints that the patterns match, in the order of joints, or of the patterns where the file says so.
  std::vector<std::string> matching(const YamlPlace& place, bool in_pattern_order);
  // A number for all of `names`, or a map of patterns; nothing where no pattern matches.
  std::vector<std::optional<double>> values(const YamlPlace& place, const std::vector<std::string>& names);
  std::vector<double> values(const YamlPlace& place, const std::vector<std::string>& names, double otherwise);

 private:
  void no_match(const YamlPlace& place, const std::string& pattern, const std::vector<std::string>& names);

  YamlPlace action_, robot_;
  std::string type_;
  std::vector<std::string> acted_;
};

}  // namespace assay
