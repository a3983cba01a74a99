// A simulation written by hand against one engine's own API: what an adapter's cost is measured against.
//
// Each covers what the two systems of the benchmark need (hinges without limits or springs; single capsules on a plane)
// and takes its numbers from the same settings as the adapter, so that both do the same arithmetic and end in the same
// state, bit by bit.
//
// Each is a library of its own that the benchmark loads, so that engines which would clash in one program do not meet:
// direct_<name>.cc ends with ASSAY_DIRECT_LOOP(function, "contender", ...), and CMakeLists.txt has one line for it.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "engines/engine.h"
#include "model/model.h"

namespace assay::benchmarks {

class Direct {
 public:
  virtual ~Direct() = default;
  Direct(const Direct&) = delete;
  Direct& operator=(const Direct&) = delete;

  // `count` steps in a loop around the engine's own step call.
  virtual void run(int count) = 0;

  // The same with `torques` (Nm, one per hinge) set before each step.
  virtual void run_with_torques(std::span<const double> torques, int count) = 0;

  // Centre of mass of every body.
  virtual std::vector<Vec3> positions() const = 0;

 protected:
  Direct() = default;
};

struct Scene {
  std::string path;  // the model's file
  Model model;
};

// What a library offers: the contenders whose settings its loop follows, and how to make one.
struct DirectEntry {
  std::vector<std::string> contenders;
  std::unique_ptr<Direct> (*make)(const Scene& scene, const State& start, const Settings& settings);
};

}  // namespace assay::benchmarks

// Names `function` (of DirectEntry::make's type) as the loop of the contenders that follow. Use once, at global scope.
#define ASSAY_DIRECT_LOOP(function, ...)                                                                            \
  extern "C" __attribute__((visibility("default"))) void assay_direct_loop(assay::benchmarks::DirectEntry* entry) { \
    *entry = {{__VA_ARGS__}, function};                                                                             \
  }
