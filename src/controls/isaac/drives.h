// What drives the joints of a training in Isaac Lab: its groups of actuators.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "controls/isaac/environment.h"

namespace assay {

class IsaacDrives {
 public:
  explicit IsaacDrives(IsaacEnvironment& environment) : in_(environment) {}

  void read();
  std::string pd_text();  // [pd]
  int delay() const { return delay_; }
  const std::vector<PolicyImporter::Held>& held() const { return held_; }

 private:
  // Of one joint.
  struct Drive {
    YamlPlace group;
    std::string kind;  // class of the actuator
    double stiffness = 0, damping = 0;
    std::optional<double> limit;
  };

  void list_actuator(const YamlPlace& group, const std::string& kind, const std::vector<std::string>& names);
  void list_passive_drives();
  std::string effort_limits_text(bool with_heading);

  IsaacEnvironment& in_;
  std::map<std::string, Drive> drives_;  // by joint
  std::vector<std::string> beside_;
  std::vector<PolicyImporter::Held> held_;
  int delay_ = 0;  // control steps
};

}  // namespace assay
