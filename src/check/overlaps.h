// Shapes that overlap, by PairDistances (load/pair_distances.h).
#pragma once

#include <vector>

#include "model/model.h"

namespace assay {

struct Overlap {
  int pair = 0;      // index into Model::contacts
  double depth = 0;  // m, positive: how far the shapes have to move apart
};

// The contact pairs that overlap in `state` by more than `least` (m), deepest first. Of a plane and of a height field
// it is the depth below the surface. Throws InputError with MuJoCo's message for hulls that it does not take.
std::vector<Overlap> overlaps(const Model& model, const State& state, double least);

}  // namespace assay
