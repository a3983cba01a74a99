#include "shapes.h"

#include <algorithm>
#include <map>
#include <mutex>
#include <string>

#include <BulletCollision/CollisionShapes/btConvexPolyhedron.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>

#include "convert.h"

namespace assay::bullet {
namespace {

// Bullet rounds the edges of boxes and cylinders by their margin where it compares distances (GJK). Its default of 40
// mm is meant for large bodies; 1 mm is that of its loaders of robot files.
constexpr double kMargin = 1e-3;           // m
constexpr double kMarginOfHalfSize = 0.1;  // and at most this part of the smallest half size

btScalar margin_of(double smallest_half_size) {
  return real(std::min(kMargin, kMarginOfHalfSize * smallest_half_size));
}

// An ellipsoid about its centre. Bullet has none, but takes convex shapes by their support function.
//
// Its core without margin is the inner parallel body, which is convex as long as the margin is at most the smallest
// radius of curvature, shortest^2 / longest. So the shape with its margin is the ellipsoid exactly, and the distance of
// cores finds depths up to the margin without Bullet's less exact search for deep ones.
class Ellipsoid final : public btConvexInternalShape {
 public:
  explicit Ellipsoid(const btVector3& semi_axes) : semi_axes_(semi_axes) {
    m_shapeType = CUSTOM_CONVEX_SHAPE_TYPE;
    const btScalar shortest = semi_axes[semi_axes.minAxis()], longest = semi_axes[semi_axes.maxAxis()];
    setMargin(real(0.5) * shortest * shortest / longest);
  }

  btVector3 localGetSupportingVertexWithoutMargin(const btVector3& direction) const override {
    const btVector3 n = direction.length2() < SIMD_EPSILON * SIMD_EPSILON ? btVector3(1, 0, 0) : direction.normalized();
    const btVector3 scaled = semi_axes_ * n;
    return semi_axes_ * scaled / scaled.length() - getMargin() * n;
  }
  void batchedUnitVectorGetSupportingVertexWithoutMargin(const btVector3* directions, btVector3* out,
                                                         int count) const override {
    for (int i = 0; i < count; ++i) out[i] = localGetSupportingVertexWithoutMargin(directions[i]);
  }
  void getAabb(const btTransform& X, btVector3& lower, btVector3& upper) const override {
    btVector3 half;
    for (int i = 0; i < 3; ++i) half[i] = (X.getBasis().getRow(i) * semi_axes_).length();
    lower = X.getOrigin() - half;
    upper = X.getOrigin() + half;
  }
  // Unused: the adapter sets the inertia of every body.
  void calculateLocalInertia(btScalar mass, btVector3& inertia) const override {
    const btVector3 s = semi_axes_ * semi_axes_ * (mass / 5);
    inertia.setValue(s.y() + s.z(), s.x() + s.z(), s.x() + s.y());
  }
  const char* getName() const override { return "Ellipsoid"; }

 private:
  btVector3 semi_axes_;  // m
};

std::unique_ptr<btCollisionShape> make_box(const Shape& shape) {
  auto box = std::make_unique<btBoxShape>(to_bt(shape.half_size));
  box->setMargin(margin_of(shape.half_size.minCoeff()));
  box->initializePolyhedralFeatures();  // for full manifolds against hulls
  return box;
}

std::unique_ptr<btCollisionShape> make_cylinder(const Shape& shape) {
  auto cylinder = std::make_unique<btCylinderShapeZ>(to_bt(Vec3(shape.radius, shape.radius, shape.half_length)));
  cylinder->setMargin(margin_of(std::min(shape.radius, shape.half_length)));
  return cylinder;
}

// Faces and edges of hulls by their vertices. Bullet takes up to 0.1 s to find those of a mesh, and a robot is made
// anew for every window that is timed.
class KnownFeatures {
 public:
  void give(const Hull& hull, btConvexHullShape& shape) {
    const auto* numbers = reinterpret_cast<const char*>(hull.vertices.data());
    const std::string key(numbers, hull.vertices.size() * sizeof(Vec3));
    const std::lock_guard lock(mutex_);
    if (const auto found = known_.find(key); found != known_.end()) {
      shape.setPolyhedralFeatures(*found->second);
      return;
    }
    shape.initializePolyhedralFeatures();
    if (known_.size() >= kMost) known_.clear();
    known_.emplace(key, std::make_unique<btConvexPolyhedron>(*shape.getConvexPolyhedron()));
  }

 private:
  static constexpr size_t kMost = 1000;

  std::mutex mutex_;
  std::map<std::string, std::unique_ptr<btConvexPolyhedron>> known_;
};

// Without margin, which would inflate the hull.
std::unique_ptr<btCollisionShape> make_hull(const Hull& hull) {
  static KnownFeatures features;
  auto made = std::make_unique<btConvexHullShape>();
  for (const Vec3& vertex : hull.vertices) made->addPoint(to_bt(vertex), false);
  made->recalcLocalAabb();
  made->setMargin(0);
  features.give(hull, *made);
  return made;
}

// Bullet's field has its origin in the middle of its heights and cells of size 1; its diagonal is the model's. With a
// margin, below which it lies, bodies touch it without the search for deep contacts, whose normals at inner edges stop
// a sliding hull.
MadeShape make_height_field(const HeightField& field) {
  MadeShape made;
  for (const double height : field.heights) made.heights.push_back(real(height));
  const auto [lowest, highest] = std::ranges::minmax(made.heights);
  auto shape = std::make_unique<btHeightfieldTerrainShape>(field.columns, field.rows, made.heights.data(), lowest,
                                                           highest, 2, false);
  shape->setLocalScaling(to_bt(Vec3(2 * field.half_x / (field.columns - 1), 2 * field.half_y / (field.rows - 1), 1)));
  shape->setMargin(real(kMargin));
  made.shape = std::move(shape);
  made.X_SB.p.z() = -static_cast<double>(made.shape->getMargin()) + (double{lowest} + double{highest}) / 2;
  return made;
}

}  // namespace

MadeShape make_shape(const Model& model, const Shape& shape) {
  MadeShape made;
  switch (shape.type) {
    case ShapeType::kSphere:
      made.shape = std::make_unique<btSphereShape>(real(shape.radius));
      break;
    case ShapeType::kCapsule:
      made.shape = std::make_unique<btCapsuleShapeZ>(real(shape.radius), real(2 * shape.half_length));
      break;
    case ShapeType::kPlane: {
      const Vec3 normal = shape.X_BS.q * Vec3::UnitZ();
      made.shape = std::make_unique<btStaticPlaneShape>(to_bt(normal), real(normal.dot(shape.X_BS.p)));
      break;
    }
    case ShapeType::kBox:
      made.shape = make_box(shape);
      break;
    case ShapeType::kCylinder:
      made.shape = make_cylinder(shape);
      break;
    case ShapeType::kEllipsoid:
      made.shape = std::make_unique<Ellipsoid>(to_bt(shape.half_size));
      break;
    case ShapeType::kHull:
      made.shape = make_hull(model.hulls[shape.data]);
      break;
    case ShapeType::kHeightField:
      return make_height_field(model.height_fields[shape.data]);
  }
  return made;
}

}  // namespace assay::bullet
