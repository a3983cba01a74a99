#include "base/paths.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <system_error>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

// The name of one kind of file and the folder of those that assay brings.
struct Kind {
  const char* noun;
  const char* known;  // what its names stand for
  const char* folder;
  const char* ending;
};
constexpr Kind kModel{"model", "system", "models", ".xml"};
constexpr Kind kCampaign{"campaign", "campaign", "campaigns", ".toml"};

// A family of systems without files.
constexpr std::string_view kCapsules = "capsules-";
constexpr int kMostCapsules = 10000, kMostCapsulesParts = 1000;

std::vector<std::string> names_of(const Kind& kind) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(fs::path(assay_data_dir()) / kind.folder, error)) {
    // paper_claims.toml (src/claims) lies in the same folder and is no campaign.
    if (entry.path().stem().string().ends_with("_claims")) continue;
    if (entry.path().extension() == kind.ending && entry.is_regular_file(error)) names.push_back(entry.path().stem());
  }
  std::ranges::sort(names);
  return names;
}

// Of a process that is another program.
std::string& given_program() {
  static std::string path;
  return path;
}

std::string find(const Kind& kind, const std::string& given) {
  if (given.empty())
    throw InputError(fmt::format("the {} is empty: give a file or a {}'s name", kind.noun, kind.known));
  const bool is_name = given.find('/') == std::string::npos && !fs::path(given).has_extension();
  const std::vector<std::string> names = is_name ? names_of(kind) : std::vector<std::string>{};
  if (std::ranges::find(names, given) != names.end()) {
    return fs::path(assay_data_dir()) / kind.folder / (given + kind.ending);
  }
  std::error_code error;
  const fs::file_status status = fs::status(given, error);
  if (fs::is_directory(status)) {
    throw InputError(fmt::format("{} '{}' is a directory: give a file in it", kind.noun, given));
  }
  if (fs::exists(status)) return given;
  if (is_name && &kind == &kModel && given.starts_with(kCapsules)) {
    throw InputError(
        fmt::format("there is no system '{}': give {}N with N from 1 to {}", given, kCapsules, kMostCapsules));
  }
  if (is_name) {
    throw InputError(
        fmt::format("there is no {} and no file named '{}'{}", kind.known, given, did_you_mean(given, names)));
  }
  if (error && error != std::errc::no_such_file_or_directory) {
    throw InputError(fmt::format("{} '{}' cannot be opened: {}", kind.noun, given, error.message()));
  }
  throw InputError(
      fmt::format("{} '{}' does not exist: check the path or give a {}'s name", kind.noun, given, kind.known));
}

}  // namespace

void set_program_path(const std::string& path) { given_program() = path; }

std::string program_path() {
  if (!given_program().empty()) return given_program();
  std::error_code error;
  const fs::path path = fs::read_symlink("/proc/self/exe", error);
  if (error) throw SystemError(fmt::format("/proc/self/exe cannot be read ({}): mount /proc", error.message()));
  return path;
}

std::string assay_data_dir() {
  std::error_code error;
  if (const char* given = std::getenv("ASSAY_DATA"); given != nullptr && *given != '\0') {
    if (fs::is_directory(fs::path(given) / kModel.folder, error)) return given;
    throw InputError(
        fmt::format("ASSAY_DATA is '{}', which has no folder '{}': unset it or correct it", given, kModel.folder));
  }
  const fs::path installed = (fs::path(program_path()).parent_path() / "../share/assay").lexically_normal();
  for (const fs::path& folder : {installed, fs::path(ASSAY_SOURCE_DIR)}) {
    if (fs::is_directory(folder / kModel.folder, error)) return folder;
  }
  throw InputError(
      fmt::format("assay's models are neither in '{}' nor in '{}': set ASSAY_DATA to the folder that holds '{}'",
                  installed.string(), ASSAY_SOURCE_DIR, kModel.folder));
}

std::optional<CapsulesName> capsules_named(std::string_view name) {
  // "7" of "7-seed-2", and takes it away
  const auto number = [&](int most) -> std::optional<int> {
    const std::string_view digits = name.substr(0, name.find('-'));
    const std::optional<long long> value = parse_integer(std::string(digits));
    if (!value || *value < 1 || *value > most || std::to_string(*value) != digits) return std::nullopt;
    name.remove_prefix(digits.size());
    return static_cast<int>(*value);
  };
  const auto take = [&](std::string_view word) {
    if (!name.starts_with(word)) return false;
    name.remove_prefix(word.size());
    return true;
  };
  if (!take(kCapsules)) return std::nullopt;
  const std::optional<int> count = number(kMostCapsules);
  if (!count) return std::nullopt;
  CapsulesName found{*count};
  for (const auto& [word, value] : {std::pair("-layers-", &found.layers), std::pair("-seed-", &found.seed)}) {
    if (!take(word)) continue;
    const std::optional<int> given = number(kMostCapsulesParts);
    if (!given) return std::nullopt;
    *value = *given;
  }
  return name.empty() ? std::optional(found) : std::nullopt;
}

std::vector<std::string> system_names() { return names_of(kModel); }
std::vector<std::string> campaign_names() { return names_of(kCampaign); }
std::vector<std::string> folders_in(const char* variable) {
  std::vector<std::string> folders;
  const char* value = std::getenv(variable);
  std::istringstream stream(value == nullptr ? "" : value);
  for (std::string folder; std::getline(stream, folder, ':');) {
    if (!folder.empty()) folders.push_back(folder);
  }
  return folders;
}

std::string cache_dir() {
  const auto folder_in = [](const char* variable, const char* below) -> std::optional<std::string> {
    const char* value = std::getenv(variable);
    if (value == nullptr || *value == '\0') return std::nullopt;
    return (fs::path(value) / below).lexically_normal().string();
  };
  if (auto folder = folder_in("ASSAY_CACHE", "")) return *folder;
  if (auto folder = folder_in("XDG_CACHE_HOME", "assay")) return *folder;
  return folder_in("HOME", ".cache/assay").value_or("");
}

std::string find_model(const std::string& model) {
  std::error_code error;
  if (constexpr std::string_view kRobots = "robots:"; model.starts_with(kRobots)) {
    const fs::path file = fs::path(cache_dir()) / "robots" / model.substr(kRobots.size());
    if (fs::is_regular_file(file, error)) return file.lexically_normal();
    throw InputError(
        fmt::format("model '{}' is not there: '{}' does not exist; fetch the robots with ./assay robots, or "
                    "correct the name",
                    model, file.string()));
  }
  if (capsules_named(model) && !fs::exists(model, error)) {
    return fs::path(assay_data_dir()) / kModel.folder / (model + kModel.ending);
  }
  return find(kModel, model);
}
std::string find_campaign(const std::string& campaign) { return find(kCampaign, campaign); }

}  // namespace assay
