#include "controls/deploy_file.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"

namespace assay {
namespace {

// Of unitree_rl_lab, all of which have articulations with Isaac Lab's own solver.
constexpr const char* kTrainedIn = "physx-art-tgs";

class DeployImporter : PolicyImporter {
 public:
  DeployImporter(const Model& model, const YamlTree& tree, const std::string& path, const PolicyImportOptions& options)
      : PolicyImporter(model, tree, path, "deployment file of unitree_rl_lab", options) {}

  PolicyImport run() {
    order_joints();
    default_pos_ = of_joints(read_.need(root_, "default_joint_pos"));
    list_start("default_joint_pos");
    // a decimal fraction of a second
    const double period = read_.positive(read_.need(root_, "step_dt"));
    const std::string control = fmt::format("\n[control]\nperiod_ms = {}\n", shortest(std::round(1e12 * period) / 1e9));
    std::string observations, actions, pd;
    part([&] { observations = observations_text(); });
    if (part([&] { actions = actions_text(); })) part([&] { pd = pd_text(); });
    list_no_termination("terminations");
    left_out("step_dt",
             "the timestep of training, which the file does not have: a run tries a twentieth, a tenth and a quarter "
             "of it, or --timesteps");
    return finish(kTrainedIn, control + observations + actions + pd + hold_text(held_) + command_text_);
  }

 private:
  // ---- joints -------------------------------------------------------------------------------------------------------

  // Names of the robot's motors.
  std::vector<std::string> motors() const {
    std::vector<std::string> joints = robot_joints(), driven;
    std::set<int> seen;
    for (const Actuator& actuator : model_.actuators) {
      if (actuator.terms.size() != 1 || !seen.insert(actuator.terms.front().joint).second) return joints;
      driven.push_back(joints[static_cast<size_t>(actuator.terms.front().joint)]);
    }
    return driven.empty() ? joints : driven;
  }

  void order_joints() {
    const YamlPlace map = read_.need(root_, "joint_ids_map");
    for (const double number : read_.numbers(map)) ids_.push_back(number);
    std::vector<double> sorted = ids_;
    std::ranges::sort(sorted);
    for (size_t i = 0; i < sorted.size(); ++i) {
      if (sorted[i] != static_cast<double>(i)) {
        read_.fail(map, fmt::format("it has no {}: give each number from 0 to {} once", i, sorted.size() - 1));
      }
    }
    const std::vector<std::string> motors = this->motors();
    const size_t given = options_.joints.empty() ? motors.size() : options_.joints.size();
    if (given != ids_.size()) {
      read_.fail(map, fmt::format("it has {}, and {} {}: give a robot with as many, or name the policy's with --joints",
                                  counted(ids_.size(), "joint"),
                                  options_.joints.empty() ? fmt::format("'{}'", model_.name) : "--joints", given));
    }
    std::vector<std::string> names;
    names.reserve(ids_.size());
    for (const double id : ids_) names.push_back(motors.size() == ids_.size() ? motors[static_cast<size_t>(id)] : "");
    take_joints(names, "order of joints: that of joint_ids_map, by the robot's motors");
    // PhysX counted them in training
    std::vector<std::string> tree = breadth_first_joints(model_);
    std::erase_if(tree, [&](const std::string& name) { return std::ranges::find(names_, name) == names_.end(); });
    if (tree != names_) {
      const auto differs = std::ranges::mismatch(tree, names_);
      left_out(map.path, fmt::format("breadth first in the robot's tree, as PhysX counts, joint {} would be '{}', and "
                                     "by the file it is '{}': if the robot's motors have another order than the "
                                     "training's, give --joints",
                                     differs.in1 - tree.begin(), *differs.in1, *differs.in2));
    }
  }

  // A list of one number for each of the policy's joints.
  std::vector<double> of_joints(const YamlPlace& place) const {
    std::vector<double> values = read_.numbers(place);
    if (values.size() != names_.size()) {
      read_.fail(place,
                 fmt::format("it has {}, and joint_ids_map {}", counted(values.size(), "number"), names_.size()));
    }
    return values;
  }

