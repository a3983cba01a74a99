// A policy as control: a network in closed loop at its control period, under the conventions of its configuration.
//
// At the start of each control step the state becomes an observation, the network's answer becomes targets or torques,
// and those act for the engine's steps of one period. PD torques follow from the state at the start of each engine
// step, so every step is taken by itself.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/errors.h"
#include "controls/control.h"
#include "controls/policy_config.h"

namespace assay {

// A run ended because of its policy: an action that is no number, a network that fails.
class PolicyError : public EngineError {
 public:
  using EngineError::EngineError;
};

// Gives the actions of one run, a control step at a time.
class ActionSource {
 public:
  virtual ~ActionSource() = default;
  ActionSource(const ActionSource&) = delete;
  ActionSource& operator=(const ActionSource&) = delete;
  // `observation` has PolicyConfig::inputs() numbers, `actions` one for each action.
  virtual void act(std::span<const double> observation, std::span<double> actions) = 0;

 protected:
  ActionSource() = default;
};

// The observation of one control step without history: terms in order, clipped and scaled. `last_action` has a number
// for each action, `time` is the run's own. `observation` has PolicyConfig::observations() numbers.
void observe(const PolicyConfig& config, const Model& model, const State& state, std::span<const double> last_action,
             double time, std::span<double> observation);

// A run of a policy whose actions come from `source`; `config` and `model` have to outlive it. Throws InputError for a
// period that is no whole number of timesteps.
std::unique_ptr<ControlRun> policy_run(const PolicyConfig& config, const Model& model,
                                       std::unique_ptr<ActionSource> source, double timestep_s);

// How a run under a policy departs from the policy's configuration.
struct PolicyChange {
  int delay = 0;                      // control steps more; fewer where it is negative
  bool without_clamp = false;         // no effort limits
  std::optional<bool> engine_drives;  // in place of the configuration's law
};

// `network` takes the place of the configuration's, "" for that one: an ONNX file (onnx_network.h) or a CSV file of
// recorded actions. Its header has the names of the joints that get actions, in any order; each line after it is a
// control step, and after the last line its actions are held. Throws InputError for what does not fit the robot or the
// file, and for a change that the policy cannot have. The network itself is read by Control::start() and
// Control::rehearse() only.
std::unique_ptr<Control> policy_control(const Model& model, const std::string& config, const std::string& network,
                                        const PolicyChange& change = {});

}  // namespace assay
