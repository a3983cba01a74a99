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
#include "controls/hold.h"
#include "controls/input_file.h"
#include "controls/pattern.h"
#include "controls/policy_config.h"
#include "controls/toml_text.h"
#include "controls/yaml_tree.h"

namespace assay {
namespace {

constexpr size_t kLongestPattern = 500;
constexpr int kMostZeros = 100'000;

// A node and where it is in the file: "scene.robot.init_state".
struct Place {
  const YamlNode* node = nullptr;
  std::string path;
};

std::string shown(const YamlNode& node) {
  if (!node.tag.empty() && node.tag.starts_with("python/object")) return fmt::format("a Python object ({})", node.tag);
  if (node.kind == YamlNode::Kind::kList) return "a list";
  if (node.kind == YamlNode::Kind::kMap) return "a map";
  return node.is_null() ? "null" : fmt::format("'{}'", node.text);
}

std::string vector_text(const std::vector<double>& values) {
  std::vector<std::string> texts;
  texts.reserve(values.size());
  for (const double value : values) texts.push_back(shortest(value));
  return "(" + join(texts, ", ") + ")";
}

std::string list_of(const std::vector<std::string>& names) {
  std::vector<std::string> quoted;
  quoted.reserve(names.size());
  for (const std::string& name : names) quoted.push_back(fmt::format("'{}'", name));
  return join(quoted, ", ");
}

bool nearly(double a, double b) { return std::abs(a - b) <= 1e-6 * std::max({1.0, std::abs(a), std::abs(b)}); }

// Reading of the file's values; what is wrong is named with its line and path.
class Values {
 public:
  explicit Values(std::string path) : path_(std::move(path)) {}

  [[noreturn]] void fail(const Place& place, const std::string& sentence) const {
    throw InputError(fmt::format("{}:{}: {}: {}", path_, place.node->line, place.path, sentence));
  }

  // Nothing for a key that is missing or null.
  static std::optional<Place> child(const Place& of, const std::string& key) {
    const YamlNode* node = of.node->find(key);
    if (node == nullptr || node->is_null()) return std::nullopt;
    return Place{node, of.path.empty() ? key : of.path + "." + key};
  }
  Place need(const Place& of, const std::string& key) const {
    if (auto found = child(of, key)) return *found;
    const std::string sentence = fmt::format("it has no '{}', which the environments of Isaac Lab have", key);
    if (of.path.empty()) throw InputError(fmt::format("'{}' is no environment of Isaac Lab: {}", path_, sentence));
    fail(of, sentence);
  }
  static std::vector<Place> entries(const Place& of) {
    std::vector<Place> all;
    for (const auto& [key, node] : of.node->entries) {
      if (!node->is_null()) all.push_back({node, of.path.empty() ? key : of.path + "." + key});
    }
    return all;
  }
  // The last name of a path.
  static std::string key(const Place& place) { return place.path.substr(place.path.rfind('.') + 1); }

