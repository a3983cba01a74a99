#include "check/pairing/surfaces.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "model/shape.h"

namespace assay::pairing {
namespace {

constexpr int kDirections = 80;

Vec3 spread(int k, int count) {  // Fibonacci's sphere
  const double z = 1 - (2 * k + 1.0) / count, r = std::sqrt(1 - z * z);
  const double turn = k * std::numbers::pi * (3 - std::sqrt(5.0));
  return {r * std::cos(turn), r * std::sin(turn), z};
}

double box_distance(const Vec3& half, const Vec3& p) {
  const Vec3 q = p.cwiseAbs() - half;
  return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
}

double cylinder_distance(double radius, double half_length, const Vec3& p) {
  const double across = p.head<2>().norm() - radius, along = std::abs(p.z()) - half_length;
  return std::hypot(std::max(across, 0.0), std::max(along, 0.0)) + std::min(std::max(across, along), 0.0);
}

// Eberly, Distance from a point to an ellipsoid: the foot is a^2 p / (a^2 + t) at the largest root t.
double ellipsoid_distance(const Vec3& axes, const Vec3& at) {
  const Vec3 p = at.cwiseAbs();
  const auto foot = [&](double t) {
    return Vec3(axes.cwiseAbs2().cwiseProduct(p).cwiseQuotient(axes.cwiseAbs2() + Vec3::Constant(t)));
  };
  const double least = axes.minCoeff();
  double low = -least * least * (1 - 1e-12), high = axes.maxCoeff() * p.norm() + 1e-12;
  for (int k = 0; k < 80; ++k) {
    const double middle = (low + high) / 2;
    (foot(middle).cwiseQuotient(axes).squaredNorm() > 1 ? low : high) = middle;
  }
  Vec3 nearest = foot(high);
  const double level = nearest.cwiseQuotient(axes).squaredNorm();
  if (level < 1 - 1e-9) {  // on the plane of the shortest axis: the foot leaves it
    Eigen::Index shortest = 0;
    axes.minCoeff(&shortest);
    nearest[shortest] = axes[shortest] * std::sqrt(1 - level);
  }
  const double distance = (nearest - p).norm();
  return p.cwiseQuotient(axes).squaredNorm() < 1 ? -distance : distance;
}

double triangle_distance(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) {  // Ericson, 5.1.5
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return ap.norm();
  const Vec3 bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return bp.norm();
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return (ap - ab * (d1 / (d1 - d3))).norm();
  const Vec3 cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return cp.norm();
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return (ap - ac * (d2 / (d2 - d6))).norm();
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return (bp - (c - b) * ((d4 - d3) / (d4 - d3 + d5 - d6))).norm();
  const double sum = va + vb + vc;
  return (ap - ab * (vb / sum) - ac * (vc / sum)).norm();
}

double hull_distance(const Hull& hull, const Vec3& p) {
  double deepest = -std::numeric_limits<double>::infinity();
  for (const auto& face : hull.faces) {
    const Vec3 &a = hull.vertices[static_cast<size_t>(face[0])], &b = hull.vertices[static_cast<size_t>(face[1])],
               &c = hull.vertices[static_cast<size_t>(face[2])];
    const Vec3 normal = (b - a).cross(c - a);
    const double length = normal.norm();
    if (length > 0) deepest = std::max(deepest, normal.dot(p - a) / length);
  }
  if (deepest <= 0) return deepest;
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& face : hull.faces) {
    nearest = std::min(nearest, triangle_distance(hull.vertices[static_cast<size_t>(face[0])],
                                                  hull.vertices[static_cast<size_t>(face[1])],
                                                  hull.vertices[static_cast<size_t>(face[2])], p));
  }
  return nearest;
}

// The same up to rounding.
bool equal(const Model& model_a, const Shape& a, const Model& model_b, const Shape& b) {
  constexpr double kLength = 1e-6, kAngle = 1e-5;
  if (a.type != b.type || std::abs(a.radius - b.radius) > kLength ||
      std::abs(a.half_length - b.half_length) > kLength || (a.half_size - b.half_size).norm() > kLength ||
      (a.X_BS.p - b.X_BS.p).norm() > kLength) {
    return false;
  }
  if (a.type != ShapeType::kSphere && a.X_BS.q.angularDistance(b.X_BS.q) > kAngle) return false;
  if (a.type != ShapeType::kHull) return true;
  const auto &u = model_a.hulls[static_cast<size_t>(a.data)].vertices,
             &v = model_b.hulls[static_cast<size_t>(b.data)].vertices;
  return u.size() == v.size() &&
         std::ranges::equal(u, v, [](const Vec3& p, const Vec3& q) { return (p - q).norm() < kLength; });
}

struct Ball {
  Vec3 centre = Vec3::Zero();
  double radius = 0;
};
std::vector<Ball> balls_of(const ShapeSet& set) {
  std::vector<Ball> balls;
  for (const Shape* shape : set.shapes) {
    balls.push_back({shape->X_BS.p, largest_reach(*shape, data_of(*set.model, *shape))});
  }
  return balls;
}

double set_distance(const ShapeSet& set, const std::vector<Ball>& balls, const Vec3& p, const Shape* except = nullptr) {
  double least = std::numeric_limits<double>::infinity();
  for (size_t k = 0; k < set.shapes.size(); ++k) {
    const Shape& shape = *set.shapes[k];
    if (&shape == except || (p - balls[k].centre).norm() - balls[k].radius > least) continue;
    least = std::min(least, signed_distance(*set.model, shape, shape.X_BS.inverse() * p));
  }
  return least;
}

double one_way(const ShapeSet& from, const ShapeSet& to, const std::vector<bool>& skip) {
  const std::vector<Ball> balls_from = balls_of(from), balls_to = balls_of(to);
  double most = 0;
  for (size_t k = 0; k < from.shapes.size(); ++k) {
    if (skip[k]) continue;
    const Shape& shape = *from.shapes[k];
    for (const Vec3& p_S : surface_points(*from.model, shape)) {
      const Vec3 p = shape.X_BS * p_S;
      const double apart = std::abs(set_distance(to, balls_to, p));
      if (apart <= most) continue;
      if (set_distance(from, balls_from, p, &shape) < -1e-6) continue;  // within its own set
      most = apart;
    }
  }
  return most;
}

}  // namespace

