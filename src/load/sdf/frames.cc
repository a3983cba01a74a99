#include <cstddef>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/text.h"
#include "load/sdf/robot.h"

namespace assay::sdf {
namespace {

using Kind = Frame::Kind;

// Names that can stand for a frame in a scope.
std::vector<std::string> known_names(const Scope& scope) {
  std::vector<std::string> names;
  for (const auto& [name, index] : scope.frames) names.push_back(name);
  for (const auto& [name, index] : scope.children) names.push_back(name);
  return names;
}

// The frame of a name, with a problem where there is none.
int look_up(Robot& robot, const Frame& frame, const std::string& what, const std::string& name, int scope, int model) {
  const int found = find_frame(robot, scope, name, model);
  if (found >= 0) return found;
  const Element at = frame.element;
  robot.refuse(frame.name, at, fmt::format("has {} '{}', which is no frame of its model", what, name),
               fmt::format("correct it{}", did_you_mean(name, known_names(robot.scopes[scope]))));
  return -1;
}

Pose local(const Robot& robot, int frame, int depth);

// A frame's pose in one that it leads to.
Pose pose_below(const Robot& robot, int frame, int stop, int depth = 0) {
  Pose X;
  for (int f = frame; f != stop && f > 0; f = robot.frames[f].base) X = local(robot, f, depth) * X;
  return X;
}

// In its base. A placement frame stands where the pose says, instead of the model's own.
Pose local(const Robot& robot, int frame, int depth) {
  const Frame& own = robot.frames[frame];
  constexpr int kDeepest = 100;  // of models in models; what is deeper was refused
  if (own.placed < 0 || depth > kDeepest) return own.raw;
  return own.raw * pose_below(robot, own.placed, frame, depth + 1).inverse();
}

// Whether following `next` from each frame ends; else a problem.
template <typename Next>
bool ends(Robot& robot, const char* what, const Next& next) {
  const size_t count = robot.frames.size();
  std::vector<int> state(count, 0);  // 1: on the way, 2: ends
  for (size_t start = 0; start < count; ++start) {
    std::vector<int> way;
    int f = static_cast<int>(start);
    while (f > 0 && state[f] == 0) {
      state[f] = 1;
      way.push_back(f);
      f = next(robot.frames[f]);
    }
    if (f > 0 && state[f] == 1) {
      const Frame& own = robot.frames[f];
      robot.refuse(own.name, own.element, fmt::format("is {} itself by way of other frames", what),
                   "correct one of them");
      return false;
    }
    for (const int each : way) state[each] = 2;
  }
  return true;
}

// Whether the way from `frame` leads to `stop`.
bool leads_to(const Robot& robot, int frame, int stop) {
  while (frame > 0 && frame != stop) frame = robot.frames[frame].base;
  return frame == stop;
}

}  // namespace

int find_frame(const Robot& robot, int scope, const std::string& name, int model) {
  if (name == "__model__") return model;
  if (name == "world") return 0;
  const Scope& home = robot.scopes[scope];
  if (const auto found = home.frames.find(name); found != home.frames.end()) return found->second;
  if (const auto found = home.children.find(name); found != home.children.end()) {
    return robot.scopes[found->second].frame;
  }
  for (size_t at = name.find("::"); at != std::string::npos; at = name.find("::", at + 2)) {
    const auto inner = home.children.find(name.substr(0, at));
    if (inner == home.children.end()) continue;
    return find_frame(robot, inner->second, name.substr(at + 2), robot.scopes[inner->second].frame);
  }
  return -1;
}

int attached_link(const Robot& robot, int frame) {
  for (size_t i = 0; i <= robot.frames.size() && frame >= 0; ++i) {
    const Frame& own = robot.frames[frame];
    if (own.kind == Kind::kWorld) return -1;
    if (own.kind == Kind::kLink) return own.index;
    frame = own.attached;
  }
  return -2;
}

Pose pose_of(const Robot& robot, int frame) { return pose_below(robot, frame, 0); }

bool resolve_frames(Robot& robot) {
  const auto known = [&robot] { return robot.result.parts.problems.size(); };
  const size_t before = known();
  for (size_t i = 1; i < robot.frames.size(); ++i) {
    Frame& frame = robot.frames[i];
    if (frame.kind == Kind::kModel) {
      const Scope& own = robot.scopes[frame.index];
      // a model is attached to its canonical link: the first, or that of its first model
      if (own.is_static) {
        frame.attached = 0;
      } else if (!own.canonical.empty()) {
        frame.attached = look_up(robot, frame, "the canonical_link", own.canonical, frame.index, static_cast<int>(i));
      } else if (!own.links.empty()) {
        frame.attached = robot.links[own.links.front()].frame;
      } else if (!own.nested.empty()) {
        frame.attached = robot.scopes[own.nested.front()].frame;
      } else {
        frame.attached = 0;
      }
      if (!frame.placement.empty()) {
        frame.placed = look_up(robot, frame, "the placement_frame", frame.placement, frame.index, static_cast<int>(i));
      }
    } else if (frame.kind == Kind::kFrame && !frame.placement.empty()) {  // a merged model
      frame.placed = look_up(robot, frame, "the placement_frame", frame.placement, frame.scope, static_cast<int>(i));
    }
    if (frame.kind == Kind::kJoint && frame.attached_to.empty()) {
      robot.refuse(frame.name, frame.element, "has no child", "give it a <child>");
      continue;
    }
    if (frame.kind == Kind::kFrame || frame.kind == Kind::kJoint) {
      frame.attached = frame.attached_to.empty()
                           ? frame.model
                           : look_up(robot, frame, frame.kind == Kind::kJoint ? "the child" : "attached_to",
                                     frame.attached_to, frame.scope, frame.model);
    }
    if (!frame.relative_to.empty()) {
      frame.base = look_up(robot, frame, "relative_to", frame.relative_to, frame.scope, frame.model);
    } else if (frame.base < 0) {
      const bool hangs = frame.kind == Kind::kFrame || frame.kind == Kind::kJoint;
      frame.base = hangs ? frame.attached : frame.model;
    }
  }
  if (known() > before) return false;
  if (!ends(robot, "relative to", [](const Frame& frame) { return frame.base; })) return false;
  if (!ends(robot, "attached to", [](const Frame& frame) { return frame.kind == Kind::kLink ? 0 : frame.attached; })) {
    return false;
  }
  for (size_t i = 1; i < robot.frames.size(); ++i) {
    const Frame& frame = robot.frames[i];
    if (frame.placed < 0 || leads_to(robot, frame.placed, static_cast<int>(i))) continue;
    robot.refuse(frame.name, frame.element,
                 fmt::format("has the placement_frame '{}', which does not lie in it", frame.placement),
                 "name one of its own frames");
    return false;
  }
  for (Link& link : robot.links) link.X_WL = pose_of(robot, link.frame);
  return true;
}

}  // namespace assay::sdf
