#include "controls/isaac/environment.h"

#include <algorithm>
#include <iterator>
#include <map>

#include <fmt/format.h>

#include "base/errors.h"
#include "controls/pattern.h"

namespace assay {

void IsaacEnvironment::check_kind() const {
  if (root_.node->kind != YamlNode::Kind::kMap) {
    throw InputError(
        fmt::format("'{}' is {}, no environment of Isaac Lab: give the params/env.yaml that a training writes", path_,
                    shown(*root_.node)));
  }
  if (!YamlValues::child(root_, "observations") && YamlValues::child(root_, "observation_space")) {
    throw InputError(
        fmt::format("'{}' is an environment of the direct workflow, whose observations are computed in Python and "
                    "stand in no file: write the configuration by hand (docs/guide.md)",
                    path_));
  }
  for (const char* key : {"sim", "decimation", "scene", "observations", "actions"})
    static_cast<void>(read_.need(root_, key));
}

void IsaacEnvironment::order_joints() {
  const std::vector<std::string> known = robot_joints(), tree = breadth_first_joints(model_);
  take_joints(tree, tree == known ? "order of joints: breadth first, as PhysX has it, which is the robot's own here"
                                  : "order of joints: breadth first in the robot's tree, as PhysX has it; the "
                                    "robot's own is another");
}

std::vector<std::string> IsaacEnvironment::matching(const YamlPlace& place, bool in_pattern_order) {
  std::vector<std::string> patterns = read_.texts(place), found;
  std::map<std::string, std::string> by;
  for (const std::string& text : patterns) {
    const Pattern pattern = read_.pattern(place, text);
    bool any = false;
    for (const std::string& name : names_) {
      if (!read_.matches(place, pattern, text, name)) continue;
      any = true;
      if (const auto [at, fresh] = by.emplace(name, text); !fresh) {
        read_.fail(place, fmt::format("'{}' and '{}' both match the joint '{}'", at->second, text, name));
      }
      found.push_back(name);
    }
    if (!any) no_match(place, text, names_);
  }
  if (in_pattern_order) return found;
  std::vector<std::string> ordered;
  std::ranges::copy_if(names_, std::back_inserter(ordered), [&](const std::string& name) { return by.contains(name); });
  return ordered;
}

void IsaacEnvironment::no_match(const YamlPlace& place, const std::string& pattern,
                                const std::vector<std::string>& names) {
  must_ignore(place,
              fmt::format("'{}' matches no joint of '{}' here, of {}", pattern, model_.name, quoted_list(names)));
}

std::vector<std::optional<double>> IsaacEnvironment::values(const YamlPlace& place,
                                                            const std::vector<std::string>& names) {
  if (place.node->kind != YamlNode::Kind::kMap) {
    return std::vector<std::optional<double>>(names.size(), read_.number(place));
  }
  std::vector<std::optional<double>> found(names.size());
  for (const auto& [text, node] : place.node->entries) {
    const Pattern pattern = read_.pattern({node, place.path}, text);
    const double value = read_.number({node, place.path + "." + text});
    bool any = false;
    for (size_t i = 0; i < names.size(); ++i) {
      if (!read_.matches({node, place.path}, pattern, text, names[i])) continue;
      any = true;
      if (found[i]) read_.fail({node, place.path}, fmt::format("two patterns match the joint '{}'", names[i]));
      found[i] = value;
    }
    if (!any) no_match({node, place.path}, text, names);
  }
  return found;
}
std::vector<double> IsaacEnvironment::values(const YamlPlace& place, const std::vector<std::string>& names,
                                             double otherwise) {
  std::vector<double> all;
  for (const auto& value : values(place, names)) all.push_back(value.value_or(otherwise));
  return all;
}

void IsaacEnvironment::read_action() {
  const YamlPlace actions = read_.need(root_, "actions");
  const std::vector<YamlPlace> terms = YamlValues::entries(actions);
  const std::map<std::string, std::string> types = {{"JointPositionAction", "joint_position"},
                                                    {"JointVelocityAction", "joint_velocity"},
                                                    {"JointEffortAction", "joint_effort"}};
  std::vector<YamlPlace> taken;
  for (const YamlPlace& term : terms) {
    if (term.node->kind != YamlNode::Kind::kMap) read_.fail(term, "it is no term of actions");
    const std::string kind = read_.name_of(term, "class_type");
    const bool known = types.contains(kind);
    const std::string held = "its joints are held at their default positions by the drives of training";
    if (ignores(term, fmt::format("actions of the kind '{}': {}", kind, held))) continue;
    if (known) {
      taken.push_back(term);
    } else {
      must_ignore(term,
                  fmt::format("assay has no actions of the kind '{}', only JointPositionAction, JointVelocityAction "
                              "and JointEffortAction; without it {}",
                              kind, held));
    }
  }
  if (taken.empty()) read_.fail(actions, "no term of it gives a network's actions to joints");
  action_ = taken.front();
  for (size_t i = 1; i < taken.size(); ++i) {
    must_ignore(taken[i],
                fmt::format("a second term of actions beside '{}', and assay takes one: without it its joints "
                            "are held at their default positions by the drives of training, and the network "
                            "has to have the other's actions alone",
                            YamlValues::key(action_)));
  }
  type_ = types.at(read_.name_of(action_, "class_type"));
  const auto asset = YamlValues::child(action_, "asset_name");
  robot_ = read_.need(read_.need(root_, "scene"), asset ? read_.text(*asset) : "robot");
  acted_ = matching(read_.need(action_, "joint_names"), read_.flag(action_, "preserve_order", false));
  if (acted_.empty()) read_.fail(action_, fmt::format("it acts on no joint of '{}'", model_.name));
}

void IsaacEnvironment::read_robot() {
  default_pos_.assign(names_.size(), 0);
  const auto start = YamlValues::child(robot_, "init_state");
  if (!start) return;
  if (const auto positions = YamlValues::child(*start, "joint_pos")) default_pos_ = values(*positions, names_, 0);
  if (const auto rates = YamlValues::child(*start, "joint_vel")) {
    for (const double rate : values(*rates, names_, 0)) {
      if (rate == 0) continue;
      must_ignore(*rates, "default rates that are not 0, of which assay has none");
      break;
    }
  }
  list_start(start->path + ".joint_pos");
  if (const auto p = YamlValues::child(*start, "pos"); p && has_free_base()) {
    const std::vector<double> position = read_.numbers(*p);
    left_out(p->path, fmt::format("runs start at the robot's own initial pose, not at {}", vector_text(position)));
  }
}

}  // namespace assay
