#include "run/search/stance.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "base/text.h"
#include "controls/hold.h"
#include "load/mjcf.h"
#include "load/start.h"
#include "load/urdf.h"
#include "run/search/support.h"

namespace assay {
namespace {

bool is_urdf(const std::string& file) {
  std::error_code error;
  // a generated model has no file
  return std::filesystem::exists(file, error) && root_element(model_text(file)) == "robot";
}

// The model, or nothing where the file is refused like this.
std::optional<Model> loaded(const std::string& file, const LoadOptions& load) {
  return inspect_model(file, load).model;
}

// Starts at the limit where the file starts beyond one. Does nothing for a file that is refused: that is said later.
void keep_within_limits(const std::string& file, Stance& stance) {
  std::optional<Model> model = loaded(file, stance.load);
  if (!model) return;
  const std::vector<Clamped> clamped = start_within_limits(*model);
  if (clamped.empty()) return;
  stance.load.within_limits = true;
  const Clamped& first = clamped.front();
  stance.notes.push_back(fmt::format(
      "{} joint{} beyond the limits in the file and {} at the limit (first '{}', {} instead of {}; --qpos "
      "or --keyframe gives another pose)",
      clamped.size(), clamped.size() == 1 ? " is" : "s are", clamped.size() == 1 ? "starts" : "start",
      model->joints[first.joint].name, shortest(model->initial.position[first.joint]), shortest(first.was)));
}

}  // namespace

int root_of(const Model& model, int body) {
  for (int parent = body; parent != kWorld; parent = model.bodies[static_cast<size_t>(body)].parent) body = parent;
  return body;
}

bool can_land(const Model& model) {
  return std::ranges::any_of(model.contacts, [&](const ContactPair& pair) {
    const int a = model.shapes[static_cast<size_t>(pair.shape_a)].body;
    const int b = model.shapes[static_cast<size_t>(pair.shape_b)].body;
    return (a == kWorld) != (b == kWorld);
  });
}

bool has_free_base(const Model& model) {
  std::map<int, size_t> sizes;  // of the trees of free roots
  size_t fixed = 0;
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    const int root = root_of(model, static_cast<int>(b));
    model.bodies[static_cast<size_t>(root)].is_free() ? ++sizes[root] : ++fixed;
  }
  return std::ranges::any_of(sizes, [&](const auto& tree) { return tree.second >= fixed; });
}

bool has_free_slide(const Model& model) {
  const std::vector<double> limits = effort_limits(model);
  return std::ranges::any_of(model.joints, [&](const Joint& joint) {
    const Body& body = model.bodies[static_cast<size_t>(joint.body)];
    const auto own = static_cast<size_t>(&joint - model.joints.data());
    return joint.is_slide() && body.parent == kWorld && limits[own] == 0 && !joint.has_spring();
  });
}

Stance stand(const std::string& file, const LoadOptions& given) {
  Stance stance{given, {}, {}};
  if (given.qpos.empty() && given.keyframe.empty() && !given.within_limits) keep_within_limits(file, stance);
  const LoadOptions load = stance.load;
  std::optional<Model> model;
  if (load.root_joint == RootJoint::kAsInFile && is_urdf(file)) {
    stance.load.root_joint = RootJoint::kFloating;
    stance.load.ground = Ground::kPlane;  // so that all its shapes can collide
    model = loaded(file, stance.load);
    stance.load.ground = load.ground;
    const bool freeable = model && model->bodies.front().is_free();
    std::optional<Model> as_in_file = loaded(file, load);
    const bool is_object = as_in_file && std::ranges::count(as_in_file->notes, kFreeObject) > 0;
    const std::string support = freeable ? support_of(*model) : "";
    if (load.ground != Ground::kPlane) model.reset();
    if (as_in_file && !is_object && as_in_file->bodies.front().is_free()) {
      model = std::move(as_in_file);  // it has a floating joint
      stance.load = load;
    } else if (!support.empty()) {
      stance.notes.push_back(
          fmt::format("its base is free, because it {}, and URDF cannot say so (--fixed-base holds it)", support));
    } else if (freeable && (!as_in_file || is_object)) {
      stance.notes.emplace_back(kFreeObject);
    } else {
      model = std::move(as_in_file);
      stance.load = load;
      stance.notes.emplace_back("its base is fixed to the world, as in the file (--floating-base frees it)");
    }
  }
  stance.model = model ? std::move(*model) : load_model(file, stance.load);

  const bool floats = has_free_base(stance.model) || has_free_slide(stance.model);
  const bool falls = stance.model.gravity.z() < 0;
  if (load.ground != Ground::kAsInFile || !floats || !falls || can_land(stance.model)) return stance;
  LoadOptions grounded = stance.load;
  grounded.ground = Ground::kPlane;
  model = loaded(file, grounded);
  if (!model || !can_land(*model)) {
    stance.notes.emplace_back("it has no ground, because none of its shapes can touch one");
    return stance;
  }
  stance.load = grounded;
  stance.model = std::move(*model);
  stance.notes.emplace_back("a ground plane lies under its lowest point, because the file has none (--no-ground)");
  return stance;
}

}  // namespace assay
