#include "shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <utility>

#include "base/errors.h"
#include "convert.h"
#include "model/ellipsoid.h"
#include "plugin.h"

namespace assay::px {

using namespace physx;

namespace {

struct Box {
  Vec3 centre = Vec3::Zero();
  double half = 0;  // of the longest edge
};
Box bounding_box(const Hull& hull) {
  Vec3 low = hull.vertices.front(), high = low;
  for (const Vec3& vertex : hull.vertices) {
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  return {(low + high) / 2, (high - low).maxCoeff() / 2};
}

// The hull about the origin and 2 m large, because PhysX's tolerances for making it are lengths.
Owned<PxConvexMesh> cook(const Hull& hull, const Box& box) {
  std::vector<PxVec3> points;
  points.reserve(hull.vertices.size());
  for (const Vec3& vertex : hull.vertices) points.push_back(to_px((vertex - box.centre) / box.half));
  PxConvexMeshDesc description;
  description.points = {};
  description.points.count = static_cast<PxU32>(points.size());
  description.points.stride = sizeof(PxVec3);
  description.points.data = points.data();
  description.flags = PxConvexFlag::eCOMPUTE_CONVEX;
  const PxCookingParams parameters(sdk().getTolerancesScale());
  Owned<PxConvexMesh> mesh(PxCreateConvexMesh(parameters, description, sdk().getPhysicsInsertionCallback()));
  if (mesh == nullptr) throw EngineError("PhysX made no hull of mesh '" + hull.name + "': " + take_complaint());
  return mesh;
}

// PhysX's heights are integers of 16 bits over x (rows) and z (columns), y is up.
Owned<PxHeightField> make_height_field(const HeightField& field, double unit) {
  std::vector<PxHeightFieldSample> samples(field.heights.size());
  for (size_t i = 0; i < samples.size(); ++i) {
    samples[i].height = static_cast<PxI16>(std::lround(field.heights[i] / unit));
    samples[i].materialIndex0 = 0;  // without its flag the diagonal runs between the other two corners
    samples[i].materialIndex1 = 0;
  }
  PxHeightFieldDesc description;
  description.nbRows = static_cast<PxU32>(field.rows);
  description.nbColumns = static_cast<PxU32>(field.columns);
  description.samples.data = samples.data();
  description.samples.stride = sizeof(PxHeightFieldSample);
  Owned<PxHeightField> made(PxCreateHeightField(description, sdk().getPhysicsInsertionCallback()));
  if (made == nullptr) throw EngineError("PhysX made no height field '" + field.name + "': " + take_complaint());
  return made;
}

// A cylinder as a prism, as far outside of it as inside.
Hull prism(const Shape& cylinder) {
  constexpr int kSides = 64;
  const double radius = cylinder.radius * 2 / (1 + std::cos(std::numbers::pi / kSides));
  Hull hull{.name = cylinder.name, .vertices = {}, .faces = {}};
  for (int side = 0; side < kSides; ++side) {
    const double angle = 2 * std::numbers::pi * side / kSides;
    for (const double z : {-cylinder.half_length, cylinder.half_length}) {
      hull.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  }
  return hull;
}

}  // namespace

Geometry Geometries::make_hull(const Hull& hull) {
  const Box box = bounding_box(hull);
  hulls_.push_back(cook(hull, box));
  return {PxGeometryHolder(PxConvexMeshGeometry(hulls_.back().get(), PxMeshScale(real(box.half)))),
          {box.centre, Quat::Identity()}};
}

Geometry Geometries::make(const Model& model, const Shape& shape, bool as_polyhedron) {
  const Quat x_along_z = x_to(Vec3::UnitZ());
  const Vec3& half = shape.half_size;
  switch (shape.type) {
    case ShapeType::kSphere:
      return {PxGeometryHolder(PxSphereGeometry(real(shape.radius))), {Vec3::Zero(), x_along_z}};
    case ShapeType::kCapsule:
      return {PxGeometryHolder(PxCapsuleGeometry(real(shape.radius), real(shape.half_length))),
              {Vec3::Zero(), x_along_z}};
    case ShapeType::kPlane:
      return {PxGeometryHolder(PxPlaneGeometry()), {Vec3::Zero(), x_along_z}};
    case ShapeType::kBox:
      return {PxGeometryHolder(PxBoxGeometry(to_px(half))), {}};
    case ShapeType::kCylinder:
    case ShapeType::kEllipsoid:
      if (auto curved = as_polyhedron ? std::nullopt : make_curved(shape)) {
        curved_.push_back(std::move(curved->callbacks));
        return {curved->holder, {}};
      }
      return make_hull(shape.type == ShapeType::kCylinder ? prism(shape) : ellipsoid_hull(half, /*subdivisions=*/1));
    case ShapeType::kHull:
      return make_hull(model.hulls[shape.data]);
    case ShapeType::kHeightField:
      break;
  }
  const HeightField& field = model.height_fields[shape.data];
  const double highest = std::ranges::max(field.heights);
  const double unit = highest > 0 ? highest / INT16_MAX : 1.0;
  height_fields_.push_back(make_height_field(field, unit));
  const PxHeightFieldGeometry geometry(height_fields_.back().get(), {}, real(unit),
                                       real(2 * field.half_y / (field.rows - 1)),
                                       real(2 * field.half_x / (field.columns - 1)));
  Mat3 axes;  // PhysX's x, y, z
  axes << Vec3::UnitY(), Vec3::UnitZ(), Vec3::UnitX();
  return {PxGeometryHolder(geometry), {{-field.half_x, -field.half_y, 0}, Quat(axes)}};
}

double hull_deviation(const Hull& hull) {
  const Box box = bounding_box(hull);
  const Owned<PxConvexMesh> mesh = cook(hull, box);
  // PhysX's hull lies outside the other where a vertex of it does, and inside where one of its faces cuts vertices off.
  double worst = 0;
  for (PxU32 v = 0; v < mesh->getNbVertices(); ++v) {
    const Vec3 vertex = from_px(mesh->getVertices()[v]) * box.half + box.centre;
    double outside = 0;
    for (const std::array<int, 3>& face : hull.faces) {
      const Vec3& a = hull.vertices[face[0]];
      const Vec3 normal = (hull.vertices[face[1]] - a).cross(hull.vertices[face[2]] - a);
      if (const double size = normal.norm(); size > 0) outside = std::max(outside, normal.dot(vertex - a) / size);
    }
    worst = std::max(worst, outside);
  }
  for (const Vec3& vertex : hull.vertices) {
    const PxVec3 point = to_px((vertex - box.centre) / box.half);
    for (PxU32 p = 0; p < mesh->getNbPolygons(); ++p) {
      PxHullPolygon polygon;
      mesh->getPolygonData(p, polygon);
      const float distance =
          PxPlane(polygon.mPlane[0], polygon.mPlane[1], polygon.mPlane[2], polygon.mPlane[3]).distance(point);
      worst = std::max(worst, distance * box.half);
    }
  }
  return worst / (2 * box.half);
}

}  // namespace assay::px
