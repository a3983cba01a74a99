#include "model/ellipsoid.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace assay {
namespace {

Hull icosahedron() {
  constexpr double kLong = std::numbers::phi;
  Hull hull;
  for (const double a : {-1.0, 1.0}) {
    for (const double b : {-kLong, kLong}) {
      hull.vertices.insert(hull.vertices.end(), {{0, a, b}, {a, b, 0}, {b, 0, a}});
    }
  }
  // its faces are the triples of vertices at the edge's length 2 from each other
  const auto joined = [&](int i, int j) { return (hull.vertices[i] - hull.vertices[j]).squaredNorm() < 4.1; };
  for (int i = 0; i < 12; ++i) {
    for (int j = i + 1; j < 12; ++j) {
      for (int k = j + 1; k < 12; ++k) {
        if (!joined(i, j) || !joined(j, k) || !joined(i, k)) continue;
        const Vec3 &a = hull.vertices[i], &b = hull.vertices[j], &c = hull.vertices[k];
        const bool outward = a.dot(b.cross(c)) > 0;
        hull.faces.push_back({i, outward ? j : k, outward ? k : j});
      }
    }
  }
  for (Vec3& vertex : hull.vertices) vertex.normalize();
  return hull;
}

// Every triangle becomes four, their new corners on the unit sphere.
void subdivide(Hull& sphere) {
  std::map<std::pair<int, int>, int> middles;
  const auto middle = [&](int a, int b) {
    const auto [found, added] = middles.emplace(std::minmax(a, b), static_cast<int>(sphere.vertices.size()));
    if (added) sphere.vertices.push_back((sphere.vertices[a] + sphere.vertices[b]).normalized());
    return found->second;
  };
  std::vector<std::array<int, 3>> faces;
  for (const auto& [a, b, c] : sphere.faces) {
    const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    faces.insert(faces.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  sphere.faces = std::move(faces);
}

}  // namespace

Hull ellipsoid_hull(const Vec3& semi_axes, int subdivisions) {
  Hull hull = icosahedron();
  for (int n = 0; n < subdivisions; ++n) subdivide(hull);
  double inner = 1;  // distance of the nearest face from the centre
  for (const auto& [a, b, c] : hull.faces) {
    const Vec3 normal = (hull.vertices[b] - hull.vertices[a]).cross(hull.vertices[c] - hull.vertices[a]).normalized();
    inner = std::min(inner, normal.dot(hull.vertices[a]));
  }
  for (Vec3& vertex : hull.vertices) vertex = vertex.cwiseProduct(semi_axes) * (2 / (1 + inner));
  return hull;
}

}  // namespace assay