  // May be infinite.
  static std::optional<double> number_or_none(const Place& place) {
    const YamlNode& node = *place.node;
    if (node.kind != YamlNode::Kind::kScalar || node.quoted) return std::nullopt;
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    if (node.text == ".inf" || node.text == "+.inf") return kInfinity;
    if (node.text == "-.inf") return -kInfinity;
    return parse_number(node.text);
  }
  double number(const Place& place) const {
    const auto value = number_or_none(place);
    if (!value) fail(place, fmt::format("it is {}: write the number", shown(*place.node)));
    return *value;
  }
  double positive(const Place& place) const {
    const double value = number(place);
    if (!(value > 0) || !std::isfinite(value)) {
      fail(place, fmt::format("it is {}: give a positive number", shortest(value)));
    }
    return value;
  }
  int whole(const Place& place, int least) const {
    const double value = number(place);
    if (value < least || value > 1e6 || value != std::floor(value)) {
      fail(place, fmt::format("it is {}: give a whole number of at least {}", shortest(value), least));
    }
    return static_cast<int>(value);
  }
  bool flag(const Place& of, const std::string& key, bool otherwise) const {
    const auto place = child(of, key);
    if (!place) return otherwise;
    if (place->node->text != "true" && place->node->text != "false") {
      fail(*place, fmt::format("it is {}: write true or false", shown(*place->node)));
    }
    return place->node->text == "true";
  }
  std::string text(const Place& place) const {
    if (place.node->kind != YamlNode::Kind::kScalar) {
      fail(place, fmt::format("it is {}: write a name", shown(*place.node)));
    }
    return place.node->text;
  }
  // One text or a list of them.
  std::vector<std::string> texts(const Place& place) const {
    if (place.node->kind != YamlNode::Kind::kList) return {text(place)};
    std::vector<std::string> all;
    all.reserve(place.node->items.size());
    for (const YamlNode* item : place.node->items) all.push_back(text({item, place.path}));
    return all;
  }
  std::vector<double> numbers(const Place& place) const {
    if (place.node->kind != YamlNode::Kind::kList) {
      fail(place, fmt::format("it is {}: write a list of numbers", shown(*place.node)));
    }
    std::vector<double> all;
    all.reserve(place.node->items.size());
    for (const YamlNode* item : place.node->items) all.push_back(number({item, place.path}));
    return all;
  }
  Range range(const Place& place) const {
    const std::vector<double> both = numbers(place);
    if (both.size() != 2 || !(both[0] <= both[1])) fail(place, "it is no range: write [low, high]");
    return {both[0], both[1]};
  }

  // "isaaclab.envs.mdp.observations:joint_pos_rel" is joint_pos_rel.
  std::string name_of(const Place& of, const char* key) const {
    const std::string whole = text(need(of, key));
    return whole.substr(whole.find_last_of(":.") + 1);
  }

  Pattern pattern(const Place& place, const std::string& text) const {
    if (text.size() > kLongestPattern) {
      fail(place, fmt::format("a pattern has {} characters: write one of at most {}", text.size(), kLongestPattern));
    }
    try {
      return Pattern(text);
    } catch (const PatternError& error) {
      fail(place, fmt::format("'{}' is no regular expression: {}", text, error.what()));
    }
  }
  bool matches(const Place& place, const Pattern& pattern, const std::string& text, const std::string& name) const {
    try {
      return pattern.matches(name);
    } catch (const PatternError& error) {
      fail(place, fmt::format("the pattern '{}' on the joint '{}': {}; write a simpler one", text, name, error.what()));
    }
  }

 private:
  std::string path_;
};

// What drives one joint in training.
struct Drive {
  Place group;
  std::string kind;  // class of the actuator
  double stiffness = 0, damping = 0;
  std::optional<double> limit;
};

class Importer {
 public:
  Importer(const Model& model, const YamlTree& tree, const std::string& path, const IsaacImportOptions& options)
      : model_(model), root_{&tree.root(), ""}, path_(path), options_(options), read_(path) {
    for (const std::string& text : options.ignore) {
      const size_t equals = text.rfind('=');
      Ignored ignored = {text.substr(0, equals), std::nullopt, false};
      if (equals != std::string::npos) {
        const auto count = parse_integer(text.substr(equals + 1));
        if (!count || *count < 1 || *count > kMostZeros) {
          throw InputError(
              fmt::format("--ignore is '{}': give PATH, or PATH=COUNT with a count from 1 to {}", text, kMostZeros));
        }
        ignored.zeros = static_cast<int>(*count);
      }
      ignored_.push_back(std::move(ignored));
    }
  }

