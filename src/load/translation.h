// From MuJoCo's compiled model to the neutral Model: the part of the loader (mjcf.h) behind the parser.
#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>

#include "load/drawing.h"
#include "load/file_facts.h"
#include "load/inertia.h"
#include "load/load_options.h"
#include "load/mujoco_messages.h"
#include "load/problems.h"

namespace assay {

struct TranslationInput {
  const mjSpec* spec = nullptr;       // as parsed, for lines
  const mjModel* compiled = nullptr;  // of `spec`, with fusestatic off
  LoadOptions load = {};
  // Shapes that are fixed to the world, planes excepted, are those of a link: as between moving links, they do not
  // collide with what a joint joins to it. So it is in URDF, where no pair can be excluded.
  bool base_is_link = false;
  // The initial state moves joints that follow others to where these put them, as in URDF.
  bool starts_mimics = false;
  bool base_floats = false;  // RootJoint::kFloating, or what no joint could move, because no link has mass
  // Moving bodies whose mass and inertia in `compiled` are placeholders, because MuJoCo compiles no massless ones: they
  // become massless bodies.
  std::set<std::string> massless = {};
  // The same for bodies that MuJoCo takes for massless: their mass and inertia in the body's frame.
  std::map<std::string, RigidPart> inertia = {};
  // The file of elements that were attached from a model asset of this name, for messages.
  std::function<std::string(const std::string&)> file_of_model = [](const std::string& name) { return name; };
  FileFacts* facts = nullptr;  // where given, gets the lines
  Drawing* drawing = nullptr;  // gets the links' places and the meshes of the compiled model, where it is wanted
};

// Everything but Model::name, source, hash and the parser's warnings. Every problem is found, not only the first; they
// are in the file's order, those without a line first.
LoadReport translate(const TranslationInput& input);

}  // namespace assay
