#include "results/store/pictures.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <meshoptimizer.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"

namespace assay {
namespace {

constexpr size_t kFewest = 24;  // triangles that any mesh may keep

using nlohmann::json;

constexpr double kFinest = 1e-3;  // of a mesh's size: the step of its lengths

double size_of(const PictureMesh& mesh) {
  if (mesh.vertices.empty()) return 0;
  Vec3 low = mesh.vertices.front(), high = low;
  for (const Vec3& p : mesh.vertices) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return (high - low).norm();
}

// By quadric errors along edges; where that cannot reach the number, for example in a heap of loose triangles, by
// clustering vertices.
void simplify(PictureMesh& mesh, size_t triangles) {
  constexpr float kLargestError = 0.1F;  // of the mesh's size
  std::vector<float> points;
  points.reserve(3 * mesh.vertices.size());
  for (const Vec3& p : mesh.vertices) {
    for (int k = 0; k < 3; ++k) points.push_back(static_cast<float>(p[k]));
  }
  std::vector<unsigned int> corners, left;
  for (const auto& face : mesh.faces) {
    for (const int corner : face) corners.push_back(static_cast<unsigned int>(corner));
  }
  left.resize(corners.size());
  constexpr size_t kStride = 3 * sizeof(float);
  size_t count = meshopt_simplify(left.data(), corners.data(), corners.size(), points.data(), mesh.vertices.size(),
                                  kStride, 3 * triangles, kLargestError, 0, nullptr);
  if (count > 3 * triangles * 3 / 2) {
    count = meshopt_simplifySloppy(left.data(), corners.data(), corners.size(), points.data(), mesh.vertices.size(),
                                   kStride, 3 * triangles, 1.0F, nullptr);
  }
  std::vector<int> kept(mesh.vertices.size(), -1);
  PictureMesh small;
  for (size_t i = 0; i + 2 < count; i += 3) {
    std::array<int, 3> face{};
    for (size_t k = 0; k < 3; ++k) {
      const unsigned int corner = left[i + k];
      if (kept[corner] < 0) {
        kept[corner] = static_cast<int>(small.vertices.size());
        small.vertices.push_back(mesh.vertices[corner]);
      }
      face[k] = kept[corner];
    }
    small.faces.push_back(face);
  }
  mesh = std::move(small);
}

}  // namespace

size_t Pictures::triangles() const {
  size_t count = 0;
  for (const PictureMesh& mesh : meshes) count += mesh.faces.size();
  return count;
}

void simplify(Pictures& pictures, size_t most_triangles) {
  if (pictures.triangles() <= most_triangles) return;
  const size_t count = pictures.meshes.size();
  std::vector<double> size(count);
  std::ranges::transform(pictures.meshes, size.begin(), size_of);
  // in the order of how little of its share each mesh needs: what one leaves over goes to the others
  std::vector<size_t> order(count);
  for (size_t i = 0; i < count; ++i) order[i] = i;
  const auto need = [&](size_t i) {
    return static_cast<double>(pictures.meshes[i].faces.size()) / std::max(size[i], 1e-9);
  };
  std::ranges::sort(order, [&](size_t a, size_t b) { return need(a) < need(b); });
  double sizes = 0;
  for (const double each : size) sizes += each;
  auto left = static_cast<double>(most_triangles);
  for (const size_t i : order) {
    const double share = sizes > 0 ? left * size[i] / sizes : left;
    const size_t most = std::max(kFewest, static_cast<size_t>(share));
    PictureMesh& mesh = pictures.meshes[i];
    if (mesh.faces.size() > most) simplify(mesh, most);
    left = std::max(0.0, left - static_cast<double>(mesh.faces.size()));
    sizes -= size[i];
  }
}

json pictures_json(const Pictures& pictures) {
  json meshes = json::array(), parts = json::array();
  for (const PictureMesh& mesh : pictures.meshes) {
    const double step = kFinest * std::max(size_of(mesh), 1e-9);
    json points = json::array(), corners = json::array();
    for (const Vec3& p : mesh.vertices) {
      for (const double x : p) points.push_back(std::llround(x / step));
    }
    for (const auto& face : mesh.faces) {
      for (const int corner : face) corners.push_back(corner);
    }
    meshes.push_back({{"step", step}, {"v", std::move(points)}, {"f", std::move(corners)}});
  }
  for (const PicturePart& part : pictures.parts) {
    const Quat& q = part.X_BS.q;
    json rgba = json::array();
    for (const float value : part.rgba) rgba.push_back(std::round(1e4 * static_cast<double>(value)) / 1e4);
    parts.push_back({{"mesh", part.mesh},
                     {"body", part.body},
                     {"p", {part.X_BS.p.x(), part.X_BS.p.y(), part.X_BS.p.z()}},
                     {"q", {q.w(), q.x(), q.y(), q.z()}},
                     {"rgba", std::move(rgba)}});
  }
  return {{"meshes", std::move(meshes)}, {"parts", std::move(parts)}};
}

Pictures parse_pictures(const json& parsed) {
  try {
    Pictures pictures;
    for (const json& each : parsed.at("meshes")) {
      PictureMesh& mesh = pictures.meshes.emplace_back();
      const double step = each.at("step");
      const auto numbers = each.at("v").get<std::vector<double>>();
      for (size_t i = 0; i + 2 < numbers.size(); i += 3) {
        mesh.vertices.emplace_back(step * numbers[i], step * numbers[i + 1], step * numbers[i + 2]);
      }
      const auto corners = each.at("f").get<std::vector<int>>();
      for (size_t i = 0; i + 2 < corners.size(); i += 3) {
        mesh.faces.push_back({corners[i], corners[i + 1], corners[i + 2]});
        for (const int corner : mesh.faces.back()) {
          if (corner >= 0 && std::cmp_less(corner, mesh.vertices.size())) continue;
          throw InputError(
              fmt::format("the results have a mesh of {} points with a corner {}", mesh.vertices.size(), corner));
        }
      }
    }
    for (const json& each : parsed.at("parts")) {
      const auto p = each.at("p").get<std::array<double, 3>>();
      const auto q = each.at("q").get<std::array<double, 4>>();
      PicturePart part{each.at("mesh"),
                       each.at("body"),
                       {Vec3(p[0], p[1], p[2]), Quat(q[0], q[1], q[2], q[3])},
                       each.at("rgba").get<std::array<float, 4>>()};
      if (part.mesh < 0 || std::cmp_greater_equal(part.mesh, pictures.meshes.size())) {
        throw InputError(
            fmt::format("the results draw a mesh {}, of which there are {}", part.mesh, pictures.meshes.size()));
      }
      pictures.parts.push_back(part);
    }
    return pictures;
  } catch (const json::exception& error) {
    throw InputError(
        fmt::format("the results hold meshes that cannot be read ({}): they are another version's", error.what()));
  }
}

}  // namespace assay