  IsaacImport run() {
    check_kind();
    order_joints();
    read_action();
    read_robot();
    read_drives();
    const std::string control = control_text();
    const std::string observations = observations_text();
    const std::string actions = actions_text();
    const std::string pd = pd_text();
    const std::string termination = termination_text();
    list_events();
    list_world();
    for (const Ignored& each : ignored_) {
      if (!each.used) {
        throw InputError(
            fmt::format("--ignore {} names nothing of '{}' that has to be ignored: leave it out", each.path, path_));
      }
    }
    IsaacImport result;
    result.joints = names_;
    result.joint_order = joint_order_;
    result.left_out = left_out_;
    result.toml =
        fmt::format("# Written by assay import from {}. docs/sim2sim.md explains the keys.\n", printable(path_));
    for (const LeftOut& each : left_out_) {
      result.toml += fmt::format("# left out: {}: {}\n", printable(each.path), printable(each.meaning));
    }
    if (!options_.network.empty()) result.toml += fmt::format("network = {}\n", toml_text(options_.network));
    if (const std::string contender = trained_in(); !contender.empty()) {
      result.toml += fmt::format("trained_in = {}\n", toml_text(contender));
    }
    result.toml += fmt::format("# {}\njoints = {}\n", joint_order_, names_text(names_));
    result.toml += per_joint("default_joint_pos", names_, default_pos_);
    result.toml += control + observations + actions + pd + command_text_ + termination;
    return result;
  }

 private:
  struct Ignored {
    std::string path;
    std::optional<int> zeros;
    bool used = false;
  };

  void left_out(const std::string& path, const std::string& meaning) { left_out_.push_back({path, meaning}); }

  // The option --ignore that names a path or its end.
  Ignored* ignored(const std::string& path) {
    for (Ignored& each : ignored_) {
      if (path == each.path || path.ends_with("." + each.path)) {
        each.used = true;
        return &each;
      }
    }
    return nullptr;
  }
  // A part without which the policy is another one.
  void must_ignore(const Place& place, const std::string& meaning) {
    if (ignored(place.path) == nullptr) {
      read_.fail(place, fmt::format("{}; --ignore {} leaves it out", meaning, place.path));
    }
    left_out(place.path, "IGNORED: " + meaning);
  }

  // ---- the file as a whole ------------------------------------------------------------------------------------------

  void check_kind() const {
    if (root_.node->kind != YamlNode::Kind::kMap) {
      throw InputError(
          fmt::format("'{}' is {}, no environment of Isaac Lab: give the params/env.yaml that a training writes", path_,
                      shown(*root_.node)));
    }
    if (!Values::child(root_, "observations") && Values::child(root_, "observation_space")) {
      throw InputError(
          fmt::format("'{}' is an environment of the direct workflow, whose observations are computed in Python and "
                      "stand in no file: write the configuration by hand (docs/sim2sim.md)",
                      path_));
    }
    for (const char* key : {"sim", "decimation", "scene", "observations", "actions"})
      static_cast<void>(read_.need(root_, key));
  }

  std::string trained_in() const {
    if (!options_.trained_in.empty()) return options_.trained_in;
    const Place sim = read_.need(root_, "sim");
    const auto physx = Values::child(sim, "physx");
    if (!physx) return "";
    const auto solver = Values::child(*physx, "solver_type");
    return solver && solver->node->text == "0" ? "physx-art-pgs" : "physx-art-tgs";
  }

  void order_joints() {
    std::vector<std::string> known;
    known.reserve(model_.joints.size());
    for (const Joint& joint : model_.joints) known.push_back(joint.name);
    if (known.empty()) throw InputError(fmt::format("'{}' has no hinge or slide for a policy to act on", model_.name));
    if (options_.joints.empty()) {
      names_ = breadth_first_joints(model_);
      joint_order_ = names_ == known ? "order of joints: breadth first, as PhysX has it, which is the robot's own here"
                                     : "order of joints: breadth first in the robot's tree, as PhysX has it; the "
                                       "robot's own is another";
    } else {
      std::set<std::string> seen;
      for (const std::string& name : options_.joints) {
        if (std::ranges::find(known, name) == known.end()) {
          throw InputError(fmt::format("--joints names '{}', which is no hinge or slide of '{}'{}", name, model_.name,
                                       did_you_mean(name, known)));
        }
        if (!seen.insert(name).second) {
          throw InputError(fmt::format("--joints names '{}' twice: name each joint once", name));
        }
      }
      names_ = options_.joints;
      joint_order_ = "order of joints: that of --joints";
    }
    for (const std::string& name : names_) joints_.push_back(index_in(known, name));
  }

