#include "store/scene.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"

namespace assay {
namespace {

using nlohmann::json;

constexpr std::array<std::string_view, 3> kShapes = {"sphere", "capsule", "plane"};

json to_json(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
json to_json(const Quat& q) { return {q.w(), q.x(), q.y(), q.z()}; }
Vec3 vec3_of(const json& v) { return {v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>()}; }
Pose pose_of(const json& v) {
  const json& q = v.at("q");
  return {vec3_of(v.at("p")),
          Quat(q.at(0).get<double>(), q.at(1).get<double>(), q.at(2).get<double>(), q.at(3).get<double>())};
}

// A colour to four digits: as many as a picture can show.
double colour(float value) { return std::round(1e4 * static_cast<double>(value)) / 1e4; }

ShapeType shape_type(const std::string& name) {
  for (size_t i = 0; i < kShapes.size(); ++i) {
    if (kShapes[i] == name) return static_cast<ShapeType>(i);
  }
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
    const Vec3 anchor = body.is_free() ? body.p_BBcm : model.joints[static_cast<size_t>(body.joint)].p_BJ;
    SceneBody& added = scene.bodies.emplace_back(SceneBody{body.name, body.parent, body.p_BBcm, anchor, {}});
    added.X_WB = scene_pose(added, model.initial.bodies[i]);
  }
  for (const Joint& hinge : model.joints) scene.joints.push_back(hinge.name);
  for (const Shape& shape : model.shapes) {
    scene.shapes.push_back({shape.type, shape.body, shape.X_BS, shape.radius, shape.half_length, shape.rgba});
  }
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
  for (const SceneShape& shape : scene.shapes) {
    shapes.push_back(
        {{"type", kShapes.at(static_cast<size_t>(shape.type))},
         {"body", shape.body},
         {"p", to_json(shape.X_BS.p)},
         {"q", to_json(shape.X_BS.q)},
         {"radius", shape.radius},
         {"half_length", shape.half_length},
         {"rgba", {colour(shape.rgba[0]), colour(shape.rgba[1]), colour(shape.rgba[2]), colour(shape.rgba[3])}}});
  }
  json control = {{"kind", scene.control.kind}};
  for (const SinePart& part : kSineParts) control[part.name] = scene.control.*part.member;
  return json{{"bodies", std::move(bodies)},
              {"hinges", scene.joints},
              {"shapes", std::move(shapes)},
              {"control", std::move(control)}}
      .dump();
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
    for (const json& shape : parsed.at("shapes")) {
      SceneShape& added = scene.shapes.emplace_back();
      added.type = shape_type(shape.at("type"));
      added.body = body_index(shape.at("body"), bodies.size());
      added.X_BS = pose_of(shape);
      added.radius = shape.at("radius");
      added.half_length = shape.at("half_length");
      added.rgba = shape.at("rgba").get<std::array<float, 4>>();
    }
    const json& control = parsed.at("control");
    scene.control.kind = control.at("kind");
    for (const SinePart& part : kSineParts) scene.control.*part.member = control.at(part.name);
    return scene;
  } catch (const json::exception& error) {
    throw InputError(
        fmt::format("the results hold a scene that cannot be read ({}): they are another version's", error.what()));
  }
}

Pose scene_pose(const SceneBody& body, const BodyState& state) {
  return {state.p_WBcm - state.q_WB * body.p_BBcm, state.q_WB};
}

}  // namespace assay
