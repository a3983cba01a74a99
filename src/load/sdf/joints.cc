// Joints: their ends, axes, limits and what follows from other joints.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "base/text.h"
#include "load/sdf/robot.h"
#include "load/sdf/values.h"

namespace assay::sdf {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// How many axes a type has; -1 for an unknown type.
int axes_of(std::string_view type) {
  static const std::map<std::string_view, int> kAxes = {{"revolute", 1}, {"continuous", 1}, {"prismatic", 1},
                                                        {"screw", 1},    {"universal", 2},  {"revolute2", 2},
                                                        {"gearbox", 2},  {"ball", 0},       {"fixed", 0}};
  const auto found = kAxes.find(type);
  return found == kAxes.end() ? -1 : found->second;
}

class Joints {
 public:
  explicit Joints(Robot& robot) : robot_(robot) {}

  void read() {
    std::vector<std::string> still;
    std::set<std::string> names;
    std::erase_if(robot_.joints, [&](Joint& joint) {
      if (!robot_.scopes[joint.scope].is_static) return false;
      still.push_back(fmt::format("'{}'", joint.name));
      return true;
    });
    if (!still.empty()) {
      robot_.note(fmt::format("joints of static models are left out: {}", join(still, ", ")));
    }
    for (size_t j = 0; j < robot_.joints.size(); ++j) {
      robot_.frames[robot_.joints[j].frame].index = static_cast<int>(j);
      read(robot_.joints[j], names);
    }
    lock();
    follow();
  }

 private:
  std::string label(const Joint& joint) const { return fmt::format("joint '{}'", joint.name); }

  // The link of an end; -2 where there is none.
  int end(const Joint& joint, const char* tag) {
    const std::string name = text_of(joint.element.child(tag).at);
    if (name.empty()) {
      robot_.refuse(label(joint), joint.element, fmt::format("has no {}", tag), fmt::format("give it a <{}>", tag));
      return -2;
    }
    if (name == "world" && std::string_view(tag) == "child") {
      robot_.refuse(label(joint), joint.element.child(tag), "has the world as its child",
                    "make the world its parent: only a parent may be the world");
      return -2;
    }
    const int frame = find_frame(robot_, joint.scope, name, robot_.frames[joint.frame].model);
    const int link = frame < 0 ? -2 : attached_link(robot_, frame);
    if (link == -2) {
      std::vector<std::string> known;
      for (const auto& [each, index] : robot_.scopes[joint.scope].frames) known.push_back(each);
      robot_.refuse(label(joint), joint.element.child(tag),
                    fmt::format("names the {} '{}', which is no link or frame of its model{}", tag, name,
                                nearest_name(name, known) ? did_you_mean(name, known) : ""),
                    "correct it, or add that link");
    }
    return link;
  }

  void read(Joint& joint, std::set<std::string>& names) {
    const std::string own = joint.name;
    for (int i = 2; names.contains(joint.name); ++i) joint.name = fmt::format("{}_{}", own, i);
    const int axes = axes_of(joint.type);
    if (axes == 0) names.insert(joint.name);
    if (axes < 0) {
      robot_.refuse(label(joint), joint.element,
                    joint.type.empty() ? "has no type" : fmt::format("has the type '{}'", joint.type),
                    "use revolute, continuous, prismatic, fixed, ball, universal, revolute2, screw or gearbox");
      return;
    }
    joint.parent = end(joint, "parent");
    joint.child = end(joint, "child");
    if (joint.parent == -2 || joint.child == -2) return;
    if (joint.parent == joint.child) {
      robot_.refuse(label(joint), joint.element, "joins a link to itself", "correct its <parent> or <child>");
      return;
    }
    joint.X_WJ = pose_of(robot_, joint.frame);
    for (int k = 0; k < axes; ++k) read_axis(joint, k, names);
    if (joint.type == "screw") read_pitch(joint);
    if (joint.type == "gearbox") read_gearbox(joint);
  }

  void read_axis(Joint& joint, int k, std::set<std::string>& names) {
    const char* tag = k == 0 ? "axis" : "axis2";
    const Element element = joint.element.child(tag);
    const std::string owner = k == 0 ? label(joint) : fmt::format("<axis2> of {}", label(joint));
    if (!element) {
      robot_.refuse(label(joint), joint.element, fmt::format("has no <{}>", tag), "give it one");
      return;
    }
    Axis& axis = joint.axes[static_cast<size_t>(k)];
    axis.is_there = true;
    axis.coordinate = k == 0 ? joint.name : joint.name + "_2";
    for (int i = 2; !names.insert(axis.coordinate).second; ++i) axis.coordinate = fmt::format("{}_{}", joint.name, i);
    const Element xyz = element.child("xyz");
    const Vec3 direction = robot_.vector(xyz, Vec3::UnitZ(), owner);
    if (direction.norm() < 1e-9) {
      robot_.refuse(owner, xyz, fmt::format("has the axis {}", text_of(xyz.at)), "give a direction that is not zero");
      return;
    }
    axis.axis_W = (orientation(joint, element, xyz, owner) * direction).normalized();
    const Element dynamics = element.child("dynamics");
    const auto value = [&](const char* name, bool negative) {
      const double number = robot_.number(dynamics, name, 0, owner);
      if (std::isfinite(number) && (negative || number >= 0)) return number;
      robot_.refuse(owner, dynamics.child(name), fmt::format("has the {} {}", name, shortest(number)),
                    negative ? "give a finite number" : "give a number that is not negative");
      return 0.0;
    };
    axis.damping = value("damping", false);
    axis.dry_friction = value("friction", false);
    axis.stiffness = value("spring_stiffness", false);
    axis.spring_reference = value("spring_reference", true);
    read_limits(joint, element.child("limit"), owner, axis);
    read_mimic(element.child("mimic"), owner, axis);
  }

