#include "engines/registry.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <dlfcn.h>
#include <filesystem>
#include <functional>
#include <limits>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "base/hash.h"
#include "base/paths.h"
#include "base/text.h"
#include "engines/about.h"
#include "engines/builds.h"
#include "engines/engine_files.h"
#include "engines/plugin_trial.h"
#include "engines/python_engine.h"
#include "engines/releases.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPluginPrefix = "assay-engine-";
// Plugins of releases that were tried and can be used, separated by colons.
constexpr const char* kReleasesTried = "ASSAY_RELEASES_TRIED";

// Engines that were there when assay was configured, and those that were not.
struct KnownEngine {
  std::string name;
  std::string how_to_get;     // sentences
  std::string set_up, takes;  // as in AbsentEngine
};
const std::vector<KnownEngine>& known_engines() {
  static const std::vector<KnownEngine> known = {
#include "known_engines.inc"
  };
  return known;
}

// "Run this. Then that." as the end of a sentence.
std::string as_clause(std::string sentences) {
  const auto is_lower = [](char c) { return std::islower(static_cast<unsigned char>(c)) != 0; };
  if (sentences.size() > 1 && is_lower(sentences[1])) {
    sentences[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(sentences[0])));
  }
  if (sentences.ends_with('.')) sentences.pop_back();
  return sentences;
}

std::string_view family(std::string_view name) { return name.substr(0, name.find_first_of("-@")); }

// A plugin is a shared library, or an adapter in Python: a file, or a folder with engine.py.
bool is_python(const fs::path& plugin) { return plugin.extension() != ".so"; }
bool is_plugin(const fs::path& path) {
  if (!path.stem().string().starts_with(kPluginPrefix)) return false;
  std::error_code error;
  return path.extension() == ".so" || path.extension() == ".py" || fs::exists(path / "engine.py", error);
}

// The order of tables and reports: by family, which is the first word of a plugin's name, doubles before floats.
// Families without an order follow by name.
auto rank(const std::string& name) {
  const EngineAbout* about = about_engine(family(name));
  const int place =
      about == nullptr ? std::numeric_limits<int>::max() : about->order.value_or(std::numeric_limits<int>::max());
  return std::tuple(place, name.ends_with("-f32"), name);
}

std::vector<std::string> setting_names(const std::vector<Setting>& settings) {
  std::vector<std::string> names;
  names.reserve(settings.size());
  for (const Setting& setting : settings) names.push_back(setting.name);
  return names;
}

template <typename Number>
void check_range(const Setting& setting, Number value) {
  const auto number = static_cast<double>(value);
  if ((setting.minimum && number < *setting.minimum) || (setting.maximum && number > *setting.maximum)) {
    const std::string low = setting.minimum ? fmt::format("at least {}", *setting.minimum) : "";
    const std::string high = setting.maximum ? fmt::format("at most {}", *setting.maximum) : "";
    throw InputError(fmt::format("setting '{}' is {}: give a value of {}{}{}", setting.name, value, low,
                                 low.empty() || high.empty() ? "" : " and ", high));
  }
}

constexpr std::array<std::string_view, 7> kRoleNames = {  // by SettingRole
    "", "iterations", "tolerance", "contact_softness", "contact_stiffness", "contact_damping", "contact_rebound"};

// A compliance that would have no effect is not left out in silence: contenders are compared by it.
void require_compliance(const std::string& contender, const std::vector<Setting>& declared, const Settings& settings) {
  const auto value = [&](SettingRole role) {
    const Setting* setting = setting_with_role(declared, role);
    return setting == nullptr ? 0.0 : settings.get<double>(setting->name);
  };
  const double stiffness = value(SettingRole::kContactStiffness), damping = value(SettingRole::kContactDamping);
  if (stiffness == 0 && damping == 0) return;
  const Setting& setting = *setting_with_role(declared, SettingRole::kContactStiffness);
  if (stiffness == 0) {
    throw InputError(fmt::format("'{}' has a contact_damping of {} N s/m without a stiffness: give '{}' too", contender,
                                 damping, setting.name));
  }
  if (const std::string missing = missing_condition(setting, settings); !missing.empty()) {
    throw InputError(fmt::format("'{}' cannot be given a contact stiffness: '{}' does nothing without {}", contender,
                                 setting.name, missing));
  }
}

