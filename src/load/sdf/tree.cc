// From links and joints to a tree of bodies, with the joints that close loops.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "base/text.h"
#include "load/sdf/robot.h"

namespace assay::sdf {
namespace {

constexpr int kWorldEnd = -1;  // of a joint

// What MuJoCo's bodies hang on: a joint, and whether its child is the body that comes first.
struct Edge {
  int joint = -1, parent = kWorldEnd;
  bool reversed = false;
};

// Body of a motion about or along an axis through a point, in the world.
Pose moved(bool slides, const Vec3& axis, const Vec3& p, double q) {
  if (slides) return {q * axis, Quat::Identity()};
  const Quat R(Eigen::AngleAxisd(q, axis));
  return {p - R * p, R};
}

class Tree {
 public:
  explicit Tree(Robot& robot) : robot_(robot), result_(robot.result) {}

  void build() {
    up_.resize(robot_.links.size());
    choose_edges();
    add_bodies();
    add_loops();
    add_couplings();
    add_gearboxes();
    keep_apart();
    demand_motion();
    tell();
  }

 private:
  std::string label(const Joint& joint) const { return fmt::format("joint '{}'", joint.name); }

  // Links of static models are the world.
  int end(int link) const { return link < 0 || robot_.links[link].is_static ? kWorldEnd : link; }

  // The link at the top of the tree; the world's end where its root hangs on that.
  int root_of(int link) const {
    while (link != kWorldEnd && up_[link].joint >= 0) link = up_[link].parent;
    return link;
  }

  // Makes a link the root of its tree, whose root hangs on nothing.
  void turn(int link) {
    Edge above = up_[link];
    up_[link] = {};
    while (above.joint >= 0) {
      const int next = above.parent;
      const Edge before = up_[next];
      up_[next] = {above.joint, link, !above.reversed};
      link = next;
      above = before;
    }
  }

  // A link hangs on the first joint whose child it is. Others turn a tree over where that makes one of two, and close
  // loops where it does not.
  void choose_edges() {
    std::vector<int> others;
    for (size_t j = 0; j < robot_.joints.size(); ++j) {
      const Joint& joint = robot_.joints[j];
      if (joint.type == "gearbox") continue;
      const int a = end(joint.parent), b = end(joint.child);
      if (a == b) {
        robot_.note(
            fmt::format("{} ({}) joins what stands still and is left out", label(joint), robot_.place(joint.element)));
      } else if (b == kWorldEnd || up_[b].joint >= 0 || root_of(a) == b) {
        others.push_back(static_cast<int>(j));
      } else {
        up_[b] = {static_cast<int>(j), a, false};
      }
    }
    for (const int j : others) {
      const int a = end(robot_.joints[j].parent), b = end(robot_.joints[j].child);
      const int root_a = root_of(a), root_b = root_of(b);
      if (root_a == root_b) {
        loops_.push_back(j);
      } else if (root_a == kWorldEnd || (root_b != kWorldEnd && root_a < root_b)) {  // the first root stays one
        turn(b);
        up_[b] = {j, a, false};
      } else {
        turn(a);
        up_[a] = {j, b, true};
      }
    }
  }

  void add_bodies() {
    body_of_.assign(robot_.links.size(), -1);
    std::vector<std::vector<int>> below(robot_.links.size());
    std::vector<int> stack;
    for (size_t i = robot_.links.size(); i-- > 0;) {
      const int link = static_cast<int>(i);
      const bool hangs = up_[i].joint >= 0 && up_[i].parent != kWorldEnd;
      if (hangs) {
        below[static_cast<size_t>(up_[i].parent)].push_back(link);
      } else {
        stack.push_back(link);
      }
    }
    while (!stack.empty()) {
      const int link = stack.back();
      stack.pop_back();
      add_body(link);
      stack.insert(stack.end(), below[static_cast<size_t>(link)].begin(), below[static_cast<size_t>(link)].end());
    }
  }

