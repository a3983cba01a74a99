#include "controls/policy_config.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numeric>
#include <optional>

#include <fmt/format.h>
#include <fnmatch.h>
#include <toml++/toml.h>

#include "base/errors.h"
#include "base/external_files.h"
#include "base/hash.h"
#include "base/input_file.h"
#include "base/text.h"
#include "base/toml_file.h"
#include "controls/hold.h"
#include "load/outside_files.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMostConfigBytes = std::uintmax_t{1} << 20;
constexpr int kMostHistory = 1000, kMostDelay = 1000;
constexpr double kMostPeriodMs = 1e5;

struct TermInfo {
  const char* name;
  TermKind kind;
  int size;  // 0: one for each joint; -1: one for each action; -2: given
  bool needs_base;
};
constexpr std::array kTerms = {
    TermInfo{"base_lin_vel", TermKind::kBaseLinearVelocity, 3, true},
    TermInfo{"base_ang_vel", TermKind::kBaseAngularVelocity, 3, true},
    TermInfo{"projected_gravity", TermKind::kProjectedGravity, 3, true},
    TermInfo{"base_quat_wxyz", TermKind::kBaseQuaternion, 4, true},
    TermInfo{"base_height", TermKind::kBaseHeight, 1, true},
    TermInfo{"velocity_commands", TermKind::kCommand, 3, false},
    TermInfo{"joint_pos_rel", TermKind::kJointPositionRelative, 0, false},
    TermInfo{"joint_pos", TermKind::kJointPosition, 0, false},
    TermInfo{"joint_vel_rel", TermKind::kJointVelocity, 0, false},
    TermInfo{"last_action", TermKind::kLastAction, -1, false},
    TermInfo{"phase", TermKind::kPhase, 2, false},
    TermInfo{"constant", TermKind::kConstant, -2, false},
};

std::string shown(const toml::node& node) {
  if (const auto text = node.value_exact<std::string>()) return fmt::format("'{}'", *text);
  if (const auto number = node.value<double>(); number && node.is_number()) return shortest(*number);
  if (const auto flag = node.value_exact<bool>()) return *flag ? "true" : "false";
  if (node.is_array()) return "a list";
  return node.is_table() ? "a table" : "a date or time";
}

// One table of the file; its messages name the file and the line.
class ConfigTable {
 public:
  ConfigTable(const toml::table& table, std::string name, const std::string& path)
      : table_(table), name_(std::move(name)), path_(path) {}

  [[noreturn]] void fail(const toml::node* node, const std::string& sentence) const {
    const auto line = (node != nullptr ? node->source() : table_.source()).begin.line;
    throw InputError(line > 0 ? fmt::format("{}:{}: {}", path_, line, sentence)
                              : fmt::format("{}: {}", path_, sentence));
  }

  void allow(const std::vector<std::string>& known) const {
    for (const auto& [key, node] : table_) {
      const std::string name(key.str());
      if (std::ranges::find(known, name) == known.end()) {
        fail(&node, fmt::format("unknown key '{}' in {}{}", name, name_, did_you_mean(name, known)));
      }
    }
  }

  const toml::node* find(std::string_view key) const { return table_.get(key); }

  std::string text(std::string_view key, const std::string& otherwise) const {
    const toml::node* node = find(key);
    if (node == nullptr) return otherwise;
    const auto text = node->value_exact<std::string>();
    if (!text || text->empty()) fail(node, fmt::format("'{}' is {}: give a text in quotes", key, shown(*node)));
    return *text;
  }

  std::string choice(std::string_view key, const std::vector<std::string>& choices) const {
    const std::string text = this->text(key, choices.front());
    if (std::ranges::find(choices, text) == choices.end()) {
      fail(find(key), fmt::format("'{}' is '{}': use one of {}", key, text, join(choices, ", ")));
    }
    return text;
  }

  // May be infinite.
  double number(const std::string& what, const toml::node& node) const {
    const auto number = node.is_number() ? node.value<double>() : std::nullopt;
    if (!number || std::isnan(*number)) fail(&node, fmt::format("{} is {}: give a number", what, shown(node)));
    return *number;
  }