std::string name_of(const std::string& plugin) {
  // a folder's name can end in a release: what follows its last dot is no extension
  const fs::path path = plugin;
  const bool is_file = path.extension() == ".so" || path.extension() == ".py";
  return (is_file ? path.stem() : path.filename()).string().substr(std::string_view(kPluginPrefix).size());
}

// Of adapters in Python, by their paths; "" where it is not known.
std::map<std::string, std::string>& declarations() {
  static std::map<std::string, std::string> known;
  return known;
}

void keep_told(const std::map<std::string, std::string>& told) {
  for (const auto& [plugin, declaration] : told) {
    declarations()[plugin] = declaration;
    keep_declaration(name_of(plugin), plugin, declaration);
  }
}

// What every command asks of an engine without a model. Not build(), which may start a program to ask it for its
// version.
void ask(const Engine& engine) {
  Settings settings;
  for (const Setting& setting : engine.settings()) settings.values[setting.name] = setting.default_value;
  for (const Contender& contender : engine.contenders()) {
    Settings its_own = settings;
    for (const auto& [key, value] : contender.set) its_own.values.at(key) = value;
    static_cast<void>(engine.capabilities(its_own));
  }
}

// What the trial of a plugin does, in a process that ends: loads it and asks. `load` gives null where that fails.
// Returns what an adapter in Python declares, where that is not known.
std::string load_and_ask(const std::string& plugin, const std::function<const Engine*()>& load) {
  const bool asks = is_python(plugin) && declarations()[plugin].empty() && !is_python_process();
  try {
    if (asks) declarations()[plugin] = declare_in_python(name_of(plugin), plugin);
  } catch (const std::exception& error) {
    throw RefusedPlugin(error.what());
  }
  if (const Engine* engine = load()) ask(*engine);
  return asks ? declarations()[plugin] : "";
}

const Engine* engine_of(const std::vector<const Engine*>& engines, const std::string& contender) {
  const auto found = std::ranges::find_if(engines, [&](const Engine* engine) {
    const std::vector<Contender> contenders = engine->contenders();
    return std::ranges::find(contenders, contender, &Contender::name) != contenders.end();
  });
  return found == engines.end() ? nullptr : *found;
}

}  // namespace

Registry& Registry::owned() {
  // never destroyed: an interpreter that has assay as a library is gone before static objects are
  static auto* const registry = new Registry;
  return *registry;
}

const Registry& Registry::instance() { return owned(); }

void Registry::add(const std::string& path) {
  Registry& registry = owned();
  const std::string name = name_of(path);
  if (registry.paths_.contains(name)) {
    throw InputError(fmt::format("there is an engine '{}' already: give the new one another name", name));
  }
  const std::vector<std::string> taken = registry.contender_names();
  const size_t absent = registry.absent_.size();
  registry.load(path);
  if (registry.absent_.size() > absent) {
    const std::string reason = registry.absent_.back().reason;
    registry.absent_.pop_back();
    throw InputError(fmt::format("engine '{}': {}", name, reason));
  }
  std::string fault;
  try {
    ask(*registry.engines_.back());
  } catch (const std::exception& error) {
    fault = fmt::format("engine '{}' does not say what it is: {}", name, error.what());
  }
  for (const Contender& contender : registry.engines_.back()->contenders()) {
    if (std::ranges::find(taken, contender.name) == taken.end()) continue;
    fault = fmt::format("engine '{}' has a contender '{}', and there is one already: give it another name", name,
                        contender.name);
  }
  if (fault.empty()) return;
  // the engine itself stays until the process ends, as all do
  registry.engines_.pop_back();
  registry.paths_.erase(name);
  throw InputError(fault);
}

