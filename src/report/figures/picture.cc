#include "report/figures/picture.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fnmatch.h>

#include "base/toml_file.h"

namespace assay::figures {
namespace {

constexpr const char* kViews =
#include "views.inc"
    ;

}  // namespace

double azimuth_of(const std::string& system) {
  static const toml::table views = toml_table(kViews, "models/views.toml");
  for (const auto& [pattern, azimuth] : *views["systems"].as_table()) {
    const std::string text(pattern.str());
    if (::fnmatch(text.c_str(), system.c_str(), FNM_NOESCAPE) == 0) return azimuth.value<double>().value();
  }
  return views["azimuth"].value<double>().value();
}

size_t picture(Canvas& canvas, const Box& box, const Scene& scene, const std::vector<Pose>& poses,
               double azimuth_degrees, double share) {
  constexpr double kDegree = 0.017453292519943295;
  const double azimuth = azimuth_degrees * kDegree, elevation = -15 * kDegree;
  const double ca = std::cos(azimuth), sa = std::sin(azimuth), ce = std::cos(elevation), se = std::sin(elevation);
  const Vec3 right(sa, -ca, 0), up(-ca * se, -sa * se, ce), back(-ca * ce, -sa * ce, -se);
  struct Stroke {
    double depth;
    Canvas::Point a, b;
    double radius;
    Color color;
  };
  std::vector<Stroke> strokes;
  for (const Shape& shape : scene.shapes) {
    if (is_ground(shape)) continue;
    const Pose pose = (shape.body == kWorld ? Pose() : poses[static_cast<size_t>(shape.body)]) * shape.X_BS;
    const Rod rod = rod_of(shape, data_of(scene, shape));
    const Vec3 a = pose * rod.a, b = pose * rod.b;
    strokes.push_back({back.dot(a + b),
                       {right.dot(a), -up.dot(a)},
                       {right.dot(b), -up.dot(b)},
                       rod.radius,
                       {shape.rgba[0], shape.rgba[1], shape.rgba[2]}});
  }
  if (strokes.empty()) return 0;
  const auto middle_of = [&](double Canvas::Point::* axis) {
    std::vector<double> sums;
    sums.reserve(strokes.size());
    for (const Stroke& stroke : strokes) sums.push_back(stroke.a.*axis + stroke.b.*axis);
    std::ranges::nth_element(sums, sums.begin() + std::ssize(sums) / 2);
    return sums[sums.size() / 2] / 2;
  };
  const Canvas::Point middle{middle_of(&Canvas::Point::x), middle_of(&Canvas::Point::y)};
  std::ranges::stable_sort(strokes, {}, [&](const Stroke& stroke) {
    return std::hypot((stroke.a.x + stroke.b.x) / 2 - middle.x, (stroke.a.y + stroke.b.y) / 2 - middle.y);
  });
  const auto shown = static_cast<size_t>(std::ceil(share * static_cast<double>(strokes.size())));
  double x1 = std::numeric_limits<double>::infinity(), x2 = -x1, y1 = x1, y2 = -x1;
  for (size_t i = 0; i < shown; ++i) {
    const Stroke& stroke = strokes[i];
    for (const Canvas::Point& end : {stroke.a, stroke.b}) {
      x1 = std::min(x1, end.x - stroke.radius);
      x2 = std::max(x2, end.x + stroke.radius);
      y1 = std::min(y1, end.y - stroke.radius);
      y2 = std::max(y2, end.y + stroke.radius);
    }
  }
  std::ranges::stable_sort(strokes, {}, &Stroke::depth);
  const double scale = std::min(box.width() / (x2 - x1), box.height() / (y2 - y1));
  const auto place = [&](const Canvas::Point& p) {
    return Canvas::Point{(box.left + box.right) / 2 + scale * (p.x - (x1 + x2) / 2),
                         (box.top + box.bottom) / 2 + scale * (p.y - (y1 + y2) / 2)};
  };
  size_t outside = 0;
  canvas.clip(box.left - 1, box.top - 1, box.width() + 2, box.height() + 2);
  for (const Stroke& stroke : strokes) {
    const double thickness = 2 * scale * stroke.radius;
    const Canvas::Point a = place(stroke.a), b = place(stroke.b);
    const double x = (a.x + b.x) / 2, y = (a.y + b.y) / 2;
    if (x < box.left || x > box.right || y < box.top || y > box.bottom) ++outside;
    canvas.stroke(a, b, mix(stroke.color, kInk, 0.55), thickness);
    canvas.stroke(a, b, stroke.color, std::max(0.7 * thickness, thickness - 1));
  }
  canvas.unclip();
  return outside;
}

std::vector<Pose> start_of(const Scene& scene) {
  std::vector<Pose> poses;
  poses.reserve(scene.bodies.size());
  for (const SceneBody& body : scene.bodies) poses.push_back(body.X_WB);
  return poses;
}

void start_picture(Canvas& canvas, const Results& results, const Box& box, const std::string& system) {
  if (const Scene* scene = results.scene(system)) picture(canvas, box, *scene, start_of(*scene), azimuth_of(system));
}

}  // namespace assay::figures
