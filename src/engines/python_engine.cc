#include "engines/python_engine.h"

#include <algorithm>
#include <cstdlib>
#include <dlfcn.h>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/hash.h"
#include "base/json.h"
#include "base/paths.h"
#include "base/write_file.h"
#include "engines/batch.h"
#include "engines/engine_files.h"
#include "engines/facts.h"
#include "engines/python_declaration.h"
#include "engines/python_host.h"
#include "isolate/child.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

// One plugin for each interpreter: of the distribution's, and assay-python-host-3.13.so of one that set-up builds.
constexpr std::string_view kHostPrefix = "assay-python-host", kHostEnding = ".so";
constexpr const char* kUsualPython = "3.11";
// The library of the former, in the environment, or beside the folder of the host.
constexpr const char* kPythonLibraryVariable = "ASSAY_PYTHON_LIBRARY";
constexpr const char* kPythonLibrary = "libpython3.11.so.1.0";

struct HostFile {
  std::string version, path;
};

// The usual one first, then by version.
const std::vector<HostFile>& host_files() {
  static const std::vector<HostFile> found = [] {
    std::vector<HostFile> files;
    for (const std::string& folder : plugin_folders()) {
      std::error_code error;
      for (const auto& entry : fs::directory_iterator(folder, error)) {
        const std::string file = entry.path().filename();
        if (!file.starts_with(kHostPrefix) || !file.ends_with(kHostEnding)) continue;
        std::string version = file.substr(kHostPrefix.size(), file.size() - kHostPrefix.size() - kHostEnding.size());
        version = version.empty() ? kUsualPython : version.substr(1);
        if (std::ranges::find(files, version, &HostFile::version) == files.end()) {
          files.push_back({std::move(version), entry.path()});
        }
      }
    }
    std::ranges::sort(files, {},
                      [](const HostFile& file) { return std::pair(file.version != kUsualPython, file.version); });
    return files;
  }();
  return found;
}

// How to get the interpreter; "" where assay has none of that version.
std::string how_to_get_python(std::string version) {
  if (version == kUsualPython) return "install libpython3.11-dev and run ./assay again";
  const std::string_view built = ASSAY_BUILT_PYTHONS;  // " 3.13 "
  if (built.find(fmt::format(" {} ", version)) == std::string_view::npos) return "";
  std::erase(version, '.');
  return fmt::format("run ./assay setup cpython{}", version);
}

const HostFile& any_host() {
  if (host_files().empty()) {
    throw std::runtime_error(fmt::format("is in Python, and '{}{}' was not built: {}", kHostPrefix, kHostEnding,
                                         how_to_get_python(kUsualPython)));
  }
  return host_files().front();
}

struct LoadedHost {
  std::string version;
  PythonHost host;
};
std::optional<LoadedHost>& loaded_host() {
  static std::optional<LoadedHost> loaded;
  return loaded;
}

// The Python package builds the host without the interpreter's library: in the user's interpreter it uses that one, and
// in a process of assay's own the library that is loaded here.
void load_python_library(const fs::path& host) {
  if (dlsym(RTLD_DEFAULT, "Py_IsInitialized") != nullptr) return;
  const char* given = std::getenv(kPythonLibraryVariable);
  const std::string file = given != nullptr && *given != '\0'
                               ? std::string(given)
                               : (host.parent_path() / ".." / kPythonLibrary).lexically_normal().string();
  std::error_code error;
  if (!fs::exists(file, error)) return;  // the host was linked with its own
  if (dlopen(file.c_str(), RTLD_NOW | RTLD_GLOBAL) == nullptr) {
    throw std::runtime_error(fmt::format("is in Python, and its library '{}' cannot be loaded: {}", file, dlerror()));
  }
}

