#include "check/overlaps.h"

#include <algorithm>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "base/errors.h"
#include "model/extent.h"
#include "model/mujoco_messages.h"

namespace assay {
namespace {

struct DataDeleter {
  void operator()(mjData* data) const { mj_deleteData(data); }
};

mjtGeom geom_type(ShapeType type) {
  switch (type) {
    case ShapeType::kSphere:
      return mjGEOM_SPHERE;
    case ShapeType::kCapsule:
      return mjGEOM_CAPSULE;
    case ShapeType::kBox:
      return mjGEOM_BOX;
    case ShapeType::kCylinder:
      return mjGEOM_CYLINDER;
    case ShapeType::kEllipsoid:
      return mjGEOM_ELLIPSOID;
    case ShapeType::kHull:
      return mjGEOM_MESH;
    case ShapeType::kPlane:
      return mjGEOM_PLANE;
    case ShapeType::kHeightField:
      return mjGEOM_HFIELD;
  }
  return mjGEOM_NONE;
}

Vec3 geom_size(const Shape& shape) {
  switch (shape.type) {
    case ShapeType::kBox:
    case ShapeType::kEllipsoid:
      return shape.half_size;
    default:
      return {shape.radius, shape.half_length, 0};
  }
}

// Shapes at rest in the world, which MuJoCo then measures between.
class Scene {
 public:
  Scene(const Model& model, const std::vector<Pose>& X_WS, const std::vector<int>& shapes)
      : spec_(mj_makeSpec()), geom_of_(model.shapes.size(), -1) {
    std::vector<bool> has_mesh(model.hulls.size(), false);
    for (const int s : shapes) {
      const Shape& shape = model.shapes[s];
      mjsGeom* geom = mjs_addGeom(mjs_findBody(spec_.get(), "world"), nullptr);
      geom_of_[s] = count_++;
      geom->type = geom_type(shape.type);
      for (int k = 0; k < 3; ++k) geom->pos[k] = X_WS[s].p[k];
      const Quat& q = X_WS[s].q;
      const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
      std::copy_n(wxyz, 4, geom->quat);
      for (int k = 0; k < 3; ++k) geom->size[k] = geom_size(shape)[k];
      if (shape.type != ShapeType::kHull) continue;
      const std::string name = std::to_string(shape.data);
      if (!has_mesh[shape.data]) add_mesh(model.hulls[shape.data], name);
      has_mesh[shape.data] = true;
      mjs_setString(geom->meshname, name.c_str());
    }
    compiled_.reset(mj_compile(spec_.get(), nullptr));
    if (compiled_ == nullptr) throw InputError(one_line(mjs_getError(spec_.get())));
    data_.reset(mj_makeData(compiled_.get()));
    mj_kinematics(compiled_.get(), data_.get());
  }

  // m, negative where they overlap
  double distance(int shape_a, int shape_b) const {
    return mj_geomDistance(compiled_.get(), data_.get(), geom_of_[shape_a], geom_of_[shape_b], 1e-3, nullptr);
  }

 private:
  void add_mesh(const Hull& hull, const std::string& name) {
    mjsMesh* mesh = mjs_addMesh(spec_.get(), nullptr);
    mjs_setName(mesh->element, name.c_str());
    std::vector<float> vertices;
    for (const Vec3& p : hull.vertices) {
      for (int k = 0; k < 3; ++k) vertices.push_back(static_cast<float>(p[k]));
    }
    mjs_setFloat(mesh->uservert, vertices.data(), static_cast<int>(vertices.size()));
    mesh->inertia = mjMESH_INERTIA_CONVEX;
  }

