#include "campaign/roster.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <fnmatch.h>

#include "base/hash.h"
#include "base/text.h"

namespace assay {
namespace {

// The family of an engine's contenders is the first word of its name: bullet-f64's are bullet-si-f64, bullet-mb, ...
std::string absent_reason(const std::string& contender, const Registry& registry) {
  const auto family = [](const std::string& name) { return name.substr(0, name.find('-')); };
  for (const AbsentEngine& absent : registry.absent()) {
    if (family(absent.name) == family(contender)) {
      return fmt::format("contender '{}' is left out: engine '{}' is absent: {}", contender, absent.name,
                         absent.reason);
    }
  }
  return "";
}

CampaignContender resolve(const Section& section, const toml::node* node, const std::string& name,
                          const std::string& base, const std::map<std::string, std::string>& overrides,
                          const Registry& registry) {
  CampaignContender contender;
  contender.overrides = overrides;
  const std::vector<std::string> known = registry.contender_names();
  if (std::ranges::find(known, base) == known.end()) {
    contender.absent = absent_reason(base, registry);
    if (contender.absent.empty()) {
      section.fail(node, fmt::format("there is no contender '{}'{}", base, did_you_mean(base, known)));
    }
    contender.resolved.name = name;
    contender.resolved.base = base;
    return contender;
  }
  // The base is known, so what can still be wrong is a setting.
  const toml::node* set = section.find("set");
  contender.resolved = at_node(section, set != nullptr ? set : node, [&] { return registry.resolve(base, overrides); });
  contender.resolved.name = name;
  contender.resolved.base = base;
  contender.plugin_hash = file_hash(registry.plugin_path(contender.resolved.engine->name()));
  return contender;
}

std::map<std::string, std::string> overrides_of(const Section& section) {
  std::map<std::string, std::string> overrides;
  const toml::node* node = section.find("set");
  if (node == nullptr) return overrides;
  const toml::table* table = node->as_table();
  if (table == nullptr) section.fail(node, fmt::format("'set' is {}: give {{key = value, ...}}", node_text(*node)));
  for (const auto& [key, value] : *table) {
    const auto text = setting_value_text(value);
    if (!text) {
      section.fail(&value, fmt::format("setting '{}' is {}: give one value", std::string_view(key), node_text(value)));
    }
    overrides[std::string(key.str())] = *text;
  }
  return overrides;
}

// The contenders that `pattern` (of a shell: * and ?) names, in the engines' order, without those that are taken and
// those of order 0, which do not move anything (the null engine).
std::vector<std::string> matching(const std::string& pattern, const std::set<std::string>& taken,
                                  const Registry& registry) {
  std::vector<std::string> names;
  for (const std::string& name : registry.contender_names()) {
    if (taken.contains(name) || ::fnmatch(pattern.c_str(), name.c_str(), 0) != 0) continue;
    const ResolvedContender contender = registry.resolve(name);
    if (contender.engine->capabilities(contender.settings).order > 0) names.push_back(name);
  }
  return names;
}

}  // namespace

Roster::Roster(const Section& root, const Registry& registry) : registry_(registry) {
  for (const Section& section : root.sections("contender")) {
    section.allow({"name", "base", "set"});
    const std::string name = section.required_text("name");
    if (!derived_.emplace(name, section).second) {
      section.fail(section.find("name"), fmt::format("there are two contenders '{}': rename one", name));
    }
    in_order_.push_back(name);
  }
}

std::vector<int> Roster::listed(const Section& section, const toml::node& node) {
  std::vector<int> found;
  std::set<std::string> taken;
  for (const toml::node& entry : section.list("contenders", node)) {
    const auto name = entry.value_exact<std::string>();
    if (!name) section.fail(&entry, fmt::format("'contenders' has {}: give a contender's name", node_text(entry)));
    if (name->find_first_of("*?") != std::string::npos) {
      const std::vector<std::string> names = matching(*name, taken, registry_);
      if (names.empty()) {
        section.fail(&entry,
                     fmt::format("'{}' matches no further contender: see 'assay engines' for their names", *name));
      }
      for (const std::string& each : names) found.push_back(index(section, &entry, each));
      taken.insert(names.begin(), names.end());
      continue;
    }
    if (!taken.insert(*name).second) {
      section.fail(&entry, fmt::format("contender '{}' is there twice: leave one out, or derive one under another "
                                       "name with [[contender]]",
                                       *name));
    }
    found.push_back(index(section, &entry, *name));
  }
  return found;
}

std::vector<int> Roster::unlisted(const std::vector<Section>& lists) {
  std::set<std::string> named;
  for (const Section& section : lists) {
    const toml::node* node = section.find("contenders");
    if (node == nullptr || !node->is_array()) continue;
    for (const toml::node& entry : *node->as_array()) named.insert(entry.value_or(std::string()));
  }
  std::vector<int> found;
  for (const std::string& name : in_order_) {
    if (!named.contains(name)) found.push_back(index(derived_.at(name), nullptr, name));
  }
  return found;
}

int Roster::index(const Section& section, const toml::node* node, const std::string& name) {
  const auto [at, is_new] = index_.emplace(name, static_cast<int>(contenders_.size()));
  if (!is_new) return at->second;
  const auto found = derived_.find(name);
  if (found == derived_.end()) {
    contenders_.push_back(resolve(section, node, name, name, {}, registry_));
  } else {
    const Section& own = found->second;
    contenders_.push_back(
        resolve(own, own.find("base"), name, own.required_text("base"), overrides_of(own), registry_));
  }
  return at->second;
}

}  // namespace assay
