#include "model/extent.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/kinematics.h"

namespace assay {

bool is_ground(const Shape& shape) { return shape.type == ShapeType::kPlane || shape.type == ShapeType::kHeightField; }

double reach(const Model& model, const Shape& shape, const Vec3& direction_S) {
  const Vec3& d = direction_S;
  switch (shape.type) {
    case ShapeType::kSphere:
      return shape.radius;
    case ShapeType::kCapsule:
      return shape.radius + std::abs(d.z()) * shape.half_length;
    case ShapeType::kBox:
      return d.cwiseAbs().dot(shape.half_size);
    case ShapeType::kCylinder:
      return std::abs(d.z()) * shape.half_length + std::hypot(d.x(), d.y()) * shape.radius;
    case ShapeType::kEllipsoid:
      return d.cwiseProduct(shape.half_size).norm();
    case ShapeType::kHull: {
      double farthest = -std::numeric_limits<double>::infinity();
      for (const Vec3& p : model.hulls[shape.data].vertices) farthest = std::max(farthest, d.dot(p));
      return farthest;
    }
    case ShapeType::kPlane:
    case ShapeType::kHeightField:
      break;
  }
  return 0;
}

Box box_around(const Model& model, const Shape& shape, const Pose& X_FS) {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 d = X_FS.q.conjugate() * Vec3::Unit(axis);
    box.max()[axis] = X_FS.p[axis] + reach(model, shape, d);
    box.min()[axis] = X_FS.p[axis] - reach(model, shape, -d);
  }
  return box;
}

Pose shape_pose(const Model& model, const State& state, const Shape& shape) {
  if (shape.body == kWorld) return shape.X_BS;
  return body_pose(model.bodies[shape.body], state.bodies[shape.body]) * shape.X_BS;
}

}  // namespace assay
