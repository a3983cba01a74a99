#include "load/pair_distances.h"

#include <algorithm>
#include <optional>
#include <string>

#include "base/errors.h"
#include "load/mujoco_messages.h"
#include "model/shape.h"

namespace assay {
namespace {

constexpr double kFar = 1e-3;  // m: no distance above it is needed

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

// Height of the shape's lowest point above a height field; some distance beside it.
double height_above(const Model& model, const HeightField& field, const Pose& X_WField, const Shape& shape,
                    const Pose& X_WS) {
  const Pose X_FS = X_WField.inverse() * X_WS;
  const double lowest = X_FS.p.z() - reach(model, shape, X_FS.q.conjugate() * -Vec3::UnitZ());
  const std::optional<double> height = height_at(field, X_FS.p.x(), X_FS.p.y());
  return height ? lowest - *height : kFar;
}

// Height of the shape's lowest point above a plane.
double height_above(const Pose& X_WPlane, const Model& model, const Shape& shape, const Pose& X_WS) {
  const Vec3 down = X_WPlane.q * -Vec3::UnitZ();
  return down.dot(X_WPlane.p - X_WS.p) - reach(model, shape, X_WS.q.conjugate() * down);
}

}  // namespace

// Shapes as MuJoCo's geometries of the world, which are put where they are wanted before their distance is asked for.
class PairDistances::Scene {
 public:
  Scene(const Model& model, const std::vector<int>& shapes) : spec_(mj_makeSpec()), geom_of_(model.shapes.size(), -1) {
    std::vector<bool> has_mesh(model.hulls.size(), false);
    for (const int s : shapes) {
      const Shape& shape = model.shapes[s];
      mjsGeom* geom = mjs_addGeom(mjs_findBody(spec_.get(), "world"), nullptr);
      geom_of_[s] = count_++;
      geom->type = geom_type(shape.type);
      for (int k = 0; k < 3; ++k) geom->size[k] = geom_size(shape)[k];
      if (shape.type != ShapeType::kHull) continue;
      const std::string name = std::to_string(shape.data);
      if (!has_mesh[shape.data]) add_mesh(model.hulls[shape.data], name);
      has_mesh[shape.data] = true;
      mjs_setString(geom->meshname, name.c_str());
    }
    const MessageGuard guard;
    compiled_.reset(mj_compile(spec_.get(), nullptr));
    if (compiled_ == nullptr) throw InputError(one_line(mjs_getError(spec_.get())));
    data_.reset(mj_makeData(compiled_.get()));
    // MuJoCo moves a mesh to its own principal frame
    for (int g = 0; g < count_; ++g) {
      const mjtNum* p = compiled_->geom_pos + 3 * static_cast<ptrdiff_t>(g);
      const mjtNum* q = compiled_->geom_quat + 4 * static_cast<ptrdiff_t>(g);
      X_SG_.push_back({Vec3(p[0], p[1], p[2]), Quat(q[0], q[1], q[2], q[3])});
    }
  }

  double distance(int a, int b, const std::vector<Pose>& X_WS) const {
    place(a, X_WS[a]);
    place(b, X_WS[b]);
    const MessageGuard guard;
    return mj_geomDistance(compiled_.get(), data_.get(), geom_of_[a], geom_of_[b], kFar, nullptr);
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

  void place(int shape, const Pose& X_WS) const {
    const auto geom = static_cast<size_t>(geom_of_[shape]);
    const Pose X_WG = X_WS * X_SG_[geom];
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> R_WG = X_WG.q.toRotationMatrix();
    std::copy_n(X_WG.p.data(), 3, data_->geom_xpos + 3 * geom);
    std::copy_n(R_WG.data(), 9, data_->geom_xmat + 9 * geom);
  }

  struct DataDeleter {
    void operator()(mjData* data) const { mj_deleteData(data); }
  };

  SpecPtr spec_;
  CompiledPtr compiled_;
  std::unique_ptr<mjData, DataDeleter> data_;
  std::vector<int> geom_of_;  // by Model::shapes
  std::vector<Pose> X_SG_;    // by geometry
  int count_ = 0;
};

PairDistances::PairDistances(const Model& model, const std::vector<int>& pairs) : model_(model) {
  std::vector<bool> needed(model.shapes.size(), false);
  for (const int i : pairs) {
    const ContactPair& pair = model.contacts[i];
    if (is_ground(model.shapes[pair.shape_a]) || is_ground(model.shapes[pair.shape_b])) continue;
    needed[pair.shape_a] = needed[pair.shape_b] = true;
  }
  std::vector<int> shapes;
  for (size_t s = 0; s < needed.size(); ++s) {
    if (needed[s]) shapes.push_back(static_cast<int>(s));
  }
  if (!shapes.empty()) scene_ = std::make_unique<Scene>(model, shapes);
}

PairDistances::~PairDistances() = default;

double PairDistances::distance(int pair, const std::vector<Pose>& X_WS) const {
  int a = model_.contacts[pair].shape_a, b = model_.contacts[pair].shape_b;
  if (is_ground(model_.shapes[b])) std::swap(a, b);
  const Shape &first = model_.shapes[a], &second = model_.shapes[b];
  if (is_ground(second)) return kFar;
  if (!is_ground(first)) return scene_->distance(a, b, X_WS);
  if (first.type == ShapeType::kPlane) return height_above(X_WS[a], model_, second, X_WS[b]);
  return height_above(model_, model_.height_fields[first.data], X_WS[a], second, X_WS[b]);
}

}  // namespace assay