// The one of this process; `file` is loaded where there is none yet. Throws std::runtime_error.
const LoadedHost& host_of_process(const HostFile& file) {
  std::optional<LoadedHost>& loaded = loaded_host();
  if (loaded) return *loaded;
  if (file.version == kUsualPython) load_python_library(file.path);
  void* library = dlopen(file.path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    const std::string why = dlerror(), how = how_to_get_python(file.version);
    throw std::runtime_error(
        fmt::format("is in Python, and '{}' cannot be loaded ({}){}", file.path, why, how.empty() ? "" : ": " + how));
  }
  const auto entry = reinterpret_cast<PythonHost (*)()>(dlsym(library, "assay_python_host"));
  const PythonHost found = entry == nullptr ? PythonHost{0, nullptr, nullptr, nullptr} : entry();
  if (found.version != kPluginVersion) {
    throw std::runtime_error(fmt::format("is in Python, and '{}' was built for plugin version {}, this assay has {}",
                                         file.path, found.version, kPluginVersion));
  }
  loaded = {file.version, found};
  return *loaded;
}

fs::path folder_of(const fs::path& adapter) {
  std::error_code error;
  return fs::is_directory(adapter, error) ? adapter : adapter.parent_path();
}

std::string first_line(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

std::string environment_of(const PythonDeclaration& declaration, const fs::path& adapter) {
  const fs::path folder = folder_of(adapter);
  std::string named = declaration.environment.value_or(first_line(folder / "environment.txt"));
  if (named.empty()) return "";
  if (const char* home = std::getenv("HOME"); home != nullptr && (named == "~" || named.starts_with("~/"))) {
    named.replace(0, 1, home);
  }
  std::error_code error;
  const fs::path path = (folder / named).lexically_normal(), real = fs::weakly_canonical(path, error);
  return error ? path : real;
}

// What pyvenv.cfg says of the interpreter that the environment was made with.
struct Interpreter {
  std::string version, prefix;  // "3.13"
};
Interpreter interpreter_of(const std::string& environment) {
  Interpreter found;
  std::ifstream file(fs::path(environment) / "pyvenv.cfg");
  for (std::string line; std::getline(file, line);) {
    const size_t equals = line.find(" = ");
    if (equals == std::string::npos) continue;
    const std::string key = line.substr(0, equals), value = line.substr(equals + 3);
    if (key == "version" || key == "version_info") {
      found.version = value.substr(0, value.find('.', value.find('.') + 1));
    } else if (key == "home") {
      found.prefix = fs::path(value).parent_path();
    }
  }
  return found;
}

// Throws where it is not here.
const HostFile& host_for(const Interpreter& interpreter, const std::string& environment) {
  if (interpreter.version.empty()) return any_host();
  const auto found = std::ranges::find(host_files(), interpreter.version, &HostFile::version);
  if (found != host_files().end()) return *found;
  if (const std::string how = how_to_get_python(interpreter.version); !how.empty()) {
    throw std::runtime_error(fmt::format("needs Python {}, of which its environment '{}' is and which is not here: {}",
                                         interpreter.version, environment, how));
  }
  throw std::runtime_error(fmt::format(
      "has the environment '{}' of Python {}, and assay has {}: make it again, as with `python{} -m venv --clear {}`",
      environment, interpreter.version, any_host().version, any_host().version, environment));
}

// ---- what was declared ----------------------------------------------------------------------------------------------

constexpr std::string_view kDeclarationForm = "1";

std::string module_of(const fs::path& host) { return host.parent_path() / "python" / "assay_adapter.py"; }

// Where a declaration that comes from these files is kept; "" for nowhere.
std::string declaration_file(const std::string& name, const fs::path& adapter) {
  const std::string cache = cache_dir();
  if (cache.empty() || host_files().empty()) return "";
  std::vector<std::string> files;
  std::error_code error;
  if (fs::is_directory(adapter, error)) {
    for (const auto& entry : fs::directory_iterator(adapter, error)) {
      if (entry.is_regular_file() && entry.path().filename() != "environment.txt") files.push_back(entry.path());
    }
    std::ranges::sort(files);
  } else {
    files.push_back(adapter);
  }
  std::string all =
      fmt::format("{} {} {} {}", kDeclarationForm, kPluginVersion, name, file_hash(module_of(any_host().path)));
  for (const std::string& file : files) all += fs::path(file).filename().string() + file_hash(file);
  return (fs::path(cache) / "declarations" / (content_hash(all) + ".json")).string();
}

// ---- answers of a process that ends ---------------------------------------------------------------------------------

// The versions that engines of this process need.
std::set<std::string>& interpreters() {
  static std::set<std::string> versions;
  return versions;
}

constexpr char kTold = 't', kFailedToTell = 'f';

std::string told_apart(const std::function<std::string()>& ask) {
  Pipe ends = make_pipe();
  const pid_t child = start_child([&] {
    ends.reading.close();
    std::string text;
    try {
      text = kTold + ask();
    } catch (const std::exception& error) {
      text = kFailedToTell + std::string(error.what());
    }
    return write_all(ends.writing.get(), text) ? 0 : 1;
  });
  ends.writing.close();
  const std::string text = read_to_end(ends.reading.get());
  const int status = wait_for(child);
  if (text.empty())
    throw EngineError(fmt::format("an adapter in Python ended the process that asked it: {}", end_text(status)));
  if (text.front() == kFailedToTell) throw EngineError(text.substr(1));
  return text.substr(1);
}

nlohmann::json limitations_json(const std::vector<Limitation>& limitations) {
  nlohmann::json all = nlohmann::json::array();
  for (const Limitation& each : limitations) {
    all.push_back({{"fidelity", fidelity_text(each.fidelity)}, {"element", each.element}, {"how", each.how}});
  }
  return all;
}

// ---- the engine -----------------------------------------------------------------------------------------------------

class DeclaredEngine : public Engine {
 public:
  DeclaredEngine(std::string name, std::string path, PythonDeclaration declaration, PythonFacts facts,
                 std::string interpreter)
      : name_(std::move(name)),
        path_(std::move(path)),
        interpreter_(std::move(interpreter)),
        declaration_(std::move(declaration)),
        facts_(std::move(facts)) {}

  const PythonFacts& facts() const { return facts_; }
  std::string name() const override { return name_; }
  BuildFacts build() const override { return declaration_.build; }
  std::vector<Setting> settings() const override { return declaration_.settings; }
  std::vector<Contender> contenders() const override { return declaration_.contenders; }

  Capabilities capabilities(const Settings& settings) const override {
    if (const Capabilities* declared = declaration_.capabilities_with(settings)) return *declared;
    if (!asks_apart()) return adapter().capabilities(settings);
    std::string& told = capabilities_[python_settings(settings)];
    if (told.empty())
      told = told_apart([&] {
        const Engine& asked = adapter();
        return loaded_host()->host.capabilities(asked, settings);
      });
    return python_capabilities(told);
  }

  // As declarations, it needs the standard library alone: of whatever interpreter is there.
  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    if (!asks_apart()) return adapter().check(model, settings);
    const std::string of_model = fmt::format("{} {} ", model_hash(model), settings.timestep);
    const std::string key = of_model + python_settings(settings);
    if (!checked_.contains(key)) {
      constexpr size_t kMost = 1000;
      if (checked_.size() > kMost) checked_.clear();
      // all contenders at once: the model is read once
      std::vector<Settings> asked = {settings};
      for (const auto& [values, capabilities] : declaration_.capabilities) {
        if (values == settings.values) continue;
        asked.push_back(settings);
        asked.back().values = values;
      }
      const nlohmann::json told = nlohmann::json::parse(told_apart([&] {
        nlohmann::json texts = nlohmann::json::array();
        for (const Settings& each : asked) texts.push_back(limitations_json(adapter().check(model, each)));
        return dump_json(texts);
      }));
      for (size_t i = 0; i < asked.size(); ++i) {
        checked_[of_model + python_settings(asked[i])] = python_limitations(told.at(i).dump());
      }
    }
    return checked_.at(key);
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    return adapter_that_simulates().create(model, state, settings);
  }

 protected:
  const Engine& adapter_that_simulates() const {
    const Engine& engine = adapter();
    const std::string& running = loaded_host()->version;
    if (running != interpreter_ && !is_python_process()) {
      throw UnsupportedError(
          fmt::format("engine '{}' needs Python {}, and this process has Python {} already: `assay simulate MODEL "
                      "--engine {}` gives it a "
                      "process of its own",
                      name_, interpreter_, running, declaration_.contenders.front().name));
    }
    return engine;
  }

 private:
  const Engine& adapter() const {
    if (adapter_ == nullptr) {
      try {
        adapter_.reset(host_of_process({interpreter_, facts_.host}).host.make(name_, path_, facts_.environment));
      } catch (const std::runtime_error& error) {
        throw EngineError(fmt::format("engine '{}' {}", name_, error.what()));
      }
    }
    return *adapter_;
  }

  // A process has one interpreter for good, and forks may want another: while nothing is simulated here, adapters
  // answer in processes that end.
  bool asks_apart() const {
    return adapter_ == nullptr && !loaded_host() && interpreters().size() > 1 && !is_python_process();
  }

  std::string name_, path_;
  std::string interpreter_;  // its version
  PythonDeclaration declaration_;
  PythonFacts facts_;
  mutable std::unique_ptr<const Engine> adapter_;  // made when the first model is checked or simulated
  // Answers of other processes, by model and settings.
  mutable std::map<std::string, std::vector<Limitation>> checked_;
  mutable std::map<std::string, std::string> capabilities_;
};

