// How far a state is from what the model's joints, limits and surfaces allow: geometry in closed form from the uniform
// state, the same for every engine. Formulas: docs/methodology.md, "Violation".
#pragma once

#include <cstdint>
#include <vector>

#include "model/model.h"

namespace assay {

// The worst of each kind in one state; 0 where the model has none of it.
struct Violation {
  double dislocation = 0;   // m, between the two anchors of a hinge
  double misalignment = 0;  // rad, between the two axes of a hinge
  double limit = 0;         // rad, of an angle beyond its limit
  double penetration = 0;   // m, depth of two shapes of a contact pair in each other
};
Violation violation(const Model& model, const State& state);

// Signed distance of the surfaces of a pair, m; negative inside each other: then it is how far the shapes have to be
// moved along the line of their axes' nearest points (or the plane's normal) until they touch.
double separation(const Model& model, const State& state, const ContactPair& pair);

// Over the samples of a run: the largest, and the root of the mean square with its 95 % interval
// (bootstrap_rms_of_series), of each state's worst.
struct ViolationSummary {
  Violation largest, rms, rms_low, rms_high;
};
ViolationSummary violation_summary(const Model& model, const std::vector<State>& states, std::uint64_t seed = 1);

}  // namespace assay
