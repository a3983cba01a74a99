#include "load/outside_files.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <strings.h>
#include <tinyxml2.h>

#include "base/input_file.h"
#include "base/paths.h"
#include "base/text.h"
#include "load/parser_faults.h"

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

// As MuJoCo compares the names of elements that it looks for before it knows its schema.
bool is_called(const xml::XMLElement& element, const char* name) { return ::strcasecmp(element.Name(), name) == 0; }

// ---- names of files as MuJoCo takes them (its FilePath) --------------------------------------------------------------

bool is_separator(char c) { return c == '/' || c == '\\'; }

// What makes a path absolute for MuJoCo; "C:/" does, though the system counts it from the current folder.
std::string absolute_prefix(const std::string& path) {
  if (path.empty()) return "";
  if (is_separator(path.front())) return path.substr(0, 1);
  for (const char* mark : {":/", ":\\"}) {
    if (const size_t at = path.find(mark); at != std::string::npos) return path.substr(0, at + 2);
  }
  return "";
}

// Without "." and "NAME/..", whatever links NAME goes through, and with slashes alone.
std::string reduced_path(const std::string& path) {
  const std::string prefix = absolute_prefix(path);
  std::vector<std::string> parts;
  size_t begin = prefix.size();
  for (size_t i = begin; i < path.size(); ++i) {
    if (!is_separator(path[i])) continue;
    const std::string part = path.substr(begin, i - begin);
    begin = i + 1;
    if (part == ".." && !parts.empty() && parts.back() != "..") {
      parts.pop_back();
    } else if (part != ".") {
      parts.push_back(part);
    }
  }
  parts.push_back(path.substr(begin));
  return prefix + join(parts, "/");
}

// With the separator at its end.
std::string folder_part(const std::string& file) { return file.substr(0, file.find_last_of("/\\") + 1); }

// Where an included file, or a model that is an asset, may be; the first that exists is taken.
std::vector<std::string> document_places(const std::string& first, const std::string& folder, const std::string& name) {
  return {joined_path(first, name), joined_path(folder, name)};
}

// Where a link ends, which may lead to nothing.
std::string end_of_links(fs::path file) {
  std::error_code error;
  for (int i = 0; i < kMostDepth && fs::is_symlink(fs::symlink_status(file, error)); ++i) {
    const fs::path next = fs::read_symlink(file, error);
    if (error) break;
    file = file.parent_path() / next;
  }
  return file.string();
}

// ---- the examination -------------------------------------------------------------------------------------------------

// A model with all that it includes, and the models that are its assets.
class Examination {
 public:
  Examination(const LoadOptions& options, std::vector<Problem>& problems) : options_(options), problems_(problems) {}

  void document(const std::string& text, const std::string& path) {
    const std::string folder = path.empty() ? "" : model_folder(path).string();
    root_ = path.empty() ? fs::current_path().string() : model_root(path);
    if ((folder + path.substr(path.rfind('/') + 1)).find('\\') != std::string::npos) {
      add({.message = "has a backslash in its path, which MuJoCo takes for a slash", .mend = "rename it"});
      return;
    }
    std::set<std::string> within;
    if (!path.empty()) within.insert(canonical(path));
    model({.text = text, .name = "", .folder = folder, .within = std::move(within), .depth = 0});
  }

 private:
  struct Source {
    std::string text;
    std::string name;              // as the document writes it that names it; empty for the first
    std::string folder;            // of its file, as MuJoCo opens it
    std::set<std::string> within;  // the files that it is a part of, and its own
    int depth = 0;
  };
  struct Part {
    explicit Part(Source from) : source(std::move(from)) {}
    Source source;
    xml::XMLDocument document;
  };
  struct Whole {
    std::string folder;                // its first file's
    std::vector<std::string> folders;  // of assets, as its compilers name them, wherever they stand
    std::set<std::string> included;
    std::vector<std::unique_ptr<Part>> parts;
  };

  static std::string canonical(const fs::path& path) {
    std::error_code error;
    return fs::weakly_canonical(path, error).string();
  }

  // What a compiler says holds for all that is read, before it and after: files of assets are examined at the end.
  void model(Source source) {
    Whole whole = {.folder = source.folder, .folders = {""}, .included = {}, .parts = {}};
    examine(std::move(source), whole);
    for (const auto& each : whole.parts) assets(*each->document.RootElement(), *each, whole);
  }

