// Joints and actuators: limits, efforts, damping.
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "check/model_check.h"
#include "model/joint.h"

namespace assay::findings {
namespace {

// Whether a body's joint is one of a root that other joints compose with it: planar and floating bases have no stops.
bool composes_root(const Model& model, const int of) {
  int body = of;
  const bool leads_on = model.bodies[body].is_massless();
  while (model.bodies[body].parent != kWorld) {
    body = model.bodies[body].parent;
    if (!model.bodies[body].is_massless()) return false;
  }
  return leads_on || body != of;
}

void add_limits(const Model& model, const FileFacts& facts, std::vector<Finding>& out) {
  Finding unlimited = {.kind = "joint-unlimited", .title = "no limits", .advice = ""};
  Finding locked = {.level = Level::kMend,
                    .kind = "joint-locked",
                    .title = "limits that leave no way",
                    .advice = "widen them, or make the joint fixed"};
  for (const auto& [joint, position] : facts.locked) {
    locked.places.push_back(place_at(facts, fmt::format("joint '{}'", joint), 0, fmt::format("at {:.4g}", position)));
  }
  const auto place = [&](const auto& joint, const std::string& text) {
    return place_at(facts, fmt::format("joint '{}'", joint.name), 0, text);
  };
  for (const Joint& joint : model.joints) {
    if (!joint.limited || joint.lower < joint.upper || facts.locked.contains(joint.name)) continue;
    locked.places.push_back(place(joint, fmt::format("at {:.4g}", joint.lower)));
  }
  each_joint(model, [&](const auto& joint) {
    if (joint.limited || facts.locked.contains(joint.name) || composes_root(model, joint.body)) return;
    unlimited.places.push_back(place(joint, ""));
  });
  unlimited.all = unlimited.places.size() == joint_count(model);
  unlimited.advice = facts.is_urdf
                         ? "continuous, or without lower < upper in <limit>: give both where the robot has stops"
                         : "give range where the robot has stops";
  add(std::move(locked), out);
  add(std::move(unlimited), out);
}

bool is_unbounded(const Actuator& actuator) {
  return !actuator.force_limited && (actuator.has_feedback() || !actuator.control_limited);
}

void add_efforts(const Model& model, const FileFacts& facts, std::vector<Finding>& out) {
  Finding finding = {.kind = "effort-missing",
                     .title = "no effort limit",
                     .advice = facts.is_urdf ? "their motors have no bound: give <limit effort>"
                                             : "their force has no bound: give forcerange"};
  for (const Actuator& actuator : model.actuators) {
    if (!is_unbounded(actuator)) continue;
    const std::string label = facts.is_urdf && actuator.terms.size() == 1
                                  ? fmt::format("joint '{}'", model.joints[actuator.terms.front().joint].name)
                                  : fmt::format("actuator '{}'", actuator.name);
    finding.places.push_back(place_at(facts, label));
  }
  finding.all = finding.places.size() == model.actuators.size();
  add(std::move(finding), out);
}

void add_damping(const Model& model, const FileFacts& facts, std::vector<Finding>& out) {
  Finding finding = {.kind = "damping-missing",
                     .title = "no damping and no dry friction",
                     .advice = "only limits, contacts and torques stop them"};
  size_t candidates = 0;
  each_joint(model, [&](const auto& joint) {
    if (speeds_of(joint) == 1 && composes_root(model, joint.body)) return;
    ++candidates;
    if (joint.damping != 0 || joint.dry_friction != 0) return;
    finding.places.push_back(place_at(facts, fmt::format("joint '{}'", joint.name)));
  });
  finding.all = finding.places.size() == candidates && candidates == joint_count(model);
  add(std::move(finding), out);
}

// A damper or a dry friction of the wrong sign feeds energy into its joint in every engine that takes it.
void add_negative(const Model& model, const FileFacts& facts, std::vector<Finding>& out) {
  Finding finding = {.level = Level::kMend,
                     .kind = "damping-negative",
                     .title = "damping, dry friction or armature below 0",
                     .advice = "they drive the joint instead of braking it: make them positive, or remove them"};
  each_joint(model, [&](const auto& joint) {
    for (const auto& [what, value] :
         {std::pair("damping", joint.damping), std::pair("dry friction", joint.dry_friction),
          std::pair("armature", joint.armature)}) {
      if (value >= 0) continue;
      finding.places.push_back(
          place_at(facts, fmt::format("joint '{}'", joint.name), value, fmt::format("{} {:.4g}", what, value)));
    }
  });
  add(std::move(finding), out);
}

// Feedback that drives away from the set point grows with every timestep, in every engine.
void add_unstable(const Model& model, const FileFacts& facts, std::vector<Finding>& out) {
  Finding finding = {.level = Level::kMend,
                     .kind = "actuator-unstable",
                     .title = "feedback that drives the joint away",
                     .advice = "kp and kv have to be positive, biasprm negative"};
  for (const Actuator& actuator : model.actuators) {
    if (actuator.bias[1] <= 0 && actuator.bias[2] <= 0) continue;
    finding.places.push_back(place_at(facts, fmt::format("actuator '{}'", actuator.name), 0,
                                      fmt::format("bias {:.4g}, {:.4g}", actuator.bias[1], actuator.bias[2])));
  }
  add(std::move(finding), out);
}

}  // namespace

void add_joints(const Model& model, const FileFacts& facts, std::vector<Finding>& out) {
  add_unstable(model, facts, out);
  add_negative(model, facts, out);
  add_limits(model, facts, out);
  add_efforts(model, facts, out);
  add_damping(model, facts, out);
}

}  // namespace assay::findings