  static size_t index_in(const std::vector<std::string>& all, const std::string& name) {
    return static_cast<size_t>(std::ranges::find(all, name) - all.begin());
  }
  const Joint& joint(const std::string& name) const { return model_.joints[joints_[index_in(names_, name)]]; }

  // ---- patterns of joints -------------------------------------------------------------------------------------------

  // Joints that the patterns match, in the order of joints, or of the patterns where the file says so.
  std::vector<std::string> matching(const Place& place, bool in_pattern_order) {
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

  void no_match(const Place& place, const std::string& pattern, const std::vector<std::string>& names) {
    must_ignore(place, fmt::format("'{}' matches no joint of '{}' here, of {}", pattern, model_.name, list_of(names)));
  }

  // A number for all of `names`, or a map of patterns; nothing where no pattern matches.
  std::vector<std::optional<double>> values(const Place& place, const std::vector<std::string>& names) {
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
  std::vector<double> values(const Place& place, const std::vector<std::string>& names, double otherwise) {
    std::vector<double> all;
    for (const auto& value : values(place, names)) all.push_back(value.value_or(otherwise));
    return all;
  }

  // ---- text of the configuration --------------------------------------------------------------------------------------

  static std::string names_text(const std::vector<std::string>& names) {
    std::string text = "[\n";
    for (const std::string& name : names) text += fmt::format("  {},\n", toml_text(name));
    return text + "]";
  }

  static std::string per_joint(const std::string& key, const std::vector<std::string>& names,
                               const std::vector<double>& values) {
    const bool equal = std::ranges::all_of(values, [&](double value) { return value == values.front(); });
    if (equal) return fmt::format("{} = {}\n", key, shortest(values.front()));
    std::string text = key + " = [\n";
    for (size_t i = 0; i < values.size(); ++i) {
      text += fmt::format("  {}, # {}\n", shortest(values[i]), printable(names[i]));
    }
    return text + "]\n";
  }

  std::string joints_line(const std::vector<std::string>& names) const {
    return names == names_ ? "" : fmt::format("joints = {}\n", names_text(names));
  }

  // ---- robot and drives -----------------------------------------------------------------------------------------------

  void read_action() {
    const Place actions = read_.need(root_, "actions");
    const std::vector<Place> terms = Values::entries(actions);
    if (terms.size() != 1) {
      read_.fail(actions,
                 fmt::format("it has {}: assay takes exactly one term of actions", counted(terms.size(), "term")));
    }
    action_ = terms.front();
    if (action_.node->kind != YamlNode::Kind::kMap) read_.fail(action_, "it is no term of actions");
    const std::string kind = read_.name_of(action_, "class_type");
    const std::map<std::string, std::string> types = {{"JointPositionAction", "joint_position"},
                                                      {"JointVelocityAction", "joint_velocity"},
                                                      {"JointEffortAction", "joint_effort"}};
    const auto type = types.find(kind);
    if (type == types.end()) {
      read_.fail(action_, fmt::format("assay has no actions of the kind '{}', only JointPositionAction, "
                                      "JointVelocityAction and JointEffortAction",
                                      kind));
    }
    type_ = type->second;
    const auto asset = Values::child(action_, "asset_name");
    robot_ = read_.need(read_.need(root_, "scene"), asset ? read_.text(*asset) : "robot");
    acted_ = matching(read_.need(action_, "joint_names"), read_.flag(action_, "preserve_order", false));
    if (acted_.empty()) read_.fail(action_, fmt::format("it acts on no joint of '{}'", model_.name));
  }

  void read_robot() {
    default_pos_.assign(names_.size(), 0);
    const auto start = Values::child(robot_, "init_state");
    if (!start) return;
    if (const auto positions = Values::child(*start, "joint_pos")) default_pos_ = values(*positions, names_, 0);
    if (const auto rates = Values::child(*start, "joint_vel")) {
      for (const double rate : values(*rates, names_, 0)) {
        if (rate == 0) continue;
        must_ignore(*rates, "default rates that are not 0, of which assay has none");
        break;
      }
    }
    std::vector<std::string> elsewhere;
    for (size_t i = 0; i < names_.size(); ++i) {
      if (!nearly(model_.initial.position[joints_[i]], default_pos_[i])) elsewhere.push_back(names_[i]);
    }
    if (!elsewhere.empty()) {
      left_out(start->path + ".joint_pos",
               fmt::format("runs start at the robot's own initial state, which is another for {}: give the model a "
                           "keyframe",
                           some(elsewhere)));
    }
    if (const auto p = Values::child(*start, "pos"); p && has_free_base()) {
      const std::vector<double> position = read_.numbers(*p);
      left_out(p->path, fmt::format("runs start at the robot's own initial pose, not at {}", vector_text(position)));
    }
  }

  bool has_free_base() const { return std::ranges::any_of(model_.bodies, &Body::is_free); }

  // "'a', 'b' and 10 more".
  static std::string some(const std::vector<std::string>& names) {
    constexpr size_t kMost = 3;
    if (names.size() <= kMost + 1) return list_of(names);
    return fmt::format("{} and {} more", list_of({names.begin(), names.begin() + kMost}), names.size() - kMost);
  }

  void read_drives() {
    const Place actuators = read_.need(robot_, "actuators");
    for (const Place& group : Values::entries(actuators)) {
      if (group.node->kind != YamlNode::Kind::kMap) read_.fail(group, "it is no group of actuators");
      const auto type = Values::child(group, "class_type");
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
        const auto place = Values::child(group, key);
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
      auto limit = Values::child(group, own);
      if (!limit && implicit) limit = Values::child(group, "effort_limit");
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
  void list_actuator(const Place& group, const std::string& kind, const std::vector<std::string>& names) {
    if (kind == "DCMotor") {
      left_out(group.path, "a motor whose torque falls with its speed: here the limit is the same at every speed");
    }
    const auto least = Values::child(group, "min_delay"), most = Values::child(group, "max_delay");
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
      const auto place = Values::child(group, key);
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
                                          some(others), shortest(joint(others.front()).*of), others.front()));
      } else {
        left_out(place->path,
                 fmt::format("PhysX's friction of joints: the robot's own dry friction acts, {} N or Nm of "
                             "'{}'",
                             shortest(joint(others.front()).*of), others.front()));
      }
    }
    if (const auto rate = Values::child(group, "velocity_limit_sim")) {
      left_out(rate->path, "joints are not slowed down at a largest rate here");
    }
  }