  // What cannot be parsed cannot be examined, and MuJoCo's parser does not get it.
  void examine(Source source, Whole& whole) {
    whole.parts.push_back(std::make_unique<Part>(std::move(source)));
    Part& own = *whole.parts.back();
    std::optional<Problem> fault = encoding_problem(own.source.text);
    const bool parsed =
        !fault && own.document.Parse(own.source.text.data(), own.source.text.size()) == xml::XML_SUCCESS;
    own.source.text = {};
    const xml::XMLElement* root = own.document.RootElement();
    if (!parsed) {
      if (!fault) fault = xml_problem(own.document.ErrorStr());
      if (own.source.name.empty()) {
        fault->message = "it " + fault->message;
      } else {
        fault->element = fmt::format("the file '{}'", own.source.name);
      }
      add(std::move(*fault));
    }
    if (!parsed || root == nullptr) {
      whole.parts.pop_back();
      return;
    }
    if (own.source.depth == 0 && is_called(*root, "robot")) {
      refuse(*root, own, "is taken for URDF by MuJoCo alone", "write 'robot' in small letters");
    }
    walk(*root, own, whole);
  }

  void walk(const xml::XMLElement& element, const Part& part, Whole& whole) {
    for (const xml::XMLAttribute* a = element.FirstAttribute(); a != nullptr; a = a->Next()) {
      const std::string_view name = a->Name(), value = a->Value();
      if ((name == "class" || name == "childclass") && value.find('%') != std::string_view::npos) {
        refuse(element, part, fmt::format("has the class '{}', whose '%' MuJoCo takes for a format", value),
               "rename the class");
      }
      if (name == "nkey" || name.starts_with("nuser_")) bound(element, part, a->Name(), a->Value(), kMostCount);
    }
    if (std::string_view(element.Name()) == "hfield") heights(element, part);
    if (is_called(element, "compiler")) {
      for (const char* name : {"assetdir", "meshdir", "texturedir"}) {
        const std::string folder = attribute(element, name);
        if (std::ranges::find(whole.folders, folder) == whole.folders.end()) whole.folders.push_back(folder);
      }
    }
    if (is_called(element, "include")) include(element, part, whole);
    for (const xml::XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      walk(*e, part, whole);
    }
  }

  void include(const xml::XMLElement& element, const Part& part, Whole& whole) {
    if (std::string_view(element.Name()) != "include") {
      refuse(element, part, "includes a file", "write 'include' in small letters");
      return;
    }
    const std::string name = attribute(element, "file");
    if (name.empty()) return;
    const std::vector<std::string> files =
        readable(element, part, name, document_places(whole.folder, part.source.folder, name), true);
    for (const std::string& file : files) {
      const std::string key = canonical(file);
      if (part.source.within.contains(key) || part.source.depth >= kMostDepth) {
        if (file != files.front()) continue;  // MuJoCo does not come to it
        refuse(element, part, fmt::format("includes '{}', which contains itself", name), "include a file once");
        return;
      }
      if (whole.included.insert(file).second) examine(inner(part, name, file, key), whole);
    }
  }

  // Attributes that name files. MuJoCo looks in the folder of the kind of asset, beside the included file, and with
  // `strippath` for the name alone: all of these places are examined.
  void assets(const xml::XMLElement& element, const Part& part, const Whole& whole) {
    const bool is_model = std::string_view(element.Name()) == "model";
    for (const xml::XMLAttribute* a = element.FirstAttribute(); a != nullptr; a = a->Next()) {
      const std::string name = a->Value();
      if (!std::string_view(a->Name()).starts_with("file") || name.empty() || is_called(element, "include")) continue;
      std::vector<std::string> places = document_places(whole.folder, part.source.folder, name);
      const std::string last = name.substr(folder_part(name).size());
      for (const std::string& folder : whole.folders) {
        if (is_model) break;
        places.push_back(joined_path(joined_path(whole.folder, folder), name));
        places.push_back(joined_path(whole.folder, joined_path(folder, name)));
        if (!last.empty()) places.push_back(joined_path(whole.folder, joined_path(folder, last)));
      }
      for (const std::string& file : readable(element, part, name, places, is_model)) {
        if (!is_model) break;
        const std::string key = canonical(file);
        if (part.source.within.contains(key) || part.source.depth >= kMostDepth) {
          refuse(element, part, fmt::format("is the model '{}', which contains itself", name), "remove it");
          break;
        }
        if (models_.insert(file).second) model(inner(part, name, file, key));
      }
    }
    for (const xml::XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      assets(*e, part, whole);
    }
  }

  static Source inner(const Part& part, const std::string& name, const std::string& file, const std::string& key) {
    Source source = {.text = read(file),
                     .name = name,
                     .folder = folder_part(file),
                     .within = part.source.within,
                     .depth = part.source.depth + 1};
    source.within.insert(key);
    return source;
  }

