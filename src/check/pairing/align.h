// The second model in the frames of the first. What two files call a body's frame is a convention; where a joint's
// line, a centre of mass and the next joints lie relative to each other is not.
#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "check/pairing/match.h"
#include "model/model.h"

namespace assay::pairing {

// Differences up to these are taken for rounding of files: they have some four to six digits.
inline constexpr double kRoundingLength = 2e-5;    // m
inline constexpr double kRoundingAngle = 3.5e-4;   // rad, 0.02 degrees
inline constexpr double kRoundingRelative = 5e-4;  // of masses, inertias, gains

// The angle of a rotation, at most pi, rad.
inline double angle_of(const Quat& q) { return 2 * std::atan2(q.vec().norm(), std::abs(q.w())); }

// Of two models whose trees are the same.
struct Placement {
  std::vector<int> b_of;  // by A's body, and a_of by B's
  std::vector<int> a_of;
  Pose X_world;                // what is p in B's world is X_world * p in A's
  std::vector<Pose> X_AB;      // by A's body: the frame of B's body in it
  std::vector<bool> reversed;  // by A's body: the axes of its joint point in opposite directions
};

// Of all ways to lay B's bodies over A's that are tried (their frames are one, they lie where they lie at 0, their
// joints' lines are one, the best fit of joints and centres of mass), body by body from the roots the one that leaves
// the fewest quantities different. So a frame that two files choose differently makes no difference, and a joint that
// was moved makes one and not one for each body behind it.
Placement placed(const Model& a, const Model& b, const std::vector<int>& b_of);

// B with A's bodies and joints: their indices, frames, signs and names.
Model in_frames_of(const Model& a, const Model& b, const Placement& placement);

// The rigid motion that takes `from` to `to` with the least sum of distances, or nothing for fewer than three points.
std::optional<Pose> best_fit(const std::vector<Vec3>& from, const std::vector<Vec3>& to);

}  // namespace assay::pairing
