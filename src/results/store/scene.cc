#include "results/store/scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/json.h"
#include "model/joint.h"

namespace assay {
namespace {

using nlohmann::json;

constexpr int kMostCorners = 96;    // of a hull
constexpr int kMostSamples = 65;    // of a height field, along each side
constexpr double kCoarsest = 1e-4;  // m, to which hulls and heights are rounded
constexpr double kRelative = 1e-3;  // of their size, where that is less

json to_json(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
json to_json(const Quat& q) { return {q.w(), q.x(), q.y(), q.z()}; }
Vec3 vec3_of(const json& v) { return {v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>()}; }
Pose pose_of(const json& v) {
  const json& q = v.at("q");
  return {vec3_of(v.at("p")),
          Quat(q.at(0).get<double>(), q.at(1).get<double>(), q.at(2).get<double>(), q.at(3).get<double>())};
}

// Points all around the unit sphere, evenly: a golden spiral.
Vec3 direction(int index, int count) {
  const double z = 1 - (2 * index + 1.0) / count, r = std::sqrt(1 - z * z);
  const double turn = index * std::numbers::pi * (3 - std::sqrt(5.0));
  return {r * std::cos(turn), r * std::sin(turn), z};
}

// Edges of the box around the corners.
Vec3 extent_of(const SceneHull& corners) {
  if (corners.empty()) return Vec3::Zero();
  Vec3 low = corners.front(), high = low;
  for (const Vec3& corner : corners) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  return high - low;
}

SceneHull corners_of(const Hull& hull) {
  if (hull.vertices.size() <= kMostCorners) return hull.vertices;
  // a flat hull has as many corners drawn as one that is not
  const Vec3 extent = extent_of(hull.vertices).cwiseMax(1e-9);
  std::vector<bool> kept(hull.vertices.size(), false);
  for (int i = 0; i < kMostCorners; ++i) {
    const Vec3 along = direction(i, kMostCorners).cwiseQuotient(extent);
    const auto far = std::ranges::max_element(hull.vertices, {}, [&](const Vec3& v) { return along.dot(v); });
    kept[static_cast<size_t>(far - hull.vertices.begin())] = true;
  }
  SceneHull corners;
  for (size_t i = 0; i < kept.size(); ++i) {
    if (kept[i]) corners.push_back(hull.vertices[i]);
  }
  return corners;
}

HeightField drawn_field(const HeightField& field) {
  HeightField drawn = field;
  drawn.rows = std::min(field.rows, kMostSamples);
  drawn.columns = std::min(field.columns, kMostSamples);
  if (drawn.rows == field.rows && drawn.columns == field.columns) return drawn;
  const auto between = [&](double row, double column) {
    const int r = std::min(static_cast<int>(row), field.rows - 2),
              c = std::min(static_cast<int>(column), field.columns - 2);
    const double x = column - c, y = row - r;
    const auto height = [&](int i, int j) { return field.heights[static_cast<size_t>(i) * field.columns + j]; };
    return (1 - y) * ((1 - x) * height(r, c) + x * height(r, c + 1)) +
           y * ((1 - x) * height(r + 1, c) + x * height(r + 1, c + 1));
  };
  drawn.heights.clear();
  for (int row = 0; row < drawn.rows; ++row) {
    for (int column = 0; column < drawn.columns; ++column) {
      drawn.heights.push_back(
          between(row * (field.rows - 1.0) / (drawn.rows - 1), column * (field.columns - 1.0) / (drawn.columns - 1)));
    }
  }
  return drawn;
}

// Lengths as whole numbers of a step that suits their size.
double step_for(double size) { return size > 0 ? std::min(kCoarsest, kRelative * size) : kCoarsest; }
json to_json(const SceneHull& corners) {
  const double step = step_for(extent_of(corners).minCoeff());
  json numbers = json::array();
  for (const Vec3& corner : corners) {
    for (const double x : corner) numbers.push_back(std::llround(x / step));
  }
  return {{"step", step}, {"v", std::move(numbers)}};
}
json to_json(const HeightField& field) {
  const double step = step_for(field.heights.empty() ? 0 : std::ranges::max(field.heights));
  json numbers = json::array();
  for (const double height : field.heights) numbers.push_back(std::llround(height / step));
  return {{"rows", field.rows},     {"columns", field.columns}, {"half_x", field.half_x},
          {"half_y", field.half_y}, {"base", field.base},       {"step", step},
          {"h", std::move(numbers)}};
}
SceneHull hull_of(const json& hull) {
  const json& numbers = hull.at("v");
  const double step = hull.at("step");
  SceneHull corners;
  for (size_t i = 0; i + 2 < numbers.size(); i += 3) {
    corners.emplace_back(
        step * Vec3(numbers.at(i).get<double>(), numbers.at(i + 1).get<double>(), numbers.at(i + 2).get<double>()));
  }
  return corners;
}
HeightField field_of(const json& parsed) {
  HeightField field;
  field.rows = parsed.at("rows");
  field.columns = parsed.at("columns");
  field.half_x = parsed.at("half_x");
  field.half_y = parsed.at("half_y");
  field.base = parsed.at("base");
  const double step = parsed.at("step");
  for (const json& number : parsed.at("h")) field.heights.push_back(step * number.get<double>());
  if (field.rows < 2 || field.columns < 2 ||
      field.heights.size() != static_cast<size_t>(field.rows) * static_cast<size_t>(field.columns)) {
    throw InputError(fmt::format("the results have a height field of {} by {} samples with {} heights", field.rows,
                                 field.columns, field.heights.size()));
  }
  return field;
}

// A colour to four digits: as many as a picture can show.
double colour(float value) { return std::round(1e4 * static_cast<double>(value)) / 1e4; }

ShapeType shape_type(const std::string& name) {
  if (const auto type = shape_named(name)) return *type;
  throw InputError(fmt::format("the results have a shape of the unknown type '{}': they are another version's", name));
}

// An index of a body, or kWorld.
int body_index(const json& index, size_t bodies) {
  const int body = index.get<int>();
  if (body < kWorld || std::cmp_greater_equal(body, bodies)) {
    throw InputError(fmt::format("the results have a shape of body {}, of which there are {}", body, bodies));
  }
  return body;
}

}  // namespace

Scene scene_of(const Model& model) {
  Scene scene;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    SceneBody& added =
        scene.bodies.emplace_back(SceneBody{body.name, body.parent, body.p_BBcm, anchor_of(model, body), {}});
    added.X_WB = scene_pose(added, model.initial.bodies[i]);
  }
  for (const Joint& joint : model.joints) scene.joints.push_back(joint.name);
  scene.shapes = model.shapes;
  for (const Hull& hull : model.hulls) scene.hulls.push_back(corners_of(hull));
  for (const HeightField& field : model.height_fields) scene.height_fields.push_back(drawn_field(field));
  return scene;
}

std::string scene_text(const Scene& scene) {
  json bodies = json::array(), shapes = json::array();
  for (const SceneBody& body : scene.bodies) {
    bodies.push_back({{"name", body.name},
                      {"parent", body.parent},
                      {"cm", to_json(body.p_BBcm)},
                      {"anchor", to_json(body.anchor_B)},
                      {"start", {{"p", to_json(body.X_WB.p)}, {"q", to_json(body.X_WB.q)}}}});
  }
  for (const Shape& shape : scene.shapes) {
    json added = {
        {"type", shape_name(shape.type)},
        {"body", shape.body},
        {"p", to_json(shape.X_BS.p)},
        {"q", to_json(shape.X_BS.q)},
        {"radius", shape.radius},
        {"half_length", shape.half_length},
        {"rgba", {colour(shape.rgba[0]), colour(shape.rgba[1]), colour(shape.rgba[2]), colour(shape.rgba[3])}}};
    if (has_half_size(shape.type)) added["half_size"] = to_json(shape.half_size);
    if (has_data(shape.type)) added["data"] = shape.data;
    shapes.push_back(std::move(added));
  }
  json control = {{"kind", scene.control.kind}};
  for (const ControlPart& part : kControlParts) control[part.name] = scene.control.*part.member;
  if (!scene.control.file.empty()) control["file"] = scene.control.file;
  if (!scene.control.policy.empty()) control["policy"] = scene.control.policy;
  if (!scene.control.network.empty()) control["network"] = scene.control.network;
  json text = {{"bodies", std::move(bodies)},
               {"hinges", scene.joints},
               {"shapes", std::move(shapes)},
               {"control", std::move(control)}};
  for (const SceneHull& hull : scene.hulls) text["hulls"].push_back(to_json(hull));
  for (const HeightField& field : scene.height_fields) text["height_fields"].push_back(to_json(field));
  return dump_json(text);
}

Scene parse_scene(const std::string& text) {
  try {
    const json parsed = json::parse(text);
    Scene scene;
    const json& bodies = parsed.at("bodies");
    for (const json& body : bodies) {
      scene.bodies.push_back({body.at("name"), body_index(body.at("parent"), bodies.size()), vec3_of(body.at("cm")),
                              vec3_of(body.at("anchor")), pose_of(body.at("start"))});
    }
    scene.joints = parsed.at("hinges").get<std::vector<std::string>>();
    if (parsed.contains("hulls")) {
      for (const json& hull : parsed.at("hulls")) scene.hulls.push_back(hull_of(hull));
    }
    if (parsed.contains("height_fields")) {
      for (const json& field : parsed.at("height_fields")) scene.height_fields.push_back(field_of(field));
    }
    for (const json& shape : parsed.at("shapes")) {
      Shape& added = scene.shapes.emplace_back();
      added.type = shape_type(shape.at("type"));
      added.body = body_index(shape.at("body"), bodies.size());
      added.X_BS = pose_of(shape);
      added.radius = shape.at("radius");
      added.half_length = shape.at("half_length");
      added.collides = shape.value("collides", true);
      added.rgba = shape.at("rgba").get<std::array<float, 4>>();
      if (has_half_size(added.type)) added.half_size = vec3_of(shape.at("half_size"));
      if (!has_data(added.type)) continue;
      added.data = shape.at("data");
      const size_t there = added.type == ShapeType::kHull ? scene.hulls.size() : scene.height_fields.size();
      if (added.data < 0 || std::cmp_greater_equal(added.data, there)) {
        throw InputError(fmt::format("the results have a {} of number {}, of which there are {}",
                                     shape_name(added.type), added.data, there));
      }
    }
    const json& control = parsed.at("control");
    scene.control.kind = control.at("kind");
    // Results of earlier versions hold fewer.
    for (const ControlPart& part : kControlParts) {
      scene.control.*part.member = control.value(part.name, scene.control.*part.member);
    }
    scene.control.file = control.value("file", "");
    scene.control.policy = control.value("policy", "");
    scene.control.network = control.value("network", "");
    return scene;
  } catch (const json::exception& error) {
    throw InputError(
        fmt::format("the results hold a scene that cannot be read ({}): they are another version's", error.what()));
  }
}

ShapeData data_of(const Scene& scene, const Shape& shape) {
  const auto index = static_cast<size_t>(shape.data);
  if (shape.type == ShapeType::kHull) return {.corners = scene.hulls[index]};
  if (shape.type == ShapeType::kHeightField) return {.field = &scene.height_fields[index]};
  return {};
}

Pose scene_pose(const SceneBody& body, const BodyState& state) {
  return {state.p_WBcm - state.q_WB * body.p_BBcm, state.q_WB};
}

}  // namespace assay
