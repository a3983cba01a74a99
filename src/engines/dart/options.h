// The adapter's settings, read once from assay's Settings.
#pragma once

#include <vector>

#include "engines/adapter.h"

namespace assay::dartsim {

// What settings() declares, typed. The meaning of each is in its declaration in options.cc.
struct Options {
  double timestep = 1e-3;  // s
  bool pgs = false;
  int pgs_iterations = 50;
  double pgs_tolerance = 1e-3;
  double contact_erp = 0.2;
  double contact_max_correcting_velocity = 0;  // m/s; 0: none
  double contact_cfm = 1e-5, limit_cfm = 1e-9;
  double limit_max_correcting_velocity = 0;  // rad/s, m/s; 0: none
  bool along_slip = true;
  Restitution restitution = {};
  bool native_pd = true;
};

std::vector<Setting> declared_settings();
Options read_options(const Settings& settings);

}  // namespace assay::dartsim
