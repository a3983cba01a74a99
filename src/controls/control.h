// Joint torques as a function of time and state. Every engine gets the same torques. Springs and dampers of joints are
// part of the model, not of a control: the engine or its adapter applies them.
#pragma once

#include <array>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "model/actuator_force.h"
#include "model/model.h"
#include "model/state.h"

namespace assay {

// The part of the state that a control reads. A runner need not read more from the engine before each step.
enum class ControlInput {
  kNothing,  // constant torques
  kTime,     // only State::time
  kState,    // time, angles and rates
};

// What a run's control has done so far.
struct ControlAccount {
  long long policy_steps = 0;  // of a policy
  double policy_s = 0;         // that they took, outside the engine's clock
  double work = 0;  // J, of the torques that were asked for: the sum of |torque rate| h over steps and joints
};

// One run under a control, from its first step on: what the control remembers of it.
class ControlRun {
 public:
  virtual ~ControlRun() = default;
  ControlRun(const ControlRun&) = delete;
  ControlRun& operator=(const ControlRun&) = delete;

  // Torques that are held during the step that begins in `state`, as Control::torques. Called once a step, in order.
  // May throw PolicyError (policy.h).
  virtual void torques(const State& state, std::span<double> torques) = 0;

  virtual ControlAccount account() const { return {}; }

 protected:
  ControlRun() = default;
};

struct PolicyConfig;

// Immutable. But for a policy, which a ControlRun of its own remembers, equal states give equal torques, so a run can
// be continued from any state.
class Control {
 public:
  virtual ~Control() = default;
  Control(const Control&) = delete;
  Control& operator=(const Control&) = delete;

  // Torques in `state`: one per hinge, Nm, about the hinge's axis on the child. `torques` has one entry per hinge and
  // is overwritten. Of a control with memory: those of a run that begins in `state`.
  virtual void torques(const State& state, std::span<double> torques) const = 0;

  // A run with steps of `timestep_s`. Throws InputError where check_timestep() does, and for a policy's network that
  // does not fit it.
  virtual std::unique_ptr<ControlRun> start(double timestep_s) const;

  // Whether torques depend on more than the state: the run must then start where the control's does.
  virtual bool has_memory() const { return false; }

  // Throws InputError for a timestep with which the control cannot go.
  virtual void check_timestep(double /*timestep_s*/) const {}

  // Reads the stranger's files that only a run needs, so that a process with limits can find out what they do. Throws
  // InputError.
  virtual void rehearse() const {}

  // Adds to the model what of the control the engine itself computes: the springs and dampers of drives.
  virtual void equip(Model& /*model*/) const {}

  // The largest torque of each joint, where the control knows it without a state; else nothing.
  virtual std::optional<std::vector<double>> largest_torques() const { return std::nullopt; }

  // What a policy is to do; null for other controls.
  virtual const PolicyConfig* policy() const { return nullptr; }

  virtual ControlInput input() const = 0;

  // True when every torque is always zero, so that a runner may skip set_torques().
  virtual bool is_zero() const = 0;

  // "sine, 2 Nm, 1 Hz": for manifests.
  virtual std::string description() const = 0;

 protected:
  Control() = default;
};

// Torques that are held during the step of `timestep_s` that begins in `state`: the one rule for all engines. A control
// that reads only the time is asked at the middle of the step, because torques of the step's start would be an error of
// first order whatever the engine's method; one that reads the state knows that of the start.
void torques_of_step(const Control& control, const State& state, double timestep_s, std::span<double> torques);

// No torque.
std::unique_ptr<Control> passive_control();

// One sine per hinge, amplitudes in Nm. Throws std::invalid_argument when their number is not the model's number of
// hinges (a bug).
std::unique_ptr<Control> sine_control(const Model& model, std::vector<Sine> sines);

// The model's actuators with controls of their own, one per actuator, each plus its actuator's sine: motors give a
// torque, position actuators an explicit PD torque toward their set-point. An empty `control` means Model::control0.
std::unique_ptr<Control> actuator_control(const Model& model, std::vector<double> control = {});

// A control as campaigns and users name it.
struct ControlSpec {
  std::string kind = "actuators";  // one of control_kinds()
  double amplitude = 1;
  double frequency = 1;
  double phase_step = 2 * std::numbers::pi / 5;
  double natural_frequency = 0;  // 0: as stiff as hold.h says
  double motion = 0.3;
  double seed = 1;
  std::string file = {};     // file: path of a CSV file of torques (torque_file.h)
  std::string policy = {};   // policy: path of its configuration (policy_config.h)
  std::string network = {};  // policy: path of an ONNX or CSV file in place of the configuration's
};
// The numbers of a control, as users and files name them, and the kind that has them.
struct ControlPart {
  const char* kind;
  const char* name;
  double ControlSpec::* member;
  const char* meaning;
};
inline constexpr std::array<ControlPart, 6> kControlParts = {
    {{"sine", "amplitude", &ControlSpec::amplitude, "Nm, at every hinge"},
     {"sine", "frequency", &ControlSpec::frequency, "Hz, at every hinge"},
     {"sine", "phase_step", &ControlSpec::phase_step, "rad from one hinge to the next"},
     {"hold", "natural_frequency", &ControlSpec::natural_frequency, "Hz; 0: as stiff as is stable"},
     {"random", "motion", &ControlSpec::motion, "rad (slides: m) that a free joint would move about"},
     {"random", "seed", &ControlSpec::seed, "a whole number"}}};

// "passive": no torque. "sine": one at every hinge. "actuators": the model's own, with their sines. "hold": a PD that
// holds the start pose (hold.h). "random": seeded sums of sines (hold.h). "file": torques of a CSV file
// (torque_file.h). "policy": a network in closed loop (policy_config.h).
std::vector<std::string> control_kinds();

// A control as one word: its kind, and its parameters: "passive", "sine,amplitude=2,frequency=1,phase_step=0.5",
// "random,seed=3", "file,path=torques.csv", "policy,config=policy.toml,network=policy.onnx". parse_control() is the
// inverse; parameters that have a default may be left out, and a word that ends in .csv is a file's path. It throws
// InputError for an unknown parameter; make_control() checks the kind.
std::string control_text(const ControlSpec& spec);
ControlSpec parse_control(const std::string& text);

// Throws InputError for an unknown kind (with the nearest name), values that are not finite, and a file that cannot be
// used.
std::unique_ptr<Control> make_control(const Model& model, const ControlSpec& spec);

}  // namespace assay
