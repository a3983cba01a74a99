#include "model/outside_files.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <tinyxml2.h>

#include "base/input_file.h"
#include "base/paths.h"
#include "base/text.h"

namespace assay {
namespace {

namespace fs = std::filesystem;
namespace xml = tinyxml2;

constexpr int kMostDepth = 64;        // of includes and models in models
constexpr double kMostCount = 1e6;    // of keyframes, user data
constexpr double kMostHeights = 1e8;  // of a height field

// What a package's folder of models is called, beside folders of meshes and textures.
constexpr std::array<std::string_view, 6> kPartsOfPackages = {"urdf", "xacro", "mjcf", "sdf", "robots", "robot"};
// What lies at the top of what people pack and publish; how far above a model it is looked for.
constexpr std::array<std::string_view, 5> kMarkers = {".git", "model.config", "pyproject.toml", "setup.py",
                                                      "CMakeLists.txt"};
constexpr std::array<std::string_view, 4> kMarkerStems = {"license", "readme", "copying", "citation"};
constexpr int kMostLevels = 3;

bool has_marker(const fs::path& folder) {
  std::error_code error;
  for (const std::string_view name : kMarkers) {
    if (fs::exists(folder / name, error)) return true;
  }
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::string stem = it->path().stem().string();
    std::ranges::transform(stem, stem.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (std::ranges::find(kMarkerStems, stem) != kMarkerStems.end()) return true;
  }
  return false;
}

// Whether Python packages lie unpacked in the folder.
bool holds_python_packages(const fs::path& folder) {
  if (folder.filename() == "site-packages" || folder.filename() == "dist-packages") return true;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (it->path().extension() == ".dist-info") return true;
  }
  return false;
}

std::string attribute(const xml::XMLElement& element, const char* name) {
  const char* value = element.Attribute(name);
  return value == nullptr ? "" : value;
}

// One document with what it includes.
class Examination {
 public:
  Examination(const LoadOptions& options, std::vector<Problem>& problems) : options_(options), problems_(problems) {}

  void document(const std::string& text, const std::string& path, int depth) {
    const fs::path folder = path.empty() ? fs::current_path() : fs::absolute(path).parent_path();
    const Places places = {folder, path.empty() ? folder.string() : model_root(path), {""}};
    std::set<std::string> within;
    if (!path.empty()) within.insert(canonical(path));
    part(text, places, within, depth);
  }

 private:
  struct Places {
    fs::path folder;                   // relative names count from it
    std::string root;                  // files have to lie below it
    std::vector<std::string> folders;  // of assets, as the document names them
  };

  static std::string canonical(const fs::path& path) {
    std::error_code error;
    return fs::weakly_canonical(path, error).string();
  }

  // Folders that a document's compiler elements name.
  static std::vector<std::string> folders_of(const xml::XMLElement& root) {
    std::vector<std::string> folders;
    for (const xml::XMLElement* e = root.FirstChildElement("compiler"); e != nullptr;
         e = e->NextSiblingElement("compiler")) {
      for (const char* name : {"assetdir", "meshdir", "texturedir"}) {
        if (std::string folder = attribute(*e, name); !folder.empty()) folders.push_back(std::move(folder));
      }
    }
    return folders;
  }

  // A document that cannot be parsed has nothing to examine: MuJoCo says why.
  void part(const std::string& text, const Places& places, const std::set<std::string>& within, int depth) {
    xml::XMLDocument document;
    if (document.Parse(text.data(), text.size()) != xml::XML_SUCCESS || document.RootElement() == nullptr) return;
    Places own = places;
    for (std::string& folder : folders_of(*document.RootElement())) own.folders.push_back(std::move(folder));
    walk(*document.RootElement(), own, within, depth);
  }

  void walk(const xml::XMLElement& element, const Places& places, const std::set<std::string>& within, int depth) {
    const std::string_view kind = element.Name();
    for (const xml::XMLAttribute* a = element.FirstAttribute(); a != nullptr; a = a->Next()) {
      const std::string_view name = a->Name(), value = a->Value();
      if ((name == "class" || name == "childclass") && value.find('%') != std::string_view::npos) {
        refuse(element, fmt::format("has the class '{}', whose '%' MuJoCo takes for a format", value),
               "rename the class");
      }
      if (name == "nkey" || name.starts_with("nuser_")) bound(element, a->Name(), a->Value(), kMostCount);
    }
    if (kind == "hfield") heights(element);
    if (kind == "include") {
      include(element, places, within, depth);
    } else {
      assets(element, places, within, depth);
    }
    for (const xml::XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      walk(*e, places, within, depth);
    }
  }

  void include(const xml::XMLElement& element, const Places& places, const std::set<std::string>& within, int depth) {
    const std::string name = attribute(element, "file");
    const fs::path file = places.folder / name;
    if (name.empty() || !may_be_read(element, name, file, places)) return;
    const std::string key = canonical(file);
    if (within.contains(key) || depth >= kMostDepth) {
      refuse(element, fmt::format("includes '{}', which contains itself", name), "include a file once");
      return;
    }
    std::set<std::string> deeper = within;
    deeper.insert(key);
    part(read(file), places, deeper, depth + 1);
  }

