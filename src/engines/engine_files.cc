#include "engines/engine_files.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <string_view>
#include <utility>

#include <link.h>

#include "base/paths.h"
#include "base/text.h"
#include "isolate/sandbox.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLibraries = "ASSAY_ENGINE_LIBRARIES";

// Of the interpreters that virtual environments in `folder` are made from: pyvenv.cfg says "home = PREFIX/bin".
std::vector<std::string> python_prefixes(const fs::path& folder) {
  std::vector<std::string> prefixes;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::ifstream file(it->path() / "pyvenv.cfg");
    for (std::string line; std::getline(file, line);) {
      constexpr std::string_view kHome = "home = ";
      if (line.starts_with(kHome)) prefixes.push_back(fs::path(line.substr(kHome.size())).parent_path());
    }
  }
  return prefixes;
}

// The folders that adapters in other languages name in their environment.txt.
std::vector<std::string> environments(const std::vector<std::string>& plugins) {
  std::vector<std::string> folders;
  for (const std::string& folder : plugins) {
    std::error_code error;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
      std::ifstream file(it->path() / "environment.txt");
      for (std::string line; std::getline(file, line);) {
        if (line.starts_with('/')) folders.push_back(line);
      }
    }
  }
  return folders;
}

}  // namespace

std::vector<std::string> plugin_folders() {
  std::vector<std::string> folders = folders_in("ASSAY_ENGINE_PATH");
  const fs::path program = fs::path(program_path()).parent_path();
  folders.push_back((program / "../engines").lexically_normal());
  folders.push_back((program / "../lib/assay/engines").lexically_normal());
  return folders;
}

void remember_libraries(const std::vector<std::string>& more) {
  std::set<std::string> folders(more.begin(), more.end());
  ::dl_iterate_phdr(
      [](dl_phdr_info* info, size_t /*size*/, void* into) {
        const std::string name = info->dlpi_name == nullptr ? "" : info->dlpi_name;
        if (name.starts_with('/')) static_cast<std::set<std::string>*>(into)->insert(fs::path(name).parent_path());
        return 0;
      },
      &folders);
  ::setenv(kLibraries, join({folders.begin(), folders.end()}, ":").c_str(), 1);
}

std::vector<std::string> engine_files() {
  std::vector<std::string> files = plugin_folders();
  for (const std::vector<std::string>& more : {environments(files), folders_in(kLibraries), program_folders()}) {
    files.insert(files.end(), more.begin(), more.end());
  }
  files.push_back(program_path());
  const fs::path program = fs::path(program_path()).parent_path(), cache = cache_dir();
  for (const char* folder : {"../lib/assay", "../releases"}) files.push_back((program / folder).lexically_normal());
  for (const char* folder : {"engines", "libraries", "python", "declarations"}) files.push_back(cache / folder);
  for (std::string& prefix : python_prefixes(cache / "python")) files.push_back(std::move(prefix));
  // the interpreter that the Python package was installed in
  for (const char* variable : {"ASSAY_PYTHON_HOME", "ASSAY_PYTHON_LIBRARY"}) {
    for (std::string& file : folders_in(variable)) files.push_back(std::move(file));
  }
  return files;
}

std::vector<std::string> engine_caches() {
  // of the cache that the environments are in, which need not be the user's own
  std::set<std::string> found;
  for (const std::string& environment : environments(plugin_folders())) {
    const fs::path python = fs::path(environment).parent_path(), kernels = python.parent_path() / "kernels";
    std::error_code error;
    if (python.filename() == "python" && (fs::create_directories(kernels, error) || !error)) found.insert(kernels);
  }
  return {found.begin(), found.end()};
}

std::vector<std::string> model_caches() {
  std::vector<std::string> caches = engine_caches();
  std::error_code error;
  const fs::path cache = cache_dir(), hulls = cache / "hulls";
  if (!cache.empty() && fs::is_directory(cache / "libraries", error) && fs::create_directories(hulls, error))
    error = {};
  if (fs::is_directory(hulls, error)) caches.push_back(hulls);
  return caches;
}

}  // namespace assay
