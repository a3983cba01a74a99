#include "load/package_paths.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string_view>

#include <fmt/format.h>

#include "base/paths.h"
#include "base/regular_file.h"
#include "load/outside_files.h"

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
  for (const char* variable : {"GZ_SIM_RESOURCE_PATH", "GAZEBO_MODEL_PATH"}) {
    for (const std::string& folder : folders_in(variable)) folders.push_back({fs::path(folder) / name, Trust::kNamed});
  }
  for (const std::string& folder : folders_in("AMENT_PREFIX_PATH"))
    folders.push_back({fs::path(folder) / "share" / name, Trust::kNamed});
  return folders;
}

std::string lower_case(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// The only file that `rest` names below `folder` if upper and lower case are alike; empty where there is none.
fs::path in_any_case(const fs::path& folder, const fs::path& rest) {
  fs::path path = folder;
  std::error_code error;
  for (const fs::path& part : rest) {
    if (part == ".." || part == "." || fs::exists(path / part, error)) {
      path /= part;
      continue;
    }
    const std::string wanted = lower_case(part.string());
    std::optional<fs::path> found;
    for (fs::directory_iterator it(path, error), end; !error && it != end; it.increment(error)) {
      if (lower_case(it->path().filename().string()) != wanted) continue;
      if (found) return {};
      found = it->path();
    }
    if (!found) return {};
    path = *found;
  }
  return is_file(path) ? path : fs::path();
}

std::optional<std::string> without(std::string_view prefix, const std::string& uri) {
  if (!uri.starts_with(prefix)) return std::nullopt;
  return uri.substr(prefix.size());
}

}  // namespace

FoundFile find_resource(const std::string& as_written, const std::string& from,
                        const std::map<std::string, std::string>& packages, const MeshFolder& as_mujoco) {
  std::error_code error;
  std::string uri = as_written;
  std::ranges::replace(uri, '\\', '/');
  fs::path model_folder =
      fs::canonical(fs::path(from).parent_path().empty() ? "." : fs::path(from).parent_path(), error);
  if (error) model_folder = fs::absolute(fs::path(from)).parent_path();
  struct Candidate {
    fs::path path;
    fs::path folder, rest;  // the same in two parts, where it is not absolute
    fs::path package;
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
      if (fs::is_directory(folder.path, error))
        candidates.push_back({folder.path / rest, folder.path, rest, folder.path, folder.trust});
    }
  } else {
    const fs::path path = without("file://", uri).value_or(uri);
    if (path.is_absolute()) {
      candidates.push_back({path, {}, {}, {}});
    } else {
      candidates.push_back({model_folder / path, model_folder, path, {}});
    }
  }
  FoundFile found;
  const auto take = [&](const fs::path& file, const Candidate& from_here, const std::string& taken_for) {
    // "package://NAME/../x" is in no package
    const bool in_package =
        (from_here.trust == Trust::kNamed && inside.value_or("..").find("..") == std::string::npos) ||
        (from_here.trust == Trust::kBelow && is_below(file.string(), from_here.package.string()));
    return FoundFile{file.lexically_normal().string(), in_package, {}, taken_for};
  };
  for (const Candidate& candidate : candidates) {
    if (is_file(candidate.path)) return take(candidate.path, candidate, "");
    found.looked.push_back(candidate.path.lexically_normal().string());
  }
  for (const Candidate& candidate : candidates) {
    if (candidate.rest.empty()) continue;
    const fs::path file = in_any_case(candidate.folder, candidate.rest);
    if (!file.empty()) return take(file, candidate, "whose name differs in upper and lower case");
  }
  // MuJoCo strips the folders, and what precedes them
  const fs::path name = as_mujoco.strip_path ? fs::path(uri).filename() : fs::path(inside.value_or(uri));
  const fs::path folder = model_folder / fs::path(as_mujoco.folder);
  if (!name.empty() && !name.is_absolute()) {
    if (is_file(folder / name)) return take(folder / name, {}, "where MuJoCo looks for it");
    const std::string looked = (folder / name).lexically_normal().string();
    if (std::ranges::find(found.looked, looked) == found.looked.end()) found.looked.push_back(looked);
  }
  if (candidates.empty()) {
    found.looked.insert(found.looked.begin(),
                        fmt::format("no folder of the package '{}' upward from the file, in ROS_PACKAGE_PATH or "
                                    "AMENT_PREFIX_PATH",
                                    inside->substr(0, inside->find('/'))));
  }
  return found;
}

}  // namespace assay
