#include "campaign/roster.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <fnmatch.h>

#include "base/hash.h"
#include "base/text.h"
#include "campaign/keys.h"
#include "engines/builds.h"
#include "engines/releases.h"

namespace assay {
namespace {

constexpr const char* kBest = "best";

// Whether the absent engine may have a contender of that name. The family of an engine's contenders is the first word
// of its name: bullet-f64's are bullet-si-f64, bullet-mb, ... Beside an engine whose name is a part of its own (mujoco,
// of mujoco-warp) its contenders begin with all of it: what else has that first word is misspelt.
bool may_have(const AbsentEngine& absent, const std::string& contender, const Registry& registry) {
  const auto is_longer = [](const std::string& name, const std::string& than) { return name.starts_with(than + "-"); };
  const auto shares_name = [&](const Engine* engine) { return is_longer(absent.name, engine->name()); };
  if (std::ranges::any_of(registry.engines(), shares_name)) {
    return contender == absent.name || is_longer(contender, absent.name);
  }
  const auto family = [](const std::string& name) { return name.substr(0, name.find('-')); };
  return family(absent.name) == family(contender);
}

// Sets `needs` and `absent` of a contender that cannot be run here.
void find_absent(const std::string& base, const Registry& registry, CampaignContender& contender) {
  if (registry.has(without_build(base))) {
    try {
      static_cast<void>(registry.resolve(base));
    } catch (const InputError& error) {
      contender.absent = fmt::format("left out: {}", error.what());
      const std::string engine = registry.resolve(without_build(base)).engine->name(), release = build_of(base);
      const std::vector<std::string> known = releases_of(engine);
      if (std::ranges::find(known, release) != known.end()) {
        const std::string name = in_build(engine, release);
        contender.needs = AbsentEngine{name, error.what(), name,
                                       registry.runs_python(engine) ? "a minute" : "10 seconds of compiling"};
      } else if (is_release(release)) {
        throw;
      }
      return;
    }
  }
  for (const AbsentEngine& absent : registry.absent()) {
    if (may_have(absent, without_build(base), registry)) {
      contender.absent =
          fmt::format("contender '{}' is left out: engine '{}' is absent: {}", base, absent.name, absent.reason);
      contender.needs = absent;
      return;
    }
  }
}

CampaignContender resolve(const Section& section, const toml::node* node, const std::string& name,
                          const std::string& base, const std::map<std::string, std::string>& overrides,
                          const Registry& registry) {
  CampaignContender contender;
  contender.overrides = overrides;
  if (!registry.has(base)) {
    find_absent(base, registry, contender);
    if (contender.absent.empty()) {
      section.fail(node,
                   fmt::format("there is no contender '{}'{}", base, did_you_mean(base, registry.contender_names())));
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
  contender.plugin_hash = registry.plugin_hash(contender.resolved.engine->name());
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

Roster::Roster(const Section& root, const Registry& registry) : registry_(registry), builds_({kBaseline}) {
  if (const toml::node* node = root.find("builds")) {
    builds_.clear();
    for (const toml::node& entry : root.list("builds", *node)) {
      const auto build = entry.value_exact<std::string>();
      if (!build || build->empty()) {
        root.fail(&entry, fmt::format(R"('builds' has {}: give names of builds, as "baseline", "v3" or "best")",
                                      node_text(entry)));
      }
      const std::string lacking = lacking_for(*build);
      if (!lacking.empty()) {
        root.fail(&entry, fmt::format("this processor cannot run the build '{}': it lacks {}", *build, lacking));
      }
      const auto has_it = [&](const Engine* engine) { return build_of(engine->name()) == *build; };
      if (*build != kBaseline && *build != kBest && std::ranges::none_of(registry.other_builds(), has_it)) {
        root.fail(
            &entry,
            fmt::format("no engine has a build '{}' here: `./assay setup --builds v3` makes builds for AVX2", *build));
      }
      if (std::ranges::find(builds_, *build) != builds_.end()) {
        root.fail(&entry, fmt::format("build '{}' is there twice: leave one out", *build));
      }
      builds_.push_back(*build);
    }
    if (builds_.empty()) root.fail(node, "'builds' is empty: name a build, or leave the key out for the baseline");
  }
  for (const Section& section : root.sections("contender")) {
    section.allow(key_names(kContenderKeys));
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
                     fmt::format("'{}' matches no further contender: see 'assay list engines' for their names", *name));
      }
      for (const std::string& each : names) add(found, section, &entry, each);
      taken.insert(names.begin(), names.end());
      continue;
    }
    if (!taken.insert(*name).second) {
      section.fail(&entry, fmt::format("contender '{}' is there twice: leave one out, or derive one under another "
                                       "name with [[contender]]",
                                       *name));
    }
    add(found, section, &entry, *name);
  }
  return found;
}

// In each build that the campaign asks for. A contender of which there is none stays in the baseline, once.
void Roster::add(std::vector<int>& found, const Section& section, const toml::node* node, const std::string& name) {
  const auto put = [&](int index) {
    if (std::ranges::find(found, index) == found.end()) found.push_back(index);
  };
  if (name.find('@') != std::string::npos) {
    put(index(section, node, name));
    return;
  }
  const auto derived = derived_.find(name);
  const std::string base = derived == derived_.end() ? name : derived->second.required_text("base");
  const std::vector<std::string> known = registry_.builds_of(base);
  for (const std::string& build : builds_) {
    if (build == kBaseline || (build == kBest && known.empty())) {
      put(index(section, node, name));
    } else if (build == kBest) {
      put(index(section, node, in_build(name, known.back())));
    } else if (std::ranges::find(known, build) != known.end()) {
      put(index(section, node, in_build(name, build)));
    } else {
      put(index(section, node, name));
      const std::string note =
          fmt::format("'{}' takes part in its only build: its engine has no build '{}' here", name, build);
      if (std::ranges::find(notes_, note) == notes_.end()) notes_.push_back(note);
    }
  }
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
    if (!named.contains(name)) add(found, derived_.at(name), nullptr, name);
  }
  return found;
}

int Roster::index(const Section& section, const toml::node* node, const std::string& name) {
  const auto [at, is_new] = index_.emplace(name, static_cast<int>(contenders_.size()));
  if (!is_new) return at->second;
  const auto found = derived_.find(without_build(name));
  if (found == derived_.end()) {
    contenders_.push_back(resolve(section, node, name, name, {}, registry_));
  } else {
    const Section& own = found->second;
    const std::string base = own.required_text("base");
    const bool has_build = base.find('@') != std::string::npos;
    contenders_.push_back(resolve(own, own.find("base"), name, has_build ? base : in_build(base, build_of(name)),
                                  overrides_of(own), registry_));
  }
  return at->second;
}

}  // namespace assay
