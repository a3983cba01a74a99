// Many worlds of an engine that steps one: simulations that know nothing of each other, in one process a core, each
// pinned to its own. Processes, because engines need not be thread-safe.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engines/batch.h"

namespace assay {

class ProcessBatch final : public BatchSimulation {
 public:
  // One world for each of `states`, in at most as many processes as there are processors that this one may use. Throws
  // as Engine::create(); what a process does not survive is a std::runtime_error. This process must not have started
  // the engine: its threads would be missing in the others.
  ProcessBatch(const Engine& engine, const Model& model, std::span<const State> states, Settings settings);
  ~ProcessBatch() override;

  int processes() const { return static_cast<int>(processes_.size()); }

  int worlds() const override { return static_cast<int>(states_.size()); }
  // In new processes.
  void restart(std::span<const State> states) override;
  void set_torques(std::span<const double> torques) override;
  // Of each world one after the other all steps: nothing couples them.
  void advance(int count) override;
  void synchronize() override;
  void read_state(int world, State& out) const override;
  // The memory is what the processes have for themselves alone.
  BatchFacts facts() const override;

 private:
  struct Process;

  void start();

  const Engine& engine_;
  const Model& model_;
  Settings settings_;
  std::vector<State> states_;
  std::vector<std::unique_ptr<Process>> processes_;
  std::vector<Process*> pending_;  // those that have to answer
};

}  // namespace assay
