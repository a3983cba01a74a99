#include "report/thumbnail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <set>

#include <fmt/format.h>
#include <png.h>

#include "base/errors.h"

namespace assay {
namespace {

constexpr int kWidth = 300, kHeight = 220;  // twice the gallery's, for dense screens
constexpr int kFine = 2;                    // samples of a pixel along each side
constexpr double kElevation = -15 * std::numbers::pi / 180;

struct Surface {
  std::array<float, 4> rgba;
  int body;  // kWorld for what does not move
};

struct Triangle {
  std::array<Vec3, 3> corners;  // in the world frame, m; later in the view's
  Surface look;
};

// Triangles of a grid of points that wraps around in its second index.
template <typename Point>
void add_grid(int rows, int columns, const Point& point, const Surface& look, std::vector<Triangle>& out) {
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      const Vec3 a = point(i, j), b = point(i + 1, j), c = point(i + 1, j + 1), d = point(i, j + 1);
      out.push_back({{a, b, c}, look});
      out.push_back({{a, c, d}, look});
    }
  }
}

// A rotation that takes z to this direction.
Mat3 turn_to(const Vec3& direction) {
  const Vec3 axis = direction.normalized();
  Mat3 turn;
  turn.col(2) = axis;
  turn.col(0) = (std::abs(axis.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitY()).cross(axis).normalized();
  turn.col(1) = axis.cross(turn.col(0));
  return turn;
}

// A shape, or the rod that stands for it (model/shape.h).
void add_shape(const Scene& scene, const Shape& shape, const Pose& X_WS, std::vector<Triangle>& out) {
  constexpr int kRows = 14, kColumns = 28;
  const Surface look{shape.rgba, shape.body};
  const auto around = [](int j) { return 2 * std::numbers::pi * j / kColumns; };
  const auto direction = [&](int i, int j) {
    const double polar = std::numbers::pi * i / kRows;
    return Vec3(std::sin(polar) * std::cos(around(j)), std::sin(polar) * std::sin(around(j)), std::cos(polar));
  };
  switch (shape.type) {
    case ShapeType::kBox: {
      const auto corner = [&](int i, int j) {  // rows: a point, a square, a square, a point
        const double x = j % 4 == 0 || j % 4 == 3 ? 1 : -1, y = j % 4 < 2 ? 1 : -1;
        const bool middle = i == 0 || i == 3;
        return X_WS * Vec3(shape.half_size.cwiseProduct(Vec3(middle ? 0 : x, middle ? 0 : y, i < 2 ? 1 : -1)));
      };
      add_grid(3, 4, corner, look, out);
      return;
    }
    case ShapeType::kCylinder: {
      const auto rim = [&](int i, int j) {
        const double radius = i == 0 || i == 3 ? 0 : shape.radius;
        return X_WS * Vec3(radius * std::cos(around(j)), radius * std::sin(around(j)),
                           i < 2 ? shape.half_length : -shape.half_length);
      };
      add_grid(3, kColumns, rim, look, out);
      return;
    }
    case ShapeType::kEllipsoid:
      add_grid(
          kRows, kColumns, [&](int i, int j) { return X_WS * Vec3(shape.half_size.cwiseProduct(direction(i, j))); },
          look, out);
      return;
    default:
      break;
  }
  const Rod rod = rod_of(shape, data_of(scene, shape));
  const Vec3 along = rod.b - rod.a;
  const Mat3 turn = along.norm() > 0 ? turn_to(along) : Mat3(Mat3::Identity());
  // half a sphere about each end, one row between them
  const auto capsule = [&](int i, int j) {
    const bool far = i <= kRows / 2;
    return X_WS * Vec3((far ? rod.b : rod.a) + turn * Vec3(rod.radius * direction(far ? i : i - 1, j)));
  };
  add_grid(kRows + 1, kColumns, capsule, look, out);
}

std::vector<Triangle> triangles_of(const Scene& scene, const std::vector<Pose>& poses, const Pictures& pictures) {
  const auto pose_of = [&](int body) { return body == kWorld ? Pose() : poses[static_cast<size_t>(body)]; };
  std::vector<Triangle> out;
  std::set<int> seen;
  for (const PicturePart& part : pictures.parts) {
    if (part.body != kWorld && (part.body < 0 || static_cast<size_t>(part.body) >= poses.size())) continue;
    seen.insert(part.body);
    const Pose X_WS = pose_of(part.body) * part.X_BS;
    const PictureMesh& mesh = pictures.meshes[static_cast<size_t>(part.mesh)];
    const auto corner = [&](int i) { return X_WS * mesh.vertices[static_cast<size_t>(i)]; };
    for (const auto& [a, b, c] : mesh.faces) out.push_back({{corner(a), corner(b), corner(c)}, {part.rgba, part.body}});
  }
  for (const Shape& shape : scene.shapes) {
    const bool mark = !shape.collides && shape.body == kWorld;  // a target, the axes of a frame
    if (is_ground(shape) || mark || (shape.collides && seen.contains(shape.body))) continue;
    add_shape(scene, shape, pose_of(shape.body) * shape.X_BS, out);
  }
  return out;
}

// A rod from each joint to its parent's, for a file with shapes on few of its bodies.
std::vector<Triangle> skeleton_of(const Scene& scene, const std::vector<Pose>& poses) {
  const auto joint = [&](int body) {
    const auto at = static_cast<size_t>(body);
    return poses[at] * scene.bodies[at].anchor_B;
  };
  Eigen::AlignedBox3d box;
  for (size_t i = 0; i < poses.size(); ++i) box.extend(joint(static_cast<int>(i)));
  std::vector<Triangle> out;
  for (size_t i = 0; i < poses.size(); ++i) {
    const int parent = scene.bodies[i].parent;
    if (parent == kWorld) continue;
    const Vec3 a = joint(parent), b = joint(static_cast<int>(i));
    Shape rod;
    rod.type = ShapeType::kCapsule;
    rod.body = static_cast<int>(i);
    rod.radius = 0.015 * box.diagonal().norm();
    rod.half_length = (b - a).norm() / 2;
    rod.rgba = {0.6F, 0.65F, 0.7F, 1};
    const Quat turn(rod.half_length > 0 ? turn_to(b - a) : Mat3(Mat3::Identity()));
    add_shape(scene, rod, {(a + b) / 2, turn}, out);
  }
  return out;
}

// The tree that each body is part of: its root.
std::vector<int> roots_of(const Scene& scene) {
  std::vector<int> roots(scene.bodies.size());
  for (size_t i = 0; i < roots.size(); ++i) {
    const int parent = scene.bodies[i].parent;
    const bool is_root = parent == kWorld || static_cast<size_t>(parent) >= i;
    roots[i] = is_root ? static_cast<int>(i) : roots[static_cast<size_t>(parent)];
  }
  return roots;
}

// What the picture is filled with: the robot, without what is small beside it or stands far from it.
Eigen::AlignedBox3d frame_of(const Scene& scene, const std::vector<Triangle>& triangles) {
  const std::vector<int> roots = roots_of(scene);
  const auto bodies_of = [&](int root) { return std::ranges::count(roots, root); };
  std::ptrdiff_t most = 0;
  for (const int root : roots) most = std::max(most, bodies_of(root));
  constexpr std::ptrdiff_t kSmall = 10;  // times fewer bodies
  std::set<int> large;
  for (const int root : roots) {
    if (kSmall * bodies_of(root) >= most) large.insert(root);
  }
  Eigen::AlignedBox3d robot, all;
  for (const auto& [corners, look] : triangles) {
    const bool is_part = look.body != kWorld && large.contains(roots[static_cast<size_t>(look.body)]);
    for (const Vec3& corner : corners) {
      all.extend(corner);
      if (is_part) robot.extend(corner);
    }
  }
  if (robot.isEmpty()) return all;
  const Vec3 around = robot.sizes() / 2;
  const Eigen::AlignedBox3d near(Vec3(robot.min() - around), Vec3(robot.max() + around));
  for (const auto& [corners, look] : triangles) {
    if (look.body != kWorld || !std::ranges::all_of(corners, [&](const Vec3& one) { return near.contains(one); }))
      continue;
    for (const Vec3& corner : corners) robot.extend(corner);
  }
  return robot;
}

class Raster {
 public:
  Raster() : depth_(kPixels, -std::numeric_limits<double>::infinity()), color_(kPixels, Vec3::Zero()) {}

  // Corners in fine pixels, with the distance towards the camera.
  void fill(const std::array<Vec3, 3>& corners, const Vec3& color) {
    const auto& [a, b, c] = corners;
    const double area = (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
    if (std::abs(area) < 1e-12) return;
    const auto first = [](double least) { return static_cast<int>(std::ceil(std::clamp(least - 0.5, 0.0, 1e6))); };
    const auto last = [](double most, int size) {
      return static_cast<int>(std::floor(std::clamp(most - 0.5, -1.0, size - 1.0)));
    };
    const int x1 = last(std::max({a.x(), b.x(), c.x()}), kWidth * kFine);
    const int y1 = last(std::max({a.y(), b.y(), c.y()}), kHeight * kFine);
    for (int y = first(std::min({a.y(), b.y(), c.y()})); y <= y1; ++y) {
      for (int x = first(std::min({a.x(), b.x(), c.x()})); x <= x1; ++x) {
        const double px = x + 0.5, py = y + 0.5;
        const double of_b = ((px - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (py - a.y())) / area;
        const double of_c = ((b.x() - a.x()) * (py - a.y()) - (px - a.x()) * (b.y() - a.y())) / area;
        if (of_b < 0 || of_c < 0 || of_b + of_c > 1) continue;
        const auto at = static_cast<size_t>(y * kWidth * kFine + x);
        const double depth = a.z() + of_b * (b.z() - a.z()) + of_c * (c.z() - a.z());
        if (depth <= depth_[at]) continue;
        depth_[at] = depth;
        color_[at] = color;
      }
    }
  }

  // RGBA, rows from the top.
  std::vector<std::uint8_t> pixels() const {
    constexpr double kSamples = kFine * kFine;
    constexpr int kCoarse = 0xf8;  // fewer colours, which pack better
    std::vector<std::uint8_t> out;
    out.reserve(static_cast<size_t>(kWidth * kHeight) * 4);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        Vec3 sum = Vec3::Zero();
        int covered = 0;
        for (int i = 0; i < kFine * kFine; ++i) {
          const int row = y * kFine + i / kFine, column = x * kFine + i % kFine;
          const auto at = static_cast<size_t>(row * kWidth * kFine + column);
          if (std::isinf(depth_[at])) continue;
          sum += color_[at];
          ++covered;
        }
        const Vec3 mean = covered > 0 ? Vec3(sum / covered) : sum;
        for (const double part : mean) {
          out.push_back(static_cast<std::uint8_t>(std::lround(255 * std::clamp(part, 0.0, 1.0)) & kCoarse));
        }
        out.push_back(static_cast<std::uint8_t>(std::lround(255 * covered / kSamples)));
      }
    }
    return out;
  }

 private:
  static constexpr size_t kPixels = static_cast<size_t>(kWidth * kFine) * kHeight * kFine;
  std::vector<double> depth_;
  std::vector<Vec3> color_;
};

std::string png_of(const std::vector<std::uint8_t>& rgba) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = kWidth;
  image.height = kHeight;
  image.format = PNG_FORMAT_RGBA;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, rgba.data(), 0, nullptr) == 0) {
    throw SystemError(fmt::format("cannot make a picture of a robot: {}", static_cast<const char*>(image.message)));
  }
  bytes.resize(size);
  return bytes;
}

}  // namespace

