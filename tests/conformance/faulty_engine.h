// An engine that is right except for one mistake on purpose: a real engine behind a wrapper that edits what goes in and
// what comes out. It exists to prove that the conformance suite sees such mistakes.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engines/registry.h"

namespace assay {

// What is wrong; every member that is set is applied.
struct Fault {
  std::string name;

  // The engine is given another model, state, timestep or torques than the caller gave.
  std::function<void(Model&)> model = {};
  std::function<void(const Model&, State&)> start = {};
  double timestep_factor = 1;
  std::function<void(std::vector<double>&)> torques = {};

  // What is read is edited.
  std::function<void(const Model&, State&)> read = {};
  bool leaks_instances = false;  // positions change a little with the number of instances
  bool leaks_history = false;    // positions change a little with every read in the process
  bool stale = false;            // bodies and joints of one step ago

  // After every tenth step the motion goes on from an edited state; `before` is `duration` s earlier.
  std::function<void(const State& before, State& after, double duration)> step = {};

  // Calls go wrong.
  bool repeats_torques = false;  // a torque acts in every following step of a batch and beyond
  bool loses_steps = false;      // advance(n) does n - 1 steps for n > 1
  int fails_at_step = -1;        // throws EngineError
  double contact_factor = 1;     // of the impulses of contacts

  std::function<void(Capabilities&)> capabilities = {};
};

// Wraps `contender`, which has to outlive the result.
class FaultyEngine : public Engine {
 public:
  FaultyEngine(const ResolvedContender& contender, Fault fault) : inner_(contender), fault_(std::move(fault)) {}

  std::string name() const override { return inner_.engine->name(); }
  BuildFacts build() const override { return inner_.engine->build(); }
  std::vector<Setting> settings() const override { return inner_.engine->settings(); }
  std::vector<Contender> contenders() const override { return inner_.engine->contenders(); }
  Capabilities capabilities(const Settings& settings) const override;
  std::vector<Limitation> check(const Model& model, const Settings& settings) const override;
  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override;

  // The contender with this engine instead of its own.
  ResolvedContender contender() const;

 private:
  const ResolvedContender& inner_;
  Fault fault_;
};

}  // namespace assay
