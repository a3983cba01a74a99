#include "campaign/sweep.h"

#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>
#include <fnmatch.h>

#include "base/text.h"
#include "campaign/keys.h"

namespace assay {
namespace {

constexpr size_t kMostVariants = 1000;  // of a contender

// One thing that a table varies: a role, or a setting by its name, with its values.
struct Axis {
  const toml::node* node = nullptr;
  std::optional<SettingRole> role;
  std::string key;
  std::vector<std::string> values;  // as in `--set`
};

struct Sweep {
  Section section;
  std::vector<Axis> axes;
  std::vector<std::string> patterns;
  std::set<std::string> systems;  // empty: all
};

std::vector<std::string> values_of(const Section& section, std::string_view key, const toml::node& node) {
  std::vector<std::string> values;
  for (const toml::node& entry : section.list(key, node)) {
    const auto text = setting_value_text(entry);
    if (!text) section.fail(&entry, fmt::format("'{}' has {}: give values of a setting", key, node_text(entry)));
    if (std::ranges::find(values, *text) != values.end()) {
      section.fail(&entry, fmt::format("'{}' has {} twice: leave one out", key, node_text(entry)));
    }
    values.push_back(*text);
  }
  return values;
}

std::vector<std::string> names_in(const Section& section, std::string_view key, const toml::node& node) {
  std::vector<std::string> names;
  for (const toml::node& entry : section.list(key, node)) {
    const auto name = entry.value_exact<std::string>();
    if (!name) section.fail(&entry, fmt::format("'{}' has {}: give names", key, node_text(entry)));
    names.push_back(*name);
  }
  return names;
}

Sweep sweep_of(const Section& section, const Campaign& campaign) {
  Sweep sweep{section, {}, {}, {}};
  std::vector<std::string> keys = key_names(kSweepKeys);
  for (const std::string& role : setting_role_names()) keys.push_back(role);
  section.allow(keys);
  const toml::node* contenders = section.find("contenders");
  if (contenders == nullptr) {
    section.fail(nullptr, "a sweep has no 'contenders': give names or patterns of the campaign's contenders");
  }
  sweep.patterns = names_in(section, "contenders", *contenders);
  std::vector<std::string> systems;
  systems.reserve(campaign.systems.size());
  for (const CampaignSystem& system : campaign.systems) systems.push_back(system.name);
  if (const toml::node* node = section.find("systems")) {
    for (const std::string& name : names_in(section, "systems", *node)) {
      if (std::ranges::find(systems, name) == systems.end()) {
        section.fail(node, fmt::format("the campaign has no system '{}'{}", name, did_you_mean(name, systems)));
      }
      sweep.systems.insert(name);
    }
  }
  for (const std::string& role : setting_role_names()) {
    const toml::node* node = section.find(role);
    if (node != nullptr) sweep.axes.push_back({node, parse_setting_role(role), role, values_of(section, role, *node)});
  }
  if (const toml::node* set = section.find("set")) {
    const toml::table* table = set->as_table();
    if (table == nullptr) section.fail(set, fmt::format("'set' is {}: give {{key = [values]}}", node_text(*set)));
    for (const auto& [key, node] : *table) {
      const std::string name(key.str());
      sweep.axes.push_back({&node, std::nullopt, name, values_of(section, name, node)});
    }
  }
  if (sweep.axes.empty()) {
    section.fail(nullptr, fmt::format("a sweep varies nothing: give {} or set = {{...}}, each with a list of values",
                                      join(setting_role_names(), ", ")));
  }
  size_t combinations = 1;
  for (const Axis& axis : sweep.axes) combinations *= axis.values.size();
  if (combinations > kMostVariants) {
    section.fail(nullptr, fmt::format("a sweep makes {} variants of each contender: at most {} are possible",
                                      combinations, kMostVariants));
  }
  return sweep;
}

// Settings that take each axis's values, by name; or why there are none.
struct Mapped {
  std::vector<std::string> names;
  std::string obstacle;
};

Mapped map_axes(const Sweep& sweep, const ResolvedContender& contender) {
  const std::vector<Setting> declared = contender.engine->settings();
  Mapped mapped;
  for (const Axis& axis : sweep.axes) {
    const Setting* setting = nullptr;
    if (axis.role) {
      setting = setting_with_role(declared, *axis.role);
    } else if (const auto found = std::ranges::find(declared, axis.key, &Setting::name); found != declared.end()) {
      setting = &*found;
    }
    if (setting == nullptr) {
      mapped.obstacle = axis.role ? fmt::format("its engine has no setting for '{}'", axis.key)
                                  : fmt::format("it has no setting '{}'", axis.key);
      return mapped;
    }
    if (const std::string missing = missing_condition(*setting, contender.settings); !missing.empty()) {
      mapped.obstacle = fmt::format("its setting '{}' does nothing without {}", setting->name, missing);
      return mapped;
    }
    mapped.names.push_back(setting->name);
  }
  return mapped;
}

std::vector<CampaignContender> variants_of(const Sweep& sweep, const std::vector<std::string>& names,
                                           const CampaignContender& own, const Registry& registry) {
  std::vector<CampaignContender> variants;
  std::vector<size_t> at(names.size(), 0);  // which value of each axis
  const std::vector<Setting> declared = own.resolved.engine->settings();
  for (bool more = true; more;) {
    CampaignContender variant = own;
    for (size_t i = 0; i < names.size(); ++i) variant.overrides[names[i]] = sweep.axes[i].values[at[i]];
    try {
      variant.resolved = registry.resolve(own.resolved.base, variant.overrides);
    } catch (const InputError& error) {
      sweep.section.fail(sweep.axes.front().node, fmt::format("of '{}', {}", own.resolved.name, error.what()));
    }
    variant.resolved.base = own.resolved.base;
    variant.resolved.name = variant_name(own.resolved.name, declared, own.resolved.settings, variant.resolved.settings);
    variant.varies = own.resolved.name;
    if (variant.resolved.name != own.resolved.name) variants.push_back(std::move(variant));
    size_t i = names.size();
    while (i > 0 && ++at[i - 1] == sweep.axes[i - 1].values.size()) at[--i] = 0;
    more = i > 0;
  }
  return variants;
}

bool matches(const std::string& pattern, const std::string& name) {
  return ::fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
}

bool is_pattern(const std::string& name) { return name.find_first_of("*?") != std::string::npos; }

// Which of the campaign's contenders a sweep varies, as indices.
std::vector<size_t> swept(const Sweep& sweep, const Campaign& campaign) {
  std::vector<std::string> known;
  known.reserve(campaign.contenders.size());
  for (const CampaignContender& each : campaign.contenders) known.push_back(each.resolved.name);
  std::set<size_t> found;
  const toml::node* node = sweep.section.find("contenders");
  for (const std::string& pattern : sweep.patterns) {
    const size_t before = found.size();
    for (size_t c = 0; c < known.size(); ++c) {
      if (is_pattern(pattern) ? matches(pattern, known[c]) : pattern == known[c]) found.insert(c);
    }
    if (found.size() > before || std::ranges::any_of(found, [&](size_t c) { return matches(pattern, known[c]); })) {
      continue;
    }
    sweep.section.fail(
        node, fmt::format("a sweep's '{}' is no contender of the campaign{}", pattern, did_you_mean(pattern, known)));
  }
  return {found.begin(), found.end()};
}

}  // namespace

std::string variant_name(const std::string& of, const std::vector<Setting>& declared, const Settings& own,
                         const Settings& varied) {
  std::string name = of;
  for (const Setting& setting : declared) {
    const SettingValue& value = varied.values.at(setting.name);
    if (value == own.values.at(setting.name)) continue;
    std::string brief = setting.name;
    if (setting.role == SettingRole::kIterations) brief = "it";
    if (setting.role == SettingRole::kTolerance) brief = "tol";
    name += fmt::format(" {}={}", brief, setting_text(value));
  }
  return name;
}

void add_variants(const Section& root, const Registry& registry, Campaign& campaign) {
  // of each contender, each once by its name, with the systems that it takes part in
  std::vector<std::vector<CampaignContender>> variants(campaign.contenders.size());
  std::map<std::string, std::set<size_t>> systems;
  for (const Section& section : root.sections("sweep")) {
    const Sweep sweep = sweep_of(section, campaign);
    for (const size_t c : swept(sweep, campaign)) {
      const CampaignContender& own = campaign.contenders[c];
      if (!own.absent.empty()) continue;
      const Mapped mapped = map_axes(sweep, own.resolved);
      if (!mapped.obstacle.empty()) {
        const std::string& name = own.resolved.name;
        if (std::ranges::find(sweep.patterns, name) != sweep.patterns.end()) {
          section.fail(section.find("contenders"),
                       fmt::format("a sweep cannot vary '{}': {}; leave it out", name, mapped.obstacle));
        }
        campaign.notes.push_back(fmt::format("a sweep leaves '{}' as it is: {}", name, mapped.obstacle));
        continue;
      }
      std::set<size_t> there;
      for (size_t s = 0; s < campaign.systems.size(); ++s) {
        const CampaignSystem& system = campaign.systems[s];
        if (!sweep.systems.empty() && !sweep.systems.contains(system.name)) continue;
        if (std::ranges::find(system.contenders, static_cast<int>(c)) != system.contenders.end()) there.insert(s);
      }
      for (CampaignContender& variant : variants_of(sweep, mapped.names, own, registry)) {
        systems[variant.resolved.name].insert(there.begin(), there.end());
        const auto same = [&](const CampaignContender& other) { return other.resolved.name == variant.resolved.name; };
        if (std::ranges::any_of(campaign.contenders, same)) {
          section.fail(nullptr, fmt::format("a sweep makes a contender '{}', and there is one: rename that one",
                                            variant.resolved.name));
        }
        if (std::ranges::none_of(variants[c], same)) variants[c].push_back(std::move(variant));
      }
    }
  }
  std::vector<CampaignContender> all;
  std::vector<std::vector<int>> takes_part(campaign.systems.size());
  for (size_t c = 0; c < variants.size(); ++c) {
    for (size_t s = 0; s < campaign.systems.size(); ++s) {
      const std::vector<int>& listed = campaign.systems[s].contenders;
      if (std::ranges::find(listed, static_cast<int>(c)) != listed.end()) {
        takes_part[s].push_back(static_cast<int>(all.size()));
      }
    }
    all.push_back(std::move(campaign.contenders[c]));
    for (CampaignContender& variant : variants[c]) {
      for (const size_t s : systems.at(variant.resolved.name)) takes_part[s].push_back(static_cast<int>(all.size()));
      all.push_back(std::move(variant));
    }
  }
  campaign.contenders = std::move(all);
  for (size_t s = 0; s < takes_part.size(); ++s) campaign.systems[s].contenders = std::move(takes_part[s]);
}

}  // namespace assay
