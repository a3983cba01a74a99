// What a rotational inertia may be, and parts joined to one rigid body.
#pragma once

#include "model/geometry.h"

namespace assay {

// A part of a rigid body, in the body's axes.
struct RigidPart {
  double mass = 0;        // kg
  Vec3 p = Vec3::Zero();  // centre of mass, m
  Mat3 I = Mat3::Zero();  // about that centre, kg m^2
};

RigidPart joined(const RigidPart& a, const RigidPart& b);

// Eigenvalues in ascending order.
Vec3 principal_moments(const Mat3& I);

// Positive, and no principal moment exceeds the sum of the two others (with a margin for rounding): what engines need.
bool inertia_valid(const Mat3& I);
// The same with zeros allowed: the inertia of a point or a line of mass, which is valid as a part of a body.
bool inertia_possible(const Mat3& I);

// A valid inertia with the same principal axes: moments that are too small are raised to a millionth of the largest
// (without any, to those of a ball of water of that mass), then a broken triangle inequality is mended by the
// least squares change of the moments. The result keeps a margin, so that it stays valid when it is written as text.
Mat3 nearest_valid_inertia(const Mat3& I, double mass);

}  // namespace assay
