#include "search/stance.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "controls/hold.h"
#include "model/kinematics.h"
#include "model/mjcf.h"
#include "model/start.h"
#include "model/urdf.h"

namespace assay {
namespace {

bool is_urdf(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  return root_element(std::string(std::istreambuf_iterator<char>(stream), {})) == "robot";
}

// The model, or nothing where the file is refused like this.
std::optional<Model> loaded(const std::string& file, const LoadOptions& load) {
  return inspect_model(file, load).model;
}

// Puts joints that start beyond their limits at the limit, and joints that follow others where they belong. Does
// nothing for a file that is refused: that is said later.
void start_within_limits(const std::string& file, const std::string& folder, Stance& stance) {
  constexpr double kBeyond = 1e-3;  // rad, m
  LoadOptions load = stance.load;
  std::optional<Model> model = loaded(file, load);
  if (!model) return;
  std::vector<double>& position = model->initial.position;
  std::vector<size_t> moved;
  std::string first;
  const auto follows = [&](size_t j) {
    return std::ranges::any_of(model->couplings,
                               [&](const Coupling& coupling) { return std::cmp_equal(coupling.joint, j); });
  };
  for (size_t j = 0; j < position.size(); ++j) {
    const Joint& joint = model->joints[j];
    if (!joint.limited || follows(j)) continue;
    const double within = std::clamp(position[j], joint.lower, joint.upper);
    if (std::abs(within - position[j]) <= kBeyond) continue;
    if (moved.empty()) {
      first = fmt::format("'{}', {} instead of {}", joint.name, shortest(within), shortest(position[j]));
    }
    position[j] = within;
    moved.push_back(j);
  }
  if (moved.empty()) return;
  for (const Coupling& coupling : model->couplings) {
    const auto own = static_cast<size_t>(coupling.joint);
    position[own] = coupling.offset + sum_of_terms(coupling.terms, position);
    moved.push_back(own);
  }
  std::string text = "# the start pose, with joints that the file starts beyond their limits at the limit\n";
  for (const size_t j : moved) text += fmt::format("{}={:.17g}\n", model->joints[j].name, position[j]);
  const std::filesystem::path path = std::filesystem::path(folder) / "start.txt";
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  std::ofstream stream(path);
  if (!(stream << text) || !stream.flush()) {
    throw SystemError(fmt::format("'{}' cannot be written: {}", path.string(), std::strerror(errno)));
  }
  const size_t count = moved.size() - model->couplings.size();
  load.qpos = path.string();
  stream.close();
  if (!loaded(file, load)) return;
  stance.load = load;
  stance.notes.push_back(
      fmt::format("{} joint{} beyond the limits in the file and {} at the limit (first {}; --qpos "
                  "or --keyframe gives another pose)",
                  count, count == 1 ? " is" : "s are", count == 1 ? "starts" : "start", first));
}

// How many limbs of the only root reach the ground while the root itself stays clear of it.
int limbs_on_ground(const Model& model) {
  constexpr double kClear = 0.01, kReaches = 0.1;  // of the robot's height
  const std::vector<double> lowest = lowest_points(model);
  std::map<int, double> limbs;  // by the child of the root that they begin with
  double top = -std::numeric_limits<double>::infinity();
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    top = std::max(top, model.initial.bodies[b].p_WBcm.z());
    int limb = static_cast<int>(b);
    int parent = model.bodies[b].parent;
    if (parent == kWorld) {
      if (b != 0) return 0;
      continue;
    }
    for (; parent != 0; parent = model.bodies[static_cast<size_t>(limb)].parent) limb = parent;
    double& own = limbs.emplace(limb, std::numeric_limits<double>::infinity()).first->second;
    own = std::min(own, lowest[b]);
  }
  const double ground = *std::min_element(lowest.begin(), lowest.end() - 1);
  if (!std::isfinite(ground)) return 0;
  const double height = top - ground;
  if (lowest.front() - ground < kClear * height) return 0;
  return static_cast<int>(
      std::ranges::count_if(limbs, [&](const auto& limb) { return limb.second - ground < kReaches * height; }));
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

Stance stand(const std::string& file, const LoadOptions& given, const std::string& folder) {
  Stance stance{given, {}, {}};
  if (given.qpos.empty() && given.keyframe.empty()) start_within_limits(file, folder, stance);
  const LoadOptions load = stance.load;
  std::optional<Model> model;
  if (load.root_joint == RootJoint::kAsInFile && is_urdf(file)) {
    stance.load.root_joint = RootJoint::kFloating;
    stance.load.ground = Ground::kPlane;  // so that all its shapes can collide
    model = loaded(file, stance.load);
    stance.load.ground = load.ground;
    const bool freeable = model && model->bodies.front().is_free();
    const int limbs = freeable ? limbs_on_ground(*model) : 0;
    if (load.ground != Ground::kPlane) model.reset();
    if (limbs > 1) {
      stance.notes.push_back(fmt::format(
          "its base is free, because it stands on {} of its limbs or wheels, and URDF cannot say so (--fixed-base "
          "holds it)",
          limbs));
    } else if (freeable && !inspect_model(file, load).model) {
      stance.notes.emplace_back("its base is free, because nothing else could move (--fixed-base holds it)");
    } else {
      model.reset();
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