  std::optional<double> positive(std::string_view key, double most) const {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    const double value = number(fmt::format("'{}'", key), *node);
    if (value <= 0 || value > most) {  // never NaN
      fail(node, fmt::format("'{}' is {}: give a positive number of at most {}", key, shown(*node), shortest(most)));
    }
    return value;
  }

  int count(std::string_view key, int otherwise, int least, int most) const {
    const toml::node* node = find(key);
    if (node == nullptr) return otherwise;
    const auto value = node->value_exact<int64_t>();
    if (!value || *value < least || *value > most) {
      fail(node, fmt::format("'{}' is {}: give a whole number from {} to {}", key, shown(*node), least, most));
    }
    return static_cast<int>(*value);
  }

  std::optional<ConfigTable> table(std::string_view key) const {
    const toml::node* node = find(key);
    if (node == nullptr) return std::nullopt;
    if (!node->is_table()) fail(node, fmt::format("'{}' is {}: write it as a table [{}]", key, shown(*node), key));
    return ConfigTable(*node->as_table(), fmt::format("[{}]", key), path_);
  }

  std::vector<double> numbers(const std::string& what, const toml::node& node) const {
    if (!node.is_array()) fail(&node, fmt::format("{} is {}: give a list of numbers", what, shown(node)));
    std::vector<double> list;
    for (const toml::node& each : *node.as_array()) list.push_back(number(what, each));
    return list;
  }

  // A number for [-number, number], or [low, high].
  Range range(std::string_view key) const {
    const toml::node* node = find(key);
    return node == nullptr ? Range() : range(fmt::format("'{}'", key), *node);
  }
  Range range(const std::string& what, const toml::node& node) const {
    if (node.is_number()) {
      const double value = number(what, node);
      if (!(value > 0)) fail(&node, fmt::format("{} is {}: give a positive number or [low, high]", what, shown(node)));
      return {-value, value};
    }
    if (!node.is_array()) fail(&node, fmt::format("{} is {}: give a number or [low, high]", what, shown(node)));
    const std::vector<double> list = numbers(what, node);
    if (list.size() != 2 || !(list[0] < list[1])) {
      fail(&node, fmt::format("{} is no range: give [low, high], low below high", what));
    }
    return {list[0], list[1]};
  }

  const toml::table& raw() const { return table_; }

 private:
  const toml::table& table_;
  std::string name_;
  const std::string& path_;
};

class ConfigReader {
 public:
  ConfigReader(const Model& model, const toml::table& root, const std::string& path)
      : model_(model), root_(root, "the file", path) {
    for (const Joint& joint : model.joints) names_.push_back(joint.name);
    config_.path = path;
  }

  PolicyConfig read() {
    root_.allow({"network", "output", "trained_in", "base", "joints", "default_joint_pos", "control", "observations",
                 "actions", "pd", "hold", "command", "termination"});
    const fs::path folder = fs::path(config_.path).parent_path();
    if (const std::string file = root_.text("network", ""); !file.empty()) {
      config_.network = (folder / file).lexically_normal().string();
      const std::string root = model_root(config_.path);
      if (!agreed_to_external_files() && !is_below(config_.network, root)) {
        root_.fail(root_.find("network"),
                   fmt::format("network = '{}' lies outside the configuration's folder '{}': copy it there, or give "
                               "--allow-external-files (ASSAY_ALLOW_EXTERNAL_FILES=1) if you trust the policy",
                               file, root));
      }
    }
    config_.output = root_.text("output", "");
    config_.trained_in = root_.text("trained_in", "");
    joints_ = joints_in(root_, "joints", all_joints());
    zero_ = per_joint(root_, "default_joint_pos", joints_, model_.initial.position);
    read_base();
    read_control();
    read_actions();
    read_pd();
    read_hold();
    read_command();
    read_observations();
    read_termination();
    return std::move(config_);
  }

 private:
  std::vector<int> all_joints() const {
    std::vector<int> all(names_.size());
    std::iota(all.begin(), all.end(), 0);
    return all;
  }

