#include "engines/releases.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include <fmt/format.h>

#include "base/paths.h"
#include "base/text.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

constexpr std::array kFiles = {
    std::pair{"", ""},
#include "releases.inc"
};

// What the plugins of this program's releases are made from; empty where the build has none.
std::string adapter_key(const std::string& engine) {
  const fs::path program = fs::path(program_path()).parent_path();
  std::ifstream file((program / "../releases" / (engine + ".key")).lexically_normal());
  std::string key;
  file >> key;
  return key;
}

}  // namespace

bool is_release(std::string_view build) {
  return !build.empty() && std::isdigit(static_cast<unsigned char>(build.front())) != 0;
}

std::vector<std::string> releases_of(const std::string& engine) {
  std::vector<std::string> releases;
  for (const auto& [name, text] : kFiles) {
    if (name != engine) continue;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      if (is_release(line)) releases.push_back(line.substr(0, line.find(' ')));
    }
  }
  return releases;
}

std::vector<std::string> releases_ready(const std::string& engine) {
  std::vector<std::string> releases = releases_of(engine);
  std::erase_if(releases, [&](const std::string& release) { return release_plugin(engine, release).empty(); });
  return releases;
}

std::string changelog_of(const std::string& engine, const std::string& release) {
  constexpr std::string_view kKey = "# changelog: ", kPlace = "RELEASE";
  for (const auto& [name, text] : kFiles) {
    if (name != engine) continue;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      if (!line.starts_with(kKey)) continue;
      std::string address = line.substr(kKey.size());
      if (const size_t at = address.find(kPlace); at != std::string::npos) address.replace(at, kPlace.size(), release);
      return address;
    }
  }
  return "";
}

std::string release_plugin(const std::string& engine, const std::string& release) {
  const std::string key = adapter_key(engine), cache = cache_dir();
  if (key.empty() || cache.empty()) return "";
  const std::string name = fmt::format("{}@{}", engine, release);
  const fs::path folder = fs::path(cache) / "engines" / fmt::format("{}-{}", name, key);
  std::error_code error;
  for (const char* ending : {".so", ""}) {  // compiled, or an adapter in Python
    const fs::path plugin = folder / fmt::format("assay-engine-{}{}", name, ending);
    if (fs::exists(plugin, error)) return plugin.string();
  }
  return "";
}

}  // namespace assay
