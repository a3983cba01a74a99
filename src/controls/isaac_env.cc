#include "controls/isaac_env.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <set>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/terminal.h"
#include "base/text.h"
#include "controls/deploy_file.h"
#include "controls/hold.h"
#include "controls/pattern.h"
#include "controls/policy_config.h"
#include "controls/toml_text.h"
#include "controls/yaml_tree.h"
#include "controls/yaml_values.h"

namespace assay {
namespace {

// What drives one joint in training.
struct Drive {
  YamlPlace group;
  std::string kind;  // class of the actuator
  double stiffness = 0, damping = 0;
  std::optional<double> limit;
};

class Importer : PolicyImporter {
 public:
  Importer(const Model& model, const YamlTree& tree, const std::string& path, const PolicyImportOptions& options)
      : PolicyImporter(model, tree, path, "environment of Isaac Lab", options) {}

  PolicyImport run() {
    check_kind();
    order_joints();
    std::string control, observations, actions, pd, termination;
    part([&] { read_action(); });
    // the rest asks for the robot and the joints of the actions
    if (acted_.empty()) throw_problems();
    part([&] { read_robot(); });
    const bool drives = part([&] { read_drives(); });
    part([&] { control = control_text(); });
    part([&] { observations = observations_text(); });
    part([&] { actions = actions_text(); });
    if (drives) part([&] { pd = pd_text(); });
    part([&] { termination = termination_text(); });
    part([&] { list_events(); });
    part([&] { list_world(); });
    return finish(trained_in(), control + observations + actions + pd + hold_text(held_) + command_text_ + termination);
  }

 private:
  // ---- the file as a whole ------------------------------------------------------------------------------------------

  void check_kind() const {
    if (root_.node->kind != YamlNode::Kind::kMap) {
      throw InputError(
          fmt::format("'{}' is {}, no environment of Isaac Lab: give the params/env.yaml that a training writes", path_,
                      shown(*root_.node)));
    }
    if (!YamlValues::child(root_, "observations") && YamlValues::child(root_, "observation_space")) {
      throw InputError(
          fmt::format("'{}' is an environment of the direct workflow, whose observations are computed in Python and "
                      "stand in no file: write the configuration by hand (docs/sim2sim.md)",
                      path_));
    }
    for (const char* key : {"sim", "decimation", "scene", "observations", "actions"})
      static_cast<void>(read_.need(root_, key));
  }

  std::string trained_in() const {
    const YamlPlace sim = read_.need(root_, "sim");
    const auto physx = YamlValues::child(sim, "physx");
    if (!physx) return "";
    const auto solver = YamlValues::child(*physx, "solver_type");
    return solver && solver->node->text == "0" ? "physx-art-pgs" : "physx-art-tgs";
  }

  void order_joints() {
    const std::vector<std::string> known = robot_joints(), tree = breadth_first_joints(model_);
    take_joints(tree, tree == known ? "order of joints: breadth first, as PhysX has it, which is the robot's own here"
                                    : "order of joints: breadth first in the robot's tree, as PhysX has it; the "
                                      "robot's own is another");
  }

  // ---- patterns of joints -------------------------------------------------------------------------------------------

  // Joints that the patterns match, in the order of joints, or of the patterns where the file says so.
  std::vector<std::string> matching(const YamlPlace& place, bool in_pattern_order) {
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
    std::ranges::copy_if(names_, std::back_inserter(ordered),
                         [&](const std::string& name) { return by.contains(name); });
    return ordered;
  }

  void no_match(const YamlPlace& place, const std::string& pattern, const std::vector<std::string>& names) {
    must_ignore(place,
                fmt::format("'{}' matches no joint of '{}' here, of {}", pattern, model_.name, quoted_list(names)));
  }