  void add_body(int index) {
    Link& link = robot_.links[index];
    const Edge& edge = up_[index];
    SdfBody body;
    body.name = link.name;
    body.line = robot_.line_of(fmt::format("body '{}'", link.name), link.element);
    body.shapes = std::move(link.shapes);
    Pose X_WB = link.X_WL;
    const Pose X_WP = edge.joint >= 0 && edge.parent != kWorldEnd ? robot_.links[edge.parent].X_WL : Pose{};
    if (edge.joint >= 0) {
      body.parent = edge.parent == kWorldEnd ? -1 : body_of_[edge.parent];
      add_joints(robot_.joints[edge.joint], edge.reversed, body, X_WB);
    } else if (!link.is_static) {
      body.joints.push_back({.type = SdfJoint::Type::kFree, .name = "", .line = body.line});
    }
    body.X_PB = X_WP.inverse() * X_WB;
    if (!link.is_static && link.part.mass > 0) result_.parts.inertia.emplace(link.name, link.part);
    if (link.part.mass > 0) result_.parts.has_mass = true;
    body_of_[index] = static_cast<int>(result_.bodies.size());
    result_.bodies.push_back(std::move(body));
  }

  // From the parent on; X_WB becomes the body's place where held axes put it.
  void add_joints(const Joint& joint, bool reversed, SdfBody& body, Pose& X_WB) {
    using Type = SdfJoint::Type;
    const int line = robot_.line_of(label(joint), joint.element);
    if (joint.type == "ball") {
      body.joints.push_back(
          {.type = Type::kBall, .name = joint.name, .p_BJ = X_WB.inverse() * joint.X_WJ.p, .line = line});
      return;
    }
    const double sign = reversed ? -1 : 1;
    const bool slides = joint.type == "prismatic";
    struct Moving {
      const Axis* axis;
      Pose before;  // motion of the held axes above it
    };
    std::vector<Moving> moving;
    Pose T;
    for (size_t i = 0; i < joint.axes.size(); ++i) {
      const Axis& axis = joint.axes[reversed ? joint.axes.size() - 1 - i : i];
      if (!axis.is_there) continue;
      if (axis.held) {
        T = T * moved(slides, axis.axis_W, joint.X_WJ.p, sign * *axis.held);
      } else {
        moving.push_back({&axis, T});
      }
    }
    X_WB = T * X_WB;
    const Pose X_BW = X_WB.inverse();
    for (const auto& [axis, before] : moving) {
      SdfJoint own;
      own.type = slides ? Type::kSlide : Type::kHinge;
      own.name = axis->coordinate;
      own.p_BJ = X_BW * (before * joint.X_WJ.p);
      own.axis_B = (X_BW.q * (before.q * (sign * axis->axis_W))).normalized();
      own.limited = std::isfinite(axis->lower) && std::isfinite(axis->upper);
      own.lower = own.limited ? axis->lower : 0;
      own.upper = own.limited ? axis->upper : 0;
      own.stiffness = axis->stiffness;
      own.spring_reference = axis->spring_reference;
      own.damping = axis->damping;
      own.dry_friction = axis->dry_friction;
      own.effort = axis->effort;
      own.line = line;
      if (std::isfinite(axis->velocity)) result_.parts.velocity_limits[own.name] = axis->velocity;
      moving_.insert(own.name);
      if (!axis->mimic && axis->effort > 0) driven_.push_back(own.name);
      if (!axis->mimic && axis->effort == 0) without_effort_.push_back(fmt::format("'{}'", own.name));
      if (!axis->mimic && std::isinf(axis->effort)) ++unlimited_;
      if (joint.type == "screw") {
        SdfJoint slide;
        slide.type = Type::kSlide;
        slide.name = fmt::format("{}_slide", own.name);
        slide.p_BJ = own.p_BJ;
        slide.axis_B = own.axis_B;
        slide.line = line;
        result_.couplings.push_back({.name = fmt::format("{}_thread", own.name),
                                     .follower = slide.name,
                                     .leader = own.name,
                                     .multiplier = joint.pitch,
                                     .line = line});
        body.joints.push_back(std::move(slide));
      }
      body.joints.push_back(std::move(own));
    }
  }

