// A model's shapes as Box3D has them: spheres, capsules, convex hulls, triangle meshes.
#pragma once

#include <vector>

#include "library.h"
#include "model/model.h"
#include "options.h"

namespace assay::box3d {

// Box3D moves the surface of meshes outwards by this (B3_MESH_REST_OFFSET); here their triangles lie as much lower.
inline constexpr double kMeshOffset = 0.005;  // m
// A capsule without more than this between its ends is a sphere in Box3D (b3CreateCapsuleShape).
inline constexpr double kShortestCapsule = 0.005;  // m
// Boxes are at least so thick (b3MakeTransformedBoxHull).
inline constexpr double kThinnestBox = 0.002;  // m
// Smaller triangles of meshes are dropped (b3CreateMesh).
inline constexpr double kSmallestTriangle = 0.01 * 0.005 * 0.005;  // m^2
// Of convex hulls, for each of corners, faces and edges.
inline constexpr int kMostOfHull = 128;

// Makes shapes, and owns the meshes that they point to.
class ShapeMaker {
 public:
  // `size` and `thickness` of the box that stands for a plane, m.
  ShapeMaker(double size, double thickness) : size_(size), thickness_(thickness) {}

  // A shape of the model on Box3D's body, at `X` in the body's frame; planes and height fields at the body's own.
  // Throws EngineError when Box3D refuses it.
  void make(const Model& model, const Shape& shape, const Pose& X, b3BodyId body, const b3ShapeDef& definition);

 private:
  b3ShapeId made(const Model& model, const Shape& shape, const Pose& X, b3BodyId body, const b3ShapeDef& definition);
  b3ShapeId make_surface(const HeightField& field, b3BodyId body, const b3ShapeDef& definition);

  double size_, thickness_;
  std::vector<MeshHandle> meshes_;
};

// The corners of a prism around z that stands for a cylinder: its edges lie as far outside as the middles of its sides
// inside.
std::vector<Vec3> prism_corners(double radius, double half_length);

}  // namespace assay::box3d