  // Attributes that name files. MuJoCo looks in one of the asset folders, by the kind of asset: all of them are
  // examined.
  void assets(const xml::XMLElement& element, const Places& places, const std::set<std::string>& within, int depth) {
    for (const xml::XMLAttribute* a = element.FirstAttribute(); a != nullptr; a = a->Next()) {
      if (!std::string_view(a->Name()).starts_with("file") || *a->Value() == '\0') continue;
      for (const std::string& folder : places.folders) {
        const fs::path file = places.folder / folder / a->Value();
        std::error_code error;
        if (!fs::exists(file, error) || !may_be_read(element, a->Value(), file, places)) continue;
        if (std::string_view(element.Name()) != "model") continue;
        const std::string key = canonical(file);
        if (within.contains(key) || depth >= kMostDepth) {
          refuse(element, fmt::format("is the model '{}', which contains itself", a->Value()), "remove it");
          return;
        }
        std::set<std::string> deeper = within;
        deeper.insert(key);
        const Places its = {file.parent_path(), places.root, {""}};
        part(read(file), its, deeper, depth + 1);
      }
    }
  }

  bool may_be_read(const xml::XMLElement& element, const std::string& name, const fs::path& file,
                   const Places& places) {
    std::error_code error;
    const fs::file_status status = fs::status(file, error);
    if (!fs::exists(status) || fs::is_directory(status)) return false;  // MuJoCo says so
    if (!options_.allow_external_files && !is_below(file.string(), places.root)) {
      refuse(element,
             fmt::format("names the file '{}', which lies outside the model's folder '{}'",
                         file.lexically_normal().string(), places.root),
             "copy it there", "--allow-external-files if you trust the model");
      return false;
    }
    if (!fs::is_regular_file(status)) {
      refuse(element, fmt::format("names '{}', which is not a regular file", name), "name a file");
      return false;
    }
    if (fs::file_size(file, error) > kMostModelFileBytes) {
      refuse(element, fmt::format("names the file '{}' of more than {} MiB", name, kMostModelFileBytes >> 20),
             "simplify it");
      return false;
    }
    return true;
  }

  static std::string read(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }

  void bound(const xml::XMLElement& element, const char* name, const char* value, double most) {
    const auto number = parse_number(value);
    if (number && *number > most) {
      refuse(element, fmt::format("has {}=\"{}\"", name, value), fmt::format("give at most {:.0f}", most));
    }
  }

  void heights(const xml::XMLElement& element) {
    const auto rows = parse_number(attribute(element, "nrow")), columns = parse_number(attribute(element, "ncol"));
    if (rows && columns && *rows * *columns > kMostHeights) {
      refuse(element, fmt::format("has {} x {} heights", shortest(*rows), shortest(*columns)),
             fmt::format("give at most {:.0e}", kMostHeights));
    }
  }

  void refuse(const xml::XMLElement& element, const std::string& what, const std::string& mend,
              const std::string& option = "") {
    const std::string name = attribute(element, "name");
    Problem problem;
    problem.element = name.empty() ? fmt::format("a {}", element.Name()) : fmt::format("{} '{}'", element.Name(), name);
    problem.line = element.GetLineNum();
    problem.message = what;
    problem.mend = mend;
    problem.option = option;
    problems_.push_back(std::move(problem));
  }

  const LoadOptions& options_;
  std::vector<Problem>& problems_;
};

}  // namespace

std::string model_root(const std::string& path) {
  std::error_code error;
  const fs::path folder = fs::weakly_canonical(fs::absolute(path).parent_path(), error);
  const fs::path robots = fs::weakly_canonical(fs::path(cache_dir()) / "robots", error);
  const fs::path inside = folder.lexically_relative(robots);
  // a folder of urdf/, meshes/ and the like is one thing
  const bool is_part = std::ranges::find(kPartsOfPackages, folder.filename().string()) != kPartsOfPackages.end();
  const fs::path begin = is_part && !is_personal(folder.parent_path()) ? folder.parent_path() : folder;
  for (fs::path above = begin; !is_personal(above); above = above.parent_path()) {
    if (fs::is_regular_file(above / "package.xml", error)) return above;
  }
  if (!cache_dir().empty() && !inside.empty() && *inside.begin() != ".." && *inside.begin() != ".") {
    return robots / *inside.begin();
  }
  for (fs::path above = begin; !is_personal(above); above = above.parent_path()) {
    if (holds_python_packages(above.parent_path())) return above;
  }
  int levels = 0;
  for (fs::path above = begin; !is_personal(above) && levels <= kMostLevels; above = above.parent_path(), ++levels) {
    if (has_marker(above)) return above;
  }
  return begin;
}

bool is_personal(const fs::path& folder) {
  if (!folder.has_relative_path()) return true;
  std::error_code error;
  const char* home = std::getenv("HOME");
  for (const fs::path& holder : {fs::path(home == nullptr ? "" : home), fs::temp_directory_path(error)}) {
    const fs::path below = fs::weakly_canonical(holder, error).lexically_relative(folder);
    if (!holder.empty() && !below.empty() && *below.begin() != "..") return true;
  }
  return false;
}

bool is_below(const std::string& file, const std::string& root) {
  std::error_code error;
  const fs::path inside =
      fs::weakly_canonical(fs::absolute(file), error).lexically_relative(fs::weakly_canonical(root, error));
  return !inside.empty() && *inside.begin() != "..";
}

std::vector<Problem> document_refusals(const std::string& text, const std::string& path, const LoadOptions& options) {
  std::vector<Problem> problems;
  Examination(options, problems).document(text, path, 0);
  return problems;
}

}  // namespace assay
