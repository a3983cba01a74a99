// What an adapter in Python declares, as data: the host makes a text of it (assay_adapter.py), which the registry
// keeps.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engines/engine.h"

namespace assay {

struct PythonDeclaration {
  BuildFacts build;
  std::optional<std::string> environment;  // as the adapter says, relative to its folder; none: what set-up made
  bool batches = false;                    // it has create_batch()
  std::vector<Setting> settings;
  std::vector<Contender> contenders;
  // With the settings of each contender. They do not depend on the timestep.
  std::vector<std::pair<std::map<std::string, SettingValue>, Capabilities>> capabilities;
  std::vector<std::string> files;  // of modules outside its own folder and the standard library

  // Null for settings that have to be asked for.
  const Capabilities* capabilities_with(const Settings& chosen) const;
};

// Throws std::exception for what is no declaration.
PythonDeclaration python_declaration(const std::string& text);
Capabilities python_capabilities(const std::string& text);
// Of check().
std::vector<Limitation> python_limitations(const std::string& text);

// What the adapter's functions get: {"timestep": s, "values": {name: value}}.
std::string python_settings(const Settings& settings);

}  // namespace assay
