// What a picture of a system needs besides its states: bodies, shapes, and how the run was driven, so that results can
// be drawn where the model's file is not.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "controls/control.h"
#include "model/model.h"

namespace assay {

struct SceneBody {
  std::string name;
  int parent = kWorld;           // index into Scene::bodies
  Vec3 p_BBcm = Vec3::Zero();    // centre of mass in the body frame, m
  Vec3 anchor_B = Vec3::Zero();  // of its joint, in the body frame, m; the centre of mass for a free body
  Pose X_WB;                     // of the body frame where the run starts
};

struct SceneShape {
  ShapeType type = ShapeType::kSphere;
  int body = kWorld;  // index into Scene::bodies, or kWorld
  Pose X_BS;          // in the body frame (world frame for static shapes); model.h says how shapes lie in it
  double radius = 0, half_length = 0;  // m
  std::array<float, 4> rgba = {0.5f, 0.5f, 0.5f, 1.0f};
  Vec3 half_size = Vec3::Zero();  // m; box, ellipsoid
  int data = -1;                  // hull: index into Scene::hulls; height field: into Scene::height_fields
};

// The corners of a hull, m, in the shape frame.
using SceneHull = std::vector<Vec3>;

struct Scene {
  std::vector<SceneBody> bodies;    // in the order of the states' bodies
  std::vector<std::string> joints;  // hinges and slides
  std::vector<SceneShape> shapes;
  std::vector<SceneHull> hulls;
  std::vector<HeightField> height_fields;
  ControlSpec control;  // of the run
};

// All but the control. A hull of many corners is drawn by those that reach farthest in directions all around, a large
// height field by fewer samples.
Scene scene_of(const Model& model);

// JSON: {"bodies": [{"name", "parent", "cm": [x, y, z], "anchor": [x, y, z], "start": {"p", "q"}}], "hinges": [name],
// "shapes": [{"type": "sphere"|"capsule"|"plane"|"box"|"cylinder"|"ellipsoid"|"hull"|"height_field", "body",
// "p": [x, y, z], "q": [w, x, y, z], "radius", "half_length", "rgba": [r, g, b, a]}], "control": {"kind", "amplitude",
// "frequency", "phase_step"}}. A box or ellipsoid has "half_size": [x, y, z] too, a hull or height field its number as
// "data": in "hulls": [{"step", "v": [x, y, z, ...]}] or "height_fields": [{"rows", "columns", "half_x", "half_y",
// "base", "step", "h": [...]}], whole numbers of "step" m.
std::string scene_text(const Scene& scene);

// Throws InputError for a text that is not such a scene.
Scene parse_scene(const std::string& text);

// The capsule along a shape's longest axis that stands for it in small pictures: its ends in the shape frame and its
// radius, m.
struct Rod {
  Vec3 a = Vec3::Zero(), b = Vec3::Zero();
  double radius = 0;
};
Rod rod_of(const Scene& scene, const SceneShape& shape);

// The largest distance of a shape's points from the origin of its frame, m; 0 for a plane.
double reach_of(const Scene& scene, const SceneShape& shape);

// The body frame's pose in the world from the state's centre of mass.
Pose scene_pose(const SceneBody& body, const BodyState& state);

}  // namespace assay