bool has_ground(const Model& model) {
  return std::ranges::any_of(model.shapes, [](const Shape& shape) { return is_ground(shape) && shape.collides; });
}

double signed_distance(const Model& model, const Shape& shape, const Vec3& p) {
  switch (shape.type) {
    case ShapeType::kSphere:
      return p.norm() - shape.radius;
    case ShapeType::kCapsule: {
      const double along = std::clamp(p.z(), -shape.half_length, shape.half_length);
      return (p - Vec3(0, 0, along)).norm() - shape.radius;
    }
    case ShapeType::kBox:
      return box_distance(shape.half_size, p);
    case ShapeType::kCylinder:
      return cylinder_distance(shape.radius, shape.half_length, p);
    case ShapeType::kEllipsoid:
      return ellipsoid_distance(shape.half_size, p);
    case ShapeType::kHull:
      return hull_distance(model.hulls[static_cast<size_t>(shape.data)], p);
    case ShapeType::kPlane:
    case ShapeType::kHeightField:
      break;
  }
  assert(false);
  return 0;
}

std::vector<Vec3> surface_points(const Model& model, const Shape& shape) {
  std::vector<Vec3> points;
  const ShapeData data = data_of(model, shape);
  if (shape.type == ShapeType::kHull) {
    // corners that reach farthest, and middles of faces
    const Hull& hull = model.hulls[static_cast<size_t>(shape.data)];
    for (int k = 0; k < kDirections; ++k) {
      const Vec3 direction = spread(k, kDirections);
      points.push_back(*std::ranges::max_element(hull.vertices, {}, [&](const Vec3& v) { return v.dot(direction); }));
    }
    const size_t stride = std::max<size_t>(1, hull.faces.size() / kDirections);
    for (size_t k = 0; k < hull.faces.size(); k += stride) {
      const auto& face = hull.faces[k];
      points.push_back((hull.vertices[static_cast<size_t>(face[0])] + hull.vertices[static_cast<size_t>(face[1])] +
                        hull.vertices[static_cast<size_t>(face[2])]) /
                       3);
    }
    return points;
  }
  // along rays from the centre, which lies inside
  const double far = 2 * largest_reach(shape, data) + 1e-9;
  for (int k = 0; k < kDirections; ++k) {
    const Vec3 direction = spread(k, kDirections);
    double inside = 0, outside = far;
    for (int step = 0; step < 60; ++step) {
      const double middle = (inside + outside) / 2;
      (signed_distance(model, shape, middle * direction) < 0 ? inside : outside) = middle;
    }
    points.push_back(inside * direction);
  }
  if (shape.type == ShapeType::kBox) {
    for (const double x : {-1.0, 1.0}) {
      for (const double y : {-1.0, 1.0}) {
        for (const double z : {-1.0, 1.0}) points.push_back(shape.half_size.cwiseProduct(Vec3(x, y, z)));
      }
    }
  } else if (shape.type == ShapeType::kCylinder || shape.type == ShapeType::kCapsule) {
    for (int k = 0; k < 12; ++k) {
      const double turn = k * std::numbers::pi / 6;
      for (const double z : {-shape.half_length, shape.half_length}) {
        points.emplace_back(shape.radius * std::cos(turn), shape.radius * std::sin(turn), z);
      }
    }
    if (shape.type == ShapeType::kCapsule) {
      for (const double z : {-1.0, 1.0}) points.emplace_back(0, 0, z * (shape.half_length + shape.radius));
    }
  } else if (shape.type == ShapeType::kEllipsoid) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {-1.0, 1.0}) points.push_back(sign * shape.half_size[axis] * Vec3::Unit(axis));
    }
  }
  return points;
}

double surface_distance(const ShapeSet& a, const ShapeSet& b) {
  std::vector<bool> same_a(a.shapes.size()), same_b(b.shapes.size());
  for (size_t i = 0; i < a.shapes.size(); ++i) {
    for (size_t j = 0; j < b.shapes.size() && !same_a[i]; ++j) {
      if (!same_b[j] && equal(*a.model, *a.shapes[i], *b.model, *b.shapes[j])) same_a[i] = same_b[j] = true;
    }
  }
  return std::max(one_way(a, b, same_a), one_way(b, a, same_b));
}

}  // namespace assay::pairing
