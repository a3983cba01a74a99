// One running simulation of a contender in the user's interpreter.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "arrays.h"
#include "engines/registry.h"
#include "model/model.h"

namespace assay::package {

using Texts = std::map<std::string, std::string>;  // of settings, as in `--set`

// The registry, whose plugins are loaded at the first call. Those that assay brings are trusted, so that a process of
// many threads is not forked; with others on ASSAY_ENGINE_PATH each is tried in a process of its own, as everywhere.
const Registry& registry();

// What the engine does not carry over exactly: (fidelity, element, how).
nb::list limitations(const Model& model, const std::string& contender, const Texts& settings);

// The contender with these settings. Throws InputError.
ResolvedContender contender_of(const std::string& name, const Texts& settings, double timestep_s);

// Every method takes the interpreter's lock from its caller and gives it back while the engine works, but for engines
// in Python. Torques are one number a hinge (Nm) and slide (N).
class [[gnu::visibility("hidden")]] Run {
 public:
  // `state`: as state_of() takes it, or none: the model's initial state.
  Run(std::shared_ptr<const Model> model, const std::string& contender, const Texts& settings, double timestep_s,
      const std::optional<nb::tuple>& state);

  const ResolvedContender& contender() const { return contender_; }
  double timestep_s() const { return contender_.settings.timestep; }
  double time() const { return state_.time; }  // of the last read()

  // Memory of the simulation as arrays: what step() without an argument applies, and what read() writes.
  Array torques() const { return array_of(torques_, {joints()}); }
  Array bodies() const;
  Array position() const { return array_of(position_, {joints()}); }
  Array velocity() const { return array_of(velocity_, {joints()}); }

  void step();
  void step(const nb::object& torques);
  // `count` steps under the torques of torques().
  void advance(long long count);
  void read();

  // States before the first step and after each `every` steps: (time (n,), bodies (n, bodies, 13), position (n,
  // joints), velocity (n, joints)), with n = steps / every + 1. `torques`: an array (steps, joints), or None: as
  // advance().
  nb::tuple rollout(long long steps, long long every, const nb::object& torques);

 private:
  class Alone;  // in the calling thread, without the interpreter's lock where that may be

  size_t joints() const { return model_->joints.size(); }
  // One or more steps; the lock may be gone.
  void take(const double* torques, long long count);
  void read_state();

  std::shared_ptr<const Model> model_;
  Model driven_;  // what the engine has of it
  ResolvedContender contender_;
  bool in_python_, takes_torques_, adds_torques_;
  std::unique_ptr<Simulation> simulation_;
  State state_;
  Memory torques_, bodies_, position_, velocity_;
  std::atomic_flag busy_ = ATOMIC_FLAG_INIT;
};

}  // namespace assay::package
