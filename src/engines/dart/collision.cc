#include "collision.h"

#include <algorithm>
#include <numbers>
#include <utility>

#include <assimp/mesh.h>
#include <assimp/scene.h>
#include <dart/collision/CollisionObject.hpp>
#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/CapsuleShape.hpp>
#include <dart/dynamics/CylinderShape.hpp>
#include <dart/dynamics/HeightmapShape.hpp>
#include <dart/dynamics/MeshShape.hpp>
#include <dart/dynamics/PlaneShape.hpp>
#include <dart/dynamics/SphereShape.hpp>

#include "engines/adapter.h"
#include "model/ellipsoid.h"

namespace assay::dartsim {
namespace {

constexpr int kEllipsoidSubdivisions = 2;

// A shape as DART gets it: one of the model's, with a friction coefficient.
struct Part {
  int shape = 0;
  double friction = 0;
};

// DART takes the smaller coefficient of two shapes. Where one coefficient a shape gives every pair its own, a shape is
// one part. Otherwise it has a part for each of its coefficients, and only parts of equal coefficients touch.
std::vector<Part> parts_of(const Model& model) {
  std::vector<Part> parts;
  const ShapeFriction friction = shape_friction(model, FrictionRule::kSmaller);
  if (friction.gives_all(model)) {
    for (size_t s = 0; s < friction.of.size(); ++s) {
      if (friction.of[s] >= 0) parts.push_back({static_cast<int>(s), friction.of[s]});
    }
    return parts;
  }
  std::vector<std::pair<int, double>> wanted;
  for (const ContactPair& pair : model.contacts) {
    wanted.emplace_back(pair.shape_a, pair.friction);
    wanted.emplace_back(pair.shape_b, pair.friction);
  }
  std::ranges::sort(wanted);
  wanted.erase(std::ranges::unique(wanted).begin(), wanted.end());
  parts.reserve(wanted.size());
  for (const auto& [shape, coefficient] : wanted) parts.push_back({shape, coefficient});
  return parts;
}

Eigen::Isometry3d isometry(const Pose& X) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.linear() = X.q.toRotationMatrix();
  result.translation() = X.p;
  return result;
}

// DART has no convex shapes of this kind: the surface of one, as triangles. A scene in the layout of DART's importer,
// which DART frees. ODE, to which DART passes the vertices' normals, counts them by triangle; with three vertices a
// triangle there are enough.
dart::dynamics::ShapePtr make_mesh(const Hull& hull) {
  const size_t faces = hull.faces.size();
  auto mesh = std::make_unique<aiMesh>();
  mesh->mPrimitiveTypes = aiPrimitiveType_TRIANGLE;
  mesh->mNumVertices = static_cast<unsigned>(3 * faces);
  mesh->mVertices = new aiVector3D[3 * faces];
  mesh->mNormals = new aiVector3D[3 * faces];
  mesh->mNumFaces = static_cast<unsigned>(faces);
  mesh->mFaces = new aiFace[faces];
  const auto vector = [](const Vec3& v) {
    return aiVector3D(static_cast<ai_real>(v.x()), static_cast<ai_real>(v.y()), static_cast<ai_real>(v.z()));
  };
  for (size_t f = 0; f < faces; ++f) {
    const auto& [a, b, c] = hull.faces[f];
    const Vec3 &p = hull.vertices[a], &q = hull.vertices[b], &r = hull.vertices[c];
    mesh->mNormals[f] = vector((q - p).cross(r - p).normalized());
    mesh->mFaces[f].mNumIndices = 3;
    mesh->mFaces[f].mIndices = new unsigned[3];
    size_t corner = 3 * f;
    for (unsigned i = 0; const Vec3* vertex : {&p, &q, &r}) {
      mesh->mFaces[f].mIndices[i++] = static_cast<unsigned>(corner);
      mesh->mVertices[corner++] = vector(*vertex);
    }
  }
  auto scene = std::make_unique<aiScene>();
  scene->mNumMeshes = 1;
  scene->mMeshes = new aiMesh*[1]{mesh.release()};
  return std::make_shared<dart::dynamics::MeshShape>(Vec3(Vec3::Ones()), scene.release());
}

// DART's field has its columns along x and its rows along -y. Turned by 90 degrees its diagonal is the model's.
const Pose kFieldTurn{Vec3::Zero(), Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitZ()))};

