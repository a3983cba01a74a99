#include "model/shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "model/kinematics.h"

namespace assay {
namespace {

struct Words {
  std::string_view name, plural;
};

// In the order of ShapeType.
constexpr std::array<Words, 8> kWords = {{{"sphere", "spheres"},
                                          {"capsule", "capsules"},
                                          {"plane", "planes"},
                                          {"box", "boxes"},
                                          {"cylinder", "cylinders"},
                                          {"ellipsoid", "ellipsoids"},
                                          {"hull", "meshes"},
                                          {"height_field", "height fields"}}};

const Words& words_of(ShapeType type) { return kWords.at(static_cast<size_t>(type)); }

}  // namespace

std::string_view shape_name(ShapeType type) { return words_of(type).name; }

std::optional<ShapeType> shape_named(std::string_view name) {
  const auto* const found = std::ranges::find(kWords, name, &Words::name);
  if (found == kWords.end()) return std::nullopt;
  return static_cast<ShapeType>(found - kWords.begin());
}

std::string_view shapes_text(ShapeType type) { return words_of(type).plural; }

bool has_half_size(ShapeType type) { return type == ShapeType::kBox || type == ShapeType::kEllipsoid; }

bool has_data(ShapeType type) { return type == ShapeType::kHull || type == ShapeType::kHeightField; }

bool is_plane(const Shape& shape) { return shape.type == ShapeType::kPlane; }

bool is_ground(const Shape& shape) { return is_plane(shape) || shape.type == ShapeType::kHeightField; }

std::optional<double> half_segment(const Shape& shape) {
  if (shape.type == ShapeType::kSphere) return 0;
  return shape.type == ShapeType::kCapsule ? std::optional(shape.half_length) : std::nullopt;
}

ShapeData data_of(const Model& model, const Shape& shape) {
  const auto index = static_cast<size_t>(shape.data);
  if (shape.type == ShapeType::kHull) return {.corners = model.hulls[index].vertices};
  if (shape.type == ShapeType::kHeightField) return {.field = &model.height_fields[index]};
  return {};
}

double reach(const Shape& shape, const ShapeData& data, const Vec3& direction_S) {
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
      for (const Vec3& p : data.corners) farthest = std::max(farthest, d.dot(p));
      return farthest;
    }
    case ShapeType::kPlane:
    case ShapeType::kHeightField:
      break;
  }
  return 0;
}

double reach(const Model& model, const Shape& shape, const Vec3& direction_S) {
  return reach(shape, data_of(model, shape), direction_S);
}

double largest_reach(const Shape& shape, const ShapeData& data) {
  switch (shape.type) {
    case ShapeType::kBox:
      return shape.half_size.norm();
    case ShapeType::kEllipsoid:
      return shape.half_size.maxCoeff();
    case ShapeType::kHull: {
      double farthest = 0;
      for (const Vec3& corner : data.corners) farthest = std::max(farthest, corner.norm());
      return farthest;
    }
    case ShapeType::kHeightField: {
      const HeightField& field = *data.field;
      return Vec3(field.half_x, field.half_y, std::max(field.base, std::ranges::max(field.heights))).norm();
    }
    case ShapeType::kCylinder:
      return std::hypot(shape.radius, shape.half_length);
    case ShapeType::kSphere:
    case ShapeType::kCapsule:
    case ShapeType::kPlane:
      break;
  }
  return shape.radius + shape.half_length;
}

Rod rod_of(const Shape& shape, const ShapeData& data) {
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();
  switch (shape.type) {
    case ShapeType::kSphere:
    case ShapeType::kPlane:
      return {.radius = shape.radius};
    case ShapeType::kCapsule:
      return {Vec3(0, 0, -shape.half_length), Vec3(0, 0, shape.half_length), shape.radius};
    case ShapeType::kCylinder:
      high = {shape.radius, shape.radius, shape.half_length};
      low = -high;
      break;
    case ShapeType::kBox:
    case ShapeType::kEllipsoid:
      high = shape.half_size;
      low = -high;
      break;
    case ShapeType::kHull:
      if (!data.corners.empty()) low = high = data.corners.front();
      for (const Vec3& corner : data.corners) {
        low = low.cwiseMin(corner);
        high = high.cwiseMax(corner);
      }
      break;
    case ShapeType::kHeightField:
      low = {-data.field->half_x, -data.field->half_y, -data.field->base};
      high = {data.field->half_x, data.field->half_y, std::ranges::max(data.field->heights)};
      break;
  }
  const Vec3 half = (high - low) / 2, centre = low + half;
  Eigen::Index longest = 0;
  half.maxCoeff(&longest);
  const double radius = (half[(longest + 1) % 3] + half[(longest + 2) % 3]) / 2;
  const Vec3 end = Vec3::Unit(longest) * (half[longest] - radius);
  return {centre - end, centre + end, radius};
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
