// One running instance: a world of Havok's in a module of its own.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engines/engine.h"
#include "module.h"
#include "options.h"

namespace assay::havok_adapter {

// The hinge angle at which the constraint's own is zero. Havok knows its own within one turn, so a limited hinge counts
// from the middle of its range; a native spring rests at zero.
double zero_angle(const Joint& hinge, const Options& options);

std::unique_ptr<Simulation> make_simulation(const Model& model, const State& state, const Options& options);

}  // namespace assay::havok_adapter
