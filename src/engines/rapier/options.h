// The adapter's settings, read once from assay's Settings.
#pragma once

#include <vector>

#include <assay_rapier.h>

#include "engines/engine.h"
#include "model/massless.h"

namespace assay::rapier {

// Of massless bodies in multibodies.
inline constexpr double kDefaultLinkShare = 1e-5;

// Rapier's functions in one precision and what they are told. The meaning of each setting is in its declaration in
// options.cc.
struct Options {
  bool double_precision = true;
  bool native_springs = false;
  double lent_share = kLentShare;
  RapierOptions world = {};

  bool multibody() const { return world.multibody != 0; }
  const RapierApi& api() const { return double_precision ? assay_rapier_f64 : assay_rapier_f32; }
};

std::vector<Setting> declared_settings();

// `gravity` of the result is left zero: it is the model's.
Options read_options(const Settings& settings);

}  // namespace assay::rapier
