// The adapter's settings, read once from assay's Settings.
#pragma once

#include <vector>

#include "engines/adapter.h"
#include "model/massless.h"

namespace assay::havok_adapter {

// What settings() declares, typed. The meaning of each is in its declaration in options.cc.
struct Options {
  double timestep = 1e-3;  // s
  bool native_springs = false;
  double ideal_step_time = 0;                       // s
  double max_speed = 1e6, max_angular_speed = 1e6;  // m/s, rad/s
  double lent_share = kLentShare;
  Restitution restitution = {};
  double ground_size = 1000, ground_thickness = 10;  // m
};

std::vector<Setting> declared_settings();
Options read_options(const Settings& settings);

}  // namespace assay::havok_adapter
