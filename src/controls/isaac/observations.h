// What the policy of a training in Isaac Lab observes.
#pragma once

#include <string>
#include <vector>

#include "controls/isaac/environment.h"

namespace assay {

class IsaacObservations {
 public:
  explicit IsaacObservations(IsaacEnvironment& environment) : in_(environment) {}

  std::string text();  // [observations]; takes the command
  // The joints that a term's parameters choose.
  std::vector<std::string> term_joints(const YamlPlace& term, const YamlPlace& params);

 private:
  std::string term_text(const YamlPlace& term);
  // Isaac Lab's is that of the base's centre of mass.
  void list_velocity_point(const YamlPlace& term);
  // Whether the command that a term observes is a velocity; then [command] has it.
  bool is_velocity(const YamlPlace& params);
  void command_text(const YamlPlace& command, const YamlPlace& ranges);

  IsaacEnvironment& in_;
};

}  // namespace assay
