#include "cli/facts.h"

#include <algorithm>

namespace assay::cli {
namespace {

Json value_json(const SettingValue& value) {
  return std::visit([](const auto& held) { return Json(held); }, value);
}

std::string type_text(const SettingValue& value) {
  constexpr std::array kNames = {"switch", "integer", "number", "text"};
  static_assert(std::variant_size_v<SettingValue> == kNames.size());
  return kNames.at(value.index());
}

Json setting_json(const Setting& setting, const Settings& settings) {
  Json json = {{"name", setting.name},
               {"value", value_json(settings.values.at(setting.name))},
               {"default", value_json(setting.default_value)},
               {"type", type_text(setting.default_value)},
               {"unit", setting.unit},
               {"meaning", setting.meaning},
               {"choices", setting.choices},
               {"minimum", nullptr},
               {"maximum", nullptr}};
  if (setting.minimum) json["minimum"] = *setting.minimum;
  if (setting.maximum) json["maximum"] = *setting.maximum;
  return json;
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

Json capabilities_json(const Capabilities& can) {
  Json deviations = Json::array();
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
          {"hidden_damping", can.hidden_damping},
          {"other", can.other},
          {"threads", can.threads},
          {"deviations", deviations}};
}

}  // namespace

std::string precision_text(Precision precision) { return precision == Precision::kSingle ? "single" : "double"; }

std::string coordinates_text(Coordinates coordinates) {
  return coordinates == Coordinates::kJoint ? "joint" : "maximal";
}

std::string fidelity_text(Fidelity fidelity) {
  switch (fidelity) {
    case Fidelity::kExact:
      return "exact";
    case Fidelity::kApproximated:
      return "approximated";
    case Fidelity::kRefused:
      return "refused";
  }
  return "";
}

Json contender_json(const ResolvedContender& contender) {
  const BuildFacts build = contender.engine->build();
  Json settings = Json::array();
  for (const Setting& setting : contender.engine->settings()) {
    settings.push_back(setting_json(setting, contender.settings));
  }
  return {{"contender", contender.name},
          {"engine", contender.engine->name()},
          {"summary", contender.summary},
          {"version", build.version},
          {"differs", settings_text(*contender.engine, contender.settings)},
          {"capabilities", capabilities_json(contender.engine->capabilities(contender.settings))},
          {"settings", settings},
          {"build",
           {{"source", build.source},
            {"compiler", build.compiler},
            {"flags", build.flags},
            {"plugin", Registry::instance().plugin_path(contender.engine->name())}}}};
}

Json model_json(const std::string& name, const Model& model) {
  const auto shapes = [&](ShapeType type) { return std::ranges::count(model.shapes, type, &Shape::type); };
  const auto free = std::ranges::count_if(model.bodies, &Body::is_free);
  return {{"system", name},
          {"file", model.source},
          {"hash", model.hash},
          {"bodies", model.bodies.size()},
          {"dof", model.dof()},
          {"hinges", model.hinges.size()},
          {"free_joints", free},
          {"limited_hinges", std::ranges::count_if(model.hinges, &Hinge::limited)},
          {"spheres", shapes(ShapeType::kSphere)},
          {"capsules", shapes(ShapeType::kCapsule)},
          {"planes", shapes(ShapeType::kPlane)},
          {"contact_pairs", model.contacts.size()},
          {"actuators", model.actuators.size()},
          {"keyframes", model.keyframes.size()},
          {"mass", model.total_mass()},
          {"gravity", {model.gravity.x(), model.gravity.y(), model.gravity.z()}},
          {"springs", model.has_springs()},
          {"armature", model.has_armature()},
          {"notes", model.notes}};
}

}  // namespace assay::cli