  SpecPtr spec_;
  CompiledPtr compiled_;
  std::unique_ptr<mjData, DataDeleter> data_;
  std::vector<int> geom_of_;  // by Model::shapes
  int count_ = 0;
};

// Depth of the deepest point below a plane.
double depth_below(const Model& model, const Pose& X_WPlane, const Shape& shape, const Pose& X_WS) {
  const Vec3 down = X_WPlane.q * -Vec3::UnitZ();
  return down.dot(X_WS.p - X_WPlane.p) + reach(model, shape, X_WS.q.conjugate() * down);
}

// Height of a height field's surface below a point of its frame, m; nothing beside it.
std::optional<double> height_at(const HeightField& field, double x, double y) {
  const double column = (x + field.half_x) / (2 * field.half_x) * (field.columns - 1);
  const double row = (y + field.half_y) / (2 * field.half_y) * (field.rows - 1);
  if (column < 0 || row < 0 || column > field.columns - 1 || row > field.rows - 1) return std::nullopt;
  const int c = std::min(static_cast<int>(column), field.columns - 2),
            r = std::min(static_cast<int>(row), field.rows - 2);
  const auto at = [&](int i, int k) { return field.heights[static_cast<size_t>(i) * field.columns + k]; };
  const double u = column - c, v = row - r;
  // the diagonal runs from (row, column + 1) to (row + 1, column)
  if (u + v <= 1) return at(r, c) + u * (at(r, c + 1) - at(r, c)) + v * (at(r + 1, c) - at(r, c));
  return at(r + 1, c + 1) + (1 - u) * (at(r + 1, c) - at(r + 1, c + 1)) + (1 - v) * (at(r, c + 1) - at(r + 1, c + 1));
}

// Depth of the shape's lowest point below a height field: exact where the field is level around it.
double depth_in(const Model& model, const HeightField& field, const Pose& X_WField, const Shape& shape,
                const Pose& X_WS) {
  const Pose X_FS = X_WField.inverse() * X_WS;
  const double lowest = X_FS.p.z() - reach(model, shape, X_FS.q.conjugate() * -Vec3::UnitZ());
  const std::optional<double> height = height_at(field, X_FS.p.x(), X_FS.p.y());
  return height ? *height - lowest : 0;
}

}  // namespace

std::vector<Overlap> overlaps(const Model& model, const State& state, double least) {
  std::vector<Pose> X_WS;
  std::vector<Box> boxes;
  for (const Shape& shape : model.shapes) {
    X_WS.push_back(shape_pose(model, state, shape));
    boxes.push_back(is_ground(shape) ? Box() : box_around(model, shape, X_WS.back()));
  }
  std::vector<Overlap> found;
  std::vector<int> near;  // contact pairs whose boxes meet
  std::vector<bool> needed(model.shapes.size(), false);
  for (size_t i = 0; i < model.contacts.size(); ++i) {
    int a = model.contacts[i].shape_a, b = model.contacts[i].shape_b;
    if (is_ground(model.shapes[b])) std::swap(a, b);
    const Shape &first = model.shapes[a], &second = model.shapes[b];
    if (is_ground(second)) continue;
    if (is_ground(first)) {
      const double depth = first.type == ShapeType::kPlane
                               ? depth_below(model, X_WS[a], second, X_WS[b])
                               : depth_in(model, model.height_fields[first.data], X_WS[a], second, X_WS[b]);
      if (depth > least) found.push_back({static_cast<int>(i), depth});
    } else if (boxes[a].intersects(boxes[b])) {
      near.push_back(static_cast<int>(i));
      needed[a] = needed[b] = true;
    }
  }
  std::vector<int> shapes;
  for (size_t s = 0; s < needed.size(); ++s) {
    if (needed[s]) shapes.push_back(static_cast<int>(s));
  }
  if (!shapes.empty()) {
    const MessageGuard guard;
    const Scene scene(model, X_WS, shapes);
    for (const int i : near) {
      const double depth = -scene.distance(model.contacts[i].shape_a, model.contacts[i].shape_b);
      if (depth > least) found.push_back({i, depth});
    }
  }
  std::ranges::stable_sort(found, std::ranges::greater(), &Overlap::depth);
  return found;
}

}  // namespace assay
