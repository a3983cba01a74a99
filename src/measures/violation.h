// How far a state violates the model's joints, limits and surfaces: geometry of the uniform state, the same for every
// engine. Formulas: docs/methodology.md, "Violation".
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "load/pair_distances.h"
#include "model/model.h"

namespace assay {

// The largest violation of each kind in one state; 0 where the model has no such constraint.
struct Violation {
  double dislocation =
      0;  // m, joint position error: between the two anchors of a hinge or ball joint, off a slide's axis
  double misalignment = 0;  // rad, between the two axes of a hinge; of a slide the relative rotation
  double limit = 0;         // rad, of a hinge's angle or a ball joint's deflection beyond its limit; not of slides
  double penetration = 0;   // m, depth of two shapes of a contact pair in each other
};
Violation violation(const Model& model, const State& state);

// Signed distances of the surfaces of contact pairs, m. Negative for shapes that overlap: of spheres and capsules the
// distance by which they have to move along the line between their axes' nearest points (or the plane's normal) until
// they only touch, in closed form; of all others as PairDistances has it.
class Separations {
 public:
  explicit Separations(const Model& model);

  // False where MuJoCo does not take one of the hulls: pairs without a closed form are infinitely far apart then.
  bool has_all() const { return has_all_; }
  double of(int pair, const State& state) const;  // index into Model::contacts
  double deepest_penetration(const State& state) const;

 private:
  std::vector<Pose> place_shapes(const State& state) const;  // by Model::shapes
  double of(int pair, const std::vector<Pose>& X_WS) const;

  const Model& model_;
  std::unique_ptr<PairDistances> others_;  // null where all pairs have a closed form
  bool has_all_ = true;
};

// Over the samples of a run: the largest violation, and the root mean square of each state's largest with its 95 %
// interval (bootstrap_rms_of_series).
struct ViolationSummary {
  Violation largest, rms, rms_low, rms_high;
  bool has_penetration = true;  // Separations::has_all
};
ViolationSummary violation_summary(const Model& model, const std::vector<State>& states, std::uint64_t seed = 1);

}  // namespace assay