  // The same of a list that counts by motor.
  std::vector<double> of_motors(const std::string& key) const {
    const std::vector<double> by_motor = of_joints(read_.need(root_, key));
    std::vector<double> values;
    values.reserve(ids_.size());
    for (const double id : ids_) values.push_back(by_motor[static_cast<size_t>(id)]);
    return values;
  }

  // Those of the policy's joints that a part names by number; all where it names none.
  std::vector<std::string> chosen(const std::optional<YamlPlace>& numbers) const {
    if (!numbers || numbers->node->kind != YamlNode::Kind::kList || numbers->node->tag.ends_with("slice")) {
      return names_;
    }
    std::vector<std::string> names;
    for (const double number : read_.numbers(*numbers)) {
      if (number < 0 || number != std::floor(number) || number >= static_cast<double>(names_.size())) {
        read_.fail(*numbers,
                   fmt::format("it has {}: give numbers of joints from 0 to {}", shortest(number), names_.size() - 1));
      }
      names.push_back(names_[static_cast<size_t>(number)]);
    }
    return names;
  }

  // ---- parts of the configuration -----------------------------------------------------------------------------------

  std::string actions_text() {
    const YamlPlace actions = read_.need(root_, "actions");
    const std::vector<YamlPlace> terms = YamlValues::entries(actions);
    if (terms.size() != 1) {
      read_.fail(actions,
                 fmt::format("it has {}: assay takes exactly one term of actions", counted(terms.size(), "term")));
    }
    const YamlPlace& term = terms.front();
    const std::map<std::string, std::string> types = {{"JointPositionAction", "joint_position"},
                                                      {"JointVelocityAction", "joint_velocity"}};
    const auto type = types.find(YamlValues::key(term));
    if (type == types.end()) {
      read_.fail(term, "assay has no actions of this kind, only JointPositionAction and JointVelocityAction");
    }
    type_ = type->second;
    acted_ = chosen(YamlValues::child(term, "joint_ids"));
    if (const auto clip = YamlValues::child(term, "clip")) {
      must_ignore(*clip, "a clip of targets, where assay clips the network's numbers");
    }
    std::string text = fmt::format("\n[actions]\ntype = \"{}\"\n", type_) + joints_line(acted_);
    for (const char* key : {"scale", "offset"}) {
      const YamlPlace place = read_.need(term, key);
      const std::vector<double> values = read_.numbers(place);
      if (values.size() != acted_.size()) {
        read_.fail(place,
                   fmt::format("it has {} for {}", counted(values.size(), "number"), counted(acted_.size(), "action")));
      }
      text += per_joint(key, acted_, values);
    }
    return text;
  }

  std::string pd_text() {
    const std::vector<double> stiffness = of_motors("stiffness"), damping = of_motors("damping");
    std::vector<double> acted_stiffness, acted_damping;
    for (size_t i = 0; i < names_.size(); ++i) {
      if (std::ranges::find(acted_, names_[i]) == acted_.end()) {
        const Joint& own = joint(names_[i]);
        held_.push_back({names_[i], default_pos_[i], std::max(0.0, stiffness[i] - own.stiffness),
                         std::max(0.0, damping[i] - own.damping)});
      }
    }
    for (const std::string& name : acted_) {
      const auto i = static_cast<size_t>(std::ranges::find(names_, name) - names_.begin());
      acted_stiffness.push_back(stiffness[i]);
      acted_damping.push_back(damping[i]);
    }
    left_out("stiffness",
             "drives of PhysX in training, which are implicit, and of the motors on the robot: here the torques are "
             "explicit, with the robot's effort limits; law = \"engine\" with effort_limit = inf is the other choice");
    std::vector<std::string> beside;
    for (const std::string& name : acted_) {
      if (joint(name).damping != 0 || joint(name).stiffness != 0) beside.push_back(name);
    }
    if (!beside.empty()) {
      left_out("damping", fmt::format("the robot's own springs and dampers of {} act beside it", some_of(beside)));
    }
    std::string text = "\n[pd]\nlaw = \"explicit\"\n";
    if (type_ == "joint_position") text += per_joint("stiffness", acted_, acted_stiffness);
    return text + per_joint("damping", acted_, acted_damping);
  }

