// The table feature x engine: what each contender does with every feature of models (model/features.h).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "base/console.h"
#include "engines/registry.h"

namespace assay {

// Contenders of one engine that declare the same of every feature.
struct FeatureGroup {
  std::string label;  // the engine, or its first contender where the engine's contenders differ
  std::vector<std::string> contenders;
  Capabilities capabilities;
  // What the engine gives of contact forces (contact_forces_text()), with the contenders of which it does.
  std::map<std::string, std::vector<std::string>> contact_forces = {};
};

std::vector<FeatureGroup> feature_groups(const std::vector<ResolvedContender>& contenders);

Json features_json(const std::vector<FeatureGroup>& groups);
// For a terminal or a file: the table, and then how features are approximated and why they are refused.
std::string features_text(const std::vector<FeatureGroup>& groups);
// The document src/engines/features.md.
std::string features_markdown(const std::vector<FeatureGroup>& groups);

}  // namespace assay
