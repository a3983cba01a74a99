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
  // What `./assay setup` calls it and what that takes, as in "6 minutes of compiling"; empty where a clone's set-up is
  // no help.
  std::string set_up = {}, takes = {};
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
  // the program's own folder and `lib/assay/engines` beside it (installed). A plugin is assay-engine-NAME.so, or an
  // adapter in Python: assay-engine-NAME.py, or a folder assay-engine-NAME with engine.py. The first plugin of a name
  // wins. Never
  // throws for a bad plugin: it is listed in absent(). Engines stay loaded until the process ends. Each plugin is tried
  // in a process of its own first (engines/plugin_trial.h).
  static const Registry& instance();

  // One plugin more, in a process that defines engines while it runs: an adapter in Python. Throws InputError when it
  // cannot be used, or when the name of its engine or of one of its contenders is taken.
  static void add(const std::string& path);

  // In the baseline.
  const std::vector<const Engine*>& engines() const { return engines_; }
  // In other builds (engines/builds.h), "ode@v3"; only what this processor runs. And the releases of engines that
  // were named so far (engines/releases.h), "mujoco@3.3.7".
  const std::vector<const Engine*>& other_builds() const { return other_builds_; }
  // Of the contender's engine besides the baseline: "v3". A name with a build has none.
  std::vector<std::string> builds_of(const std::string& contender) const;
  const std::vector<AbsentEngine>& absent() const { return absent_; }
  std::string plugin_path(const std::string& engine) const { return paths_.at(engine); }
  // Whether its adapter is in Python: calls of it and of its simulations need the interpreter's lock.
  bool runs_python(const std::string& engine) const;
  // A hash of what the plugin is made of: its file; of an adapter in Python its files, its pins and the host.
  std::string plugin_hash(const std::string& engine) const;

  // All contenders of all engines in the baseline, in the engines' order.
  std::vector<std::string> contender_names() const;

  // Whether resolve() knows the contender, in whatever build or release its name asks for.
  bool has(const std::string& name) const;

  // Why there is no contender of that name where it is one in a release of its engine, as a sentence; nothing where
  // there is, or where the name is none of those.
  std::optional<std::string> lacking_release(const std::string& name) const;

  // `name` is a contender's, as it is or with a build: "ode-quick@v3". `overrides` are texts as in `--set`. Throws
  // InputError for an unknown contender, setting, a value of the wrong type or out of range, naming the nearest known
  // name.
  ResolvedContender resolve(const std::string& name, const std::map<std::string, std::string>& overrides = {}) const;

 private:
  Registry();
  static Registry& owned();
  void load(const std::string& path);
  void load_release(const std::string& contender, const std::string& release);
  const std::vector<const Engine*>& engines_in(const std::string& build) const;

  std::vector<std::unique_ptr<const Engine>> owned_;
  std::vector<const Engine*> engines_, other_builds_;
  std::vector<AbsentEngine> absent_;
  std::map<std::string, std::string> paths_;
  std::vector<std::string> environments_;  // of adapters in Python
};

// How campaigns name a role: "iterations", "tolerance", "contact_softness", "contact_stiffness", "contact_damping",
// "contact_rebound"; "" for none.
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
