// The model's shapes as PhysX's geometries.
#pragma once

#include <memory>
#include <vector>

#include "library.h"
#include "model/model.h"

namespace assay::px {

// One shape's geometry, and where its frame is in the shape frame.
struct Geometry {
  physx::PxGeometryHolder holder;
  Pose X_SG;
};

// The geometries of a model's shapes and what they point to; it has to live as long as the PxShapes made from them.
class Geometries {
 public:
  // `as_polyhedron`: cylinders are prisms of 64 sides and ellipsoids polyhedra of 80 faces, for height fields, on whose
  // edges PhysX's own ones stumble. Throws EngineError when PhysX makes no mesh.
  Geometry make(const Model& model, const Shape& shape, bool as_polyhedron);

 private:
  Geometry make_hull(const Hull& hull);

  std::vector<Owned<physx::PxConvexMesh>> hulls_;
  std::vector<Owned<physx::PxHeightField>> height_fields_;
  std::vector<std::unique_ptr<physx::PxCustomGeometryCallbacks>> curved_;
};

// How far the surface of the hull that PhysX makes of `hull` is from it, over the hull's largest dimension: PhysX takes
// 255 vertices and 255 faces, and puts a larger hull into a simpler one.
double hull_deviation(const Hull& hull);

}  // namespace assay::px