  // Those of the places where a file is; none where one of them may not be read. A document's name that leads out of
  // the root is refused even where nothing is, unless MuJoCo finds a file within: the answer would tell what lies
  // there. A mesh that is not there may be one that is only drawn, as in robots that share the meshes of another
  // package.
  std::vector<std::string> readable(const xml::XMLElement& element, const Part& part, const std::string& name,
                                    const std::vector<std::string>& places, bool is_document) {
    std::vector<std::string> files;
    std::set<std::string> seen;
    std::string outside;
    for (const std::string& file : places) {
      if (file.empty() || !seen.insert(file).second) continue;
      std::error_code error;
      const fs::file_status status = fs::status(file, error);
      const bool is_there = fs::exists(status) && !fs::is_directory(status);  // else MuJoCo says so
      if (!options_.allow_external_files && !is_below(end_of_links(file), root_)) {
        if (is_there || (is_document && outside.empty())) outside = file;
        if (!is_there) continue;
        files.clear();
        break;
      }
      if (!is_there) continue;
      if (!is_fit(element, part, name, file, status)) return {};
      files.push_back(file);
    }
    if (files.empty() && !outside.empty()) {
      refuse(element, part,
             fmt::format("names the file '{}', which lies outside the model's folder '{}'",
                         fs::absolute(outside).lexically_normal().string(), root_),
             "copy it there", "--allow-external-files if you trust the model");
    }
    return files;
  }

  bool is_fit(const xml::XMLElement& element, const Part& part, const std::string& name, const std::string& file,
              const fs::file_status& status) {
    std::error_code error;
    if (!fs::is_regular_file(status)) {
      refuse(element, part, fmt::format("names '{}', which is not a regular file", name), "name a file");
      return false;
    }
    if (fs::file_size(file, error) > kMostModelFileBytes) {
      refuse(element, part, fmt::format("names the file '{}' of more than {} MiB", name, kMostModelFileBytes >> 20),
             "simplify it");
      return false;
    }
    // MuJoCo would read a model in it, whatever the element is
    const auto ends_with = [&](const char* ending) {
      return file.size() >= 4 && ::strcasecmp(file.c_str() + file.size() - 4, ending) == 0;
    };
    if (!ends_with(".mjz") && !ends_with(".zip")) return true;
    refuse(element, part, fmt::format("names the archive '{}'", name), "unpack it, and name the file in it");
    return false;
  }

  static std::string read(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }

  void bound(const xml::XMLElement& element, const Part& part, const char* name, const char* value, double most) {
    const auto number = parse_number(value);
    if (number && *number > most) {
      refuse(element, part, fmt::format("has {}=\"{}\"", name, value), fmt::format("give at most {:.0f}", most));
    }
  }

  void heights(const xml::XMLElement& element, const Part& part) {
    const auto rows = parse_number(attribute(element, "nrow")), columns = parse_number(attribute(element, "ncol"));
    if (rows && columns && *rows * *columns > kMostHeights) {
      refuse(element, part, fmt::format("has {} x {} heights", shortest(*rows), shortest(*columns)),
             fmt::format("give at most {:.0e}", kMostHeights));
    }
  }

  void refuse(const xml::XMLElement& element, const Part& part, const std::string& what, const std::string& mend,
              const std::string& option = "") {
    const std::string name = attribute(element, "name");
    add({.element = name.empty() ? fmt::format("a {}", element.Name()) : fmt::format("{} '{}'", element.Name(), name),
         .line = element.GetLineNum(),
         .file = part.source.name,
         .message = what,
         .mend = mend,
         .option = option});
  }

  void add(Problem problem) { problems_.push_back(std::move(problem)); }

  const LoadOptions& options_;
  std::vector<Problem>& problems_;
  std::string root_;              // files have to lie below it
  std::set<std::string> models_;  // assets
};

}  // namespace

std::string joined_path(const std::string& folder, const std::string& name) {
  if (folder.empty() || !absolute_prefix(name).empty()) return reduced_path(name);
  return reduced_path(is_separator(folder.back()) ? folder + name : folder + "/" + name);
}

std::string model_root(const std::string& path) {
  std::error_code error;
  const fs::path folder = model_folder(path);
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

std::filesystem::path model_folder(const std::string& path) {
  if (path.empty()) return fs::current_path();
  std::error_code error;
  return fs::weakly_canonical(fs::absolute(path).parent_path(), error);
}

std::string included_file(const std::string& first, const std::string& folder, const std::string& name) {
  for (const std::string& file : document_places(first, folder, name)) {
    std::error_code error;
    if (fs::exists(file, error)) return file;
  }
  return "";
}

std::vector<Problem> document_refusals(const std::string& text, const std::string& path, const LoadOptions& options) {
  std::vector<Problem> problems;
  Examination(options, problems).document(text, path);
  return problems;
}

}  // namespace assay
