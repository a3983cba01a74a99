// Engines that step many worlds of one model together on one device: the sibling of engine.h. The class of a plugin
// that can do so derives from Engine and from BatchEngine; batch_engine() finds out. What it computes in each world is
// what Engine::create() computes in one, to rounding: the measure 'batch' compares them.
//
// A device is "cpu" or "cuda:N", the N-th GPU.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "engines/engine.h"

namespace assay {

// What an engine says of a batch, for tables.
struct BatchFacts {
  std::string device;  // a GPU's name as the engine gives it; "" for the processor
  std::string driver;  // of it, "CUDA 12.8"; ""
  Precision precision = Precision::kDouble;
  double memory_bytes = 0;  // that the worlds take on the device, with the engine's own buffers; 0: unknown
  double compile_s = 0;     // of making and compiling what steps this model in so many worlds; 0: nothing is compiled
  std::string overflow;     // buffers that have overflowed, "" for none: synchronize() has thrown then
};

// Worlds of one model that are stepped together. Not thread-safe.
class BatchSimulation {
 public:
  BatchSimulation(const BatchSimulation&) = delete;
  BatchSimulation& operator=(const BatchSimulation&) = delete;
  virtual ~BatchSimulation() = default;

  virtual int worlds() const = 0;

  // Starts all worlds again, each in a state of its own: one a world, as in Engine::create(). Nothing is compiled anew.
  // Outside of any clock.
  virtual void restart(std::span<const State> states) = 0;

  // Input of the following step: worlds x joints numbers, world by world, in the units of Simulation::set_torques().
  // Acts for exactly one step. Only where the engine's capabilities have torques; models whose springs the adapter
  // would have to compute (SpringKind::kExplicit) are refused by create_batch().
  virtual void set_torques(std::span<const double> torques) = 0;

  // `count` steps of all worlds, and nothing else. May return before they are done: synchronize() waits. The clock
  // runs from before advance() until after synchronize().
  virtual void advance(int count) = 0;

  // Waits until all steps are done. Throws EngineError for what the engine reports of them: a contact buffer that was
  // too small for some world is such a failure, with the setting that enlarges it.
  virtual void synchronize() = 0;

  // The state of one world after synchronize(), as Simulation::read_state().
  virtual void read_state(int world, State& out) const = 0;

  virtual BatchFacts facts() const = 0;

 protected:
  BatchSimulation() = default;
};

class BatchEngine {
 public:
  BatchEngine(const BatchEngine&) = delete;
  BatchEngine& operator=(const BatchEngine&) = delete;
  virtual ~BatchEngine() = default;

  // One world for each of `states`. Throws UnsupportedError for what Engine::check() refuses and for a device that the
  // engine cannot use, EngineError when the engine fails.
  virtual std::unique_ptr<BatchSimulation> create_batch(const Model& model, std::span<const State> states,
                                                        const Settings& settings, const std::string& device) const = 0;

 protected:
  BatchEngine() = default;
};

// Null for an engine of one world.
inline const BatchEngine* batch_engine(const Engine* engine) { return dynamic_cast<const BatchEngine*>(engine); }

// ---- devices (device.cc) --------------------------------------------------------------------------------------------

// Throws InputError, one sentence, for a text that is no device and for a GPU that is not there.
void require_device(const std::string& device);

// A GPU's name and the version of its driver; both empty for the processor, which results name anyway.
struct DeviceFacts {
  std::string name, driver;
};
DeviceFacts device_facts(const std::string& device);

}  // namespace assay
