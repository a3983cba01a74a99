// How a campaign may change a model before it is measured.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"

namespace assay {

// Two bodies, or a body and "world".
struct BodyPair {
  std::string a, b;

  bool operator==(const BodyPair&) const = default;
};

struct ModelVariant {
  bool contacts = true;  // false: no contact pairs
  bool gravity = true;
  // The smooth part alone: no contact pairs, limits and dry friction. Where such a model has no closed loops it has a
  // reference solution (measures/reference/smooth.h).
  bool smooth = false;
  // Free bodies are moved along the ground's normal until the lowest shape that may touch a plane of the world is this
  // high above it, m. Negative: as the model has them.
  double above_ground_m = -1;
  // Seeded random rates at the start, uniform within +- this: rad/s of hinges and ball joints, m/s of slides. Joints
  // that a coupling names first follow it. 0: as the model has them.
  double start_rates = 0;
  // Bodies whose contact pairs with each other are left out.
  std::vector<BodyPair> exclude = {};

  bool operator==(const ModelVariant&) const = default;
};

// The changed model, with its hash. Throws InputError for an excluded body that the model does not have.
Model variant_of(Model model, const ModelVariant& variant);

// How high the lowest shape that may touch a plane of the world is above it in the initial state, m; negative for a
// shape that lies in it. Infinite when there is no such pair.
double height_above_ground(const Model& model);

}  // namespace assay