Registry::Registry() {
  std::vector<std::string> plugins;
  for (const std::string& folder : plugin_folders()) {
    std::error_code error;
    std::vector<std::string> files;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
      if (is_plugin(entry.path())) files.push_back(entry.path());
    }
    std::ranges::sort(files);
    plugins.insert(plugins.end(), files.begin(), files.end());
  }
  // A plugin with instructions that the processor lacks may use them as soon as it is loaded.
  std::erase_if(plugins, [this](const std::string& plugin) {
    const std::string name = name_of(plugin), lacking = lacking_for(build_of(name));
    if (lacking.empty()) return false;
    absent_.push_back({name, fmt::format("this processor lacks {}", lacking)});
    return true;
  });
  // Adapters in Python of which nobody knows what they declare: asked in a process that ends, so that this one has no
  // interpreter before it needs one.
  std::vector<std::string> unknown;
  for (const std::string& plugin : plugins) {
    if (!is_python(plugin)) continue;
    declarations()[plugin] = kept_declaration(name_of(plugin), plugin);
    if (declarations()[plugin].empty() && !is_python_process()) unknown.push_back(plugin);
  }
  const PluginTrial trial = try_plugins(plugins, unknown, [&](const std::string& plugin) -> std::string {
    const std::string name = name_of(plugin);
    if (paths_.contains(name)) return "";
    return load_and_ask(plugin, [&] {
      load(plugin);
      return paths_.contains(name) ? owned_.back().get() : nullptr;
    });
  });
  keep_told(trial.told);
  for (const std::string& plugin : plugins) {
    const auto found = trial.refused.find(plugin);
    if (found == trial.refused.end()) {
      load(plugin);
    } else {
      const std::string name = name_of(plugin);
      if (!paths_.contains(name)) absent_.push_back({name, fmt::format("'{}' {}", plugin, found->second)});
    }
  }
  remember_libraries(environments_);
  for (std::vector<const Engine*>* engines : {&engines_, &other_builds_}) {
    std::ranges::sort(*engines, {}, [](const Engine* engine) { return rank(engine->name()); });
  }
  for (const KnownEngine& known : known_engines()) {
    const bool refused = std::ranges::find(absent_, known.name, &AbsentEngine::name) != absent_.end();
    if (!paths_.contains(known.name) && !refused) {
      absent_.push_back(
          {known.name, fmt::format("not built: {}", as_clause(known.how_to_get)), known.set_up, known.takes});
    }
  }
  std::ranges::sort(absent_, {}, [](const AbsentEngine& absent) { return rank(absent.name); });
}