  // Drives of joints on which the policy does not act, or acts by efforts, are springs and dampers of the robot.
  void list_passive_drives() {
    std::set<std::string> told;
    for (const auto& [name, drive] : drives_) {
      const bool acted = std::ranges::find(acted_, name) != acted_.end();
      const Joint& own = joint(name);
      if (acted && type_ != "joint_effort") {
        if (own.damping != 0 || own.stiffness != 0) beside_.push_back(name);
        continue;
      }
      if (nearly(own.stiffness, drive.stiffness) && nearly(own.damping, drive.damping)) continue;
      if (!told.insert(drive.group.path).second) continue;
      must_ignore(drive.group,
                  fmt::format("it gives the joint '{}' the stiffness {} and the damping {} beside the policy, and the "
                              "robot has {} and {}: give the joint of '{}' those of training",
                              name, shortest(drive.stiffness), shortest(drive.damping), shortest(own.stiffness),
                              shortest(own.damping), model_.name));
    }
    if (!beside_.empty()) {
      left_out(robot_.path + ".actuators",
               fmt::format("in training the drives' damping was all there was; the robot's own springs and dampers of "
                           "{} act beside them",
                           some(beside_)));
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
      const double robots = own[joints_[index_in(names_, name)]];
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
    if (const auto scale = Values::child(action_, "scale")) {
      text += per_joint("scale", acted_, values(*scale, acted_, 1));
    }
    if (const auto clip = Values::child(action_, "clip")) {
      must_ignore(*clip, "a clip of targets, where assay clips the network's numbers");
    }
    const bool by_default = type_ != "joint_effort" && read_.flag(action_, "use_default_offset", true);
    if (by_default) return text + (type_ == "joint_position" ? "offset = \"default\"\n" : "");
    const auto offset = Values::child(action_, "offset");
    const std::vector<double> offsets = offset ? values(*offset, acted_, 0) : std::vector<double>(acted_.size(), 0);
    return text + per_joint("offset", acted_, offsets);
  }

  // ---- observations -----------------------------------------------------------------------------------------------------

  struct Term {
    std::string name;
    std::vector<std::string> lines;
  };

  std::string observations_text() {
    const Place groups = read_.need(root_, "observations");
    const auto group = Values::child(groups, options_.group);
    if (!group) {
      std::vector<std::string> known;
      for (const Place& each : Values::entries(groups)) known.push_back(Values::key(each));
      read_.fail(groups, fmt::format("there is no group '{}'{}: name one with --group", options_.group,
                                     did_you_mean(options_.group, known)));
    }
    if (group->node->kind != YamlNode::Kind::kMap) read_.fail(*group, "it is no group of observations");
    if (!read_.flag(*group, "concatenate_terms", true)) {
      read_.fail(*group, "its terms are not concatenated, and assay's networks have one input");
    }
    const std::set<std::string> of_group = {"enable_corruption", "concatenate_terms", "concatenate_dim",
                                            "history_length", "flatten_history_dim"};
    std::optional<int> history;
    std::vector<std::string> noisy;
    std::string terms;
    for (const Place& term : Values::entries(*group)) {
      if (of_group.contains(Values::key(term))) continue;
      if (term.node->kind != YamlNode::Kind::kMap) read_.fail(term, "it is no term of observations");
      const std::string text = term_text(term);
      auto length = Values::child(*group, "history_length");
      const bool of_all = length.has_value();
      if (!of_all) length = Values::child(term, "history_length");
      const int steps = std::max(1, length ? read_.whole(*length, 0) : 1);
      if (steps > 1 && !read_.flag(of_all ? *group : term, "flatten_history_dim", true)) {
        read_.fail(length.value_or(term),
                   "the history is a dimension of its own (flatten_history_dim), and networks have one here");
      }
      if (history && *history != steps) {
        read_.fail(length.value_or(term),
                   fmt::format("a history of {} steps where others have {}, and assay has one for all terms", steps,
                               *history));
      }
      history = steps;
      if (Values::child(term, "noise")) noisy.push_back(Values::key(term));
      terms += text;
    }
    if (terms.empty()) read_.fail(*group, "it has no terms");
    if (!noisy.empty() && read_.flag(*group, "enable_corruption", false)) {
      left_out(fmt::format("{}.*.noise", group->path),
               fmt::format("noise on {}: here observations are exact", some(noisy)));
    }
    std::string text = "\n[observations]\n";
    if (const int steps = history.value_or(1); steps > 1) {
      text += fmt::format(
          "history = {}\nhistory_order = \"oldest_first\"\nhistory_layout = \"term\"\n"
          "history_start = \"first\"\n",
          steps);
    }
    return text + terms;
  }

  std::string term_text(const Place& term) {
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
    const auto params = Values::child(term, "params");
    std::string name;
    std::optional<int> zeros;
    if (const auto found = plain.find(function); found != plain.end()) name = found->second;
    if (function == "generated_commands" && params && is_velocity(*params)) name = "velocity_commands";
    if (function == "root_quat_w" && params && read_.flag(*params, "make_quat_unique", false)) {
      name = "base_quat_wxyz";
      const auto start = Values::child(robot_, "init_state");
      if (const auto given = start ? Values::child(*start, "rot") : std::nullopt) {
        const std::vector<double> rot = read_.numbers(*given);
        if (rot.size() == 4 && rot[0] == 0 && rot[3] != 0) {
          must_ignore(term, "a quaternion of Isaac Lab 3, x first, where assay's has w first");
        }
      }
    }
    if (name.empty()) {
      const Ignored* option = ignored(term.path);
      if (option == nullptr || !option->zeros) {
        read_.fail(term, fmt::format("assay has no observation '{}'; --ignore {}=COUNT gives the network that many "
                                     "zeros in its place",
                                     function, term.path));
      }
      zeros = option->zeros;
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
    if (const auto modifiers = Values::child(term, "modifiers");
        modifiers && (modifiers->node->kind != YamlNode::Kind::kList || !modifiers->node->items.empty())) {
      must_ignore(*modifiers, "modifiers, of which assay has none");
    }
    if (const auto scale = Values::child(term, "scale")) {
      if (scale->node->kind == YamlNode::Kind::kList && !scale->node->tag.starts_with("python/object")) {
        std::vector<std::string> numbers;
        for (const double value : read_.numbers(*scale)) numbers.push_back(shortest(value));
        text += fmt::format("scale = [{}]\n", join(numbers, ", "));
      } else {
        text += fmt::format("scale = {}\n", shortest(read_.number(*scale)));
      }
    }
    if (const auto clip = Values::child(term, "clip")) {
      const Range range = read_.range(*clip);
      text += fmt::format("clip = [{}, {}]\n", shortest(range.low), shortest(range.high));
    }
    return text;
  }

  // Isaac Lab's is that of the base's centre of mass.
  void list_velocity_point(const Place& term) {
    for (const Body& body : model_.bodies) {
      if (!body.is_free() || body.p_BBcm.norm() < 1e-3) continue;
      left_out(term.path, fmt::format("in training the velocity of the centre of mass of the base, {} mm from the "
                                      "origin of '{}', whose velocity it is here",
                                      shortest(std::round(1e3 * body.p_BBcm.norm())), body.name));
      return;
    }
  }

  std::vector<std::string> term_joints(const Place& term, const Place& params) {
    const auto asset = Values::child(params, "asset_cfg");
    if (!asset) return names_;
    if (const auto name = Values::child(*asset, "name"); name && read_.text(*name) != Values::key(robot_)) {
      read_.fail(term,
                 fmt::format("it observes '{}', and the policy acts on '{}'", read_.text(*name), Values::key(robot_)));
    }
    const auto joint_names = Values::child(*asset, "joint_names");
    if (joint_names) return matching(*joint_names, read_.flag(*asset, "preserve_order", false));
    const auto ids = Values::child(*asset, "joint_ids");
    if (ids && ids->node->kind == YamlNode::Kind::kList && !ids->node->tag.ends_with("slice")) {
      read_.fail(*ids, "joints by number: write joint_names instead");
    }
    return names_;
  }

  // Whether the command that a term observes is a velocity; then [command] has it.
  bool is_velocity(const Place& params) {
    const auto name = Values::child(params, "command_name");
    const auto commands = Values::child(root_, "commands");
    if (!name || !commands) return false;
    const auto command = Values::child(*commands, read_.text(*name));
    if (!command) return false;
    const auto ranges = Values::child(*command, "ranges");
    if (!ranges || !Values::child(*ranges, "lin_vel_x")) return false;
    command_text(*command, *ranges);
    return true;
  }

  void command_text(const Place& command, const Place& ranges) {
    if (!command_text_.empty()) return;
    std::array<Range, 3> of;
    size_t i = 0;
    for (const char* key : {"lin_vel_x", "lin_vel_y", "ang_vel_z"}) of.at(i++) = read_.range(read_.need(ranges, key));
    std::array<double, 3> velocity = {std::clamp(of[0].high / 2, of[0].low, of[0].high),
                                      std::clamp(0.0, of[1].low, of[1].high), std::clamp(0.0, of[2].low, of[2].high)};
    if (options_.command) velocity = *options_.command;
    left_out(
        ranges.path,
        fmt::format("commands at random, forward {} to {} m/s, left {} to {} m/s, turning {} to {} rad/s: here one, "
                    "{}{}",
                    shortest(of[0].low), shortest(of[0].high), shortest(of[1].low), shortest(of[1].high),
                    shortest(of[2].low), shortest(of[2].high), vector_text({velocity.begin(), velocity.end()}),
                    options_.command ? "" : "; --command chooses another"));
    for (size_t k = 0; k < velocity.size(); ++k) {
      if (velocity.at(k) >= of.at(k).low && velocity.at(k) <= of.at(k).high) continue;
      left_out(ranges.path, "the command is outside of what the policy was trained with");
      break;
    }
    if (read_.flag(command, "heading_command", false)) {
      left_out(command.path + ".heading_command",
               "the turning rate followed from a heading: here it is that of [command]");
    }
    command_text_ = fmt::format("\n[command]\nvelocity = [{}, {}, {}]\n", shortest(velocity[0]), shortest(velocity[1]),
                                shortest(velocity[2]));
  }

  // ---- the rest ---------------------------------------------------------------------------------------------------------

  std::string termination_text() {
    const auto terms = Values::child(root_, "terminations");
    std::string text, joints;
    for (const Place& term : terms ? Values::entries(*terms) : std::vector<Place>()) {
      if (term.node->kind != YamlNode::Kind::kMap) read_.fail(term, "it is no termination");
      const std::string function = read_.name_of(term, "func");
      const Place params = Values::child(term, "params").value_or(term);
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
      left_out("terminations",
               "nothing of it says here when the robot has fallen: give [termination] its height or tilt");
      return "";
    }
    return "\n[termination]\n" + text;
  }

  void list_events() {
    const auto events = Values::child(root_, "events");
    if (!events) return;
    for (const Place& event : Values::entries(*events)) {
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
    const Place sim = read_.need(root_, "sim");
    if (const auto gravity = Values::child(sim, "gravity")) {
      const std::vector<double> g = read_.numbers(*gravity);
      if (g.size() == 3 && (Vec3(g[0], g[1], g[2]) - model_.gravity).norm() > 1e-3) {
        left_out(gravity->path, fmt::format("the robot's file has another gravity than {} m/s²", vector_text(g)));
      }
    }
    const auto terrain = Values::child(read_.need(root_, "scene"), "terrain");
    if (!terrain) return;
    if (const auto type = Values::child(*terrain, "terrain_type"); type && read_.text(*type) != "plane") {
      left_out(type->path, fmt::format("a terrain of the kind '{}': here the ground is that of the robot's file",
                                       read_.text(*type)));
    }
    const auto material = Values::child(*terrain, "physics_material");
    if (const auto friction = material ? Values::child(*material, "dynamic_friction") : std::nullopt) {
      left_out(friction->path, fmt::format("friction of the ground, {}: here it is that of the robot's file",
                                           shortest(read_.number(*friction))));
    }
  }

  const Model& model_;
  Place root_;
  const std::string& path_;
  const IsaacImportOptions& options_;
  Values read_;
  std::vector<Ignored> ignored_;
  std::vector<LeftOut> left_out_;
  std::vector<std::string> names_;  // the policy's joints, in its order
  std::vector<size_t> joints_;      // of each, index into Model::joints
  std::string joint_order_;
  std::vector<double> default_pos_;
  Place action_, robot_;
  std::string type_;
  std::vector<std::string> acted_;  // joints of the actions, in their order
  std::map<std::string, Drive> drives_;
  std::vector<std::string> beside_;
  int delay_ = 0;
  std::string command_text_;
};

}  // namespace

std::vector<std::string> breadth_first_joints(const Model& model) {
  // of equal depth: their parents' order, then the file's
  std::vector<int> queue = {kWorld};
  std::vector<std::string> names;
  for (size_t at = 0; at < queue.size(); ++at) {
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      const Body& body = model.bodies[i];
      if (body.parent != queue[at]) continue;
      queue.push_back(static_cast<int>(i));
      if (body.joint >= 0) names.push_back(model.joints[static_cast<size_t>(body.joint)].name);
    }
  }
  return names;
}

IsaacImport import_isaac_env(const Model& model, std::string_view text, const std::string& path,
                             const IsaacImportOptions& options) {
  const YamlTree tree = YamlTree::parse(text, path);
  return Importer(model, tree, path, options).run();
}

}  // namespace assay