  void add_loops() {
    for (const int j : loops_) {
      const Joint& joint = robot_.joints[j];
      const auto leave_out = [&](const std::string& fault, const std::string& mend) {
        robot_.unsupported(label(joint), joint.element, fault, mend, "is left out, so that the loop is open there");
      };
      const bool weld = joint.type == "fixed", ball = joint.type == "ball";
      const bool hinge = joint.type == "revolute" || joint.type == "continuous";
      if (!weld && !ball && !hinge) {
        leave_out(fmt::format("closes a loop of links, and is of the type {}", joint.type),
                  "use revolute, ball or fixed there");
        continue;
      }
      const Axis& axis = joint.axes[0];
      if (axis.damping != 0 || axis.dry_friction != 0 || axis.stiffness != 0 || axis.mimic || axis.held) {
        leave_out("closes a loop of links, and has a spring, damping, friction, a mimic or equal limits",
                  "give these to another joint of the loop");
        continue;
      }
      if (std::isfinite(axis.lower) && std::isfinite(axis.upper)) {
        robot_.note(fmt::format("{} ({}) closes a loop of links: its limits are not read", label(joint),
                                robot_.place(joint.element)));
      }
      SdfLoop loop;
      loop.weld = weld;
      loop.line = robot_.line_of(fmt::format("{} '{}'", weld ? "weld" : "connect", joint.name), joint.element);
      int a = joint.parent, b = joint.child;
      if (end(a) == kWorldEnd) std::swap(a, b);
      loop.body_a = body_of_[a];
      loop.body_b = b < 0 ? -1 : body_of_[b];
      const Pose X_WA = robot_.links[a].X_WL, X_WB = b < 0 ? Pose{} : robot_.links[b].X_WL;
      // two points of its axis are a hinge
      constexpr double kApart = 0.1;  // m
      for (int k = 0; k < (hinge ? 2 : 1); ++k) {
        Pose X_WJ = joint.X_WJ;
        if (hinge) X_WJ.p += (k - 0.5) * kApart * axis.axis_W;
        loop.name = k == 0 ? joint.name : joint.name + "_2";
        loop.X_AJ = X_WA.inverse() * X_WJ;
        loop.X_BJ = X_WB.inverse() * X_WJ;
        result_.loops.push_back(loop);
      }
      robot_.note(fmt::format("{} ({}) closes a loop of links: it holds them together there", label(joint),
                              robot_.place(joint.element)));
    }
  }

  void add_couplings() {
    for (const Joint& joint : robot_.joints) {
      for (const Axis& axis : joint.axes) {
        if (!axis.mimic || !moving_.contains(axis.coordinate)) continue;
        if (!moving_.contains(axis.mimic->joint)) {
          robot_.unsupported(label(joint), joint.element,
                             fmt::format("mimics joint '{}', which closes a loop", axis.mimic->joint),
                             "mimic another joint of the loop", "loses its <mimic>, so that it moves freely");
          continue;
        }
        result_.couplings.push_back({.name = axis.coordinate,
                                     .follower = axis.coordinate,
                                     .leader = axis.mimic->joint,
                                     .multiplier = axis.mimic->multiplier,
                                     .offset = axis.mimic->offset,
                                     .line = axis.mimic->line});
      }
    }
  }

  // The hinge between two links, and +1 or -1: how its coordinate counts the turn of `to` from `from` about an axis.
  std::pair<const Axis*, double> hinge_between(int from, int to, const Vec3& axis_W) const {
    for (const Joint& joint : robot_.joints) {
      if (joint.type != "revolute" && joint.type != "continuous") continue;
      const bool forward = joint.parent == from && joint.child == to;
      const bool backward = joint.parent == to && joint.child == from;
      const Axis& axis = joint.axes[0];
      if ((!forward && !backward) || !moving_.contains(axis.coordinate)) continue;
      const double along = axis.axis_W.dot(axis_W);
      constexpr double kParallel = 1 - 1e-9;
      if (std::abs(along) < kParallel) continue;
      return {&axis, (forward ? 1 : -1) * (along > 0 ? 1 : -1)};
    }
    return {nullptr, 0};
  }

