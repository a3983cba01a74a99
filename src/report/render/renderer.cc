#include "report/render/renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include "base/errors.h"
#include "report/render/gl.h"

namespace assay {
namespace {

constexpr double kFieldOfView = 40;  // deg, vertical

struct Free {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
  void operator()(mjData* data) const { mj_deleteData(data); }
  void operator()(mjSpec* spec) const { mj_deleteSpec(spec); }
};

std::string numbers_text(const Vec3& v) { return fmt::format("{:.9g} {:.9g} {:.9g}", v.x(), v.y(), v.z()); }

// The part of a geom that says its shape.
std::string size_xml(const Shape& shape) {
  const auto geom = [](const char* type, const std::string& size) {
    return fmt::format("type='{}' size='{}'", type, size);
  };
  switch (shape.type) {
    case ShapeType::kSphere:
      return geom("sphere", fmt::format("{:.9g}", shape.radius));
    case ShapeType::kCapsule:
      return geom("capsule", fmt::format("{:.9g} {:.9g}", shape.radius, shape.half_length));
    case ShapeType::kCylinder:
      return geom("cylinder", fmt::format("{:.9g} {:.9g}", shape.radius, shape.half_length));
    case ShapeType::kBox:
      return geom("box", numbers_text(shape.half_size));
    case ShapeType::kEllipsoid:
      return geom("ellipsoid", numbers_text(shape.half_size));
    case ShapeType::kPlane:
      return "type='plane' size='0 0 1' material='floor'";
    case ShapeType::kHull:
      return fmt::format("type='mesh' mesh='hull{}'", shape.data);
    case ShapeType::kHeightField:
      return fmt::format("type='hfield' hfield='field{}'", shape.data);
  }
  return "";
}

std::string geom_xml(const Scene& scene, const Shape& shape) {
  const Quat& q = shape.X_BS.q;
  Vec3 p = shape.X_BS.p;
  if (shape.type == ShapeType::kHeightField) {
    // MuJoCo's field begins at its lowest sample
    p = shape.X_BS * Vec3(0, 0, std::ranges::min(scene.height_fields[static_cast<size_t>(shape.data)].heights));
  }
  const std::string pose = fmt::format("pos='{}' quat='{:.9g} {:.9g} {:.9g} {:.9g}' contype='0' conaffinity='0'",
                                       numbers_text(p), q.w(), q.x(), q.y(), q.z());
  if (shape.type == ShapeType::kPlane) return fmt::format("<geom {} {}/>", size_xml(shape), pose);
  return fmt::format("<geom {} rgba='{:.4g} {:.4g} {:.4g} {:.4g}' {}/>", size_xml(shape), shape.rgba[0], shape.rgba[1],
                     shape.rgba[2], shape.rgba[3], pose);
}

// The hulls and height fields that shapes use.
std::string data_xml(const Scene& scene) {
  std::string xml;
  for (size_t i = 0; i < scene.hulls.size(); ++i) {
    std::string corners;
    for (const Vec3& corner : scene.hulls[i]) corners += numbers_text(corner) + " ";
    // a shell, for a hull that has next to no volume
    xml += fmt::format("<mesh name='hull{}' inertia='shell' vertex='{}'/>", i, corners);
  }
  for (size_t i = 0; i < scene.height_fields.size(); ++i) {
    const HeightField& field = scene.height_fields[i];
    const auto columns = static_cast<size_t>(field.columns);
    std::string heights;
    for (auto row = static_cast<size_t>(field.rows); row-- > 0;) {  // MJCF begins with the last row
      for (size_t column = 0; column < columns; ++column) {
        heights += fmt::format("{:.6g} ", field.heights[row * columns + column]);
      }
    }
    const auto [low, high] = std::ranges::minmax(field.heights);
    xml += fmt::format("<hfield name='field{}' nrow='{}' ncol='{}' size='{:.9g} {:.9g} {:.9g} {:.9g}' elevation='{}'/>",
                       i, field.rows, field.columns, field.half_x, field.half_y, high > low ? high - low : 1,
                       std::max(1e-6, field.base + low), heights);
  }
  return xml;
}

// The scene as a MuJoCo model whose bodies are mocap bodies, posed from outside.
std::string scene_xml(const Scene& scene, const View& view, int width, int height) {
  const std::string grey = numbers_text(Vec3::Constant(kBackground / 255.0));
  std::string xml = fmt::format(
      "<mujoco><statistic center='{}' extent='{:.9g}'/>"
      "<visual><global offwidth='{}' offheight='{}' fovy='{}'/><map znear='0.05' zfar='100' "
      "shadowclip='1.5'/>"
      "<quality shadowsize='2048' offsamples='4'/>"
      "<headlight ambient='0.35 0.35 0.35' diffuse='0.35 0.35 0.35' specular='0.1 0.1 0.1'/></visual>"
      "<asset><texture type='skybox' builtin='flat' rgb1='{}' rgb2='{}' width='32' height='192'/>"
      "<texture name='floor' type='2d' builtin='checker' rgb1='.84 .86 .88' rgb2='.74 .77 .8' width='128' "
      "height='128'/><material name='floor' texture='floor' texuniform='true' texrepeat='1 1'/>{}</asset>"
      "<worldbody><light directional='true' pos='{}' dir='0.2 0.3 -1' diffuse='.55 .55 .55' "
      "specular='.2 .2 .2' castshadow='true'/>",
      numbers_text(view.centre), view.radius, width, height, kFieldOfView, grey, grey, data_xml(scene),
      numbers_text(view.centre + Vec3(-0.6, -0.9, 3) * view.radius));
  for (const Shape& shape : scene.shapes) {
    if (shape.body == kWorld) xml += geom_xml(scene, shape);
  }
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    xml += "<body mocap='true'>";
    for (const Shape& shape : scene.shapes) {
      if (std::cmp_equal(shape.body, i)) xml += geom_xml(scene, shape);
    }
    xml += "</body>";
  }
  return xml + "</worldbody></mujoco>";
}

std::unique_ptr<mjModel, Free> compile(const std::string& xml) {
  std::array<char, 512> why{};
  const std::unique_ptr<mjSpec, Free> spec(mj_parseXMLString(xml.c_str(), nullptr, why.data(), why.size()));
  std::unique_ptr<mjModel, Free> model(spec ? mj_compile(spec.get(), nullptr) : nullptr);
  if (model) return model;
  throw SystemError(fmt::format("MuJoCo cannot draw this model: {}", spec ? mjs_getError(spec.get()) : why.data()));
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace

View view_of(const Scene& scene, const std::vector<const std::vector<State>*>& runs) {
  // For each body the reach of its shapes from its centre of mass.
  std::vector<double> reach(scene.bodies.size(), 0);
  for (const Shape& shape : scene.shapes) {
    if (shape.body == kWorld) continue;
    const auto body = static_cast<size_t>(shape.body);
    const double far = (shape.X_BS.p - scene.bodies[body].p_BBcm).norm() + largest_reach(shape, data_of(scene, shape));
    reach[body] = std::max(reach[body], far);
  }
  std::array<std::vector<double>, 3> lower, upper;
  for (const std::vector<State>* run : runs) {
    Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const State& state : *run) {
      for (size_t i = 0; i < state.bodies.size(); ++i) {
        low = low.cwiseMin(state.bodies[i].p_WBcm - Vec3::Constant(reach[i]));
        high = high.cwiseMax(state.bodies[i].p_WBcm + Vec3::Constant(reach[i]));
      }
    }
    if (!low.allFinite() || !high.allFinite()) continue;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      lower.at(static_cast<size_t>(axis)).push_back(low[axis]);
      upper.at(static_cast<size_t>(axis)).push_back(high[axis]);
    }
  }
  View view;
  if (lower[0].empty()) return view;
  const Vec3 low(median(lower[0]), median(lower[1]), median(lower[2]));
  const Vec3 high(median(upper[0]), median(upper[1]), median(upper[2]));
  view.centre = (low + high) / 2;
  const Vec3 extent = high - low;
  constexpr double kPoint = 1e-9;  // m; bodies without shapes that stay where they are
  if (extent.norm() > kPoint) view.radius = extent.norm() / 2;
  // A planar motion is viewed along the plane's normal.
  constexpr double kFlat = 0.4, kSlant = 20, kFromAbove = -65;
  const double largest = extent.maxCoeff();
  if (extent.z() < kFlat * largest && extent.z() <= std::min(extent.x(), extent.y())) {
    view.elevation = kFromAbove;
    view.azimuth = 90;
  } else if (extent.y() < kFlat * largest && extent.y() < extent.x()) {
    view.azimuth = 90 + kSlant;
  } else if (extent.x() < kFlat * largest) {
    view.azimuth = 180 + kSlant;
  }
  return view;
}