  // "'walker' has 23 joints": hinges and slides.
  std::string robots_joints() const { return fmt::format("'{}' has {}", model_.name, counted(names_.size(), "joint")); }

  int joint_named(const ConfigTable& table, const toml::node& node, const std::string& name) const {
    const auto found = std::ranges::find(names_, name);
    if (found == names_.end()) {
      table.fail(&node,
                 fmt::format("'{}' is no hinge or slide of '{}'{}", name, model_.name, did_you_mean(name, names_)));
    }
    return static_cast<int>(found - names_.begin());
  }

  std::vector<int> joints_in(const ConfigTable& table, std::string_view key, const std::vector<int>& otherwise) const {
    const toml::node* node = table.find(key);
    if (node == nullptr) return otherwise;
    if (!node->is_array()) {
      table.fail(node, fmt::format("'{}' is {}: give a list of joints", key, shown(*node)));
    }
    if (node->as_array()->size() > names_.size()) {
      table.fail(node, fmt::format("'{}' names {}, but {}: name each joint that the policy knows once", key,
                                   counted(node->as_array()->size(), "joint"), robots_joints()));
    }
    std::vector<int> joints;
    for (const toml::node& each : *node->as_array()) {
      const auto name = each.value_exact<std::string>();
      if (!name) table.fail(&each, fmt::format("'{}' has {}: give names of joints", key, shown(each)));
      const int joint = joint_named(table, each, *name);
      if (std::ranges::find(joints, joint) != joints.end()) {
        table.fail(&each, fmt::format("'{}' names '{}' twice: name each joint once", key, *name));
      }
      joints.push_back(joint);
    }
    if (joints.empty()) table.fail(node, fmt::format("'{}' is empty: name the joints, or leave it out", key));
    return joints;
  }

  // One number for each of `joints`; `otherwise` has one for each joint of the robot.
  std::vector<double> per_joint(const ConfigTable& table, std::string_view key, const std::vector<int>& joints,
                                const std::vector<double>& otherwise) const {
    std::vector<double> values;
    const toml::node* node = table.find(key);
    if (node == nullptr) {
      for (const int joint : joints) values.push_back(otherwise[static_cast<size_t>(joint)]);
      return values;
    }
    const std::string what = fmt::format("'{}'", key);
    if (node->is_array()) {
      values = table.numbers(what, *node);
      if (values.size() != joints.size()) {
        table.fail(node, fmt::format("'{}' has {}, but there are {}: give one for each, in their order", key,
                                     counted(values.size(), "number"), counted(joints.size(), "joint")));
      }
      return values;
    }
    if (const toml::table* patterns = node->as_table()) return matched(table, key, *node, *patterns, joints);
    values.assign(joints.size(), table.number(what, *node));
    return values;
  }

  std::vector<double> matched(const ConfigTable& table, std::string_view key, const toml::node& node,
                              const toml::table& patterns, const std::vector<int>& joints) const {
    std::vector<double> values;
    std::vector<std::string> used;
    for (const int joint : joints) {
      const std::string& name = names_[static_cast<size_t>(joint)];
      std::string by;
      for (const auto& [pattern, value] : patterns) {
        const std::string text(pattern.str());
        if (::fnmatch(text.c_str(), name.c_str(), 0) != 0) continue;
        if (!by.empty()) {
          table.fail(&value, fmt::format("'{}' has '{}' and '{}', which both match the joint '{}': let exactly one "
                                         "match each joint",
                                         key, by, text, name));
        }
        by = text;
        values.push_back(table.number(fmt::format("'{}' of '{}'", text, key), value));
      }
      if (by.empty()) {
        table.fail(&node,
                   fmt::format("'{}' has nothing for the joint '{}': add it, or a pattern that matches it", key, name));
      }
      used.push_back(by);
    }
    for (const auto& [pattern, value] : patterns) {
      const std::string text(pattern.str());
      if (std::ranges::find(used, text) == used.end()) {
        table.fail(&value,
                   fmt::format("'{}' of '{}' matches no joint of the policy{}", text, key, did_you_mean(text, names_)));
      }
    }
    return values;
  }

