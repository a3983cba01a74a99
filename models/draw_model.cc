// Draws a model's first keyframe as an SVG picture: shapes in parallel projection, the far ones first.
//
// Usage: draw_model models/grasp.xml AZIMUTH ELEVATION > picture.svg, the camera's direction in degrees: azimuth 0
// looks along x, elevation counts upward. Needs only MuJoCo.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <mujoco/mujoco.h>

namespace {

// A capsule or sphere in the picture plane: a line with round ends, in metres.
struct Stroke {
  double depth = 0;                 // of the centre; larger is nearer
  std::array<double, 4> line = {};  // x1, y1, x2, y2; y down
  double width = 0;                 // diameter
  std::array<int, 3> colour = {};   // 0 to 255
};

template <typename T>
T* row(T* array, std::ptrdiff_t width, int index) {
  return array + width * index;
}

std::vector<Stroke> strokes(const mjModel* m, const mjData* d, double azimuth, double elevation) {
  const double ca = std::cos(azimuth), sa = std::sin(azimuth), ce = std::cos(elevation), se = std::sin(elevation);
  const std::array<double, 3> right = {sa, -ca, 0}, up = {-ca * se, -sa * se, ce}, back = {-ca * ce, -sa * ce, -se};
  std::vector<Stroke> found;
  for (int g = 0; g < m->ngeom; ++g) {
    if (m->geom_type[g] != mjGEOM_CAPSULE && m->geom_type[g] != mjGEOM_SPHERE) continue;
    const double half = m->geom_type[g] == mjGEOM_CAPSULE ? row(m->geom_size, 3, g)[1] : 0;
    Stroke stroke;
    stroke.width = 2 * *row(m->geom_size, 3, g);
    for (const size_t end : {0U, 1U}) {
      std::array<double, 3> p = {};
      for (int k = 0; k < 3; ++k) {
        p[k] = row(d->geom_xpos, 3, g)[k] + (end == 0 ? -half : half) * row(d->geom_xmat, 9, g)[3 * k + 2];
      }
      const auto along = [&](const std::array<double, 3>& axis) { return mju_dot3(axis.data(), p.data()); };
      stroke.line[2 * end] = along(right);
      stroke.line[2 * end + 1] = -along(up);
      stroke.depth += along(back) / 2;
    }
    for (int k = 0; k < 3; ++k) stroke.colour[k] = static_cast<int>(255 * row(m->geom_rgba, 4, g)[k]);
    found.push_back(stroke);
  }
  std::ranges::sort(found, {}, &Stroke::depth);
  return found;
}

void print_line(const Stroke& s, double shrink, const std::string& colour) {
  std::printf("<line x1=\"%.4f\" y1=\"%.4f\" x2=\"%.4f\" y2=\"%.4f\" stroke=\"%s\" stroke-width=\"%.4f\"/>\n",
              s.line[0], s.line[1], s.line[2], s.line[3], colour.c_str(), s.width - shrink);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: draw_model MODEL.xml AZIMUTH ELEVATION > picture.svg\n");
    return 2;
  }
  std::array<char, 1000> error = {};
  const std::unique_ptr<mjModel, void (*)(mjModel*)> model(
      mj_loadXML(argv[1], nullptr, error.data(), static_cast<int>(error.size())), mj_deleteModel);
  if (model == nullptr) {
    std::fprintf(stderr, "%s: %s\n", argv[1], error.data());
    return 2;
  }
  const std::unique_ptr<mjData, void (*)(mjData*)> data(mj_makeData(model.get()), mj_deleteData);
  if (model->nkey > 0) mj_resetDataKeyframe(model.get(), data.get(), 0);
  mj_forward(model.get(), data.get());

  constexpr double kDegree = std::numbers::pi / 180;
  const std::vector<Stroke> all = strokes(model.get(), data.get(), std::strtod(argv[2], nullptr) * kDegree,
                                          std::strtod(argv[3], nullptr) * kDegree);
  std::array<double, 4> box = {1e9, 1e9, -1e9, -1e9};  // smallest x, y; largest x, y
  for (const Stroke& s : all) {
    for (const int end : {0, 2}) {
      for (const int k : {0, 1}) {
        box[k] = std::min(box[k], s.line[end + k] - s.width / 2);
        box[2 + k] = std::max(box[2 + k], s.line[end + k] + s.width / 2);
      }
    }
  }
  const double edge = std::max(box[2] - box[0], box[3] - box[1]), border = 0.03 * edge, outline = 0.006 * edge;
  std::printf("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"%.4f %.4f %.4f %.4f\" stroke-linecap=\"round\">\n",
              box[0] - border, box[1] - border, box[2] - box[0] + 2 * border, box[3] - box[1] + 2 * border);
  for (const Stroke& s : all) {
    std::array<char, 8> colour = {};
    std::snprintf(colour.data(), colour.size(), "#%02x%02x%02x", s.colour[0], s.colour[1], s.colour[2]);
    print_line(s, 0, "#333333");
    print_line(s, outline, colour.data());
  }
  std::printf("</svg>\n");
  return 0;
}
