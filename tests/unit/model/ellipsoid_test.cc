#include "model/ellipsoid.h"

#include <map>
#include <random>
#include <utility>

#include <gtest/gtest.h>

namespace assay {
namespace {

TEST(EllipsoidHull, TangentPlanesAreAsFarFromTheCentreAsTheEllipsoids) {
  std::mt19937 random(3);  // NOLINT(bugprone-random-generator-seed): the same every time
  std::normal_distribution<double> normal;
  const Vec3 axes(0.03, 0.1, 0.25);
  for (const auto& [subdivisions, vertices, bound] : {std::tuple{2, 162, 0.009}, std::tuple{3, 642, 0.0023}}) {
    const Hull hull = ellipsoid_hull(axes, subdivisions);
    ASSERT_EQ(hull.vertices.size(), vertices);
    double least = 1, most = -1;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 n = Vec3(normal(random), normal(random), normal(random)).normalized();
      double support = 0;
      for (const Vec3& vertex : hull.vertices) support = std::max(support, n.dot(vertex));
      const double error = support / n.cwiseProduct(axes).norm() - 1;
      least = std::min(least, error);
      most = std::max(most, error);
    }
    EXPECT_LT(most, bound);
    EXPECT_GT(least, -bound);
    EXPECT_GT(most - least, bound);
  }
}

TEST(EllipsoidHull, IsClosedConvexAndFacesOutward) {
  const Hull hull = ellipsoid_hull({1, 2, 3}, 2);
  EXPECT_EQ(hull.faces.size(), 320U);
  std::map<std::pair<int, int>, int> edges;
  for (const auto& face : hull.faces) {
    const Vec3 &a = hull.vertices[face[0]], &b = hull.vertices[face[1]], &c = hull.vertices[face[2]];
    const Vec3 n = (b - a).cross(c - a).normalized();
    for (const Vec3& vertex : hull.vertices) EXPECT_LT(n.dot(vertex - a), 1e-12);
    for (int k = 0; k < 3; ++k) ++edges[{face[k], face[(k + 1) % 3]}];
  }
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ((edges.count({edge.second, edge.first})), 1U);
  }
}

}  // namespace
}  // namespace assay
