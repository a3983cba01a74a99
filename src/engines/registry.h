// Finds the engines' plugins, and turns a contender's name and a user's `key=value` into an engine with complete
// settings.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engines/engine.h"

namespace assay {

// A plugin that cannot be used, or an engine of known_engines() that is absent.
struct AbsentEngine {
  std::string name;
  std::string reason;  // one sentence: why, and how to get it
};

// A contender with everything that is needed to run it except the timestep.
struct ResolvedContender {
  std::string name;  // as reports show it; unique within a campaign
  std::string base;  // the contender it was derived from (equal to name when nothing was overridden or renamed)
  const Engine* engine = nullptr;
  Settings settings;  // complete
  std::string summary;
};

class Registry {
 public:
  // Loads every plugin of the search path: the folders of ASSAY_ENGINE_PATH (colon-separated), then `engines` beside
  // the program's own folder and `lib/assay/engines` beside it (installed). The first plugin of a name wins. Never
  // throws for a bad plugin: it is listed in absent(). Engines stay loaded until the process ends. Each plugin is tried
  // in a process of its own first (engines/plugin_trial.h).
  static const Registry& instance();

  const std::vector<const Engine*>& engines() const { return engines_; }
  const std::vector<AbsentEngine>& absent() const { return absent_; }
  std::string plugin_path(const std::string& engine) const { return paths_.at(engine); }

  // All contenders of all engines, in the engines' order.
  std::vector<std::string> contender_names() const;

  // `name` is a contender's. `overrides` are texts as in `--set`. Throws InputError for an unknown contender, setting,
  // a value of the wrong type or out of range, naming the nearest known name.
  ResolvedContender resolve(const std::string& name, const std::map<std::string, std::string>& overrides = {}) const;

 private:
  Registry();
  void load(const std::string& path);

  std::vector<std::unique_ptr<const Engine>> owned_;
  std::vector<const Engine*> engines_;
  std::vector<AbsentEngine> absent_;
  std::map<std::string, std::string> paths_;
};

// How campaigns name a role: "iterations", "tolerance", "contact_softness", "contact_stiffness", "contact_damping"; ""
// for none.
std::string setting_role_text(SettingRole role);
std::vector<std::string> setting_role_names();  // of all but none
std::optional<SettingRole> parse_setting_role(const std::string& name);

// The setting among `declared` that decides this; null where the engine has none.
const Setting* setting_with_role(const std::vector<Setting>& declared, SettingRole role);

// "solver=quick" where `setting` does nothing because another setting has another value; "" where it acts.
std::string missing_condition(const Setting& setting, const Settings& settings);

// Parses `text` as the setting's type and checks choices and range. Throws InputError.
SettingValue parse_setting(const Setting& setting, const std::string& text);

// "50", "0.2", "on", "dantzig".
std::string setting_text(const SettingValue& value);

// What in `settings` differs from the engine's defaults, as "key=value key=value".
std::string settings_text(const Engine& engine, const Settings& settings);

}  // namespace assay
