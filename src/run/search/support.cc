#include "run/search/support.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "load/start.h"
#include "model/joint.h"
#include "model/kinematics.h"
#include "model/shape.h"

namespace assay {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string lower_case(const std::string& text) {
  std::string result = text;
  std::ranges::transform(result, result.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

template <size_t count>
bool has_word(const std::string& text, const std::array<std::string_view, count>& words) {
  return std::ranges::any_of(words, [&](std::string_view word) { return text.find(word) != std::string::npos; });
}

struct Limb {
  std::string names;  // of its bodies and joints, in lower case
  double mass = 0, lowest = kInfinity;
  size_t joints = 0;
  bool slides = false;
  double hip = 0;  // height of its first joint
};

class Support {
 public:
  explicit Support(const Model& model) : model_(model), lowest_(lowest_points(model)) {
    for (size_t b = 0; b < model.bodies.size(); ++b) {
      const Body& body = model.bodies[b];
      top_ = std::max(top_, model.initial.bodies[b].p_WBcm.z());
      mass_ += body.mass;
      if (body.parent != kWorld) children_[body.parent].push_back(static_cast<int>(b));
    }
    ground_ = *std::min_element(lowest_.begin(), lowest_.end() - 1);
  }

  size_t wheels() const {
    size_t count = 0;
    for (size_t b = 1; std::isfinite(ground_) && b < model_.bodies.size(); ++b) count += is_wheel(b) ? 1 : 0;
    return count;
  }

  size_t rotors() const {
    constexpr double kLight = 0.1;  // of the robot's mass
    const auto found = children_.find(0);
    if (found == children_.end()) return 0;
    return static_cast<size_t>(std::ranges::count_if(found->second, [&](int b) {
      return turns_freely(b) && std::abs(axis_of(b).z()) > 0.85 && !children_.contains(b) &&
             model_.bodies[static_cast<size_t>(b)].mass < kLight * mass_;
    }));
  }

  size_t legs() const {
    if (!std::isfinite(ground_)) return 0;
    constexpr double kClear = 0.01;                                // of the robot's height
    constexpr std::array<double, 3> kReaches = {0.02, 0.05, 0.1};  // of the robot's height
    const double height = top_ - ground_;
    for (int trunk = 0;;) {
      if (lowest_[static_cast<size_t>(trunk)] - ground_ < kClear * height) return 0;
      const auto found = children_.find(trunk);
      if (found == children_.end()) return 0;
      std::vector<Limb> limbs;
      limbs.reserve(found->second.size());
      for (const int first : found->second) limbs.push_back(limb_of(first));
      for (const double reaches : kReaches) {
        std::vector<Limb> reaching;
        std::ranges::copy_if(limbs, std::back_inserter(reaching),
                             [&](const Limb& limb) { return limb.lowest - ground_ < reaches * height; });
        if (are_legs(reaching, height)) return reaching.size();
      }
      // a waist may lie between
      const auto only = std::ranges::min_element(limbs, {}, &Limb::lowest);
      const bool alone = std::ranges::count_if(limbs, [&](const Limb& limb) {
                           return limb.lowest - ground_ < kReaches.back() * height;
                         }) == 1;
      if (!alone) return 0;
      trunk = found->second[static_cast<size_t>(only - limbs.begin())];
    }
  }

 private:
  bool turns_freely(int b) const {
    const Joint* hinge = hinge_of(model_, model_.bodies[static_cast<size_t>(b)]);
    return hinge != nullptr && (!hinge->limited || hinge->upper - hinge->lower >= 4 * std::numbers::pi);
  }
  Vec3 axis_of(int b) const {
    return joint_frames(model_, model_.initial, model_.bodies[static_cast<size_t>(b)].joint).axis_W_child;
  }

  bool is_wheel(size_t b) const {
    const int body = static_cast<int>(b);
    if (!turns_freely(body) || !std::isfinite(lowest_[b]) || std::abs(axis_of(body).z()) > 0.3) return false;
    const double axle = joint_frames(model_, model_.initial, model_.bodies[b].joint).p_WJ_child.z();
    const double radius = axle - lowest_[b];
    double top = -kInfinity;
    for (const Shape& shape : model_.shapes) {
      if (shape.body != body || !shape.collides || is_ground(shape)) continue;
      const Pose X_WS = shape_pose(model_, model_.initial, shape);
      top = std::max(top, X_WS.p.z() + reach(model_, shape, X_WS.q.conjugate() * Vec3::UnitZ()));
    }
    constexpr double kRound = 0.3, kTouches = 0.5;  // of the radius; a gripper may hang lower
    return radius > 0 && std::abs(top - axle - radius) < kRound * radius && lowest_[b] - ground_ < kTouches * radius;
  }

  Limb limb_of(int first) const {
    Limb limb;
    const Body& begin = model_.bodies[static_cast<size_t>(first)];
    limb.hip = model_.initial.bodies[static_cast<size_t>(first)].p_WBcm.z();
    if (begin.joint >= 0) limb.hip = joint_frames(model_, model_.initial, begin.joint).p_WJ_child.z();
    std::vector<int> rest = {first};
    while (!rest.empty()) {
      const int b = rest.back();
      rest.pop_back();
      const Body& body = model_.bodies[static_cast<size_t>(b)];
      limb.names += lower_case(body.name) + " ";
      limb.mass += body.mass;
      limb.lowest = std::min(limb.lowest, lowest_[static_cast<size_t>(b)]);
      limb.joints += speeds_of(body);
      if (body.joint >= 0) limb.names += lower_case(joint_name(model_, body)) + " ";
      limb.slides = limb.slides || slides(model_, body);
      if (const auto found = children_.find(b); found != children_.end()) {
        rest.insert(rest.end(), found->second.begin(), found->second.end());
      }
    }
    return limb;
  }

  bool are_legs(const std::vector<Limb>& limbs, double height) const {
    constexpr std::array<std::string_view, 9> kLeg = {"leg",   "foot", "feet",  "ankle", "knee",
                                                      "thigh", "calf", "shank", "hip"};
    constexpr std::array<std::string_view, 12> kGrips = {"finger", "thumb", "gripper", "wrist",   "palm",  "hand",
                                                         "jaw",    "claw",  "elbow",   "allegro", "grasp", "fing"};
    constexpr double kShare = 0.15;  // of the robot's mass
    if (limbs.size() < 2) return false;
    if (std::ranges::any_of(limbs, [&](const Limb& limb) { return limb.joints < 1; })) return false;
    const auto grips = [&](const Limb& limb) { return has_word(limb.names, kGrips); };
    if (std::ranges::all_of(limbs, [&](const Limb& limb) { return has_word(limb.names, kLeg) && !grips(limb); })) {
      return true;
    }
    const bool pair = limbs.size() == 2;
    const size_t least_joints = pair ? 3 : 2;
    if (limbs.size() % 2 != 0 || std::ranges::any_of(limbs, grips)) return false;
    if (std::ranges::any_of(limbs, [&](const Limb& limb) { return limb.slides || limb.joints < least_joints; }))
      return false;
    double mass = 0, hips = -kInfinity;
    for (const Limb& limb : limbs) {
      mass += limb.mass;
      hips = std::max(hips, limb.hip);
    }
    // two limbs that hang from above the trunk's middle are arms
    constexpr double kSlack = 0.05;  // of the robot's height
    const double trunk = model_.initial.bodies.front().p_WBcm.z();
    return mass >= kShare * mass_ && (!pair || hips <= trunk + kSlack * height);
  }

  const Model& model_;
  std::vector<double> lowest_;  // of bodies, and of the world
  std::map<int, std::vector<int>> children_;
  double ground_ = 0, top_ = -kInfinity, mass_ = 0;
};

}  // namespace

std::string support_of(const Model& model) {
  if (model.bodies.empty() || !model.bodies.front().is_free()) return "";
  const auto on_world = std::ranges::count(model.bodies, kWorld, &Body::parent);
  if (on_world != 1) return "";
  const Support support(model);
  if (const size_t wheels = support.wheels(); wheels >= 2) return fmt::format("stands on {} of its wheels", wheels);
  if (const size_t legs = support.legs(); legs >= 2) return fmt::format("stands on {} of its limbs", legs);
  if (const size_t rotors = support.rotors(); rotors >= 3) return fmt::format("flies with {} rotors", rotors);
  return "";
}

}  // namespace assay
