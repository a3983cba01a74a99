#include "engines/about.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/toml_file.h"

namespace assay {
namespace {

struct File {
  const char *folder, *text;
};
constexpr std::array kFiles = {
#include "about.inc"
};

// The last five are read by set-up, CMake and what makes the Python package.
constexpr std::array<std::string_view, 8> kKeys = {"order",   "look",  "joint_look", "set_up",
                                                   "minutes", "wheel", "license",    "python"};

std::optional<FamilyLook> look_of(const toml::table& table, std::string_view key) {
  const toml::table* look = table[key].as_table();
  if (look == nullptr) return std::nullopt;
  return FamilyLook{(*look)["hue"].value<size_t>().value(), (*look)["mark"].value<std::string>().value()};
}

EngineAbout about(const File& file) {
  const std::string source = fmt::format("src/engines/{}/about.toml", file.folder);
  const toml::table table = toml_table(file.text, source);
  for (const auto& [key, value] : table) {
    if (std::ranges::find(kKeys, key.str()) == kKeys.end()) {
      throw InputError(fmt::format("{}:{}: unknown key '{}'", source, key.source().begin.line, key.str()));
    }
  }
  return {file.folder, table["order"].value<int>(), look_of(table, "look"), look_of(table, "joint_look")};
}

}  // namespace

const std::vector<EngineAbout>& engines_about() {
  static const std::vector<EngineAbout> all = [] {
    std::vector<EngineAbout> read;
    read.reserve(kFiles.size());
    for (const File& file : kFiles) read.push_back(about(file));
    return read;
  }();
  return all;
}

const EngineAbout* about_engine(std::string_view folder) {
  const auto found = std::ranges::find(engines_about(), folder, &EngineAbout::folder);
  return found == engines_about().end() ? nullptr : &*found;
}

}  // namespace assay
