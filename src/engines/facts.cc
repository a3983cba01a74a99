#include "engines/facts.h"

#include <algorithm>
#include <array>

#include "engines/binary_facts.h"
#include "engines/builds.h"
#include "engines/describe.h"

namespace assay {
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
  Json facts = {{"name", setting.name},
                {"value", value_json(settings.values.at(setting.name))},
                {"default", value_json(setting.default_value)},
                {"type", type_text(setting.default_value)},
                {"unit", setting.unit},
                {"meaning", setting.meaning},
                {"choices", setting.choices},
                {"minimum", nullptr},
                {"maximum", nullptr}};
  if (setting.minimum) facts["minimum"] = *setting.minimum;
  if (setting.maximum) facts["maximum"] = *setting.maximum;
  return facts;
}

}  // namespace

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
  const std::string plugin = Registry::instance().plugin_path(contender.engine->name());
  return {{"contender", contender.name},
          {"engine", contender.engine->name()},
          {"summary", contender.summary},
          {"version", build.version},
          {"differs", settings_text(*contender.engine, contender.settings)},
          {"capabilities", describe(contender.engine->capabilities(contender.settings))},
          {"settings", settings},
          {"build",
           {{"source", build.source},
            {"compiler", build.compiler},
            {"flags", build.flags},
            {"plugin", plugin},
            {"build", build_of(contender.engine->name())},
            {"binary", binary_facts(plugin)}}}};
}

Json model_json(const std::string& name, const Model& model) {
  const auto shapes = [&](ShapeType type) { return std::ranges::count(model.shapes, type, &Shape::type); };
  const auto free = std::ranges::count_if(model.bodies, &Body::is_free);
  const auto slides = std::ranges::count_if(model.joints, &Joint::is_slide);
  const auto limited_slides =
      std::ranges::count_if(model.joints, [](const Joint& j) { return j.is_slide() && j.limited; });
  return {{"system", name},
          {"file", model.source},
          {"hash", model.hash},
          {"bodies", model.bodies.size()},
          {"dof", model.dof()},
          {"hinges", std::ssize(model.joints) - slides},
          {"slides", slides},
          {"balls", model.balls.size()},
          {"free_joints", free},
          {"limited_hinges", std::ranges::count_if(model.joints, &Joint::limited) - limited_slides},
          {"limited_slides", limited_slides},
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

void tell_notes(const Model& model) {
  for (const std::string& note : model.notes) message("note: " + note);
}

}  // namespace assay
