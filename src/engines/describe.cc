#include "engines/describe.h"

namespace assay {

std::string precision_text(Precision precision) { return precision == Precision::kSingle ? "single" : "double"; }

std::string coordinates_text(Coordinates coordinates) {
  return coordinates == Coordinates::kJoint ? "joint" : "maximal";
}

std::string springs_text(SpringKind springs) {
  switch (springs) {
    case SpringKind::kNone:
      return "none";
    case SpringKind::kExplicit:
      return "explicit";
    case SpringKind::kNative:
      return "native";
  }
  return "";
}

nlohmann::ordered_json describe(const Capabilities& can) {
  auto deviations = nlohmann::ordered_json::array();
  for (const Deviation& deviation : can.deviations) {
    deviations.push_back({{"test", deviation.test}, {"bound", deviation.bound}, {"reason", deviation.reason}});
  }
  return {{"precision", precision_text(can.precision)},
          {"coordinates", coordinates_text(can.coordinates)},
          {"integrator", can.integrator},
          {"order", can.order},
          {"joint_solver", can.joint_solver},
          {"contact", can.contact},
          {"contact_solver", can.contact_solver},
          {"contact_model", can.contact_model},
          {"friction_cone", can.friction_cone},
          {"friction_combine", can.friction_combine},
          {"joint_limits", can.joint_limits},
          {"torques", can.torques},
          {"armature", can.armature},
          {"springs", springs_text(can.springs)},
          {"spring_note", can.spring_note},
          {"gyroscopic", can.gyroscopic},
          {"iterations", can.iterations},
          {"sleep", can.sleep},
          {"speed_limits", can.speed_limits},
          {"hidden_damping", can.hidden_damping},
          {"other", can.other},
          {"threads", can.threads},
          {"deviations", deviations}};
}

}  // namespace assay
