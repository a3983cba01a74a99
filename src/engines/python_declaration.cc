#include "engines/python_declaration.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/json.h"
#include "engines/springs.h"

namespace assay {
namespace {

using nlohmann::json;

SettingValue setting_value(const json& value, const std::string& name) {
  if (value.is_boolean()) return value.get<bool>();
  if (value.is_number_integer()) return value.get<long long>();
  if (value.is_number()) return value.get<double>();
  if (value.is_string()) return value.get<std::string>();
  throw std::runtime_error(fmt::format("setting '{}' is no bool, int, float or text", name));
}

json setting_json(const SettingValue& value) {
  return std::visit([](const auto& each) { return json(each); }, value);
}

SettingRole role_of(const std::string& name) {
  static const std::map<std::string, SettingRole> roles = {{"", SettingRole::kNone},
                                                           {"iterations", SettingRole::kIterations},
                                                           {"tolerance", SettingRole::kTolerance},
                                                           {"contact_softness", SettingRole::kContactSoftness},
                                                           {"contact_stiffness", SettingRole::kContactStiffness},
                                                           {"contact_damping", SettingRole::kContactDamping},
                                                           {"contact_rebound", SettingRole::kContactRebound}};
  const auto found = roles.find(name);
  if (found == roles.end()) throw std::runtime_error(fmt::format("there is no role '{}' of settings", name));
  return found->second;
}

std::optional<double> number(const json& value) {
  return value.is_null() ? std::nullopt : std::optional<double>(value.get<double>());
}

Setting setting_of(const json& j) {
  Setting setting;
  setting.name = j.at("name");
  setting.default_value = setting_value(j.at("default"), setting.name);
  setting.unit = j.at("unit");
  setting.meaning = j.at("meaning");
  setting.choices = j.at("choices").get<std::vector<std::string>>();
  setting.minimum = number(j.at("minimum"));
  setting.maximum = number(j.at("maximum"));
  setting.role = role_of(j.at("role"));
  setting.only_with = j.at("only_with").get<std::map<std::string, std::string>>();
  return setting;
}

// One of the words of an adapter.
template <typename Value>
Value word(const json& j, const char* name, std::initializer_list<std::pair<const char*, Value>> words) {
  const std::string text = j.at(name);
  std::string known;
  for (const auto& [each, value] : words) {
    if (text == each) return value;
    known += fmt::format("{}'{}'", known.empty() ? "" : ", ", each);
  }
  throw std::runtime_error(fmt::format("'{}' is '{}': give one of {}", name, text, known));
}

Fidelity fidelity_of(const json& j) {
  return word<Fidelity>(
      j, "fidelity",
      {{"exact", Fidelity::kExact}, {"approximated", Fidelity::kApproximated}, {"refused", Fidelity::kRefused}});
}

Capabilities capabilities_of(const json& j) {
  Capabilities c;
  c.precision = word<Precision>(j, "precision", {{"double", Precision::kDouble}, {"single", Precision::kSingle}});
  c.coordinates =
      word<Coordinates>(j, "coordinates", {{"joint", Coordinates::kJoint}, {"maximal", Coordinates::kMaximal}});
  c.springs = word<SpringKind>(
      j, "springs",
      {{"none", SpringKind::kNone}, {"explicit", SpringKind::kExplicit}, {"native", SpringKind::kNative}});
  c.contact_forces = word<ContactForces>(
      j, "contact_forces",
      {{"none", ContactForces::kNone}, {"normal", ContactForces::kNormal}, {"all", ContactForces::kAll}});
  const auto texts =
      std::to_array<std::pair<const char*, std::string*>>({{"integrator", &c.integrator},
                                                           {"joint_solver", &c.joint_solver},
                                                           {"contact_solver", &c.contact_solver},
                                                           {"contact_model", &c.contact_model},
                                                           {"friction_cone", &c.friction_cone},
                                                           {"friction_combine", &c.friction_combine},
                                                           {"spring_note", &c.spring_note},
                                                           {"iterations", &c.iterations},
                                                           {"sleep", &c.sleep},
                                                           {"speed_limits", &c.speed_limits},
                                                           {"hidden_damping", &c.hidden_damping},
                                                           {"other", &c.other},
                                                           {"contact_forces_note", &c.contact_forces_note}});
  for (const auto& [name, text] : texts) *text = j.at(name).get<std::string>();
  const auto flags = std::to_array<std::pair<const char*, bool*>>({{"contact", &c.contact},
                                                                   {"joint_limits", &c.joint_limits},
                                                                   {"torques", &c.torques},
                                                                   {"armature", &c.armature},
                                                                   {"gyroscopic", &c.gyroscopic}});
  for (const auto& [name, flag] : flags) *flag = j.at(name).get<bool>();
  c.order = j.at("order");
  c.threads = j.at("threads");
  for (const json& each : j.at("deviations")) {
    c.deviations.push_back({each.at("test"), each.at("bound"), each.at("reason")});
  }
  if (c.springs == SpringKind::kExplicit && c.spring_note.empty()) {
    describe_springs(c, false, "");
  }
  const json& features = j.at("features");
  std::vector<std::string> known;
  for (const Feature feature : all_features()) {
    const std::string key = feature_key(feature);
    known.push_back(key);
    if (const auto found = features.find(key); found != features.end()) {
      c.features.push_back({feature, fidelity_of(*found), found->at("how")});
    }
  }
  for (const auto& [key, value] : features.items()) {
    if (std::ranges::find(known, key) == known.end()) {
      throw std::runtime_error(
          fmt::format("there is no feature '{}': `assay list engines --features` lists them", key));
    }
  }
  return c;
}

std::map<std::string, SettingValue> values_of(const json& j) {
  std::map<std::string, SettingValue> values;
  for (const auto& [name, value] : j.items()) values[name] = setting_value(value, name);
  return values;
}

}  // namespace

const Capabilities* PythonDeclaration::capabilities_with(const Settings& chosen) const {
  for (const auto& [values, its_own] : capabilities) {
    if (values == chosen.values) return &its_own;
  }
  return nullptr;
}

PythonDeclaration python_declaration(const std::string& text) {
  const json j = json::parse(text);
  PythonDeclaration declaration;
  const json& build = j.at("build");
  declaration.build = {.version = build.at("version"),
                       .source = build.at("source"),
                       .compiler = build.at("compiler"),
                       .flags = build.at("flags")};
  if (!j.at("environment").is_null()) declaration.environment = j.at("environment").get<std::string>();
  declaration.batches = j.at("batches");
  for (const json& each : j.at("settings")) declaration.settings.push_back(setting_of(each));
  for (const json& each : j.at("contenders")) {
    declaration.contenders.push_back(
        {.name = each.at("name"), .summary = each.at("summary"), .set = values_of(each.at("set"))});
  }
  std::map<std::string, SettingValue> defaults;
  for (const Setting& setting : declaration.settings) defaults[setting.name] = setting.default_value;
  const json& capabilities = j.at("capabilities");  // of each contender
  for (size_t i = 0; i < declaration.contenders.size(); ++i) {
    std::map<std::string, SettingValue> values = defaults;
    for (const auto& [name, value] : declaration.contenders[i].set) values.at(name) = value;
    declaration.capabilities.emplace_back(std::move(values), capabilities_of(capabilities.at(i)));
  }
  declaration.files = j.at("files").get<std::vector<std::string>>();
  return declaration;
}

Capabilities python_capabilities(const std::string& text) { return capabilities_of(json::parse(text)); }

std::vector<Limitation> python_limitations(const std::string& text) {
  std::vector<Limitation> limitations;
  for (const json& each : json::parse(text)) {
    limitations.push_back({fidelity_of(each), each.at("element"), each.at("how")});
  }
  return limitations;
}

std::string python_settings(const Settings& settings) {
  json values = json::object();
  for (const auto& [name, value] : settings.values) values[name] = setting_json(value);
  return dump_json(json{{"timestep", settings.timestep}, {"values", values}});
}

}  // namespace assay