  void read_base() {
    std::vector<std::string> bodies;
    std::vector<int> free;
    for (size_t i = 0; i < model_.bodies.size(); ++i) {
      bodies.push_back(model_.bodies[i].name);
      if (model_.bodies[i].is_free()) free.push_back(static_cast<int>(i));
    }
    free_bases_ = free.size();
    if (const toml::node* node = root_.find("base")) {
      const std::string name = root_.text("base", "");
      const auto found = std::ranges::find(bodies, name);
      if (found == bodies.end()) {
        root_.fail(node,
                   fmt::format("'{}' is no moving body of '{}'{}", name, model_.name, did_you_mean(name, bodies)));
      }
      config_.base = static_cast<int>(found - bodies.begin());
    } else if (free.size() == 1) {
      config_.base = free.front();
    }
  }

  void need_base(const ConfigTable& table, const toml::node* node, const std::string& what) const {
    if (config_.base >= 0) return;
    table.fail(node, fmt::format("{} is of a base, but '{}' has {}: name one with base = \"...\"", what, model_.name,
                                 free_bases_ == 0 ? "no free body" : fmt::format("{} free bodies", free_bases_)));
  }

  void read_control() {
    const auto table = root_.table("control");
    if (!table) {
      root_.fail(nullptr,
                 "there is no [control]: give its period, as in [control] with timestep_ms = 5 and "
                 "decimation = 4");
    }
    table->allow({"timestep_ms", "decimation", "period_ms", "delay"});
    const auto timestep = table->positive("timestep_ms", kMostPeriodMs),
               period = table->positive("period_ms", kMostPeriodMs);
    const int decimation = table->count("decimation", 0, 1, 100000);
    if (timestep.has_value() != (decimation > 0) || (!timestep && !period)) {
      table->fail(nullptr,
                  "[control] does not say how long a control step is: give timestep_ms and decimation, or "
                  "period_ms");
    }
    const double product = timestep ? *timestep * decimation : period.value_or(0);
    if (period && std::abs(*period - product) > 1e-9 * product) {
      table->fail(table->find("period_ms"),
                  fmt::format("period_ms is {}, but timestep_ms = {} times decimation = {} is {}: mend one of them",
                              shortest(*period), shortest(timestep.value_or(0)), decimation, shortest(product)));
    }
    config_.period_s = 1e-3 * product;
    config_.train_timestep_s = 1e-3 * timestep.value_or(0);
    config_.delay = table->count("delay", 0, 0, kMostDelay);
  }

  void read_actions() {
    const auto table = root_.table("actions");
    if (!table) {
      root_.fail(nullptr,
                 "there is no [actions]: say what the network's numbers are, as in [actions] with "
                 "type = \"joint_position\"");
    }
    table->allow({"type", "joints", "clip", "scale", "offset"});
    if (table->find("type") == nullptr) {
      table->fail(nullptr, "[actions] has no type: give joint_position, joint_velocity or joint_effort");
    }
    const std::string type = table->choice("type", {"joint_position", "joint_velocity", "joint_effort"});
    if (type == "joint_velocity") config_.type = ActionType::kVelocity;
    if (type == "joint_effort") config_.type = ActionType::kEffort;
    config_.joints = joints_in(*table, "joints", joints_);
    if (config_.joints.empty()) table->fail(nullptr, fmt::format("'{}' has no hinge or slide to act on", model_.name));
    config_.action_clip = table->range("clip");
    config_.scale = per_joint(*table, "scale", config_.joints, std::vector<double>(names_.size(), 1));
    std::vector<double> offset(names_.size(), 0);
    if (config_.type == ActionType::kPosition) offset = zeros();
    const toml::node* node = table->find("offset");
    if (node != nullptr && node->value_exact<std::string>() == "default") {
      if (config_.type != ActionType::kPosition) {
        table->fail(node, fmt::format("the offset \"default\" is for joint_position, and the type is {}: give "
                                      "numbers, or leave it out",
                                      type));
      }
      node = nullptr;
    }
    if (node != nullptr) {
      config_.offset = per_joint(*table, "offset", config_.joints, offset);
    } else {
      for (const int joint : config_.joints) config_.offset.push_back(offset[static_cast<size_t>(joint)]);
    }
    finite(*table, "scale", config_.scale);
    finite(*table, "offset", config_.offset);
  }