int grid_columns(int panels, int width, int height) {
  int best = 1;
  double largest = 0;
  for (int columns = 1; columns <= panels; ++columns) {
    const int rows = (panels + columns - 1) / columns;
    // the side of the largest square that fits, a little more for the area
    const double w = static_cast<double>(width) / columns, h = static_cast<double>(height) / rows;
    const double room = std::min(w, h) + 1e-3 * std::max(w, h);
    if (room > largest) {
      largest = room;
      best = columns;
    }
  }
  return best;
}

struct Renderer::Impl {
  Impl(const Scene& drawn, const View& from, int w, int h, int lettering)
      : scene(drawn), view(from), width(w), height(h), model(compile(scene_xml(drawn, from, w, h))) {
    data.reset(mj_makeData(model.get()));
    if (!data) throw SystemError("there is not enough memory to draw");
    gl = GlContext::make();
    constexpr int kDecorations = 100;
    mjv_defaultScene(&drawing);
    mjv_makeScene(model.get(), &drawing, static_cast<int>(scene.shapes.size()) + kDecorations);
    mjr_defaultContext(context.get());
    mjr_makeContext(model.get(), context.get(), lettering);
    mjr_setBuffer(mjFB_OFFSCREEN, context.get());
    mjv_defaultOption(&option);
    const mjrRect room = mjr_maxViewport(context.get());
    if (context->currentBuffer == mjFB_OFFSCREEN && room.width >= width && room.height >= height) return;
    const std::string why =
        fmt::format("OpenGL here cannot draw {} x {} pixels, at most {} x {}", width, height, room.width, room.height);
    release();
    throw SystemError(why);
  }
  ~Impl() { release(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void release() {
    mjr_freeContext(context.get());
    mjv_freeScene(&drawing);
  }

  void place(const State& state) const {
    for (size_t i = 0; i < scene.bodies.size(); ++i) {
      const Pose pose = scene_pose(scene.bodies[i], state.bodies[i]);
      std::ranges::copy(pose.p, data->mocap_pos + 3 * i);
      const std::array<double, 4> q = {pose.q.w(), pose.q.x(), pose.q.y(), pose.q.z()};
      std::ranges::copy(q, data->mocap_quat + 4 * i);
    }
    mj_kinematics(model.get(), data.get());
    mj_camlight(model.get(), data.get());
  }

  void draw(const Panel& panel, const mjrRect& room) {
    if (panel.state != nullptr) {
      place(*panel.state);
      mjvCamera camera;
      mjv_defaultCamera(&camera);
      std::ranges::copy(view.centre, camera.lookat);
      // The sphere fits into the narrower of both angles.
      const double half = kFieldOfView / 2 * std::numbers::pi / 180;
      const double aspect = static_cast<double>(room.width) / room.height;
      const double narrow = std::atan(std::tan(half) * std::min(1.0, aspect));
      camera.distance = view.radius / std::sin(narrow);
      camera.azimuth = view.azimuth;
      camera.elevation = view.elevation;
      mjv_updateScene(model.get(), data.get(), &option, nullptr, &camera, mjCAT_ALL, &drawing);
      // A floor would cast shadow artefacts on itself.
      for (int i = 0; i < drawing.ngeom; ++i) {
        if (drawing.geoms[i].type == mjGEOM_PLANE) drawing.geoms[i].castshadow = 0;
      }
      drawing.flags[mjRND_REFLECTION] = drawing.flags[mjRND_HAZE] = drawing.flags[mjRND_FOG] = 0;
      mjr_render(room, &drawing, context.get());
    } else {
      constexpr float kGrey = kBackground / 255.0F;
      mjr_rectangle(room, kGrey, kGrey, kGrey, 1);
    }
    if (!panel.text.empty()) {
      mjr_overlay(mjFONT_NORMAL, mjGRID_TOPLEFT, room, panel.text.c_str(), nullptr, context.get());
    }
  }

  Scene scene;
  View view;
  int width, height;
  std::unique_ptr<mjModel, Free> model;
  std::unique_ptr<mjData, Free> data;
  std::unique_ptr<GlContext> gl;
  mjvScene drawing{};
  mjvOption option{};
  std::unique_ptr<mjrContext> context = std::make_unique<mjrContext>();
};

Renderer::Renderer(const Scene& scene, const View& view, int width, int height, int lettering)
    : impl_(std::make_unique<Impl>(scene, view, width, height, lettering)) {}

Renderer::~Renderer() = default;

Picture Renderer::draw(const std::vector<Panel>& panels, int columns, const std::string& caption) {
  Picture picture{impl_->width, impl_->height, {}};
  const int count = static_cast<int>(panels.size());
  const int rows = (count + columns - 1) / columns;
  const mjrRect all = {0, 0, picture.width, picture.height};
  mjr_rectangle(all, 1, 1, 1, 1);
  constexpr int kGap = 2;  // between panels
  for (int i = 0; i < count; ++i) {
    const int column = i % columns, row = i / columns;
    const int left = picture.width * column / columns, right = picture.width * (column + 1) / columns;
    const int top = picture.height * row / rows, bottom = picture.height * (row + 1) / rows;
    const int gap_x = column + 1 < columns ? kGap : 0, gap_y = row + 1 < rows ? kGap : 0;
    impl_->draw(panels[static_cast<size_t>(i)],
                {left, picture.height - bottom + gap_y, right - left - gap_x, bottom - top - gap_y});
  }
  if (!caption.empty()) {
    mjr_overlay(mjFONT_NORMAL, mjGRID_BOTTOMLEFT, all, caption.c_str(), nullptr, impl_->context.get());
  }
  const size_t stride = size_t{3} * static_cast<size_t>(picture.width);
  std::vector<std::uint8_t> upside_down(stride * static_cast<size_t>(picture.height));
  mjr_readPixels(upside_down.data(), nullptr, all, impl_->context.get());
  picture.rgb.resize(upside_down.size());
  const auto height = static_cast<size_t>(picture.height);
  for (size_t row = 0; row < height; ++row) {
    const size_t from = (height - 1 - row) * stride;
    std::memcpy(picture.rgb.data() + row * stride, upside_down.data() + from, stride);
  }
  return picture;
}

}  // namespace assay
