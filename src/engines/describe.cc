#include "engines/describe.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "engines/registry.h"

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

std::string contact_forces_given(ContactForces forces) {
  switch (forces) {
    case ContactForces::kNone:
      return "none";
    case ContactForces::kNormal:
      return "normal";
    case ContactForces::kAll:
      return "all";
  }
  return "";
}

std::string contact_forces_text(const Capabilities& capabilities) {
  std::string text;
  switch (capabilities.contact_forces) {
    case ContactForces::kNone:
      if (!capabilities.contact) return fmt::format("{}: no contacts", kForcesNotGiven);
      text = kForcesNotGiven;
      break;
    case ContactForces::kNormal:
      text = "along the normal, no friction";
      break;
    case ContactForces::kAll:
      text = "normal and friction";
      break;
  }
  if (!capabilities.contact_forces_note.empty()) text += ": " + capabilities.contact_forces_note;
  return text;
}

nlohmann::ordered_json describe(const Capabilities& capabilities) {
  auto deviations = nlohmann::ordered_json::array();
  for (const Deviation& deviation : capabilities.deviations) {
    auto& row = deviations.emplace_back(
        nlohmann::ordered_json{{"test", deviation.test}, {"bound", deviation.bound}, {"reason", deviation.reason}});
    if (deviation.finest > 0) row["finest_ms"] = 1e3 * deviation.finest;
    if (std::isfinite(deviation.coarsest)) row["coarsest_ms"] = 1e3 * deviation.coarsest;
  }
  return {{"precision", precision_text(capabilities.precision)},
          {"coordinates", coordinates_text(capabilities.coordinates)},
          {"integrator", capabilities.integrator},
          {"order", capabilities.order},
          {"joint_solver", capabilities.joint_solver},
          {"contact", capabilities.contact},
          {"contact_solver", capabilities.contact_solver},
          {"contact_model", capabilities.contact_model},
          {"friction_cone", capabilities.friction_cone},
          {"friction_combine", capabilities.friction_combine},
          {"joint_limits", capabilities.joint_limits},
          {"torques", capabilities.torques},
          {"actuators", capabilities.actuators},
          {"armature", capabilities.armature},
          {"springs", springs_text(capabilities.springs)},
          {"spring_note", capabilities.spring_note},
          {"gyroscopic", capabilities.gyroscopic},
          {"iterations", capabilities.iterations},
          {"sleep", capabilities.sleep},
          {"speed_limits", capabilities.speed_limits},
          {"contact_forces", contact_forces_text(capabilities)},
          {"hidden_damping", capabilities.hidden_damping},
          {"other", capabilities.other},
          {"threads", capabilities.threads},
          {"finest_timestep_ms", 1e3 * capabilities.finest_timestep},
          {"deviations", deviations}};
}

nlohmann::ordered_json describe_changes(const std::vector<Setting>& declared, const Settings& settings) {
  auto changes = nlohmann::ordered_json::array();
  for (const Setting& setting : declared) {
    const SettingValue& value = settings.values.at(setting.name);
    if (value == setting.default_value) continue;
    changes.push_back({{"setting", setting.name},
                       {"value", setting_text(value)},
                       {"default", setting_text(setting.default_value)},
                       {"unit", setting.unit},
                       {"meaning", setting.meaning}});
  }
  return changes;
}

std::vector<std::string> approximations(const std::vector<Limitation>& limitations) {
  std::vector<std::pair<std::string, std::vector<std::string>>> by_how;
  for (const Limitation& limitation : limitations) {
    if (limitation.fidelity != Fidelity::kApproximated) continue;
    auto same = std::ranges::find(by_how, limitation.how, &std::pair<std::string, std::vector<std::string>>::first);
    if (same == by_how.end()) same = by_how.insert(by_how.end(), {limitation.how, {}});
    std::vector<std::string>& elements = same->second;
    if (std::ranges::find(elements, limitation.element) == elements.end()) elements.push_back(limitation.element);
  }
  std::vector<std::string> lines;
  lines.reserve(by_how.size());
  for (const auto& [how, elements] : by_how) {
    const std::string more = elements.size() > 1 ? fmt::format(" and {} more", elements.size() - 1) : "";
    lines.push_back(fmt::format("{}{}: {}", elements.front(), more, how));
  }
  return lines;
}

}  // namespace assay
