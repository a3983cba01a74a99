// The adapter's settings, and which of its three builds this is.
#pragma once

#include <vector>

#include <jolt_world.h>

#include "engines/engine.h"
#include "model/massless.h"

namespace assay::jolt {

#ifdef ASSAY_JOLT_F64
inline constexpr bool kDoublePositions = true;
#else
inline constexpr bool kDoublePositions = false;
#endif
#ifdef ASSAY_JOLT_WASM
inline constexpr bool kWebAssembly = true;
#else
inline constexpr bool kWebAssembly = false;
#endif

// What settings() declares, typed. The meaning of each is in its declaration in options.cc.
struct Options {
  jolt_settings world{};  // all but gravity, which is the model's
  bool native_springs = false;
  double lent_share = kLentShare;
};

std::vector<Setting> declared_settings();
Options read_options(const Settings& settings);

}  // namespace assay::jolt
