// How far the surfaces of two sets of shapes are apart.
#pragma once

#include <vector>

#include "model/model.h"

namespace assay::pairing {

// Whether it has a plane or a height field that collides.
bool has_ground(const Model& model);

// Signed distance of a point of the shape's frame from the shape's surface, m, negative inside. Exact; inside of boxes,
// cylinders, ellipsoids and hulls as well. Not of planes and height fields (assert).
double signed_distance(const Model& model, const Shape& shape, const Vec3& p_S);

// Points on the surface of the shape, in its frame: directions spread evenly, edges and corners.
std::vector<Vec3> surface_points(const Model& model, const Shape& shape);

// The largest distance of a point on the outer surface of either set from the other set, m: what of a shape lies within
// another one of its own set does not count. Both sets are in one frame, belong to their models, and are not empty.
// 0 for shapes that are equal one by one.
struct ShapeSet {
  const Model* model = nullptr;
  std::vector<const Shape*> shapes;
};
double surface_distance(const ShapeSet& a, const ShapeSet& b);

}  // namespace assay::pairing