void Registry::load(const std::string& path) {
  const std::string name = name_of(path);
  if (paths_.contains(name)) return;
  if (is_python(path)) {
    try {
      std::string& declaration = declarations()[path];
      if (declaration.empty()) declaration = declare_in_python(name, path);
      std::unique_ptr<const Engine> engine = python_engine(name, path, declaration);
      const PythonFacts facts = python_facts(*engine);
      for (const std::string& folder : {facts.environment, facts.prefix}) {
        if (!folder.empty()) environments_.push_back(folder);
      }
      paths_[name] = path;
      (build_of(name) == kBaseline ? engines_ : other_builds_).push_back(engine.get());
      owned_.push_back(std::move(engine));
    } catch (const std::exception& error) {
      absent_.push_back({name, fmt::format("'{}' {}", path, error.what())});
    }
    return;
  }
  // RTLD_LOCAL keeps two builds of one engine apart; the handle is never closed, engines have static state. The program
  // has an engine's library itself, MuJoCo's for its parser, and a plugin that is loaded sees the program's symbols
  // first: a release's own come first with RTLD_DEEPBIND.
  const int deep = is_release(build_of(name)) ? RTLD_DEEPBIND : 0;
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL | deep);
  if (library == nullptr) {
    absent_.push_back({name, fmt::format("'{}' cannot be loaded: {}", path, dlerror())});
    return;
  }
  const auto entry = reinterpret_cast<PluginEntry (*)()>(dlsym(library, "assay_engine_plugin"));
  if (entry == nullptr) {
    absent_.push_back({name, fmt::format("'{}' has no entry point: put ASSAY_ENGINE_PLUGIN(YourEngine) in it", path)});
    return;
  }
  const PluginEntry plugin = entry();
  if (plugin.version != kPluginVersion) {
    absent_.push_back({name, fmt::format("'{}' was built for plugin version {}, this assay has {}: build it again",
                                         path, plugin.version, kPluginVersion)});
    return;
  }
  std::unique_ptr<const Engine> engine;
  std::string reason = "makes no engine";
  try {
    engine.reset(plugin.make());
    if (engine != nullptr) reason = engine->name() == name ? "" : fmt::format("calls itself '{}'", engine->name());
  } catch (const std::exception& error) {
    reason = fmt::format("fails when it is loaded: {}", error.what());
  } catch (...) {
    reason = "fails when it is loaded";
  }
  if (!reason.empty()) {
    absent_.push_back({name, fmt::format("'{}' {}", path, reason)});
    return;
  }
  paths_[name] = path;
  (build_of(name) == kBaseline ? engines_ : other_builds_).push_back(engine.get());
  owned_.push_back(std::move(engine));
}

// Loads the plugin of that release of the contender's engine, where set-up has made it and nobody has tried before.
// What is wrong with it is said by resolve().
void Registry::load_release(const std::string& contender, const std::string& release) {
  if (!is_release(release)) return;
  const Engine* engine = engine_of(engines_, contender);
  if (engine == nullptr) return;
  const std::string name = in_build(engine->name(), release);
  if (paths_.contains(name) || std::ranges::find(absent_, name, &AbsentEngine::name) != absent_.end()) return;
  const std::string plugin = release_plugin(engine->name(), release);
  if (plugin.empty()) return;
  if (is_python(plugin)) declarations()[plugin] = kept_declaration(name, plugin);
  // tried in a process of its own, as all are; processes that this one starts load it at once
  std::vector<std::string> tried = folders_in(kReleasesTried);
  if (std::ranges::find(tried, plugin) == tried.end()) {
    const PluginTrial trial = try_plugins({plugin}, {plugin}, [&](const std::string& path) {
      return load_and_ask(path, [&] {
        load(path);
        return paths_.contains(name) ? owned_.back().get() : nullptr;
      });
    });
    if (const auto found = trial.refused.find(plugin); found != trial.refused.end()) {
      absent_.push_back({name, fmt::format("'{}' {}", plugin, found->second)});
      return;
    }
    keep_told(trial.told);
    tried.push_back(plugin);
    ::setenv(kReleasesTried, join(tried, ":").c_str(), 1);
  }
  load(plugin);
}

std::optional<std::string> Registry::lacking_release(const std::string& name) const {
  const std::string release = build_of(name);
  const Engine* engine = engine_of(engines_, without_build(name));
  if (!is_release(release) || engine == nullptr || has(name)) return std::nullopt;
  const std::string own = in_build(engine->name(), release);
  const std::vector<std::string> known = releases_of(engine->name());
  if (known.empty()) {
    return fmt::format("'{}' names a release of {}, which has its newest alone: leave '@{}' out", name, engine->name(),
                       release);
  }
  if (std::ranges::find(known, release) == known.end()) {
    return fmt::format("'{}' names a release of {} that it has not: it has {}", name, engine->name(),
                       join(known, ", "));
  }
  const auto refused = std::ranges::find(absent_, own, &AbsentEngine::name);
  return fmt::format("contender '{}' needs release {} of {}, {}", name, release, engine->name(),
                     refused != absent_.end() ? fmt::format("which cannot be used: {}", refused->reason)
                                              : fmt::format("which is not set up: run ./assay setup {}", own));
}

