// The parts of a model whose joint-space dynamics do not touch: a hundred robots are a hundred small problems.
#pragma once

#include <vector>

#include "model/model.h"

namespace assay {

// Models of the trees that couplings, tendons and actuators do not join, each with `initial` its share of `state`, in
// the order of their first bodies. Shapes, contacts, connects, welds and keyframes are left out.
std::vector<Model> islands(const Model& model, const State& state);

}  // namespace assay
