// How far a state violates the model's joints, limits and surfaces: geometry of the uniform state, the same for every
// engine. Formulas: docs/methodology.md, "Violation".
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
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
  double added = 0;         // m, that depth less the one in which the run started
};
inline constexpr auto kViolationKinds = std::to_array<double Violation::*>(
    {&Violation::dislocation, &Violation::misalignment, &Violation::limit, &Violation::penetration, &Violation::added});
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
  // The largest depth of a pair, and the largest by which one exceeds its own of `before` (by Model::contacts; empty:
  // 0), m.
  struct Depth {
    double whole = 0, added = 0;
  };
  Depth deepest(const State& state, const std::vector<double>& before = {}) const;
  // Of each pair, by Model::contacts; 0 for those that do not overlap.
  std::vector<double> depths(const State& state) const;

 private:
  std::vector<Pose> place_shapes(const State& state) const;  // by Model::shapes
  double of(int pair, const std::vector<Pose>& X_WS) const;

  const Model& model_;
  std::unique_ptr<PairDistances> others_;  // null where all pairs have a closed form
  bool has_all_ = true;
};

// Over states of a run: the largest violation, and the root mean square of each state's largest with its 95 % interval
// (bootstrap_rms_of_series).
struct ViolationSummary {
  Violation largest, rms, rms_low, rms_high;
  bool has_penetration = true;  // Separations::has_all
};

class ViolationSeries {
 public:
  // `start` is where the run starts. The model has to stay.
  ViolationSeries(const Model& model, const State& start);

  void add(const State& state);
  ViolationSummary summary(std::uint64_t seed) const;  // of at least one state (assert)

 private:
  const Model& model_;
  Separations separations_;
  std::vector<double> before_;  // depths of pairs at the start
  std::vector<Violation> of_states_;
};

// What questions allow a contact to give way beyond the start's overlap unless they say otherwise, m: at most 5 mm and
// 5 % of the thickness of the thinnest shape that can touch another, but at least 1 mm. Absent where none can.
std::optional<double> usual_penetration_limit(const Model& model);

}  // namespace assay
