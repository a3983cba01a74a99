#include "collision.h"

#include <algorithm>
#include <utility>

#include <dart/collision/CollisionObject.hpp>
#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/CapsuleShape.hpp>
#include <dart/dynamics/CylinderShape.hpp>
#include <dart/dynamics/PlaneShape.hpp>
#include <dart/dynamics/SphereShape.hpp>

#include "engines/adapter.h"

namespace assay::dartsim {
namespace {

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

dart::dynamics::ShapePtr make_shape(const Shape& shape) {
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
    case ShapeType::kHull:
    case ShapeType::kHeightField:
      throw UnsupportedError("this shape is refused by check()");
  }
  return std::make_shared<dart::dynamics::PlaneShape>(Vec3(Vec3::UnitZ()), 0.0);
}

}  // namespace

bool PairFilter::ignoresCollision(const dart::collision::CollisionObject* a,
                                  const dart::collision::CollisionObject* b) const {
  const int first = number_.at(a->getShapeFrame()), second = number_.at(b->getShapeFrame());
  return allowed_[(static_cast<size_t>(first) * number_.size()) + second] == 0;
}

std::shared_ptr<PairFilter> add_shapes(const Model& model, const std::vector<dart::dynamics::BodyNode*>& bodies,
                                       dart::dynamics::BodyNode* world) {
  const std::vector<Part> parts = parts_of(model);
  std::unordered_map<const dart::dynamics::ShapeFrame*, int> number;
  std::vector<std::vector<int>> parts_of_shape(model.shapes.size());
  for (size_t i = 0; i < parts.size(); ++i) {
    const Shape& shape = model.shapes[parts[i].shape];
    dart::dynamics::BodyNode* body = shape.body == kWorld ? world : bodies[shape.body];
    dart::dynamics::ShapeNode* node =
        body->createShapeNodeWith<dart::dynamics::CollisionAspect, dart::dynamics::DynamicsAspect>(make_shape(shape));
    Eigen::Isometry3d X_BS = Eigen::Isometry3d::Identity();
    X_BS.linear() = shape.X_BS.q.toRotationMatrix();
    X_BS.translation() = shape.X_BS.p;
    node->setRelativeTransform(X_BS);
    node->getDynamicsAspect()->setFrictionCoeff(parts[i].friction);
    node->getDynamicsAspect()->setRestitutionCoeff(0);
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
  return std::make_shared<PairFilter>(std::move(number), std::move(allowed));
}

}  // namespace assay::dartsim