class DeclaredBatchEngine final : public DeclaredEngine, public BatchEngine {
 public:
  using DeclaredEngine::DeclaredEngine;

  std::unique_ptr<BatchSimulation> create_batch(const Model& model, std::span<const State> states,
                                                const Settings& settings, const std::string& device) const override {
    return batch_engine(&adapter_that_simulates())->create_batch(model, states, settings, device);
  }
};

}  // namespace

bool is_python_process() {
  static const bool is = [] {
    const auto asked = reinterpret_cast<int (*)()>(dlsym(RTLD_DEFAULT, "Py_IsInitialized"));
    return asked != nullptr && asked() != 0;
  }();
  return is;
}

std::string kept_declaration(const std::string& name, const std::string& path) {
  if (is_python_process()) return "";
  try {
    const std::string file = declaration_file(name, path);
    std::ifstream in(file);
    if (file.empty() || !in) return "";
    const nlohmann::json kept = nlohmann::json::parse(in);
    for (const auto& [each, hash] : kept.at("files").items()) {
      if (file_hash(each) != hash) return "";
    }
    std::string text = kept.at("declaration").get<std::string>();
    static_cast<void>(python_declaration(text));
    return text;
  } catch (const std::exception&) {  // not whole, or a file is gone: it is asked again
    return "";
  }
}

