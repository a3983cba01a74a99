#include "shapes.h"

#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"

namespace assay::box3d {
namespace {

constexpr int kPrismSides = 42;  // three edges each, and a hull has at most 128

// The hull of points at `X`. Where it has more corners, faces or edges than Box3D's hulls can have, those corners are
// left out that Box3D's builder takes last, until it fits. Null when Box3D cannot make one.
HullHandle make_hull(const std::vector<Vec3>& corners, const Pose& X) {
  std::vector<b3Vec3> points;
  points.reserve(corners.size());
  for (const Vec3& corner : corners) points.push_back(b3_vector(X * corner));
  for (const int most : {kMostOfHull, 96, 72, 60, 52, 44}) {
    HullHandle hull(b3CreateHull(points.data(), static_cast<int>(points.size()), most));
    if (hull) return hull;
  }
  return {};
}

}  // namespace

std::vector<Vec3> prism_corners(double radius, double half_length) {
  std::vector<Vec3> corners;
  corners.reserve(2 * static_cast<size_t>(kPrismSides));
  const double step = 2 * std::numbers::pi / kPrismSides;
  const double outer = radius / std::sqrt(std::cos(step / 2));
  for (int i = 0; i < kPrismSides; ++i) {
    const double x = outer * std::cos(i * step), y = outer * std::sin(i * step);
    corners.emplace_back(x, y, -half_length);
    corners.emplace_back(x, y, half_length);
  }
  return corners;
}

void ShapeMaker::make(const Model& model, const Shape& shape, const Pose& X, b3BodyId body,
                      const b3ShapeDef& definition) {
  const b3ShapeId id = made(model, shape, X, body, definition);
  if (B3_IS_NULL(id)) throw EngineError(fmt::format("Box3D could not make the shape '{}'", shape.name));
}

b3ShapeId ShapeMaker::made(const Model& model, const Shape& shape, const Pose& X, b3BodyId body,
                           const b3ShapeDef& definition) {
  const auto hull = [&](const std::vector<Vec3>& corners) -> b3ShapeId {
    const HullHandle made = make_hull(corners, X);
    return made ? b3CreateHullShape(body, &definition, made.get()) : b3_nullShapeId;
  };
  switch (shape.type) {
    case ShapeType::kSphere: {
      const b3Sphere sphere{b3_vector(X.p), real(shape.radius)};
      return b3CreateSphereShape(body, &definition, &sphere);
    }
    case ShapeType::kCapsule: {
      const Vec3 half = shape.half_length * (X.q * Vec3::UnitZ());
      const b3Capsule capsule{b3_vector(X.p - half), b3_vector(X.p + half), real(shape.radius)};
      return b3CreateCapsuleShape(body, &definition, &capsule);
    }
    case ShapeType::kPlane: {
      const b3BoxHull box =
          b3MakeOffsetBoxHull(real(size_ / 2), real(size_ / 2), real(thickness_ / 2), {0, 0, -real(thickness_ / 2)});
      return b3CreateHullShape(body, &definition, &box.base);
    }
    case ShapeType::kBox: {
      const Vec3& h = shape.half_size;
      const b3BoxHull box = b3MakeTransformedBoxHull(real(h.x()), real(h.y()), real(h.z()), b3_transform(X));
      return b3CreateHullShape(body, &definition, &box.base);
    }
    case ShapeType::kCylinder:
      return hull(prism_corners(shape.radius, shape.half_length));
    case ShapeType::kHull:
      return hull(model.hulls[shape.data].vertices);
    case ShapeType::kHeightField:
      return make_surface(model.height_fields[shape.data], body, definition);
    case ShapeType::kEllipsoid:
      break;  // refused
  }
  return b3_nullShapeId;
}

// The field's upper surface, two triangles a cell.
b3ShapeId ShapeMaker::make_surface(const HeightField& field, b3BodyId body, const b3ShapeDef& definition) {
  const int rows = field.rows, columns = field.columns;
  std::vector<b3Vec3> points;
  std::vector<int32_t> indices;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      points.push_back(b3_vector({-field.half_x + column * 2 * field.half_x / (columns - 1),
                                  -field.half_y + row * 2 * field.half_y / (rows - 1),
                                  field.heights[(row * columns) + column] - kMeshOffset}));
    }
  }
  for (int row = 0; row + 1 < rows; ++row) {
    for (int column = 0; column + 1 < columns; ++column) {
      const int a = (row * columns) + column, b = a + 1, c = a + columns, d = c + 1;
      indices.insert(indices.end(), {a, b, c, b, d, c});
    }
  }
  b3MeshDef mesh{};
  mesh.vertices = points.data();
  mesh.vertexCount = static_cast<int>(points.size());
  mesh.indices = indices.data();
  mesh.triangleCount = static_cast<int>(indices.size() / 3);
  mesh.useMedianSplit = true;
  mesh.identifyEdges = true;
  MeshHandle made(b3CreateMesh(&mesh, nullptr, 0));
  if (!made) return b3_nullShapeId;
  meshes_.push_back(std::move(made));
  return b3CreateMeshShape(body, &definition, meshes_.back().get(), {1, 1, 1});
}

}  // namespace assay::box3d
