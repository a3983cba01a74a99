// Values of a YAML file that a training wrote: read with their paths, so that what is wrong is named with its line.
#pragma once

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "controls/pattern.h"
#include "controls/policy_config.h"
#include "controls/yaml_tree.h"

namespace assay {

// A node and where it is in the file: "scene.robot.init_state".
struct YamlPlace {
  const YamlNode* node = nullptr;
  std::string path;
};

// For messages: the text of a scalar, or what else it is.
inline std::string shown(const YamlNode& node) {
  if (!node.tag.empty() && node.tag.starts_with("python/object")) return fmt::format("a Python object ({})", node.tag);
  if (node.kind == YamlNode::Kind::kList) return "a list";
  if (node.kind == YamlNode::Kind::kMap) return "a map";
  return node.is_null() ? "null" : fmt::format("'{}'", node.text);
}

// Reading of the file's values; what is wrong is named with its line and path.
class YamlValues {
 public:
  // `kind` is what the file has to be, for messages: "environment of Isaac Lab".
  YamlValues(std::string path, std::string kind) : path_(std::move(path)), kind_(std::move(kind)) {}

  [[noreturn]] void fail(const YamlPlace& place, const std::string& sentence) const {
    throw InputError(fmt::format("{}:{}: {}: {}", path_, place.node->line, place.path, sentence));
  }

  // Nothing for a key that is missing or null.
  static std::optional<YamlPlace> child(const YamlPlace& of, const std::string& key) {
    const YamlNode* node = of.node->find(key);
    if (node == nullptr || node->is_null()) return std::nullopt;
    return YamlPlace{node, of.path.empty() ? key : of.path + "." + key};
  }
  YamlPlace need(const YamlPlace& of, const std::string& key) const {
    if (auto found = child(of, key)) return *found;
    const std::string sentence = fmt::format("it has no '{}', which every {} has", key, kind_);
    if (of.path.empty()) throw InputError(fmt::format("'{}' is no {}: {}", path_, kind_, sentence));
    fail(of, sentence);
  }
  static std::vector<YamlPlace> entries(const YamlPlace& of) {
    std::vector<YamlPlace> all;
    for (const auto& [key, node] : of.node->entries) {
      if (!node->is_null()) all.push_back({node, of.path.empty() ? key : of.path + "." + key});
    }
    return all;
  }
  // The last name of a path.
  static std::string key(const YamlPlace& place) { return place.path.substr(place.path.rfind('.') + 1); }

  // May be infinite.
  static std::optional<double> number_or_none(const YamlPlace& place) {
    const YamlNode& node = *place.node;
    if (node.kind != YamlNode::Kind::kScalar || node.quoted) return std::nullopt;
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    if (node.text == ".inf" || node.text == "+.inf") return kInfinity;
    if (node.text == "-.inf") return -kInfinity;
    return parse_number(node.text);
  }
  double number(const YamlPlace& place) const {
    const auto value = number_or_none(place);
    if (!value) fail(place, fmt::format("it is {}: write the number", shown(*place.node)));
    return *value;
  }
  double positive(const YamlPlace& place) const {
    const double value = number(place);
    if (!(value > 0) || !std::isfinite(value)) {
      fail(place, fmt::format("it is {}: give a positive number", shortest(value)));
    }
    return value;
  }
  int whole(const YamlPlace& place, int least) const {
    const double value = number(place);
    if (value < least || value > 1e6 || value != std::floor(value)) {
      fail(place, fmt::format("it is {}: give a whole number of at least {}", shortest(value), least));
    }
    return static_cast<int>(value);
  }
  bool flag(const YamlPlace& of, const std::string& key, bool otherwise) const {
    const auto place = child(of, key);
    if (!place) return otherwise;
    if (place->node->text != "true" && place->node->text != "false") {
      fail(*place, fmt::format("it is {}: write true or false", shown(*place->node)));
    }
    return place->node->text == "true";
  }
  std::string text(const YamlPlace& place) const {
    if (place.node->kind != YamlNode::Kind::kScalar) {
      fail(place, fmt::format("it is {}: write a name", shown(*place.node)));
    }
    return place.node->text;
  }
  // One text or a list of them.
  std::vector<std::string> texts(const YamlPlace& place) const {
    if (place.node->kind != YamlNode::Kind::kList) return {text(place)};
    std::vector<std::string> all;
    all.reserve(place.node->items.size());
    for (const YamlNode* item : place.node->items) all.push_back(text({item, place.path}));
    return all;
  }
  std::vector<double> numbers(const YamlPlace& place) const {
    if (place.node->kind != YamlNode::Kind::kList) {
      fail(place, fmt::format("it is {}: write a list of numbers", shown(*place.node)));
    }
    std::vector<double> all;
    all.reserve(place.node->items.size());
    for (const YamlNode* item : place.node->items) all.push_back(number({item, place.path}));
    return all;
  }
  Range range(const YamlPlace& place) const {
    const std::vector<double> both = numbers(place);
    if (both.size() != 2 || !(both[0] <= both[1])) fail(place, "it is no range: write [low, high]");
    return {both[0], both[1]};
  }

  // "isaaclab.envs.mdp.observations:joint_pos_rel" is joint_pos_rel.
  std::string name_of(const YamlPlace& of, const char* key) const {
    const std::string whole = text(need(of, key));
    return whole.substr(whole.find_last_of(":.") + 1);
  }

  // A regular expression of Python, of which one has to match a whole name.
  Pattern pattern(const YamlPlace& place, const std::string& text) const {
    constexpr size_t kLongestPattern = 500;
    if (text.size() > kLongestPattern) {
      fail(place, fmt::format("a pattern has {} characters: write one of at most {}", text.size(), kLongestPattern));
    }
    try {
      return Pattern(text);
    } catch (const PatternError& error) {
      fail(place, fmt::format("'{}' is no regular expression: {}", text, error.what()));
    }
  }
  bool matches(const YamlPlace& place, const Pattern& pattern, const std::string& text, const std::string& name) const {
    try {
      return pattern.matches(name);
    } catch (const PatternError& error) {
      fail(place, fmt::format("the pattern '{}' on the joint '{}': {}; write a simpler one", text, name, error.what()));
    }
  }

 private:
  std::string path_, kind_;
};

}  // namespace assay