  std::string observations_text() {
    const YamlPlace group = read_.need(root_, "observations");
    std::string terms;
    for (const YamlPlace& term : YamlValues::entries(group)) {
      if (term.node->kind != YamlNode::Kind::kMap) read_.fail(term, "it is no term of observations");
      const auto length = YamlValues::child(term, "history_length");
      take_history(term, std::max(1, length ? read_.whole(*length, 0) : 1));
      terms += term_text(term);
    }
    if (terms.empty()) read_.fail(group, "it has no terms");
    return "\n[observations]\n" + history_text(history_.value_or(1)) + terms;
  }

  std::string term_text(const YamlPlace& term) {
    const std::string name = YamlValues::key(term);
    const std::set<std::string> known = {"base_lin_vel",  "base_ang_vel", "projected_gravity", "velocity_commands",
                                         "joint_pos_rel", "joint_pos",    "joint_vel_rel",     "joint_vel",
                                         "last_action",   "gait_phase"};
    if (!known.contains(name)) {
      const auto zeros = zeros_for(term.path);
      if (!zeros) {
        read_.fail(term, fmt::format("assay has no observation '{}'; --ignore {}=COUNT gives the network that many "
                                     "zeros in its place",
                                     name, term.path));
      }
      left_out(term.path, fmt::format("IGNORED: assay has no observation '{}', and gives the network {} in its place",
                                      name, counted(static_cast<size_t>(*zeros), "zero")));
      const std::vector<std::string> values(static_cast<size_t>(*zeros), "0");
      return fmt::format("[[observations.terms]]\nterm = \"constant\"\nvalues = [{}]\n", join(values, ", "));
    }
    const auto params = YamlValues::child(term, "params");
    if (name == "velocity_commands") {
      take_command(read_.need(read_.need(read_.need(root_, "commands"), "base_velocity"), "ranges"));
    }
    std::string text = "[[observations.terms]]\n";
    if (name == "gait_phase") {
      if (!params) read_.fail(term, "it has no 'params' with the 'period'");
      text += fmt::format("term = \"phase\"\nperiod_s = {}\n", shortest(read_.positive(read_.need(*params, "period"))));
    } else {
      text += fmt::format("term = \"{}\"\n", name == "joint_vel" ? "joint_vel_rel" : name);
    }
    if (name.starts_with("joint_") && params) {
      const auto asset = YamlValues::child(*params, "asset_cfg");
      text += joints_line(chosen(asset ? YamlValues::child(*asset, "joint_ids") : std::nullopt));
    }
    if (const auto scale = YamlValues::child(term, "scale")) {
      const std::vector<double> values = read_.numbers(*scale);
      if (values.empty()) read_.fail(*scale, "it has no number");
      std::vector<std::string> texts;
      texts.reserve(values.size());
      for (const double value : values) texts.push_back(shortest(value));
      const bool equal = std::ranges::all_of(values, [&](double value) { return value == values.front(); });
      text += equal ? fmt::format("scale = {}\n", texts.front()) : fmt::format("scale = [{}]\n", join(texts, ", "));
    }
    if (const auto clip = YamlValues::child(term, "clip")) {
      const Range range = read_.range(*clip);
      text += fmt::format("clip = [{}, {}]\n", shortest(range.low), shortest(range.high));
    }
    return text;
  }

  std::vector<double> ids_;  // of each of the policy's joints, number of its motor; whole numbers
  std::string type_;
  std::vector<std::string> acted_;  // joints of the actions, in their order
  std::vector<Held> held_;
};

}  // namespace

bool is_deploy_file(const YamlTree& tree) {
  return tree.root().kind == YamlNode::Kind::kMap && tree.root().find("joint_ids_map") != nullptr;
}

PolicyImport import_deploy_file(const Model& model, const YamlTree& tree, const std::string& path,
                                const PolicyImportOptions& options) {
  return DeployImporter(model, tree, path, options).run();
}

}  // namespace assay