  // A number for all of `names`, or a map of patterns; nothing where no pattern matches.
  std::vector<std::optional<double>> values(const YamlPlace& place, const std::vector<std::string>& names) {
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
  std::vector<double> values(const YamlPlace& place, const std::vector<std::string>& names, double otherwise) {
    std::vector<double> all;
    for (const auto& value : values(place, names)) all.push_back(value.value_or(otherwise));
    return all;
  }

  // ---- robot and drives -----------------------------------------------------------------------------------------------

  void read_action() {
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

  void read_robot() {
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

  void read_drives() {
    const YamlPlace actuators = read_.need(robot_, "actuators");
    for (const YamlPlace& group : YamlValues::entries(actuators)) {
      if (group.node->kind != YamlNode::Kind::kMap) read_.fail(group, "it is no group of actuators");
      const auto type = YamlValues::child(group, "class_type");
      const std::string kind = type ? read_.name_of(group, "class_type") : "ImplicitActuator";
      const bool implicit = kind == "ImplicitActuator";
      const std::set<std::string> known = {"ImplicitActuator", "IdealPDActuator", "DCMotor", "DelayedPDActuator"};
      if (!known.contains(kind)) {
        must_ignore(type.value_or(group),
                    fmt::format("assay has no actuators of the kind '{}', and takes stiffness and damping as those of "
                                "a PD law",
                                kind));
      }
      const std::vector<std::string> names = matching(read_.need(group, "joint_names_expr"), false);
      const auto gains = [&](const char* key) {
        const auto place = YamlValues::child(group, key);
        if (!place) {
          read_.fail(group, fmt::format("its {} is null, which is that of a USD file or of a network: write the number "
                                        "into the file",
                                        key));
        }
        std::vector<double> all;
        size_t i = 0;
        for (const auto& value : values(*place, names)) {
          if (!value) read_.fail(*place, fmt::format("no pattern matches the joint '{}'", names[i]));
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
      if (limit) limits = values(*limit, names);
      for (size_t i = 0; i < names.size(); ++i) {
        const Drive drive = {group, kind, stiffness[i], damping[i], limits[i]};
        if (!drives_.emplace(names[i], drive).second) {
          read_.fail(group, fmt::format("another group of actuators has the joint '{}', too", names[i]));
        }
      }
      list_actuator(group, kind, names);
    }
    for (const std::string& name : acted_) {
      if (!drives_.contains(name)) {
        read_.fail(actuators, fmt::format("no group of it has the joint '{}', on which the policy acts", name));
      }
    }
    list_passive_drives();
  }

  // What of a group of actuators is no PD law.
  void list_actuator(const YamlPlace& group, const std::string& kind, const std::vector<std::string>& names) {
    if (kind == "DCMotor") {
      left_out(group.path, "a motor whose torque falls with its speed: here the limit is the same at every speed");
    }
    const auto least = YamlValues::child(group, "min_delay"), most = YamlValues::child(group, "max_delay");
    const int low = least ? read_.whole(*least, 0) : 0, high = most ? read_.whole(*most, 0) : 0;
    if (most && high > 0) {
      const int decimation = read_.whole(read_.need(root_, "decimation"), 1);
      if (low == high && low % decimation == 0) {
        delay_ = low / decimation;
      } else if (!least || low == 0) {
        left_out(most->path, fmt::format("delays of 0 to {} engine steps at random: here there is none; delay in "
                                         "[control] is in control steps",
                                         high));
      } else {
        must_ignore(*least,
                    fmt::format("a delay of {} to {} engine steps, no whole number of control steps", low, high));
      }
    }
    for (const auto& [key, what, of] :
         {std::tuple{"armature", "armature", &Joint::armature}, std::tuple{"friction", "", &Joint::dry_friction}}) {
      const auto place = YamlValues::child(group, key);
      if (!place) continue;
      const auto given = values(*place, names);
      std::vector<std::string> others;
      for (size_t i = 0; i < names.size(); ++i) {
        const std::optional<double>& own = given[i];
        if (own && !nearly(*own, joint(names[i]).*of)) others.push_back(names[i]);
      }
      if (others.empty()) continue;
      if (*what != '\0') {
        left_out(place->path, fmt::format("the robot's own {} acts, which is another for {} ({} of '{}')", what,
                                          some_of(others), shortest(joint(others.front()).*of), others.front()));
      } else {
        left_out(place->path,
                 fmt::format("PhysX's friction of joints: the robot's own dry friction acts, {} N or Nm of "
                             "'{}'",
                             shortest(joint(others.front()).*of), others.front()));
      }
    }
    if (const auto rate = YamlValues::child(group, "velocity_limit_sim")) {
      left_out(rate->path, "joints are not slowed down at a largest rate here");
    }
  }

  // Drives of joints on which the policy does not act hold them at their default positions in training, and dampers act
  // beside efforts: springs and dampers of the engine. Where a stiffness beside efforts pulls to, the file does not
  // say.
  void list_passive_drives() {
    std::set<std::string> told;
    std::vector<std::string> held;
    for (const auto& [name, drive] : drives_) {
      const bool acted = std::ranges::find(acted_, name) != acted_.end();
      const Joint& own = joint(name);
      if (acted && type_ != "joint_effort") {
        if (own.damping != 0 || own.stiffness != 0) beside_.push_back(name);
        continue;
      }
      if (nearly(own.stiffness, drive.stiffness) && nearly(own.damping, drive.damping)) continue;
      if (!acted || drive.stiffness == 0) {
        // the robot's own springs may be those of training already, or a part of them
        held_.push_back({name, default_pos_[static_cast<size_t>(std::ranges::find(names_, name) - names_.begin())],
                         std::max(0.0, drive.stiffness - own.stiffness), std::max(0.0, drive.damping - own.damping)});
        held.push_back(name);
        continue;
      }
      if (!told.insert(drive.group.path).second) continue;
      must_ignore(
          drive.group,
          fmt::format(
              "it gives the joint '{}' the stiffness {} and the damping {} beside the policy, and the "
              "robot has {} and {}: give it a [hold] in the configuration, or the joint of '{}' those of training",
              name, shortest(drive.stiffness), shortest(drive.damping), shortest(own.stiffness), shortest(own.damping),
              model_.name));
    }
    if (!held.empty()) {
      left_out(
          robot_.path + ".actuators",
          fmt::format("no targets for {}: springs and dampers of the engine act as the drives of training did, without "
                      "limits of effort ([hold])",
                      some_of(held)));
    }
    if (!beside_.empty()) {
      left_out(robot_.path + ".actuators",
               fmt::format("in training the drives' damping was all there was; the robot's own springs and dampers of "
                           "{} act beside them",
                           some_of(beside_)));
    }
  }

  std::string pd_text() {
    if (type_ == "joint_effort") return effort_limits_text(true);
    bool implicit = true, limited = false;
    std::vector<double> stiffness, damping;
    for (const std::string& name : acted_) {
      const Drive& drive = drives_.at(name);
      implicit = implicit && drive.kind == "ImplicitActuator";
      limited = limited || drive.limit.has_value();
      stiffness.push_back(drive.stiffness);
      damping.push_back(drive.damping);
      if (type_ == "joint_velocity" && drive.stiffness != 0) {
        must_ignore(drive.group, "a stiffness under velocity actions, which have none here");
      }
    }
    const bool engine = implicit && !limited;
    if (implicit) {
      left_out(robot_.path + ".actuators",
               engine ? "drives of PhysX: here springs and dampers of the engine (law = \"engine\")"
                      : "drives of PhysX, which are implicit: here the torques are explicit, because springs of "
                        "engines have no torque limit; law = \"engine\" with effort_limit = inf is the other choice");
    }
    std::string text = fmt::format("\n[pd]\nlaw = \"{}\"\n", engine ? "engine" : "explicit");
    if (type_ == "joint_position") text += per_joint("stiffness", acted_, stiffness);
    text += per_joint("damping", acted_, damping);
    return text + effort_limits_text(false);
  }

  // The limits that the file gives; joints without one have the robot's.
  std::string effort_limits_text(bool with_heading) {
    const std::vector<double> own = effort_limits(model_);
    std::vector<double> limits;
    bool any = false;
    for (const std::string& name : acted_) {
      const Drive& drive = drives_.at(name);
      const double robots = own[index_of(name)];
      limits.push_back(drive.limit.value_or(robots > 0 ? robots : std::numeric_limits<double>::infinity()));
      any = any || drive.limit.has_value();
    }
    if (!any) return "";
    return (with_heading ? "\n[pd]\n" : "") + per_joint("effort_limit", acted_, limits);
  }

  std::string control_text() {
    const double dt = read_.positive(read_.need(read_.need(root_, "sim"), "dt"));
    const int decimation = read_.whole(read_.need(root_, "decimation"), 1);
    // dt is a decimal fraction of a second
    std::string text = fmt::format("\n[control]\ntimestep_ms = {}\ndecimation = {}\n",
                                   shortest(std::round(1e12 * dt) / 1e9), decimation);
    if (delay_ > 0) text += fmt::format("delay = {}\n", delay_);
    return text;
  }

  std::string actions_text() {
    std::string text = fmt::format("\n[actions]\ntype = \"{}\"\n", type_) + joints_line(acted_);
    if (const auto scale = YamlValues::child(action_, "scale")) {
      text += per_joint("scale", acted_, values(*scale, acted_, 1));
    }
    if (const auto clip = YamlValues::child(action_, "clip")) {
      must_ignore(*clip, "a clip of targets, where assay clips the network's numbers");
    }
    const bool by_default = type_ != "joint_effort" && read_.flag(action_, "use_default_offset", true);
    if (by_default) return text + (type_ == "joint_position" ? "offset = \"default\"\n" : "");
    const auto offset = YamlValues::child(action_, "offset");
    const std::vector<double> offsets = offset ? values(*offset, acted_, 0) : std::vector<double>(acted_.size(), 0);
    return text + per_joint("offset", acted_, offsets);
  }

  // ---- observations -----------------------------------------------------------------------------------------------------

  struct Term {
    std::string name;
    std::vector<std::string> lines;
  };

  std::string observations_text() {
    const YamlPlace groups = read_.need(root_, "observations");
    const auto group = YamlValues::child(groups, options_.group);
    if (!group) {
      std::vector<std::string> known;
      for (const YamlPlace& each : YamlValues::entries(groups)) known.push_back(YamlValues::key(each));
      read_.fail(groups, fmt::format("there is no group '{}'{}: name one with --group", options_.group,
                                     did_you_mean(options_.group, known)));
    }
    if (group->node->kind != YamlNode::Kind::kMap) read_.fail(*group, "it is no group of observations");
    if (!read_.flag(*group, "concatenate_terms", true)) {
      read_.fail(*group, "its terms are not concatenated, and assay's networks have one input");
    }
    const std::set<std::string> of_group = {"enable_corruption", "concatenate_terms", "concatenate_dim",
                                            "history_length", "flatten_history_dim"};
    std::vector<std::string> noisy;
    std::string terms;
    for (const YamlPlace& term : YamlValues::entries(*group)) {
      if (of_group.contains(YamlValues::key(term))) continue;
      if (term.node->kind != YamlNode::Kind::kMap) read_.fail(term, "it is no term of observations");
      const std::string text = term_text(term);
      auto length = YamlValues::child(*group, "history_length");
      const bool of_all = length.has_value();
      if (!of_all) length = YamlValues::child(term, "history_length");
      const int steps = std::max(1, length ? read_.whole(*length, 0) : 1);
      if (steps > 1 && !read_.flag(of_all ? *group : term, "flatten_history_dim", true)) {
        read_.fail(length.value_or(term),
                   "the history is a dimension of its own (flatten_history_dim), and networks have one here");
      }
      take_history(length.value_or(term), steps);
      if (YamlValues::child(term, "noise")) noisy.push_back(YamlValues::key(term));
      terms += text;
    }
    if (terms.empty()) read_.fail(*group, "it has no terms");
    if (!noisy.empty() && read_.flag(*group, "enable_corruption", false)) {
      left_out(fmt::format("{}.*.noise", group->path),
               fmt::format("noise on {}: here observations are exact", some_of(noisy)));
    }
    const std::string text = "\n[observations]\n" + history_text(history_.value_or(1));
    return text + terms;
  }

  std::string term_text(const YamlPlace& term) {
    const std::string function = read_.name_of(term, "func");
    const std::map<std::string, std::string> plain = {{"base_lin_vel", "base_lin_vel"},
                                                      {"base_ang_vel", "base_ang_vel"},
                                                      {"projected_gravity", "projected_gravity"},
                                                      {"base_pos_z", "base_height"},
                                                      {"joint_pos_rel", "joint_pos_rel"},
                                                      {"joint_pos", "joint_pos"},
                                                      {"joint_vel_rel", "joint_vel_rel"},
                                                      {"joint_vel", "joint_vel_rel"},
                                                      {"last_action", "last_action"}};
    const auto params = YamlValues::child(term, "params");
    std::string name;
    std::optional<int> zeros;
    if (const auto found = plain.find(function); found != plain.end()) name = found->second;
    if (function == "generated_commands" && params && is_velocity(*params)) name = "velocity_commands";
    if (function == "root_quat_w" && params && read_.flag(*params, "make_quat_unique", false)) {
      name = "base_quat_wxyz";
      const auto start = YamlValues::child(robot_, "init_state");
      if (const auto given = start ? YamlValues::child(*start, "rot") : std::nullopt) {
        const std::vector<double> rot = read_.numbers(*given);
        if (rot.size() == 4 && rot[0] == 0 && rot[3] != 0) {
          must_ignore(term, "a quaternion of Isaac Lab 3, x first, where assay's has w first");
        }
      }
    }
    if (name.empty()) {
      zeros = zeros_for(term.path);
      if (!zeros) {
        read_.fail(term, fmt::format("assay has no observation '{}'; --ignore {}=COUNT gives the network that many "
                                     "zeros in its place",
                                     function, term.path));
      }
      name = "constant";
      left_out(term.path, fmt::format("IGNORED: assay has no observation '{}', and gives the network {} in its place",
                                      function, counted(static_cast<size_t>(*zeros), "zero")));
    }
    if (name == "base_lin_vel") list_velocity_point(term);
    std::string text = fmt::format("[[observations.terms]]\nterm = \"{}\"\n", name);
    if (zeros) {
      std::string list;
      for (int i = 0; i < *zeros; ++i) list += i == 0 ? "0" : ", 0";
      return text + fmt::format("values = [{}]\n", list);
    }
    if (name.starts_with("joint_") && params) {
      const std::vector<std::string> names = term_joints(term, *params);
      text += joints_line(names);
    }
    if (const auto modifiers = YamlValues::child(term, "modifiers");
        modifiers && (modifiers->node->kind != YamlNode::Kind::kList || !modifiers->node->items.empty())) {
      must_ignore(*modifiers, "modifiers, of which assay has none");
    }
    if (const auto scale = YamlValues::child(term, "scale")) {
      if (scale->node->kind == YamlNode::Kind::kList && !scale->node->tag.starts_with("python/object")) {
        std::vector<std::string> numbers;
        for (const double value : read_.numbers(*scale)) numbers.push_back(shortest(value));
        text += fmt::format("scale = [{}]\n", join(numbers, ", "));
      } else {
        text += fmt::format("scale = {}\n", shortest(read_.number(*scale)));
      }
    }
    if (const auto clip = YamlValues::child(term, "clip")) {
      const Range range = read_.range(*clip);
      text += fmt::format("clip = [{}, {}]\n", shortest(range.low), shortest(range.high));
    }
    return text;
  }

  // Isaac Lab's is that of the base's centre of mass.
  void list_velocity_point(const YamlPlace& term) {
    for (const Body& body : model_.bodies) {
      if (!body.is_free() || body.p_BBcm.norm() < 1e-3) continue;
      left_out(term.path, fmt::format("in training the velocity of the centre of mass of the base, {} mm from the "
                                      "origin of '{}', whose velocity it is here",
                                      shortest(std::round(1e3 * body.p_BBcm.norm())), body.name));
      return;
    }
  }

  std::vector<std::string> term_joints(const YamlPlace& term, const YamlPlace& params) {
    const auto asset = YamlValues::child(params, "asset_cfg");
    if (!asset) return names_;
    if (const auto name = YamlValues::child(*asset, "name"); name && read_.text(*name) != YamlValues::key(robot_)) {
      read_.fail(term, fmt::format("it observes '{}', and the policy acts on '{}'", read_.text(*name),
                                   YamlValues::key(robot_)));
    }
    const auto joint_names = YamlValues::child(*asset, "joint_names");
    if (joint_names) return matching(*joint_names, read_.flag(*asset, "preserve_order", false));
    const auto ids = YamlValues::child(*asset, "joint_ids");
    if (ids && ids->node->kind == YamlNode::Kind::kList && !ids->node->tag.ends_with("slice")) {
      read_.fail(*ids, "joints by number: write joint_names instead");
    }
    return names_;
  }

  // Whether the command that a term observes is a velocity; then [command] has it.
  bool is_velocity(const YamlPlace& params) {
    const auto name = YamlValues::child(params, "command_name");
    const auto commands = YamlValues::child(root_, "commands");
    if (!name || !commands) return false;
    const auto command = YamlValues::child(*commands, read_.text(*name));
    if (!command) return false;
    const auto ranges = YamlValues::child(*command, "ranges");
    if (!ranges || !YamlValues::child(*ranges, "lin_vel_x")) return false;
    command_text(*command, *ranges);
    return true;
  }

  void command_text(const YamlPlace& command, const YamlPlace& ranges) {
    if (!command_text_.empty()) return;
    take_command(ranges);
    if (read_.flag(command, "heading_command", false)) {
      left_out(command.path + ".heading_command",
               "the turning rate followed from a heading: here it is that of [command]");
    }
  }

  // ---- the rest ---------------------------------------------------------------------------------------------------------

  std::string termination_text() {
    const auto terms = YamlValues::child(root_, "terminations");
    std::string text, joints;
    for (const YamlPlace& term : terms ? YamlValues::entries(*terms) : std::vector<YamlPlace>()) {
      if (term.node->kind != YamlNode::Kind::kMap) read_.fail(term, "it is no termination");
      const std::string function = read_.name_of(term, "func");
      const YamlPlace params = YamlValues::child(term, "params").value_or(term);
      if (function == "time_out") continue;
      if (function == "root_height_below_minimum" && has_free_base()) {
        text += fmt::format("base_height_below = {}\n", shortest(read_.number(read_.need(params, "minimum_height"))));
      } else if (function == "bad_orientation" && has_free_base()) {
        text += fmt::format("base_tilt_above = {}\n", shortest(read_.number(read_.need(params, "limit_angle"))));
      } else if (function == "joint_pos_out_of_manual_limit") {
        const Range bounds = read_.range(read_.need(params, "bounds"));
        for (const std::string& name : term_joints(term, params)) {
          joints += fmt::format("{}{} = [{}, {}]", joints.empty() ? "" : ", ", toml_text(name), shortest(bounds.low),
                                shortest(bounds.high));
        }
      } else {
        left_out(term.path, fmt::format("the end of an episode by '{}': here it is no fall", function));
      }
    }
    if (!joints.empty()) text += fmt::format("joint_outside = {{ {} }}\n", joints);
    if (text.empty()) {
      list_no_termination("terminations");
      return "";
    }
    return "\n[termination]\n" + text;
  }

  void list_events() {
    const auto events = YamlValues::child(root_, "events");
    if (!events) return;
    for (const YamlPlace& event : YamlValues::entries(*events)) {
      if (event.node->kind != YamlNode::Kind::kMap) continue;
      const std::string function = read_.name_of(event, "func");
      if (function == "push_by_setting_velocity") {
        left_out(event.path, "pushes of the base: not part of the policy (`assay run --push` pushes every contender)");
      } else {
        left_out(event.path, fmt::format("'{}' at random: here the robot is always that of the file", function));
      }
    }
  }

  void list_world() {
    const YamlPlace sim = read_.need(root_, "sim");
    if (const auto gravity = YamlValues::child(sim, "gravity")) {
      const std::vector<double> g = read_.numbers(*gravity);
      if (g.size() == 3 && (Vec3(g[0], g[1], g[2]) - model_.gravity).norm() > 1e-3) {
        left_out(gravity->path, fmt::format("the robot's file has another gravity than {} m/s²", vector_text(g)));
      }
    }
    const auto terrain = YamlValues::child(read_.need(root_, "scene"), "terrain");
    if (!terrain) return;
    if (const auto type = YamlValues::child(*terrain, "terrain_type"); type && read_.text(*type) != "plane") {
      left_out(type->path, fmt::format("a terrain of the kind '{}': here the ground is that of the robot's file",
                                       read_.text(*type)));
    }
    const auto material = YamlValues::child(*terrain, "physics_material");
    if (const auto friction = material ? YamlValues::child(*material, "dynamic_friction") : std::nullopt) {
      left_out(friction->path, fmt::format("friction of the ground, {}: here it is that of the robot's file",
                                           shortest(read_.number(*friction))));
    }
  }

  YamlPlace action_, robot_;
  std::string type_;
  std::vector<std::string> acted_;  // joints of the actions, in their order
  std::map<std::string, Drive> drives_;
  std::vector<std::string> beside_;
  std::vector<Held> held_;
  int delay_ = 0;
};

}  // namespace

PolicyImport import_isaac_env(const Model& model, std::string_view text, const std::string& path,
                              const PolicyImportOptions& options) {
  const YamlTree tree = YamlTree::parse(text, path);
  return is_deploy_file(tree) ? import_deploy_file(model, tree, path, options)
                              : Importer(model, tree, path, options).run();
}

}  // namespace assay
