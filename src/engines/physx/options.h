// The adapter's settings, read once from assay's Settings.
#pragma once

#include <vector>

#include "engines/adapter.h"
#include "model/massless.h"

namespace assay::px {

enum class Joints { kD6, kRevolute, kArticulation };
enum class Friction { kImprovedPatch, kPatch, kOneDirectional, kTwoDirectional };

// Of massless bodies with joints: with less the solver converges too slowly, with more the model differs more.
inline constexpr double kDefaultLentShare = 0.005;

// What settings() declares, typed. The meaning of each is in its declaration in options.cc.
struct Options {
  double timestep = 1e-3;  // s
  Joints joints = Joints::kD6;
  bool tgs = false;
  int position_iterations = 50;
  int velocity_iterations = 1;
  Friction friction = Friction::kImprovedPatch;
  bool friction_every_iteration = false;
  bool native_pd = false;
  bool gyroscopic = true;
  double contact_offset = 0.02;
  double link_cfm = 0;
  double lent_share = kDefaultLentShare;
  ContactCompliance compliance;
  Restitution restitution;
};

std::vector<Setting> declared_settings();
Options read_options(const Settings& settings);

}  // namespace assay::px
