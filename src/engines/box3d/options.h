// The adapter's settings, read once from assay's Settings, and which of its two builds this is.
#pragma once

#include <vector>

#include "engines/adapter.h"
#include "model/massless.h"

namespace assay::box3d {

#ifdef BOX3D_DOUBLE_PRECISION
inline constexpr bool kDoublePositions = true;
#else
inline constexpr bool kDoublePositions = false;
#endif

// What settings() declares, typed. The meaning of each is in its declaration in options.cc.
struct Options {
  double timestep = 1e-3;  // s
  int sub_steps = 4;
  double contact_hertz = 200, contact_damping_ratio = 10, contact_speed = 3;
  double joint_hertz = 1e6, joint_damping_ratio = 2;
  bool native_springs = false;
  bool warm_start = true, contact_recycling = false, continuous = false;
  double ground_size = 100, ground_thickness = 10;
  double lent_share = kLentShare;
  Restitution restitution;
};

std::vector<Setting> declared_settings();
Options read_options(const Settings& settings);

}  // namespace assay::box3d
