// What tests of single adapters share: a simulation of a model as it starts, its state, a hinge.
#pragma once

#include <memory>

#include "engines/registry.h"

namespace assay {

inline std::unique_ptr<Simulation> create(const Model& model, const ResolvedContender& contender) {
  return contender.engine->create(model, model.initial, contender.settings);
}

inline State state_of(const Simulation& simulation) {
  State state;
  simulation.read_state(state);
  return state;
}

// About the y axis.
inline Joint make_hinge(int body) {
  Joint hinge;
  hinge.name = "hinge";
  hinge.body = body;
  hinge.axis_B = Vec3::UnitY();
  return hinge;
}

}  // namespace assay