  static void finite(const ConfigTable& table, std::string_view key, const std::vector<double>& values) {
    if (std::ranges::all_of(values, [](double value) { return std::isfinite(value); })) return;
    table.fail(table.find(key), fmt::format("'{}' is not finite: give finite numbers", key));
  }

  // The default position of each joint of the robot: that of the initial state where the policy does not know it.
  std::vector<double> zeros() const {
    std::vector<double> all = model_.initial.position;
    for (size_t i = 0; i < joints_.size(); ++i) all[static_cast<size_t>(joints_[i])] = zero_[i];
    return all;
  }

  void read_hold() {
    const auto table = root_.table("hold");
    if (!table) return;
    table->allow({"joints", "position", "stiffness", "damping"});
    if (table->find("joints") == nullptr) table->fail(nullptr, "[hold] has no joints: name those that it holds");
    config_.held = joints_in(*table, "joints", {});
    for (const int joint : config_.held) {
      const bool targeted = config_.type != ActionType::kEffort;
      if (targeted && std::ranges::find(config_.joints, joint) != config_.joints.end()) {
        table->fail(table->find("joints"), fmt::format("'{}' has the drive of [pd]: leave it out of [hold]",
                                                       names_[static_cast<size_t>(joint)]));
      }
    }
    std::vector<double> zero(names_.size(), 0.0);
    for (size_t i = 0; i < joints_.size(); ++i) zero[static_cast<size_t>(joints_[i])] = zero_[i];
    config_.held_position = per_joint(*table, "position", config_.held, zero);
    finite(*table, "position", config_.held_position);
    for (const auto& [key, into] :
         {std::pair{"stiffness", &config_.held_stiffness}, {"damping", &config_.held_damping}}) {
      if (table->find(key) == nullptr) {
        table->fail(nullptr, fmt::format("[hold] has no {}: give it, as a number for all joints", key));
      }
      *into = per_joint(*table, key, config_.held, {});
      finite(*table, key, *into);
      if (std::ranges::any_of(*into, [](double value) { return value < 0; })) {
        table->fail(table->find(key), fmt::format("'{}' has a negative number: give 0 or more", key));
      }
    }
  }

  void read_pd() {
    const auto table = root_.table("pd");
    const bool effort = config_.type == ActionType::kEffort;
    const size_t count = config_.joints.size();
    config_.stiffness.assign(count, 0);
    config_.damping.assign(count, 0);
    const std::vector<double> limits = effort_limits(model_);
    const bool limited = table && table->find("effort_limit") != nullptr;
    if (!limited) {
      for (const int joint : config_.joints) {
        if (limits[static_cast<size_t>(joint)] > 0) continue;
        root_.fail(root_.find("actions"),
                   fmt::format("the policy acts on the joint '{}', but no actuator of '{}' drives it: leave it out of "
                               "the actions, or give [pd] an effort_limit",
                               names_[static_cast<size_t>(joint)], model_.name));
      }
    }
    if (table) {
      table->allow({"law", "stiffness", "damping", "effort_limit"});
      config_.engine_drives = table->choice("law", {"explicit", "engine"}) == "engine";
    }
    const ConfigTable& where = table ? *table : root_;
    config_.effort_limit = per_joint(where, "effort_limit", config_.joints, limits);
    for (const double limit : config_.effort_limit) {
      if (!(limit > 0)) {
        where.fail(where.find("effort_limit"),
                   fmt::format("an effort_limit is {}: give positive numbers, inf for none", shortest(limit)));
      }
    }
    if (effort) {
      for (const char* key : {"law", "stiffness", "damping"}) {
        if (table && table->find(key) != nullptr) {
          table->fail(table->find(key), fmt::format("'{}' is for targets of joints, but the actions are efforts: leave "
                                                    "it out, or change [actions] type",
                                                    key));
        }
      }
      return;
    }
    if (!table) {
      root_.fail(nullptr, "there is no [pd], but the actions are targets of joints: give stiffness and damping");
    }
    const bool position = config_.type == ActionType::kPosition;
    for (const auto& [key, into, needed] :
         {std::tuple{"stiffness", &config_.stiffness, position}, std::tuple{"damping", &config_.damping, true}}) {
      if (table->find(key) == nullptr) {
        if (needed) table->fail(nullptr, fmt::format("[pd] has no {}: give it, as a number for all joints", key));
        continue;
      }
      if (!needed) table->fail(table->find(key), "a joint_velocity action has no stiffness: leave it out");
      *into = per_joint(*table, key, config_.joints, {});
      finite(*table, key, *into);
      if (std::ranges::any_of(*into, [](double value) { return value < 0; })) {
        table->fail(table->find(key), fmt::format("'{}' has a negative number: give 0 or more", key));
      }
    }
    if (config_.engine_drives) {
      if (std::ranges::any_of(config_.effort_limit, [](double limit) { return std::isfinite(limit); }) && limited) {
        table->fail(table->find("effort_limit"),
                    "drives of the engine have no torque limit here: give "
                    "law = \"explicit\", or effort_limit = inf");
      }
      config_.effort_limit.assign(count, std::numeric_limits<double>::infinity());
    }
  }

