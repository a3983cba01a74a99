#include "check/dataset/files.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include "base/errors.h"
#include "load/outside_files.h"

namespace assay::dataset {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 4> kModels = {".urdf", ".xml", ".mjcf", ".sdf"};
constexpr std::array<std::string_view, 4> kOthers = {".xacro", ".usd", ".usda", ".usdc"};

template <typename Endings>
bool is_among(const Endings& endings, const std::string& ending) {
  return std::ranges::find(endings, ending) != endings.end();
}

class Walk {
 public:
  explicit Walk(const std::string& folder) : top_(folder) {}

  Listing listing() {
    std::error_code error;
    list("", error);
    if (error) {
      throw InputError(fmt::format("the folder '{}' cannot be read ({}): change its permissions or give another one",
                                   top_.string(), error.message()));
    }
    while (!waiting_.empty()) {
      const std::string folder = waiting_.back();
      waiting_.pop_back();
      list(folder, error);
      if (error) found_.unreadable.push_back(folder);
    }
    add_linked();
    std::ranges::sort(found_.files);
    std::ranges::sort(found_.unreadable);
    return std::move(found_);
  }

 private:
  // `folder` below the top; empty for the top itself.
  void list(const std::string& folder, std::error_code& error) {
    error.clear();
    fs::directory_iterator entry(folder.empty() ? top_ : top_ / folder, error);
    for (const fs::directory_iterator end; !error && entry != end; entry.increment(error)) {
      const std::string name = entry->path().filename().string();
      if (name.starts_with('.')) continue;
      const std::string path = folder.empty() ? name : fmt::format("{}/{}", folder, name);
      std::error_code unknown;
      const fs::file_status status = entry->symlink_status(unknown);
      if (fs::is_symlink(status)) {
        link(path);
      } else if (fs::is_directory(status)) {
        waiting_.push_back(path);
      } else if (fs::is_regular_file(status)) {
        file(path);
      }
    }
  }

  void file(const std::string& path) {
    const std::string ending = ending_of(path);
    if (is_among(kModels, ending)) found_.files.push_back(path);
    if (is_among(kOthers, ending)) ++found_.others[ending];
  }

  void link(const std::string& path) {
    std::error_code error;
    const fs::path target = fs::canonical(top_ / path, error);
    if (error || !is_below(target.string(), top_.string())) {
      ++found_.links_out;
    } else if (fs::is_regular_file(target, error) && is_among(kModels, ending_of(path))) {
      links_.push_back(path);
    }
  }

  // Links to files that were not found themselves, as their names have no ending or are hidden.
  void add_linked() {
    if (links_.empty()) return;
    std::ranges::sort(links_);
    std::set<std::string> there;
    std::error_code error;
    for (const std::string& path : found_.files) there.insert(fs::canonical(top_ / path, error).string());
    for (const std::string& path : links_) {
      if (there.insert(fs::canonical(top_ / path, error).string()).second) found_.files.push_back(path);
    }
  }

  fs::path top_;
  Listing found_;
  std::vector<std::string> waiting_;  // folders
  std::vector<std::string> links_;
};

}  // namespace

std::string ending_of(const std::string& file) {
  std::string ending = fs::path(file).extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

Listing list_files(const std::string& folder) { return Walk(folder).listing(); }

std::map<std::string, std::string> included_parts(const std::map<std::string, std::set<std::string>>& includes) {
  std::map<std::string, std::string> parts;
  for (const auto& [file, others] : includes) {
    for (const std::string& other : others) {
      const auto back = includes.find(other);
      const bool each_other = back != includes.end() && back->second.contains(file);
      if (other != file && !each_other) parts.emplace(other, file);
    }
  }
  return parts;
}

}  // namespace assay::dataset