  // turn of the child = -ratio * turn of the parent, both from the reference body
  void add_gearboxes() {
    for (const Joint& joint : robot_.joints) {
      if (joint.type != "gearbox") continue;
      const auto [leader, of_leader] = hinge_between(joint.reference, joint.parent, joint.axes[0].axis_W);
      const auto [follower, of_follower] = hinge_between(joint.reference, joint.child, joint.axes[1].axis_W);
      if (leader == nullptr || follower == nullptr || leader == follower) {
        robot_.unsupported(label(joint), joint.element,
                           "is a gearbox, and its links are not joined to its reference body by hinges about its axes",
                           "join them so, or write <mimic>", "is left out");
        continue;
      }
      const int line = robot_.line_of(fmt::format("coupling '{}'", joint.name), joint.element);
      result_.couplings.push_back({.name = joint.name,
                                   .follower = follower->coordinate,
                                   .leader = leader->coordinate,
                                   .multiplier = -joint.ratio * of_leader / of_follower,
                                   .line = line});
      std::erase(driven_, follower->coordinate);
    }
  }

  // Links of one model, unless one of them collides with its own; and what a joint joins.
  void keep_apart() {
    std::set<std::pair<int, int>> joined;
    for (const Joint& joint : robot_.joints) {
      if (joint.parent >= 0 && joint.child >= 0) joined.insert(std::minmax(joint.parent, joint.child));
    }
    std::vector<int> touching;
    for (size_t i = 0; i < robot_.links.size(); ++i) {
      if (!result_.bodies[body_of_[i]].shapes.empty()) touching.push_back(static_cast<int>(i));
    }
    for (size_t m = 0; m < touching.size(); ++m) {
      for (size_t n = m + 1; n < touching.size(); ++n) {
        const Link &a = robot_.links[touching[m]], &b = robot_.links[touching[n]];
        const bool one = robot_.scopes[a.scope].top == robot_.scopes[b.scope].top;
        const bool apart = one && !a.self_collide && !b.self_collide && !(a.is_static && b.is_static);
        if (apart || joined.contains({touching[m], touching[n]})) result_.apart.emplace_back(a.name, b.name);
      }
    }
  }

  void demand_motion() {
    const bool moves = std::ranges::any_of(result_.bodies, [](const SdfBody& body) { return !body.joints.empty(); });
    const bool still = std::ranges::all_of(robot_.links, &Link::is_static);
    if (moves || (!still && robot_.options.root_joint == RootJoint::kFloating)) return;
    robot_.refuse("", {}, "nothing in it can move",
                  still ? "name a file with a model that is not <static>, or remove that"
                        : "join a link by a joint that is not fixed, or give --floating-base");
  }

  void tell() {
    result_.parts.driven = driven_;
    if (unlimited_ > 0) {
      robot_.note(fmt::format("motors without a limit, because the file gives no effort limit: {}", unlimited_));
    }
    if (!without_effort_.empty()) {
      robot_.note(
          fmt::format("joints without a motor, because their effort limit is 0: {}", join(without_effort_, ", ")));
    }
    if (!result_.parts.velocity_limits.empty()) {
      robot_.note(fmt::format("velocity limits are not used, because no engine here has them: {}",
                              result_.parts.velocity_limits.size()));
    }
  }

  Robot& robot_;
  SdfDocument& result_;
  std::vector<Edge> up_;  // by link
  std::vector<int> loops_, body_of_;
  std::set<std::string> moving_;  // coordinates of the tree
  std::vector<std::string> driven_, without_effort_;
  size_t unlimited_ = 0;
};

}  // namespace

void build_tree(Robot& robot) { Tree(robot).build(); }

}  // namespace assay::sdf
