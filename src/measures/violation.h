// How far a state violates the model's joints, limits and surfaces: closed-form geometry of the uniform state, the same
// for every engine. Formulas: docs/methodology.md, "Violation".
#pragma once

#include <cstdint>
#include <vector>

#include "model/model.h"

namespace assay {

// The largest violation of each kind in one state; 0 where the model has no such constraint.
struct Violation {
  double dislocation =
      0;  // m, joint position error: between the two anchors of a hinge or ball joint, off a slide's axis
  double misalignment = 0;  // rad, between the two axes of a hinge; of a slide the relative rotation
  double limit = 0;         // rad, of a hinge's angle or a ball joint's deflection beyond its limit; not of slides
  double penetration = 0;   // m, depth of two shapes of a contact pair in each other; solids count against planes
};
Violation violation(const Model& model, const State& state);

// How far the shape reaches from the origin of its frame in the direction `n`, a unit vector in the shape frame, m.
// Minus infinity for a plane and a height field.
double shape_reach(const Model& model, const Shape& shape, const Vec3& n);

// Signed distance of the surfaces of a pair, m. Negative for shapes that overlap: the distance by which they have to
// move along the line between their axes' nearest points (or the plane's normal) until they only touch. Infinite for a
// box, cylinder, ellipsoid, hull or height field and anything but a plane.
double separation(const Model& model, const State& state, const ContactPair& pair);

// Over the samples of a run: the largest violation, and the root mean square of each state's largest with its 95 %
// interval (bootstrap_rms_of_series).
struct ViolationSummary {
  Violation largest, rms, rms_low, rms_high;
};
ViolationSummary violation_summary(const Model& model, const std::vector<State>& states, std::uint64_t seed = 1);

}  // namespace assay