  void read_command() {
    const auto table = root_.table("command");
    if (!table) return;
    table->allow({"velocity"});
    const toml::node* node = table->find("velocity");
    if (node == nullptr) table->fail(nullptr, "[command] has no velocity: give [forward, left, turning]");
    config_.command = table->numbers("'velocity'", *node);
    if (config_.command.size() != 3) {
      table->fail(node, fmt::format("'velocity' has {}: give [forward, left, turning] in m/s, m/s and rad/s",
                                    counted(config_.command.size(), "number")));
    }
    finite(*table, "velocity", config_.command);
    need_base(*table, node, "a commanded velocity");
  }

  void read_observations() {
    const auto table = root_.table("observations");
    if (!table) root_.fail(nullptr, "there is no [observations]: list its terms, each as [[observations.terms]]");
    table->allow({"history", "history_order", "history_layout", "history_start", "clip", "terms"});
    config_.history = table->count("history", 1, 1, kMostHistory);
    config_.newest_first = table->choice("history_order", {"oldest_first", "newest_first"}) == "newest_first";
    config_.by_step = table->choice("history_layout", {"term", "step"}) == "step";
    config_.zero_start = table->choice("history_start", {"first", "zero"}) == "zero";
    config_.clip = table->range("clip");
    const toml::node* terms = table->find("terms");
    if (terms == nullptr || !terms->is_array_of_tables()) {
      table->fail(terms, "[observations] has no terms: write each as [[observations.terms]]");
    }
    for (const toml::node& each : *terms->as_array()) {
      read_term(ConfigTable(*each.as_table(), "[[observations.terms]]", config_.path));
    }
  }

