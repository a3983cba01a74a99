// One running instance: a world of Havok's in a module of its own.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engines/engine.h"
#include "module.h"

namespace assay::havok_adapter {

// The settings as set-up needs them; options.cc declares them.
struct Options {
  explicit Options(const Settings& settings);

  bool native_springs;
  double ideal_step_time;  // s
  double max_speed, max_angular_speed;
  double ground_size, ground_thickness;  // m
};

std::unique_ptr<Simulation> make_simulation(const Model& model, const State& state, const Settings& settings);

}  // namespace assay::havok_adapter
