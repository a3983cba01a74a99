// The host of adapters in Python: one Engine for each adapter that the registry finds. README.md says how.
#include <algorithm>
#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "batch.h"
#include "engines/adapter.h"
#include "engines/python_declaration.h"
#include "engines/python_host.h"
#include "engines/springs.h"
#include "interpreter.h"
#include "model_json.h"
#include "simulation.h"

namespace assay::python {
namespace {

class PythonEngine : public Engine {
 public:
  // `adapter` is the loaded module's engine.
  PythonEngine(std::string name, Object adapter) : name_(std::move(name)), adapter_(std::move(adapter)) {
    declared_ = python_declaration(text_of(call("_declaration", "(O)", adapter_.get())));
  }

  std::string name() const override { return name_; }
  BuildFacts build() const override { return declared_.build; }
  std::vector<Setting> settings() const override { return declared_.settings; }
  std::vector<Contender> contenders() const override { return declared_.contenders; }

  Capabilities capabilities(const Settings& settings) const override {
    if (const Capabilities* declared = declared_.capabilities_with(settings)) return *declared;
    return python_capabilities(capabilities_text(settings));
  }

  std::string capabilities_text(const Settings& settings) const {
    return text_of(call("_capabilities", "(Os)", adapter_.get(), python_settings(settings).c_str()));
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
    const std::vector<Limitation> own = python_limitations(
        text_of(call("_check", "(OOs)", adapter_.get(), python_model(model), python_settings(settings).c_str())));
    limitations.insert(limitations.end(), own.begin(), own.end());
    return limitations;
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    require_supported(model, settings);
    StateRows start;
    start.add(model, state);
    Object made =
        call("_create", "(OOdNNNNs)", adapter_.get(), python_model(model), state.time, memory(start.bodies),
             memory(start.position), memory(start.velocity), memory(start.balls), python_settings(settings).c_str());
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
                       python_settings(settings).c_str(), device.c_str());
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

  std::string name_;
  Object adapter_;
  PythonDeclaration declared_;
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

Engine* engine_of(const std::string& name, const std::string& path, const std::string& environment) {
  Object adapter = call("_load", "(sss)", path.c_str(), name.c_str(), environment.c_str());
  const bool many = PyObject_IsTrue(call("_has_batches", "(O)", adapter.get()).get()) == 1;
  if (many) return new PythonBatchEngine(name, std::move(adapter));
  return new PythonEngine(name, std::move(adapter));
}

}  // namespace
}  // namespace assay::python

extern "C" __attribute__((visibility("default"))) assay::PythonHost assay_python_host() {
  return {assay::kPluginVersion,
          [](const std::string& name, const std::string& path) -> std::string {
            return assay::python::text_of(assay::python::call("_declare", "(ss)", path.c_str(), name.c_str()));
          },
          [](const std::string& name, const std::string& path, const std::string& environment) -> assay::Engine* {
            return assay::python::engine_of(name, path, environment);
          },
          [](const assay::Engine& made, const assay::Settings& settings) -> std::string {
            return static_cast<const assay::python::PythonEngine&>(made).capabilities_text(settings);
          }};
}
