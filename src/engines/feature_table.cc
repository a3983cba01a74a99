#include "engines/feature_table.h"

#include <algorithm>

#include <fmt/format.h>

#include "base/terminal.h"
#include "base/text.h"
#include "engines/describe.h"
#include "engines/facts.h"

namespace assay {
namespace {

constexpr const char* kLegend = "= exact, ~ approximated (how is below), - refused";

bool same_support(const Capabilities& a, const Capabilities& b) {
  return std::ranges::all_of(all_features(), [&](Feature feature) {
    const FeatureSupport *left = a.support(feature), *right = b.support(feature);
    if (left == nullptr || right == nullptr) return left == right;
    return left->fidelity == right->fidelity && left->how == right->how;
  });
}

Fidelity fidelity_of(const FeatureGroup& group, Feature feature) {
  const FeatureSupport* support = group.capabilities.support(feature);
  return support == nullptr ? Fidelity::kRefused : support->fidelity;
}

// What the contenders do instead of one feature, with the groups (counted from 1) that do it.
struct Remark {
  Fidelity fidelity = Fidelity::kApproximated;
  std::string how;
  std::vector<size_t> groups;
};

std::vector<Remark> remarks_of(const std::vector<FeatureGroup>& groups, Feature feature) {
  std::vector<Remark> remarks;
  for (size_t g = 0; g < groups.size(); ++g) {
    const FeatureSupport* support = groups[g].capabilities.support(feature);
    if (support == nullptr || support->how.empty()) continue;
    const auto same = std::ranges::find_if(remarks, [&](const Remark& remark) {
      return remark.how == support->how && remark.fidelity == support->fidelity;
    });
    if (same == remarks.end()) {
      remarks.push_back({support->fidelity, support->how, {g + 1}});
    } else {
      same->groups.push_back(g + 1);
    }
  }
  return remarks;
}

// Of exact, approximated and refused.
struct Marks {
  const char *exact, *approximated, *refused;
};

const char* mark(Fidelity fidelity, const Marks& marks) {
  if (fidelity == Fidelity::kExact) return marks.exact;
  return fidelity == Fidelity::kApproximated ? marks.approximated : marks.refused;
}

std::string numbers_text(const std::vector<size_t>& numbers) {
  std::string text;
  for (const size_t number : numbers) text += fmt::format("{}{}", text.empty() ? "" : ", ", number);
  return text;
}

std::string names_text(const std::vector<std::string>& contenders) {
  std::string names;
  for (const std::string& name : contenders) names += (names.empty() ? "" : ", ") + name;
  return names;
}

// Who gives what of contact forces, those that give nothing last.
std::vector<std::string> contact_forces_lines(const std::vector<FeatureGroup>& groups) {
  std::map<std::string, std::vector<std::string>> given, not_given;
  for (const FeatureGroup& group : groups) {
    for (const auto& [text, contenders] : group.contact_forces) {
      std::vector<std::string>& names = (text.starts_with(kForcesNotGiven) ? not_given : given)[text];
      names.insert(names.end(), contenders.begin(), contenders.end());
    }
  }
  std::vector<std::string> lines;
  for (const auto* part : {&given, &not_given}) {
    for (const auto& [text, contenders] : *part) lines.push_back(fmt::format("{}: {}", names_text(contenders), text));
  }
  return lines;
}

}  // namespace

std::vector<FeatureGroup> feature_groups(const std::vector<ResolvedContender>& contenders) {
  std::vector<FeatureGroup> groups;
  std::vector<std::string> engines;  // of each group
  for (const ResolvedContender& contender : contenders) {
    const Capabilities can = contender.engine->capabilities(contender.settings);
    const std::string engine = contender.engine->name();
    size_t g = 0;
    while (g < groups.size() && !(engines[g] == engine && same_support(groups[g].capabilities, can))) ++g;
    if (g == groups.size()) {
      groups.push_back({engine, {}, can, {}});
      engines.push_back(engine);
    }
    groups[g].contenders.push_back(contender.name);
    groups[g].contact_forces[contact_forces_text(can)].push_back(contender.name);
  }
  for (size_t g = 0; g < groups.size(); ++g) {
    if (std::ranges::count(engines, engines[g]) > 1) groups[g].label = groups[g].contenders.front();
  }
  return groups;
}

Json features_json(const std::vector<FeatureGroup>& groups) {
  Json listed = {{"features", Json::array()}, {"groups", Json::array()}};
  for (const Feature feature : all_features()) {
    listed["features"].push_back({{"feature", feature_key(feature)}, {"name", feature_name(feature)}});
  }
  for (const FeatureGroup& group : groups) {
    Json support = Json::object();
    for (const Feature feature : all_features()) {
      const FeatureSupport* found = group.capabilities.support(feature);
      support[feature_key(feature)] = {{"fidelity", fidelity_text(fidelity_of(group, feature))},
                                       {"how", found == nullptr ? "" : found->how}};
    }
    listed["groups"].push_back({{"label", group.label},
                                {"contenders", group.contenders},
                                {"support", support},
                                {"contact_forces", group.contact_forces}});
  }
  return listed;
}

std::string features_text(const std::vector<FeatureGroup>& groups) {
  std::string text;
  for (size_t g = 0; g < groups.size(); ++g) {
    text += paragraph(fmt::format("{:>2}  {}", g + 1, names_text(groups[g].contenders)), 4);
  }
  // columns of two characters; groups that do not fit the terminal side by side follow in a table below
  size_t width = 0;
  for (const Feature feature : all_features()) width = std::max(width, feature_key(feature).size());
  size_t fitting = groups.size();
  if (const auto columns = terminal_columns(stdout)) {
    fitting = std::max<size_t>(1, (*columns - std::min(*columns, width)) / 3);
  }
  for (size_t first = 0; first < groups.size(); first += fitting) {
    const size_t last = std::min(first + fitting, groups.size());
    const auto row = [&](const std::string& name, const auto& cell) {
      std::string line = fmt::format("{:<{}}", name, width);
      for (size_t g = first; g < last; ++g) line += fmt::format(" {:>2}", cell(g));
      return line;
    };
    text += "\n" + heading(row("feature", [](size_t g) { return std::to_string(g + 1); })) + "\n";
    for (const Feature feature : all_features()) {
      text += row(feature_key(feature),
                  [&](size_t g) { return std::string(mark(fidelity_of(groups[g], feature), {"=", "~", "-"})); }) +
              "\n";
    }
  }
  text += std::string("\n") + kLegend + "\n";
  for (const Feature feature : all_features()) {
    const std::vector<Remark> remarks = remarks_of(groups, feature);
    if (remarks.empty()) continue;
    text += "\n" + heading(feature_name(feature)) + "\n";
    for (const Remark& remark : remarks) {
      text += paragraph(
          fmt::format("  {} {}: {}", numbers_text(remark.groups), fidelity_text(remark.fidelity), remark.how), 4);
    }
  }
  text += "\n" + heading("contact forces") + "\n";
  for (const std::string& line : contact_forces_lines(groups)) text += paragraph("  " + line, 4);
  return text;
}

std::string features_markdown(const std::vector<FeatureGroup>& groups) {
  std::string text =
      "# Features of models and engines\n\n"
      "What every contender does with the parts of a model beyond hinges, free bodies, spheres, capsules and planes: "
      "✓ exact,\n≈ approximated, – refused. The columns are numbered below; contenders of an engine that do the same "
      "share one. What is\napproximated, and by how much, follows the table. The adapters declare it, and the "
      "[conformance suite](../conformance/README.md)\ntests it.\n`./assay list engines --features --markdown` writes "
      "this "
      "file.\n\n";
  text += "| feature |";
  for (size_t g = 0; g < groups.size(); ++g) text += fmt::format(" {} |", g + 1);
  text += "\n| --- |";
  for (size_t g = 0; g < groups.size(); ++g) text += " :-: |";
  text += "\n";
  for (const Feature feature : all_features()) {
    text += fmt::format("| {} |", feature_name(feature));
    for (const FeatureGroup& group : groups) {
      text += fmt::format(" {} |", mark(fidelity_of(group, feature), {"✓", "≈", "–"}));
    }
    text += "\n";
  }
  text += "\n| column | contenders |\n| --- | --- |\n";
  for (size_t g = 0; g < groups.size(); ++g)
    text += fmt::format("| {} | {} |\n", g + 1, names_text(groups[g].contenders));
  text += "\n## What is approximated, and why something is refused\n";
  for (const Feature feature : all_features()) {
    const std::vector<Remark> remarks = remarks_of(groups, feature);
    if (remarks.empty()) continue;
    text += fmt::format("\n### {}\n\n", feature_name(feature));
    for (const Remark& remark : remarks) {
      std::string names;
      for (const size_t g : remark.groups) names += (names.empty() ? "" : ", ") + groups[g - 1].label;
      text += fmt::format("- {} {}: {}\n", names, fidelity_text(remark.fidelity), remark.how);
    }
  }
  text += "\n## What engines give of contact forces\n\n";
  for (const std::string& line : contact_forces_lines(groups)) text += fmt::format("- {}\n", line);
  return text;
}

}  // namespace assay
