#include "model/package_paths.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string_view>

#include "base/paths.h"
#include "base/regular_file.h"
#include "model/outside_files.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

// The name that a package.xml gives.
std::string package_name(const fs::path& manifest) {
  constexpr std::uintmax_t kRead = 64 << 10;  // the name stands at the beginning
  const RegularFile file(manifest);
  std::string text;
  if (!file.other().empty() || file.error() != 0 || file.read(text, kRead) != 0) return "";
  constexpr std::string_view kOpen = "<name>";
  const size_t begins = text.find(kOpen);
  const size_t ends = begins == std::string::npos ? begins : text.find("</name>", begins);
  if (ends == std::string::npos) return "";
  std::istringstream words(text.substr(begins + kOpen.size(), ends - begins - kOpen.size()));
  std::string name;
  words >> name;
  return name;
}

// Whether what the URI names may be read: package://.ssh/id_rsa is no file of a package.
enum class Trust {
  kNone,
  kBelow,  // what lies below the folder, links followed
  kNamed,  // the user has named the folder: also what links in it point to, as in a workspace
};

struct PackageFolder {
  fs::path path;
  Trust trust = Trust::kNone;
};

// Folders that may be the package `name`, nearest first.
std::vector<PackageFolder> package_folders(const std::string& name, const fs::path& model_folder,
                                           const std::map<std::string, std::string>& packages) {
  std::vector<PackageFolder> folders;
  if (const auto given = packages.find(name); given != packages.end())
    folders.push_back({given->second, Trust::kNamed});
  for (fs::path folder = model_folder;; folder = folder.parent_path()) {
    const bool declared = package_name(folder / "package.xml") == name;
    if (folder.filename() == name || declared) {
      folders.push_back({folder, declared || !is_personal(folder) ? Trust::kBelow : Trust::kNone});
    }
    folders.push_back({folder / name, is_file(folder / name / "package.xml") ? Trust::kBelow : Trust::kNone});
    if (folder == folder.parent_path()) break;
  }
  for (const std::string& folder : folders_in("ROS_PACKAGE_PATH")) {
    if (fs::path(folder).filename() == name) folders.push_back({folder, Trust::kNamed});
    folders.push_back({fs::path(folder) / name, Trust::kNamed});
  }
  for (const std::string& folder : folders_in("AMENT_PREFIX_PATH"))
    folders.push_back({fs::path(folder) / "share" / name, Trust::kNamed});
  return folders;
}

std::optional<std::string> without(std::string_view prefix, const std::string& uri) {
  if (!uri.starts_with(prefix)) return std::nullopt;
  return uri.substr(prefix.size());
}

}  // namespace

FoundFile find_resource(const std::string& uri, const std::string& from,
                        const std::map<std::string, std::string>& packages) {
  std::error_code error;
  fs::path model_folder =
      fs::canonical(fs::path(from).parent_path().empty() ? "." : fs::path(from).parent_path(), error);
  if (error) model_folder = fs::absolute(fs::path(from)).parent_path();
  struct Candidate {
    fs::path path, package;
    Trust trust = Trust::kNone;
  };
  std::vector<Candidate> candidates;
  std::optional<std::string> inside = without("package://", uri);
  if (!inside) inside = without("model://", uri);
  if (inside) {
    const size_t slash = inside->find('/');
    const std::string name = inside->substr(0, slash);
    const std::string rest = slash == std::string::npos ? "" : inside->substr(slash + 1);
    for (const PackageFolder& folder : package_folders(name, model_folder, packages)) {
      if (fs::is_directory(folder.path, error)) candidates.push_back({folder.path / rest, folder.path, folder.trust});
    }
    if (candidates.empty()) {
      return {"",
              false,
              {"no folder of the package '" + name +
               "' upward from the file, in ROS_PACKAGE_PATH or "
               "AMENT_PREFIX_PATH"}};
    }
  } else {
    const fs::path path = without("file://", uri).value_or(uri);
    candidates.push_back({path.is_absolute() ? path : model_folder / path, {}});
  }
  FoundFile found;
  for (const auto& [candidate, package, trust] : candidates) {
    if (is_file(candidate)) {
      // "package://NAME/../x" is in no package
      const bool in_package = (trust == Trust::kNamed && inside.value_or("..").find("..") == std::string::npos) ||
                              (trust == Trust::kBelow && is_below(candidate.string(), package.string()));
      return {candidate.lexically_normal().string(), in_package, {}};
    }
    found.looked.push_back(candidate.lexically_normal().string());
  }
  return found;
}

}  // namespace assay
