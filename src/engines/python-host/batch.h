// Many worlds of an adapter in Python that steps them together.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "engines/batch.h"
#include "interpreter.h"
#include "simulation.h"

namespace assay::python {

// The states of several worlds as flat rows, each world's bodies, joints and ball joints after those of the world
// before.
struct StateRows {
  std::vector<double> bodies, position, velocity, balls;

  void add(const Model& model, const State& state);
};

class PythonBatch final : public BatchSimulation {
 public:
  // `made` is what the adapter's create_batch() gave: its worlds have no state yet.
  PythonBatch(std::string engine, const Model& model, const Capabilities& capabilities, std::span<const State> states,
              double timestep, Object made);

  int worlds() const override { return static_cast<int>(start_.size()); }
  void restart(std::span<const State> states) override;
  void set_torques(std::span<const double> torques) override;
  void advance(int count) override;
  void synchronize() override;
  void read_state(int world, State& out) const override;
  BatchFacts facts() const override;

 private:
  Object required(const char* name) const;
  template <typename... Arguments>
  Object inside(const Object& callee, const Arguments&... arguments) const;
  void give_torques();
  void take(int count);

  std::string engine_;
  Model model_;
  StateForm form_;
  Precision precision_;
  bool loaded_ = false, fresh_ = false;  // the engine has torques; they are for the next step
  double timestep_;
  long long steps_ = 0;
  std::vector<double> start_;    // s, of each world
  std::vector<double> torques_;  // what torques_array_ shows to Python
  mutable std::vector<std::vector<double>> last_angles_;
  Object made_, advance_, synchronize_, restart_, read_state_, set_torques_, torques_array_;
};

}  // namespace assay::python
