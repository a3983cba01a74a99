// One simulation under its control, with the time spent inside the engine's steps.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "controls/control.h"
#include "engines/registry.h"
#include "measures/initial_states.h"
#include "measures/plausible.h"
#include "measures/pushes.h"
#include "model/model.h"

namespace assay {

using Clock = std::chrono::steady_clock;

inline double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// What is simulated, whatever the timestep and the state it starts from.
struct Subject {
  Model model;
  std::unique_ptr<Control> control;
  ResolvedContender contender;
  Capabilities capabilities;  // of the contender's settings
  // The engine computes the control itself: torques are zero (equip_for).
  bool engine_drives = false;
  // No torque is ever applied, neither by the control nor by the adapter for a joint's spring: steps may be taken many
  // at a time.
  bool free_running = true;
  InitialStates states;
  std::optional<Model> unchanged = {};  // the model without the subject's changes, from which `states` are drawn
  Pushes pushes = {};                   // of the model's runs from those
};

// What soundness is judged with.
inline Arithmetic arithmetic_of(const Capabilities& capabilities, double timestep_s) {
  return {capabilities.precision == Precision::kSingle, timestep_s};
}

// The adapter breaks its interface: a state of another model's size, or of another time than was asked for. The text
// begins with "the engine gave".
class AdapterFault : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// What a state that was read `steps` timesteps after `start_s` may not be: throws AdapterFault for another size or
// time, EngineError for values that cannot be.
void examine_state(const State& state, const Model& model, double start_s, double timestep_s, long long steps);

// Every state of one world that the worker reads from an engine is read and examined here.
class Stepper {
 public:
  // Throws UnsupportedError and EngineError as Engine::create does, and InputError as Control::start does. Here and
  // below an engine's InputError or SystemError becomes a std::runtime_error, and a state that cannot be is an
  // AdapterFault, or an EngineError where its shape and time are right: "the engine gave a non-finite number".
  Stepper(const Subject& subject, const State& start, double timestep_s);

  // Takes `steps` steps. The clock runs over the engine's own calls alone. Throws EngineError.
  void advance(long long steps);

  // Goes on from another state of the same moment: the engine is created again, the control goes on. Throws as the
  // constructor does.
  void restart(State from);

  // The state now; the vectors of the same object are reused. Throws as above.
  const State& read();
  // The last one that was read.
  const State& state() const { return state_; }

  // Engine's contacts of the last step (Simulation::read_contacts). Throws as above, also for shapes that the model
  // does not have and numbers that are not finite.
  bool keep_contacts();
  void read_contacts(std::vector<ContactForce>& out) const;

  double engine_s() const { return engine_s_; }  // since construction
  // Seconds since construction that steps with inputs have spent outside the clock: the state that a control reads,
  // torques, a policy's network, and the springs that the adapter computes.
  double input_s() const { return input_s_; }
  long long clock_reads() const { return clock_reads_; }
  ControlAccount account() const { return control_->account(); }

 private:
  void take(long long steps);
  void read_state();
  void create(const State& start);

  const Subject& subject_;
  std::unique_ptr<ControlRun> control_;
  std::unique_ptr<Simulation> simulation_;
  State state_;
  std::vector<double> torques_;
  double start_s_, timestep_s_;
  long long steps_ = 0;
  double engine_s_ = 0, input_s_ = 0;
  long long clock_reads_ = 0;
};

}  // namespace assay
