#include "controls/isaac/drives.h"

#include <algorithm>
#include <limits>
#include <set>
#include <tuple>

#include <fmt/format.h>

#include "base/text.h"
#include "controls/hold.h"

namespace assay {

void IsaacDrives::read() {
  const YamlPlace actuators = in_.read().need(in_.robot(), "actuators");
  for (const YamlPlace& group : YamlValues::entries(actuators)) {
    if (group.node->kind != YamlNode::Kind::kMap) in_.read().fail(group, "it is no group of actuators");
    const auto type = YamlValues::child(group, "class_type");
    const std::string kind = type ? in_.read().name_of(group, "class_type") : "ImplicitActuator";
    const bool implicit = kind == "ImplicitActuator";
    const std::set<std::string> known = {"ImplicitActuator", "IdealPDActuator", "DCMotor", "DelayedPDActuator"};
    if (!known.contains(kind)) {
      in_.must_ignore(
          type.value_or(group),
          fmt::format("assay has no actuators of the kind '{}', and takes stiffness and damping as those of "
                      "a PD law",
                      kind));
    }
    const std::vector<std::string> names = in_.matching(in_.read().need(group, "joint_names_expr"), false);
    const auto gains = [&](const char* key) {
      const auto place = YamlValues::child(group, key);
      if (!place) {
        in_.read().fail(group,
                        fmt::format("its {} is null, which is that of a USD file or of a network: write the number "
                                    "into the file",
                                    key));
      }
      std::vector<double> all;
      size_t i = 0;
      for (const auto& value : in_.values(*place, names)) {
        if (!value) in_.read().fail(*place, fmt::format("no pattern matches the joint '{}'", names[i]));
        all.push_back(*value);
        ++i;
      }
      return all;
    };
    const std::vector<double> stiffness = gains("stiffness"), damping = gains("damping");
    std::vector<std::optional<double>> limits(names.size());
    const char* own = implicit ? "effort_limit_sim" : "effort_limit";
    auto limit = YamlValues::child(group, own);
    if (!limit && implicit) limit = YamlValues::child(group, "effort_limit");
    if (limit) limits = in_.values(*limit, names);
    for (size_t i = 0; i < names.size(); ++i) {
      const Drive drive = {group, kind, stiffness[i], damping[i], limits[i]};
      if (!drives_.emplace(names[i], drive).second) {
        in_.read().fail(group, fmt::format("another group of actuators has the joint '{}', too", names[i]));
      }
    }
    list_actuator(group, kind, names);
  }
  for (const std::string& name : in_.acted()) {
    if (!drives_.contains(name)) {
      in_.read().fail(actuators, fmt::format("no group of it has the joint '{}', on which the policy acts", name));
    }
  }
  list_passive_drives();
}

// What of a group of actuators is no PD law.
void IsaacDrives::list_actuator(const YamlPlace& group, const std::string& kind,
                                const std::vector<std::string>& names) {
  if (kind == "DCMotor") {
    in_.left_out(group.path, "a motor whose torque falls with its speed: here the limit is the same at every speed");
  }
  const auto least = YamlValues::child(group, "min_delay"), most = YamlValues::child(group, "max_delay");
  const int low = least ? in_.read().whole(*least, 0) : 0, high = most ? in_.read().whole(*most, 0) : 0;
  if (most && high > 0) {
    const int decimation = in_.read().whole(in_.read().need(in_.root(), "decimation"), 1);
    if (low == high && low % decimation == 0) {
      delay_ = low / decimation;
    } else if (!least || low == 0) {
      in_.left_out(most->path, fmt::format("delays of 0 to {} engine steps at random: here there is none; delay in "
                                           "[control] is in control steps",
                                           high));
    } else {
      in_.must_ignore(*least,
                      fmt::format("a delay of {} to {} engine steps, no whole number of control steps", low, high));
    }
  }
  for (const auto& [key, what, of] :
       {std::tuple{"armature", "armature", &Joint::armature}, std::tuple{"friction", "", &Joint::dry_friction}}) {
    const auto place = YamlValues::child(group, key);
    if (!place) continue;
    const auto given = in_.values(*place, names);
    std::vector<std::string> others;
    for (size_t i = 0; i < names.size(); ++i) {
      const std::optional<double>& own = given[i];
      if (own && !nearly(*own, in_.joint(names[i]).*of)) others.push_back(names[i]);
    }
    if (others.empty()) continue;
    if (*what != '\0') {
      in_.left_out(place->path, fmt::format("the robot's own {} acts, which is another for {} ({} of '{}')", what,
                                            some_of(others), shortest(in_.joint(others.front()).*of), others.front()));
    } else {
      in_.left_out(place->path,
                   fmt::format("PhysX's friction of joints: the robot's own dry friction acts, {} N or Nm of "
                               "'{}'",
                               shortest(in_.joint(others.front()).*of), others.front()));
    }
  }
  if (const auto rate = YamlValues::child(group, "velocity_limit_sim")) {
    in_.left_out(rate->path, "joints are not slowed down at a largest rate here");
  }
}

// Drives of joints on which the policy does not act hold them at their default positions in training, and dampers act
// beside efforts: springs and dampers of the engine. Where a stiffness beside efforts pulls to, the file does not
// say.
void IsaacDrives::list_passive_drives() {
  std::set<std::string> told;
  std::vector<std::string> held;
  for (const auto& [name, drive] : drives_) {
    const bool acted = std::ranges::find(in_.acted(), name) != in_.acted().end();
    const Joint& own = in_.joint(name);
    if (acted && in_.type() != "joint_effort") {
      if (own.damping != 0 || own.stiffness != 0) beside_.push_back(name);
      continue;
    }
    if (nearly(own.stiffness, drive.stiffness) && nearly(own.damping, drive.damping)) continue;
    if (!acted || drive.stiffness == 0) {
      // the robot's own springs may be those of training already, or a part of them
      held_.push_back(
          {name, in_.default_pos()[static_cast<size_t>(std::ranges::find(in_.names(), name) - in_.names().begin())],
           std::max(0.0, drive.stiffness - own.stiffness), std::max(0.0, drive.damping - own.damping)});
      held.push_back(name);
      continue;
    }
    if (!told.insert(drive.group.path).second) continue;
    in_.must_ignore(
        drive.group,
        fmt::format(
            "it gives the joint '{}' the stiffness {} and the damping {} beside the policy, and the "
            "robot has {} and {}: give it a [hold] in the configuration, or the joint of '{}' those of training",
            name, shortest(drive.stiffness), shortest(drive.damping), shortest(own.stiffness), shortest(own.damping),
            in_.model().name));
  }
  if (!held.empty()) {
    in_.left_out(
        in_.robot().path + ".actuators",
        fmt::format("no targets for {}: springs and dampers of the engine act as the drives of training did, without "
                    "limits of effort ([hold])",
                    some_of(held)));
  }
  if (!beside_.empty()) {
    in_.left_out(
        in_.robot().path + ".actuators",
        fmt::format("in training the drives' damping was all there was; the robot's own springs and dampers of "
                    "{} act beside them",
                    some_of(beside_)));
  }
}

std::string IsaacDrives::pd_text() {
  if (in_.type() == "joint_effort") return effort_limits_text(true);
  bool implicit = true, limited = false;
  std::vector<double> stiffness, damping;
  for (const std::string& name : in_.acted()) {
    const Drive& drive = drives_.at(name);
    implicit = implicit && drive.kind == "ImplicitActuator";
    limited = limited || drive.limit.has_value();
    stiffness.push_back(drive.stiffness);
    damping.push_back(drive.damping);
    if (in_.type() == "joint_velocity" && drive.stiffness != 0) {
      in_.must_ignore(drive.group, "a stiffness under velocity actions, which have none here");
    }
  }
  const bool engine = implicit && !limited;
  if (implicit) {
    in_.left_out(in_.robot().path + ".actuators",
                 engine ? "drives of PhysX: here springs and dampers of the engine (law = \"engine\")"
                        : "drives of PhysX, which are implicit: here the torques are explicit, because springs of "
                          "engines have no torque limit; law = \"engine\" with effort_limit = inf is the other choice");
  }
  std::string text = fmt::format("\n[pd]\nlaw = \"{}\"\n", engine ? "engine" : "explicit");
  if (in_.type() == "joint_position") text += per_joint("stiffness", in_.acted(), stiffness);
  text += per_joint("damping", in_.acted(), damping);
  return text + effort_limits_text(false);
}

// The limits that the file gives; joints without one have the robot's.
std::string IsaacDrives::effort_limits_text(bool with_heading) {
  const std::vector<double> own = effort_limits(in_.model());
  std::vector<double> limits;
  bool any = false;
  for (const std::string& name : in_.acted()) {
    const Drive& drive = drives_.at(name);
    const double robots = own[in_.index_of(name)];
    limits.push_back(drive.limit.value_or(robots > 0 ? robots : std::numeric_limits<double>::infinity()));
    any = any || drive.limit.has_value();
  }
  if (!any) return "";
  return (with_heading ? "\n[pd]\n" : "") + per_joint("effort_limit", in_.acted(), limits);
}

}  // namespace assay