bool Registry::runs_python(const std::string& engine) const { return is_python(paths_.at(engine)); }

std::string Registry::plugin_hash(const std::string& engine) const {
  const fs::path plugin = paths_.at(engine);
  if (!is_python(plugin)) return file_hash(plugin);
  // what the engine's answers come from: adapter, pins of its packages, host
  const auto made =
      std::ranges::find_if(owned_, [&](const std::unique_ptr<const Engine>& each) { return each->name() == engine; });
  const PythonFacts facts = python_facts(**made);
  std::vector<std::string> files = {facts.host, facts.module};
  if (fs::is_directory(plugin)) {
    for (const auto& entry : fs::directory_iterator(plugin)) {
      const fs::path& file = entry.path();
      if (file.extension() == ".py" || file.filename() == "requirements.txt") files.push_back(file);
    }
  } else {
    files.push_back(plugin);
  }
  std::sort(files.begin() + 2, files.end());
  std::string all;
  for (const std::string& file : files) all += file_hash(file);
  return content_hash(all);
}

std::vector<std::string> Registry::contender_names() const {
  std::vector<std::string> names;
  for (const Engine* engine : engines_) {
    for (const Contender& contender : engine->contenders()) names.push_back(contender.name);
  }
  return names;
}

const std::vector<const Engine*>& Registry::engines_in(const std::string& build) const {
  return build == kBaseline ? engines_ : other_builds_;
}

bool Registry::has(const std::string& name) const {
  const std::string build = build_of(name), plain = without_build(name);
  owned().load_release(plain, build);
  return std::ranges::any_of(engines_in(build), [&](const Engine* engine) {
    const std::vector<Contender> contenders = engine->contenders();
    return build_of(engine->name()) == build &&
           std::ranges::find(contenders, plain, &Contender::name) != contenders.end();
  });
}

std::vector<std::string> Registry::builds_of(const std::string& contender) const {
  std::vector<std::string> builds;
  for (const Engine* engine : other_builds_) {
    const std::string build = build_of(engine->name());
    if (is_release(build)) continue;
    const std::vector<Contender> contenders = engine->contenders();
    if (std::ranges::find(contenders, contender, &Contender::name) != contenders.end()) builds.push_back(build);
  }
  return builds;
}

ResolvedContender Registry::resolve(const std::string& name,
                                    const std::map<std::string, std::string>& overrides) const {
  const std::string build = build_of(name), plain = without_build(name);
  owned().load_release(plain, build);
  for (const Engine* engine : engines_in(build)) {
    if (build_of(engine->name()) != build) continue;
    for (const Contender& contender : engine->contenders()) {
      if (contender.name != plain) continue;
      ResolvedContender resolved{name, name, engine, {}, contender.summary};
      const std::vector<Setting> declared = engine->settings();
      for (const Setting& setting : declared) resolved.settings.values[setting.name] = setting.default_value;
      for (const auto& [key, value] : contender.set) resolved.settings.values.at(key) = value;
      for (const auto& [key, text] : overrides) {
        const auto setting = std::ranges::find(declared, key, &Setting::name);
        if (setting == declared.end() && parse_setting_role(key)) {
          throw InputError(fmt::format("'{}' has no setting '{}': its engine has none for that", name, key));
        }
        if (setting == declared.end()) {
          throw InputError(
              fmt::format("'{}' has no setting '{}'{}", name, key, did_you_mean(key, setting_names(declared))));
        }
        resolved.settings.values[key] = parse_setting(*setting, text);
      }
      require_compliance(name, declared, resolved.settings);
      return resolved;
    }
  }
  if (is_release(build) && has(plain)) throw InputError(*lacking_release(name));
  if (build != kBaseline && has(plain)) {
    const std::string engine = in_build(resolve(plain).engine->name(), build);
    const auto found = std::ranges::find(absent_, engine, &AbsentEngine::name);
    throw InputError(fmt::format(
        "contender '{}' needs the build '{}' of its engine, which is not here: {}", name, build,
        found != absent_.end()
            ? found->reason
            : fmt::format("engines that are built from source get it by `./assay setup --builds {}`", build)));
  }
  const auto is_family = [&](const std::string& engine) { return family(engine) == family(name); };
  const auto absent = std::ranges::find_if(absent_, is_family, &AbsentEngine::name);
  const bool others = std::ranges::any_of(engines_, is_family, &Engine::name);
  if (absent != absent_.end() && !others) {
    throw InputError(
        fmt::format("contender '{}' needs the engine '{}', which is absent: {}", name, absent->name, absent->reason));
  }
  const std::string note =
      absent == absent_.end() ? "" : fmt::format("; engine '{}' is absent: {}", absent->name, absent->reason);
  throw InputError(fmt::format("unknown contender '{}'{}; `assay list engines` lists them{}", name,
                               did_you_mean(name, contender_names()), note));
}