  void read_term(const ConfigTable& table) {
    const toml::node* node = table.find("term");
    if (node == nullptr)
      table.fail(nullptr, "[[observations.terms]] has no 'term': name one, as in term = \"joint_pos\"");
    const std::string name = table.text("term", "");
    const auto* info = std::ranges::find_if(kTerms, [&](const TermInfo& each) { return name == each.name; });
    if (info == kTerms.end()) {
      table.fail(node, fmt::format("there is no observation '{}'{}; there are {}", name,
                                   nearest_name(name, policy_terms()) ? did_you_mean(name, policy_terms()) : "",
                                   join(policy_terms(), ", ")));
    }
    std::vector<std::string> keys = {"term", "scale", "clip"};
    if (info->size == 0) keys.emplace_back("joints");
    if (info->kind == TermKind::kPhase) keys.emplace_back("period_s");
    if (info->kind == TermKind::kConstant) keys.emplace_back("values");
    table.allow(keys);
    if (info->needs_base) need_base(table, node, name);
    ObservationTerm term;
    term.kind = info->kind;
    auto size = static_cast<size_t>(std::max(info->size, 0));
    if (info->kind == TermKind::kCommand && config_.command.empty()) {
      table.fail(node, "the policy observes velocity_commands, but there are none: give [command] a velocity");
    }
    if (info->kind == TermKind::kLastAction) size = config_.joints.size();
    if (info->kind == TermKind::kPhase) {
      const auto period = table.positive("period_s", 1e6);
      if (!period) table.fail(nullptr, "the term 'phase' has no period_s: give the gait's period in seconds");
      term.period_s = *period;
    }
    if (info->kind == TermKind::kConstant) {
      const toml::node* values = table.find("values");
      if (values == nullptr) table.fail(nullptr, "the term 'constant' has no values: give a list of numbers");
      term.values = table.numbers("'values'", *values);
      finite(table, "values", term.values);
      size = term.values.size();
      if (size == 0) table.fail(values, "'values' is empty: give a list of numbers");
    }
    if (info->size == 0) {
      term.joints = joints_in(table, "joints", joints_);
      size = term.joints.size();
      const std::vector<double> zero = zeros();
      for (const int joint : term.joints) {
        term.joint_zero.push_back(term.kind == TermKind::kJointPositionRelative ? zero[static_cast<size_t>(joint)] : 0);
      }
      if (size == 0) table.fail(node, fmt::format("the term '{}' is of joints, but {}", name, robots_joints()));
    }
    term.clip = table.range("clip");
    term.scale.assign(size, 1);
    if (const toml::node* scale = table.find("scale")) {
      if (scale->is_array()) {
        term.scale = table.numbers("'scale'", *scale);
        if (term.scale.size() != size) {
          table.fail(scale, fmt::format("'scale' has {}, but the term '{}' has {}: give one for each",
                                        counted(term.scale.size(), "number"), name, size));
        }
      } else {
        term.scale.assign(size, table.number("'scale'", *scale));
      }
      finite(table, "scale", term.scale);
    }
    config_.terms.push_back(std::move(term));
  }

  void read_termination() {
    const auto table = root_.table("termination");
    if (!table) return;
    table->allow({"base_height_below", "base_tilt_above", "joint_outside"});
    for (const auto& [key, into] :
         {std::pair{"base_height_below", &config_.fallen_height}, std::pair{"base_tilt_above", &config_.fallen_tilt}}) {
      if (const toml::node* node = table->find(key)) {
        *into = table->number(fmt::format("'{}'", key), *node);
        need_base(*table, node, key);
      }
    }
    const auto joints = table->table("joint_outside");
    if (!joints) return;
    for (const auto& [key, node] : joints->raw()) {
      const std::string name(key.str());
      const int joint = joint_named(*joints, node, name);
      config_.joint_range.emplace_back(joint, joints->range(fmt::format("'{}'", name), node));
    }
  }

  const Model& model_;
  ConfigTable root_;
  std::vector<std::string> names_;  // of the robot's hinges and slides
  std::vector<int> joints_;         // that the policy knows, in its order
  std::vector<double> zero_;        // default position of each of those
  size_t free_bases_ = 0;
  PolicyConfig config_;
};

}  // namespace

const std::vector<std::string>& policy_terms() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names;
    names.reserve(kTerms.size());
    for (const TermInfo& term : kTerms) names.emplace_back(term.name);
    return names;
  }();
  return kNames;
}

size_t PolicyConfig::observations() const {
  size_t count = 0;
  for (const ObservationTerm& term : terms) count += term.size();
  return count;
}

PolicyConfig parse_policy_config(const Model& model, std::string_view text, const std::string& path) {
  const toml::table root = toml_table(text, path);
  PolicyConfig config = ConfigReader(model, root, path).read();
  config.hash = content_hash(text);
  return config;
}

PolicyConfig read_policy_config(const Model& model, const std::string& path) {
  return parse_policy_config(model, input_text(path, "the policy's configuration", "a TOML file", kMostConfigBytes),
                             path);
}

}  // namespace assay
