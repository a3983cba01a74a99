// One world of Rapier as a Simulation.
#pragma once

#include <memory>

#include "engines/engine.h"
#include "options.h"

namespace assay::rapier {

std::unique_ptr<Simulation> make_simulation(const Model& model, const State& state, const Options& options);

}  // namespace assay::rapier
