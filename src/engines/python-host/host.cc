// The host of adapters in Python: one Engine for each adapter that the registry finds. README.md says how.
#include <algorithm>
#include <array>
#include <deque>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/json.h"
#include "batch.h"
#include "engines/adapter.h"
#include "engines/python_host.h"
#include "engines/springs.h"
#include "interpreter.h"
#include "model_json.h"
#include "simulation.h"

namespace assay::python {
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
                                                           {"contact_damping", SettingRole::kContactDamping}};
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

class PythonEngine : public Engine {
 public:
  // `adapter` is the loaded module's engine.
  PythonEngine(std::string name, Object adapter) : name_(std::move(name)), adapter_(std::move(adapter)) {
    const json declared = json::parse(text_of(call("_declaration", "(O)", adapter_.get())));
    environment_ = declared.at("environment");
    const json& build = declared.at("build");
    build_ = {.version = build.at("version"),
              .source = build.at("source"),
              .compiler = build.at("compiler"),
              .flags = build.at("flags")};
    for (const json& each : declared.at("settings")) settings_.push_back(setting_of(each));
    for (const json& each : declared.at("contenders")) {
      Contender contender{.name = each.at("name"), .summary = each.at("summary"), .set = {}};
      for (const auto& [key, value] : each.at("set").items()) contender.set[key] = setting_value(value, key);
      contenders_.push_back(std::move(contender));
    }
  }

  const std::string& environment() const { return environment_; }
  std::string name() const override { return name_; }
  BuildFacts build() const override { return build_; }
  std::vector<Setting> settings() const override { return settings_; }
  std::vector<Contender> contenders() const override { return contenders_; }

  Capabilities capabilities(const Settings& settings) const override {
    return capabilities_of(
        json::parse(text_of(call("_capabilities", "(Os)", adapter_.get(), settings_text(settings).c_str()))));
  }

  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    const Capabilities c = capabilities(settings);
    std::vector<Limitation> limitations = feature_limitations(name_, model, c, settings);
    for (const Joint& joint : model.joints) {
      if (joint.armature != 0 && !c.armature) limitations.push_back(armature_refused(joint, name_.c_str()));
      if (joint.limited && !c.joint_limits) {
        limitations.push_back({Fidelity::kRefused, joint_element(joint, "range"),
                               fmt::format("{} has no joint limits: leave it out or choose another engine", name_)});
      }
      if (!joint.has_spring()) continue;
      if (c.springs == SpringKind::kNone) {
        limitations.push_back({Fidelity::kRefused, joint_element(joint, "stiffness and damping"),
                               fmt::format("{} has no joint springs: choose another engine", name_)});
      } else {
        limitations.push_back(
            c.springs == SpringKind::kExplicit
                ? explicit_spring(joint)
                : Limitation{Fidelity::kApproximated, joint_element(joint, "stiffness and damping"), c.spring_note});
      }
    }
    if (!model.contacts.empty() && !c.contact) {
      limitations.push_back({Fidelity::kRefused, "contacts",
                             fmt::format("{} has no contacts: use --contacts off or another engine", name_)});
    }
    const json own = json::parse(
        text_of(call("_check", "(OOs)", adapter_.get(), python_model(model), settings_text(settings).c_str())));
    for (const json& each : own) limitations.push_back({fidelity_of(each), each.at("element"), each.at("how")});
    return limitations;
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    require_supported(model, settings);
    StateRows start;
    start.add(model, state);
    Object made =
        call("_create", "(OOdNNNNs)", adapter_.get(), python_model(model), state.time, memory(start.bodies),
             memory(start.position), memory(start.velocity), memory(start.balls), settings_text(settings).c_str());
    return std::make_unique<PythonSimulation>(name_, model, capabilities(settings), state.time, settings.timestep,
                                              std::move(made));
  }

 protected:
  std::unique_ptr<BatchSimulation> batch_of(const Model& model, std::span<const State> states, const Settings& settings,
                                            const std::string& device) const {
    require_supported(model, settings);
    const Capabilities c = capabilities(settings);
    if (adapter_adds_torques(model, c)) {
      throw UnsupportedError(
          fmt::format("{}: joint springs of this model are torques of the adapter, which a batch does "
                      "not compute",
                      name_));
    }
    Object made = call("_create_batch", "(OOiss)", adapter_.get(), python_model(model), static_cast<int>(states.size()),
                       settings_text(settings).c_str(), device.c_str());
    return std::make_unique<PythonBatch>(name_, model, c, states, settings.timestep, std::move(made));
  }

 private:
  // What Python can read until the call that gets it returns.
  static PyObject* memory(const std::vector<double>& values) {
    static constexpr double kNothing = 0;
    const double* data = values.empty() ? &kNothing : values.data();
    return PyMemoryView_FromMemory(const_cast<char*>(reinterpret_cast<const char*>(data)),
                                   static_cast<Py_ssize_t>(values.size() * sizeof(double)), PyBUF_READ);
  }

  static std::string settings_text(const Settings& settings) {
    json values = json::object();
    for (const auto& [name, value] : settings.values) values[name] = setting_json(value);
    return dump_json(json{{"timestep", settings.timestep}, {"values", values}});
  }

  // Borrowed. Campaigns create simulations of one model hundreds of times.
  PyObject* python_model(const Model& model) const {
    constexpr size_t kMost = 8;
    const std::string key = model_hash(model);  // copies may differ from what Model::hash was made of
    const auto found = std::ranges::find(models_, key, &std::pair<std::string, Object>::first);
    if (found != models_.end()) return found->second.get();
    models_.emplace_back(key, call("_model", "(s)", model_json(model).c_str()));
    if (models_.size() > kMost) models_.pop_front();
    return models_.back().second.get();
  }

  std::string name_, environment_;
  Object adapter_;
  BuildFacts build_;
  std::vector<Setting> settings_;
  std::vector<Contender> contenders_;
  mutable std::deque<std::pair<std::string, Object>> models_;
};

// Of an adapter that has create_batch().
class PythonBatchEngine final : public PythonEngine, public BatchEngine {
 public:
  using PythonEngine::PythonEngine;

  std::unique_ptr<BatchSimulation> create_batch(const Model& model, std::span<const State> states,
                                                const Settings& settings, const std::string& device) const override {
    return batch_of(model, states, settings, device);
  }
};

Engine* engine_of(const std::string& name, const std::string& path) {
  Object adapter = call("_load", "(ss)", path.c_str(), name.c_str());
  const bool many = PyObject_IsTrue(call("_has_batches", "(O)", adapter.get()).get()) == 1;
  if (many) return new PythonBatchEngine(name, std::move(adapter));
  return new PythonEngine(name, std::move(adapter));
}

}  // namespace
}  // namespace assay::python

extern "C" __attribute__((visibility("default"))) assay::PythonHost assay_python_host() {
  return {
      assay::kPluginVersion,
      [](const std::string& name, const std::string& path) -> assay::Engine* {
        return assay::python::engine_of(name, path);
      },
      [](const assay::Engine& made) { return static_cast<const assay::python::PythonEngine&>(made).environment(); }};
}
