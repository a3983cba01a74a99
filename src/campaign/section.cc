#include "campaign/section.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>

#include <fmt/format.h>

#include "base/run_bounds.h"
#include "base/text.h"
#include "measures/measure.h"

namespace assay {
std::vector<std::string> measure_names() {
  std::vector<std::string> names;
  for (const Measure& measure : measures()) {
    if (measure.reads != Reads::kFineRun) names.emplace_back(measure.name);
  }
  return names;
}

std::optional<std::string> setting_value_text(const toml::node& node) {
  if (const auto* boolean = node.as_boolean()) return boolean->get() ? "on" : "off";
  if (const auto* integer = node.as_integer()) return std::to_string(integer->get());
  if (const auto* number = node.as_floating_point()) return shortest(number->get());
  if (const auto* string = node.as_string()) return string->get();
  return std::nullopt;
}

std::string node_text(const toml::node& node) {
  std::ostringstream out;
  node.visit([&](const auto& value) {
    if constexpr (toml::is_table<decltype(value)>) {
      out << "a table";
    } else if constexpr (toml::is_array<decltype(value)>) {
      out << "a list";
    } else if constexpr (toml::is_string<decltype(value)>) {
      out << "'" << *value << "'";
    } else {
      out << value;
    }
  });
  return out.str();
}

void Section::fail(const toml::node* node, const std::string& sentence) const {
  const toml::node& at = node != nullptr ? *node : static_cast<const toml::node&>(table_);
  throw InputError(fmt::format("{}:{}: {}", source_, at.source().begin.line, sentence));
}

void Section::allow(const std::vector<std::string>& known) const {
  for (const auto& [key, node] : table_) {
    const std::string name(key.str());
    if (std::ranges::find(known, name) == known.end()) {
      throw InputError(fmt::format("{}:{}: {} has no key '{}'{}", source_, key.source().begin.line, what_, name,
                                   did_you_mean(name, known)));
    }
  }
}

std::optional<std::string> Section::text(std::string_view key) const {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  const auto value = node->value_exact<std::string>();
  if (!value || value->empty()) fail(node, fmt::format("'{}' is {}: give a text", key, node_text(*node)));
  return value;
}

std::string Section::required_text(std::string_view key) const {
  const auto value = text(key);
  if (!value) fail(nullptr, fmt::format("{} has no '{}': give one", what_, key));
  return *value;
}

bool Section::flag(std::string_view key, bool otherwise) const {
  const toml::node* node = find(key);
  if (node == nullptr) return otherwise;
  const auto value = node->value_exact<bool>();
  if (!value) fail(node, fmt::format("'{}' is {}: give true or false", key, node_text(*node)));
  return *value;
}

double Section::positive(std::string_view key, double otherwise) const {
  const toml::node* node = find(key);
  return node == nullptr ? otherwise : positive(key, *node);
}

double Section::positive(std::string_view key, const toml::node& node) const {
  std::optional<double> value;
  if (const auto text = node.value_exact<std::string>()) {
    value = parse_fraction(*text);
  } else if (!node.is_boolean()) {
    value = node.value<double>();
  }
  if (!value || !std::isfinite(*value) || *value <= 0) {
    fail(&node,
         fmt::format("'{}' has {}: give a positive number, or a fraction as text like \"1/64\"", key, node_text(node)));
  }
  if (const std::string obstacle = key.ends_with("_ms") ? milliseconds_obstacle(*value) : ""; !obstacle.empty()) {
    fail(&node, fmt::format("'{}' has {}: {}", key, node_text(node), obstacle));
  }
  return *value;
}

int Section::count(std::string_view key, int otherwise, int least, int most) const {
  const toml::node* node = find(key);
  if (node == nullptr) return otherwise;
  const auto value = node->value_exact<std::int64_t>();
  if (!value || *value < least || *value > most) {
    fail(node, fmt::format("'{}' is {}: give a whole number from {} to {}", key, node_text(*node), least, most));
  }
  return static_cast<int>(*value);
}

const toml::array& Section::list(std::string_view key, const toml::node& node) const {
  const toml::array* array = node.as_array();
  if (array == nullptr || array->empty()) {
    fail(&node, fmt::format("'{}' is {}: give a list in brackets with at least one entry", key,
                            array != nullptr ? "empty" : node_text(node)));
  }
  return *array;
}

std::optional<std::vector<double>> Section::timesteps(std::string_view key) const {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  std::set<double> sorted;
  for (const toml::node& entry : list(key, *node)) {
    if (!sorted.insert(positive(key, entry)).second) {
      fail(&entry, fmt::format("'{}' has {} twice: leave one out", key, node_text(entry)));
    }
  }
  return std::vector<double>(sorted.begin(), sorted.end());
}

std::optional<std::vector<const Measure*>> Section::measures(std::string_view key) const {
  const toml::node* node = find(key);
  if (node == nullptr) return std::nullopt;
  std::set<const Measure*> sorted;  // all are in measures(): by their order there
  for (const toml::node& entry : list(key, *node)) {
    const std::string name = entry.value_or(std::string());
    const Measure* measure = find_measure(name);
    if (measure == nullptr || measure->reads == Reads::kFineRun) {
      fail(&entry, fmt::format("there is no measure {}{}", node_text(entry), did_you_mean(name, measure_names())));
    }
    sorted.insert(measure);
  }
  return std::vector<const Measure*>(sorted.begin(), sorted.end());
}

std::string Section::path_from(const std::string& path) const {
  return (std::filesystem::absolute(source_).parent_path() / path).lexically_normal().string();
}

std::vector<Section> Section::sections(std::string_view key) const {
  std::vector<Section> found;
  const toml::node* node = find(key);
  if (node == nullptr) return found;
  const toml::array* array = node->as_array();
  if (array == nullptr || !array->is_homogeneous(toml::node_type::table)) {
    fail(node, fmt::format("'{}' is {}: write each as a table under [[{}]]", key, node_text(*node), key));
  }
  found.reserve(array->size());
  for (const toml::node& entry : *array) found.emplace_back(*entry.as_table(), fmt::format("[[{}]]", key), source_);
  return found;
}

}  // namespace assay
