// One running instance: a world of Havok's in a module of its own.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engines/engine.h"
#include "module.h"

namespace assay::havok_adapter {

// The settings as set-up needs them; engine.cc declares them.
struct Options {
  explicit Options(const Settings& settings);

  bool native_springs;
  double ideal_step_time;  // s
  double max_speed, max_angular_speed;
  double ground_size, ground_thickness;  // m
};

// The hinge angle at which the constraint's own is zero. Havok knows its own within one turn, so a limited hinge counts
// from the middle of its range; a native spring rests at zero.
double zero_angle(const Hinge& hinge, const Options& options);

std::unique_ptr<Simulation> make_simulation(const Model& model, const State& state, const Settings& settings);

}  // namespace assay::havok_adapter