  // Of the axis: the joint's frame, unless it names another; in 1.4 the model's, in 1.5 and 1.6 where it says so.
  Quat orientation(const Joint& joint, const Element& element, const Element& xyz, const std::string& owner) {
    const int model = robot_.frames[joint.frame].model;
    const std::string frame = attribute(xyz.at, "expressed_in");
    if (!frame.empty()) {
      const int found = find_frame(robot_, joint.scope, frame, model);
      if (found >= 0) return pose_of(robot_, found).q;
      robot_.refuse(owner, xyz, fmt::format("has expressed_in=\"{}\", which is no frame of its model", frame),
                    "correct it");
      return Quat::Identity();
    }
    const int version = element.source->version;
    if (version < 107 && robot_.truth(element.child("use_parent_model_frame"), version == 104, owner)) {
      return pose_of(robot_, model).q;
    }
    return joint.X_WJ.q;
  }

  void read_limits(const Joint& joint, const Element& limit, const std::string& owner, Axis& axis) {
    constexpr double kNone = 1e9, kFar = 1e4;  // as in URDF (urdf/numbers.cc)
    if (joint.type != "continuous") {
      axis.lower = robot_.number(limit, "lower", -kInfinity, owner);
      axis.upper = robot_.number(limit, "upper", kInfinity, owner);
    }
    if (axis.lower > axis.upper) {
      if (robot_.options.repair) {
        std::swap(axis.lower, axis.upper);
        robot_.note(fmt::format("repaired: limits of {} ({}) are swapped back", owner, robot_.place(limit)));
      } else {
        robot_.refuse(
            owner, limit,
            fmt::format("has a lower limit {} above its upper limit {}", shortest(axis.lower), shortest(axis.upper)),
            "swap them, or give --repair");
      }
    }
    const bool low = axis.lower > -kNone, high = axis.upper < kNone;
    if (low != high) {
      double& bound = low ? axis.upper : axis.lower;
      bound = low ? kFar : -kFar;
      robot_.note(fmt::format("{} ({}) has a limit on one side alone: {:g} is taken for the other", owner,
                              robot_.place(limit), bound));
    } else if (!low) {
      axis.lower = -kInfinity;
      axis.upper = kInfinity;
    }
    const double effort = robot_.number(limit, "effort", kInfinity, owner);
    axis.effort = effort < 0 || effort >= kNone ? kInfinity : effort;
    const double velocity = robot_.number(limit, "velocity", kInfinity, owner);
    axis.velocity = velocity < 0 || velocity >= kNone ? kInfinity : velocity;
  }

  void read_mimic(const Element& mimic, const std::string& owner, Axis& axis) {
    if (!mimic) return;
    Axis::Mimic own;
    own.joint = attribute(mimic.at, "joint");
    own.axis = attribute(mimic.at, "axis");
    own.multiplier = robot_.number(mimic, "multiplier", 1, owner);
    own.offset =
        robot_.number(mimic, "offset", 0, owner) - own.multiplier * robot_.number(mimic, "reference", 0, owner);
    if (!std::isfinite(own.multiplier) || !std::isfinite(own.offset)) {
      robot_.refuse(owner, mimic, "has a <mimic> with a number that is not finite", "give finite numbers");
      return;
    }
    own.line = robot_.line_of(fmt::format("coupling '{}'", axis.coordinate), mimic);
    axis.mimic = own;
  }

  void read_pitch(Joint& joint) {
    constexpr double kTurn = 2 * std::numbers::pi;
    const Element old = joint.element.child("thread_pitch"), own = joint.element.child("screw_thread_pitch");
    double turn = robot_.number(own, 1, label(joint));  // m
    if (!own && old) turn = -kTurn / robot_.number(old, 1, label(joint));
    if (!std::isfinite(turn)) {
      robot_.refuse(label(joint), own ? own : old, "has a thread pitch that is not finite",
                    "give <screw_thread_pitch> in m per turn");
      turn = 1;
    }
    joint.pitch = turn / kTurn;
  }