dart::dynamics::ShapePtr make_height_field(const HeightField& field) {
  std::vector<double> heights;
  heights.reserve(field.heights.size());
  for (int column = 0; column < field.columns; ++column) {
    for (int row = 0; row < field.rows; ++row) heights.push_back(field.heights[(row * field.columns) + column]);
  }
  auto shape = std::make_shared<dart::dynamics::HeightmapShaped>();
  shape->setHeightField(field.rows, field.columns, heights);
  shape->setScale({2 * field.half_y / (field.rows - 1), 2 * field.half_x / (field.columns - 1), 1});
  return shape;
}

dart::dynamics::ShapePtr make_shape(const Model& model, const Shape& shape) {
  switch (shape.type) {
    case ShapeType::kSphere:
      return std::make_shared<dart::dynamics::SphereShape>(shape.radius);
    case ShapeType::kCapsule:
      return std::make_shared<dart::dynamics::CapsuleShape>(shape.radius, 2 * shape.half_length);
    case ShapeType::kPlane:
      break;
    case ShapeType::kBox:
      return std::make_shared<dart::dynamics::BoxShape>(Vec3(2 * shape.half_size));
    case ShapeType::kCylinder:
      return std::make_shared<dart::dynamics::CylinderShape>(shape.radius, 2 * shape.half_length);
    case ShapeType::kEllipsoid:
      return make_mesh(ellipsoid_hull(shape.half_size, kEllipsoidSubdivisions));
    case ShapeType::kHull:
      return make_mesh(model.hulls[shape.data]);
    case ShapeType::kHeightField:
      return make_height_field(model.height_fields[shape.data]);
  }
  return std::make_shared<dart::dynamics::PlaneShape>(Vec3(Vec3::UnitZ()), 0.0);
}

}  // namespace

bool PairFilter::ignoresCollision(const dart::collision::CollisionObject* a,
                                  const dart::collision::CollisionObject* b) const {
  const int first = number_.at(a->getShapeFrame()), second = number_.at(b->getShapeFrame());
  return allowed_[(static_cast<size_t>(first) * number_.size()) + second] == 0;
}

int PairFilter::shape_of(const dart::collision::CollisionObject* object) const {
  return shapes_[number_.at(object->getShapeFrame())];
}

std::shared_ptr<PairFilter> add_shapes(const Model& model, const std::vector<dart::dynamics::BodyNode*>& bodies,
                                       dart::dynamics::BodyNode* world, const Restitution& restitution) {
  const std::vector<Part> parts = parts_of(model);
  std::unordered_map<const dart::dynamics::ShapeFrame*, int> number;
  std::vector<std::vector<int>> parts_of_shape(model.shapes.size());
  for (size_t i = 0; i < parts.size(); ++i) {
    const Shape& shape = model.shapes[parts[i].shape];
    dart::dynamics::BodyNode* body = shape.body == kWorld ? world : bodies[shape.body];
    dart::dynamics::ShapeNode* node =
        body->createShapeNodeWith<dart::dynamics::CollisionAspect, dart::dynamics::DynamicsAspect>(
            make_shape(model, shape));
    node->setRelativeTransform(isometry(shape.type == ShapeType::kHeightField ? shape.X_BS * kFieldTurn : shape.X_BS));
    node->getDynamicsAspect()->setFrictionCoeff(parts[i].friction);
    node->getDynamicsAspect()->setRestitutionCoeff(restitution.of_material());  // DART multiplies the two
    number[node] = static_cast<int>(i);
    parts_of_shape[parts[i].shape].push_back(static_cast<int>(i));
  }

  std::vector<char> allowed(parts.size() * parts.size(), 0);
  for (const ContactPair& pair : model.contacts) {
    for (const int a : parts_of_shape[pair.shape_a]) {
      for (const int b : parts_of_shape[pair.shape_b]) {
        if (std::min(parts[a].friction, parts[b].friction) != pair.friction) continue;
        // several parts a shape: only the two that have the pair's coefficient
        const bool single = parts_of_shape[pair.shape_a].size() == 1 && parts_of_shape[pair.shape_b].size() == 1;
        if (!single && parts[a].friction != parts[b].friction) continue;
        allowed[(a * parts.size()) + b] = allowed[(b * parts.size()) + a] = 1;
      }
    }
  }
  std::vector<int> shapes;
  shapes.reserve(parts.size());
  for (const Part& part : parts) shapes.push_back(part.shape);
  return std::make_shared<PairFilter>(std::move(number), std::move(allowed), std::move(shapes));
}

}  // namespace assay::dartsim