std::string setting_role_text(SettingRole role) { return std::string(kRoleNames.at(static_cast<size_t>(role))); }

std::vector<std::string> setting_role_names() { return {kRoleNames.begin() + 1, kRoleNames.end()}; }

std::optional<SettingRole> parse_setting_role(const std::string& name) {
  const auto* found = std::ranges::find(kRoleNames, name);
  if (name.empty() || found == kRoleNames.end()) return std::nullopt;
  return static_cast<SettingRole>(found - kRoleNames.begin());
}

const Setting* setting_with_role(const std::vector<Setting>& declared, SettingRole role) {
  const auto found = std::ranges::find(declared, role, &Setting::role);
  return found == declared.end() ? nullptr : &*found;
}

std::string missing_condition(const Setting& setting, const Settings& settings) {
  std::vector<std::string> missing;
  for (const auto& [name, text] : setting.only_with) {
    if (setting_text(settings.values.at(name)) != text) missing.push_back(fmt::format("{}={}", name, text));
  }
  return join(missing, " and ");
}

SettingValue parse_setting(const Setting& setting, const std::string& text) {
  if (std::holds_alternative<bool>(setting.default_value)) {
    if (text == "on" || text == "true" || text == "1") return true;
    if (text == "off" || text == "false" || text == "0") return false;
    throw InputError(fmt::format("setting '{}' is '{}': give on or off", setting.name, text));
  }
  if (std::holds_alternative<long long>(setting.default_value)) {
    const auto value = parse_integer(text);
    if (!value) throw InputError(fmt::format("setting '{}' is '{}': give a whole number", setting.name, text));
    check_range(setting, *value);
    return *value;
  }
  if (std::holds_alternative<double>(setting.default_value)) {
    const auto value = parse_number(text);
    if (!value) throw InputError(fmt::format("setting '{}' is '{}': give a number", setting.name, text));
    check_range(setting, *value);
    return *value;
  }
  if (std::ranges::find(setting.choices, text) == setting.choices.end()) {
    throw InputError(fmt::format("setting '{}' is '{}'{}", setting.name, text, did_you_mean(text, setting.choices)));
  }
  return text;
}

std::string setting_text(const SettingValue& value) {
  if (const bool* flag = std::get_if<bool>(&value)) return *flag ? "on" : "off";
  if (const auto* integer = std::get_if<long long>(&value)) return std::to_string(*integer);
  if (const double* number = std::get_if<double>(&value)) return shortest(*number);
  return std::get<std::string>(value);
}

std::string settings_text(const Engine& engine, const Settings& settings) {
  std::vector<std::string> parts;
  for (const Setting& setting : engine.settings()) {
    const SettingValue& value = settings.values.at(setting.name);
    if (value != setting.default_value) parts.push_back(fmt::format("{}={}", setting.name, setting_text(value)));
  }
  return join(parts, " ");
}

}  // namespace assay