std::string thumbnail_png(const Scene& scene, const std::vector<Pose>& poses, const Pictures& pictures,
                          double azimuth_deg) {
  std::vector<Triangle> triangles = triangles_of(scene, poses, pictures);
  std::set<int> shown;
  for (const Triangle& triangle : triangles) shown.insert(triangle.look.body);
  constexpr size_t kFew = 4;  // times fewer bodies with a shape
  if (kFew * shown.size() < poses.size()) triangles = skeleton_of(scene, poses);
  const double azimuth = azimuth_deg * std::numbers::pi / 180;
  const double ca = std::cos(azimuth), sa = std::sin(azimuth), ce = std::cos(kElevation), se = std::sin(kElevation);
  Mat3 to_view;  // to the right, down, towards the camera
  to_view << sa, -ca, 0, ca * se, sa * se, -ce, -ca * ce, -sa * ce, -se;
  std::erase_if(triangles, [](const Triangle& triangle) {
    return std::ranges::any_of(triangle.corners, [](const Vec3& corner) { return !corner.allFinite(); });
  });
  for (Triangle& triangle : triangles) {
    for (Vec3& corner : triangle.corners) corner = to_view * corner;
  }
  const Eigen::AlignedBox3d box = frame_of(scene, triangles);
  if (box.isEmpty() || !(box.sizes().head<2>().maxCoeff() > 0)) return "";
  constexpr double kFilled = 0.97;
  const double scale =
      kFilled * kFine * std::min(kWidth / std::max(box.sizes().x(), 1e-12), kHeight / std::max(box.sizes().y(), 1e-12));
  const Vec3 offset(kWidth * kFine / 2.0, kHeight * kFine / 2.0, 0);
  const Vec3 light = Vec3(-0.45, -0.65, 0.62).normalized();
  Raster raster;
  for (const auto& [corners, look] : triangles) {
    const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    if (!(normal.norm() > 0)) continue;
    const Vec3 towards = normal.normalized() * (normal.z() < 0 ? -1 : 1);
    const double shade = 0.5 + 0.5 * std::max(0.0, towards.dot(light));
    // black parts keep their form
    const Vec3 color = Vec3(look.rgba[0], look.rgba[1], look.rgba[2]) * 0.84 + Vec3::Constant(0.14);
    std::array<Vec3, 3> placed;
    for (size_t i = 0; i < 3; ++i) placed[i] = offset + scale * (corners[i] - box.center());
    raster.fill(placed, shade * color);
  }
  return png_of(raster.pixels());
}

}  // namespace assay