void keep_declaration(const std::string& name, const std::string& path, const std::string& declaration) {
  if (is_python_process()) return;
  try {
    const std::string file = declaration_file(name, path);
    if (file.empty()) return;
    nlohmann::json files = nlohmann::json::object();
    for (const std::string& each : python_declaration(declaration).files) files[each] = file_hash(each);
    fs::create_directories(fs::path(file).parent_path());
    write_file(file, dump_json(nlohmann::json{{"declaration", declaration}, {"files", files}}));
  } catch (const std::exception&) {  // it is asked again next time
  }
}

std::string declare_in_python(const std::string& name, const std::string& path) {
  return host_of_process(any_host()).host.declare(name, path);
}

std::unique_ptr<const Engine> python_engine(const std::string& name, const std::string& path,
                                            const std::string& declaration) {
  PythonDeclaration declared = python_declaration(declaration);
  const std::string environment = environment_of(declared, path);
  const Interpreter interpreter = interpreter_of(environment);
  const HostFile& host = is_python_process() ? any_host() : host_for(interpreter, environment);
  interpreters().insert(host.version);
  const PythonFacts facts = {environment, interpreter.prefix, host.path, module_of(host.path)};
  if (declared.batches) {
    return std::make_unique<DeclaredBatchEngine>(name, path, std::move(declared), facts, host.version);
  }
  return std::make_unique<DeclaredEngine>(name, path, std::move(declared), facts, host.version);
}

PythonFacts python_facts(const Engine& made) { return dynamic_cast<const DeclaredEngine&>(made).facts(); }

}  // namespace assay
