// Engines, contenders and builds as tables and as JSON.
#pragma once

#include <string>
#include <vector>

#include "base/console.h"
#include "engines/registry.h"

namespace assay {

// {"contenders": see contender_json() of facts.h, "absent": [{"engine", "reason"}]}
Json engines_json(const std::vector<ResolvedContender>& contenders, const std::vector<AbsentEngine>& absent);

// One table of everything for programs.
std::string flat_table(const std::vector<ResolvedContender>& contenders);
// What an engine's contenders share stands once, so that both tables fit a terminal.
std::string tables_by_engine(const std::vector<ResolvedContender>& contenders);

// One row an engine and build: what its binary says (engines/binary_facts.h), and how it was made.
struct EngineBuilds {
  Json facts = Json::array();
  std::vector<std::vector<std::string>> rows;

  std::string text() const;
  std::string markdown() const;  // the document docs/lab/builds.md
};

EngineBuilds engine_builds(const Registry& registry);

}  // namespace assay