  void read_gearbox(Joint& joint) {
    joint.ratio = robot_.number(joint.element, "gearbox_ratio", 1, label(joint));
    joint.reference = end(joint, "gearbox_reference_body");
    if (!std::isfinite(joint.ratio) || joint.ratio == 0) {
      robot_.refuse(label(joint), joint.element.child("gearbox_ratio"),
                    fmt::format("has the ratio {}", shortest(joint.ratio)), "give a finite number that is not 0");
    }
  }

  // Equal limits fix an axis.
  void lock() {
    constexpr double kNoWay = 1e-6;  // rad or m
    for (Joint& joint : robot_.joints) {
      for (Axis& axis : joint.axes) {
        if (!axis.is_there || joint.type == "gearbox" || !(axis.upper - axis.lower <= kNoWay)) continue;
        if (axis.lower > axis.upper) continue;  // refused
        if (axis.mimic) {
          axis.lower = -kInfinity;
          axis.upper = kInfinity;
          robot_.note(fmt::format("{} ({}) has equal limits and mimics a joint: the limits are left out", label(joint),
                                  robot_.place(joint.element)));
        } else if (joint.type == "screw") {
          robot_.unsupported(label(joint), joint.element, "is a screw with equal limits", "make it fixed",
                             "moves freely");
          axis.lower = -kInfinity;
          axis.upper = kInfinity;
        } else {
          axis.held = (axis.lower + axis.upper) / 2;
          robot_.result.parts.locked[axis.coordinate] = *axis.held;
        }
      }
    }
    if (robot_.result.parts.locked.empty()) return;
    std::vector<std::string> names;
    constexpr size_t kNamed = 5;
    for (const auto& [name, position] : robot_.result.parts.locked) {
      if (names.size() < kNamed) names.push_back(fmt::format("'{}' at {:.4g}", name, position));
    }
    const size_t others = robot_.result.parts.locked.size() - names.size();
    robot_.note(fmt::format("joints that are fixed by their equal limits: {}{}", join(names, ", "),
                            others > 0 ? fmt::format(" and {} more", others) : ""));
  }

  // The axis that a mimic names; null where it is fixed. What is wrong is in `fault`.
  Axis* leader_of(const Joint& joint, const Axis::Mimic& mimic, std::string& fault) {
    const int frame = find_frame(robot_, joint.scope, mimic.joint, robot_.frames[joint.frame].model);
    if (frame < 0 || robot_.frames[frame].kind != Frame::Kind::kJoint) {
      fault = fmt::format("mimics the unknown joint '{}'", mimic.joint);
      return nullptr;
    }
    Joint& leader = robot_.joints[static_cast<size_t>(robot_.frames[frame].index)];
    if (!mimic.axis.empty() && mimic.axis != "axis" && mimic.axis != "axis2") {
      fault = fmt::format("mimics the axis '{}'", mimic.axis);
      return nullptr;
    }
    Axis& axis = leader.axes[mimic.axis == "axis2" ? 1 : 0];
    if (!axis.is_there) fault = fmt::format("mimics joint '{}', which has no such axis", mimic.joint);
    return axis.is_there ? &axis : nullptr;
  }

  // What mimics a held joint is held too; what mimics nothing that moves, or itself, is no coupling.
  void follow() {
    std::map<Axis*, Axis*> leaders;
    for (Joint& joint : robot_.joints) {
      for (Axis& axis : joint.axes) {
        if (!axis.mimic) continue;
        std::string fault;
        Axis* leader = leader_of(joint, *axis.mimic, fault);
        if (leader != nullptr) {
          leaders[&axis] = leader;
          axis.mimic->joint = leader->coordinate;
          continue;
        }
        robot_.unsupported(label(joint), joint.element, fault, "correct <mimic>",
                           "loses its <mimic>, so that it moves freely");
        axis.mimic.reset();
      }
    }
    for (Joint& joint : robot_.joints) {
      for (Axis& axis : joint.axes) {
        if (!axis.mimic) continue;
        Axis* at = &axis;
        for (size_t steps = 0; at != nullptr && steps <= leaders.size(); ++steps) {
          const auto next = leaders.find(at);
          at = next == leaders.end() || !at->mimic ? nullptr : next->second;
        }
        if (at == nullptr) continue;
        robot_.unsupported(label(joint), joint.element, "mimics itself by way of other joints",
                           "remove <mimic> from one of them", "loses its <mimic>, so that it moves freely");
        axis.mimic.reset();
      }
    }
    for (bool changed = true; changed;) {
      changed = false;
      for (const auto& [axis, leader] : leaders) {
        if (!axis->mimic || !leader->held || axis->held) continue;
        axis->held = axis->mimic->multiplier * *leader->held + axis->mimic->offset;
        axis->mimic.reset();
        changed = true;
      }
    }
  }

  Robot& robot_;
};

}  // namespace

void read_joints(Robot& robot) { Joints(robot).read(); }

}  // namespace assay::sdf
