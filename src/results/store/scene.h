// What a picture of a system needs besides its states: bodies, shapes, and how the run was driven, so that results can
// be drawn where the model's file is not.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "controls/control.h"
#include "model/model.h"
#include "model/shape.h"

namespace assay {

struct SceneBody {
  std::string name;
  int parent = kWorld;           // index into Scene::bodies
  Vec3 p_BBcm = Vec3::Zero();    // centre of mass in the body frame, m
  Vec3 anchor_B = Vec3::Zero();  // of its joint, in the body frame, m; the centre of mass for a free body
  Pose X_WB;                     // of the body frame where the run starts
};

// The corners of a hull, m, in the shape frame.
using SceneHull = std::vector<Vec3>;

struct Scene {
  std::vector<SceneBody> bodies;    // in the order of the states' bodies
  std::vector<std::string> joints;  // hinges and slides
  std::vector<Shape> shapes;        // `data` counts in the scene
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
// "base", "step", "h": [...]}], whole numbers of "step" m. Results add "collides": false to shapes that are only drawn,
// which parse_scene() reads.
std::string scene_text(const Scene& scene);

// Throws InputError for a text that is not such a scene.
Scene parse_scene(const std::string& text);

// What Shape::data names in the scene.
ShapeData data_of(const Scene& scene, const Shape& shape);

// The body frame's pose in the world from the state's centre of mass.
Pose scene_pose(const SceneBody& body, const BodyState& state);

}  // namespace assay
