// The adapter's settings, read once from assay's Settings.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engines/adapter.h"
#include "model/massless.h"

namespace assay::ode {

inline constexpr int kMaxContacts = 8;     // per pair; spheres and capsules never need more than 2
inline constexpr int kFoundContacts = 64;  // of a pair with faces, of which the adapter keeps the most apart

// What settings() declares, typed. The meaning of each is in its declaration in options.cc.
struct Options {
  double timestep = 1e-3;  // s
  bool exact = false;
  int iterations = 50;
  double over_relaxation = 1.3;
  std::uint32_t seed = 0;
  double erp = 0.2, cfm = 1e-10, limit_erp = 0.2, limit_cfm = 1e-10;
  bool native_springs = false;
  double contact_erp = 0.2, contact_cfm = 1e-10;
  double max_correcting_velocity = 0;  // m/s; 0: no cap
  double surface_layer = 0;            // m
  bool along_slip = false;
  int max_contacts = 4;
  std::string broadphase = "sap";
  double lent_share = kLentShare;
  ContactCompliance compliance = {};
  Restitution restitution = {};
  bool ignore_lcp_failures = false, finite_rotation = false, gyroscopic = true;
};

std::vector<Setting> declared_settings();
Options read_options(const Settings& settings);

}  // namespace assay::ode
