// Ellipsoids for engines that have none: as polyhedra.
#pragma once

#include "model/model.h"

namespace assay {

// An icosahedron whose faces are divided `subdivisions` times into four, as a polyhedron about the ellipsoid's centre:
// 10 4^n + 2 vertices. It is scaled so that its surface lies as far outside as inside: the distance of a tangent plane
// from the centre is that of the ellipsoid within 0.9 % (n = 2, 162 vertices) or 0.23 % (n = 3, 642), in every
// direction and for any semi-axes (m).
Hull ellipsoid_hull(const Vec3& semi_axes, int subdivisions);

}  // namespace assay
