#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/text.h"
#include "load/outside_files.h"
#include "load/package_paths.h"
#include "load/parser_faults.h"
#include "load/sdf/robot.h"
#include "load/sdf/values.h"

namespace assay::sdf {
namespace {

namespace fs = std::filesystem;
namespace xml = tinyxml2;

constexpr int kOldest = 104, kNewest = 112;  // 1.4 to 1.12
constexpr int kMostDepth = 32;               // of models in models, and of includes
constexpr size_t kMostFiles = 1000, kMostLinks = 100'000;

// "1.10" as 110; 0 for what is no version.
int version_of(const std::string& text) {
  const size_t dot = text.find('.');
  const auto major = parse_integer(text.substr(0, dot));
  const auto minor =
      parse_integer(dot == std::string::npos ? "0" : text.substr(dot + 1, text.find('.', dot + 1) - dot - 1));
  if (!major || !minor || *major < 0 || *minor < 0 || *major > 99 || *minor > 99) return 0;
  return static_cast<int>(100 * *major + *minor);
}

// A model with the <include> that names it, which is null for one that is written in place.
struct Entry {
  Element model, include;

  const Element& place() const { return include ? include : model; }
  std::string name() const {
    const std::string own = include ? text_of(include.child("name").at) : "";
    return own.empty() ? attribute(model.at, "name") : own;
  }
};

class Models {
 public:
  explicit Models(Robot& robot) : robot_(robot) {}

  bool read(const std::string& text) {
    Source* source = parse(text, robot_.path, "");
    if (source == nullptr) return false;
    robot_.frames.push_back({.kind = Frame::Kind::kWorld, .name = "the world", .model = 0});
    robot_.scopes.emplace_back();
    const Element root = {source->document.RootElement(), source};
    const Element world = root.child("world");
    if (world && world.next("world")) {
      robot_.refuse("", world.next("world"), "it has several worlds", "keep one <world>");
      return false;
    }
    if (world) read_gravity(world);
    const Element home = world ? world : root;
    std::vector<Entry> entries = entries_of(home);
    if (robot_.result.parts.refused() || !choose(entries, home)) return false;
    for (const Entry& entry : entries) read_model(entry, 0, 0, 0);
    if (world) {
      for (Element e = world.child("frame"); e; e = e.next("frame")) add_frame(e, 0, 0);
      for (Element e = world.child("joint"); e; e = e.next("joint")) add_joint(e, 0, 0);
    }
    if (robot_.links.empty() && !robot_.result.parts.refused()) {
      robot_.refuse("", home, "it has no link", "give its model a <link>");
    }
    return !robot_.result.parts.refused();
  }

 private:
  // ---- documents

  Source* parse(const std::string& text, const std::string& path, const std::string& name) {
    auto source = std::make_unique<Source>();
    source->path = path;
    source->name = name;
    const std::string part = name.empty() ? "" : fmt::format("the file '{}'", name);
    if (std::optional<Problem> fault = name.empty() ? std::nullopt : encoding_problem(text)) {
      fault->element = part;
      robot_.result.parts.problems.push_back(std::move(*fault));
      return nullptr;
    }
    source->document.Parse(text.data(), text.size());
    robot_.sources.push_back(std::move(source));
    Source& kept = *robot_.sources.back();
    const xml::XMLElement* root = kept.document.RootElement();
    if (kept.document.Error() || root == nullptr) {
      Problem fault = xml_problem(kept.document.Error() ? kept.document.ErrorStr() : "XML_ERROR_EMPTY_DOCUMENT");
      fault.element = part;
      robot_.result.parts.problems.push_back(std::move(fault));
      return nullptr;
    }
    const Element at = {root, &kept};
    if (std::string_view(root->Name()) != "sdf") {
      robot_.refuse(part, at, fmt::format("is no SDF but begins with <{}>", root->Name()),
                    "include an .sdf file, or name its model as MODEL of another command");
      return nullptr;
    }
    const std::string version = attribute(root, "version");
    kept.version = version_of(version);
    if (kept.version == 0 || kept.version < kOldest) {
      robot_.refuse("<sdf>", at, version.empty() ? "has no version" : fmt::format("has the version '{}'", version),
                    "give one from 1.4 to 1.12, as `gz sdf -p FILE` writes it");
      return nullptr;
    }
    if (kept.version > kNewest) {
      robot_.note(fmt::format("<sdf> ({}) has the version {}, which is newer than 1.12: it is read as that",
                              robot_.place(at), version));
    }
    return &kept;
  }

  void read_gravity(const Element& world) {
    Element gravity = world.child("gravity");
    if (!gravity) gravity = world.child("physics").child("gravity");  // before 1.6
    robot_.result.gravity = robot_.vector(gravity, Vec3(0, 0, -9.8), "the world");
  }

  // ---- includes

  FoundFile find(const std::string& uri, const Source& from) const {
    const std::string base = from.path.empty() ? (fs::current_path() / "model.sdf").string() : from.path;
    return find_resource(uri, base, robot_.options.packages, {.folder = "", .strip_path = false});
  }

  // The newest of the files that a model.config names.
  std::string file_of_config(const std::string& config) const {
    constexpr std::uintmax_t kMostBytes = std::uintmax_t{1} << 20;
    xml::XMLDocument document;
    const std::string text = input_file(config, "model.config", "an XML file", kMostBytes);
    document.Parse(text.data(), text.size());
    std::string file;
    int newest = -1;
    const xml::XMLElement* root = document.RootElement();
    for (const xml::XMLElement* e = child(root, "sdf"); e != nullptr; e = e->NextSiblingElement("sdf")) {
      const int version = version_of(attribute(e, "version"));
      if (version <= newest || version > kNewest) continue;
      newest = version;
      file = text_of(e);
    }
    if (file.empty()) file = "model.sdf";
    return (fs::path(config).parent_path() / file).lexically_normal().string();
  }

  // The model that an <include> names; an empty one where it is refused or left out.
  Entry open(const Element& include) {
    const Element at = include.child("uri");
    std::string uri = text_of(at.at);
    while (uri.ends_with('/')) uri.pop_back();
    const std::string part = fmt::format("<include> of '{}'", uri);
    if (uri.empty()) {
      robot_.refuse("<include>", include, "has no uri", "give it a <uri>, as model://NAME");
      return {};
    }
    if (uri == "model://sun") {  // Gazebo's light
      robot_.note(fmt::format("{} ({}) is a light and left out", part, robot_.place(include)));
      return {};
    }
    constexpr const char* kCosts = "is left out with all that it contains";
    try {
      FoundFile found = find(uri + "/model.config", *include.source);
      std::string file = found.path;
      const std::vector<std::string> looked = found.looked;
      if (!file.empty() && may_read(robot_, file, found.in_package)) file = file_of_config(file);
      if (file.empty()) {
        found = find(uri + "/model.sdf", *include.source);
        if (found.path.empty()) found = find(uri, *include.source);
        if (found.path.empty() && uri.find(':') == std::string::npos) {  // the name of a model alone
          found = find(fmt::format("model://{}/model.config", uri), *include.source);
          if (!found.path.empty() && may_read(robot_, found.path, found.in_package)) {
            found.path = file_of_config(found.path);
          }
        }
        file = found.path;
      }
      std::error_code error;
      if (file.empty() || !fs::exists(file, error)) {
        if (uri.starts_with("http://") || uri.starts_with("https://")) {
          robot_.unsupported(part, include, "lies on the network, where nothing is read",
                             "download it, and include it as model://NAME", kCosts);
          return {};
        }
        const size_t scheme = uri.find("://");
        const std::string name =
            scheme == std::string::npos ? "" : uri.substr(scheme + 3, uri.find('/', scheme + 3) - scheme - 3);
        robot_.unsupported(
            part, include, fmt::format("is not found (looked for: {})", join(looked, ", ")),
            name.empty() ? "put the file there" : fmt::format("name the model's folder with --package {}=DIR", name),
            kCosts);
        return {};
      }
      if (!may_read(robot_, file, found.in_package)) {
        robot_.unsupported(part, include,
                           fmt::format("lies outside the model's folder '{}'",
                                       model_root(robot_.path.empty() ? "model.sdf" : robot_.path)),
                           "copy it there, or give --allow-external-files if you trust the model", kCosts);
        return {};
      }
      return model_in(file, part, include);
    } catch (const InputError& fault) {
      robot_.refuse(part, include, fmt::format("cannot be read: {}", fault.what()), "correct its <uri>");
      return {};
    }
  }

  Entry model_in(const std::string& file, const std::string& part, const Element& include) {
    std::error_code error;
    const std::string own = fs::weakly_canonical(file, error).string();
    int depth = 1;
    for (const Source* s = include.source; s != nullptr; s = parent_of_[s], ++depth) {
      if (s->path.empty() || fs::weakly_canonical(s->path, error) != own) continue;
      robot_.refuse(part, include, "contains itself", "remove it from one of the files");
      return {};
    }
    if (depth > kMostDepth || robot_.sources.size() > kMostFiles) {
      robot_.refuse(part, include, fmt::format("is one of more than {} files", kMostFiles), "include fewer");
      return {};
    }
    const fs::path relative = fs::path(own).lexically_relative(model_folder(robot_.path));
    const std::string name = relative.empty() || *relative.begin() == ".." ? own : relative.string();
    const Source* source = parse(input_file(file, "included model", "an .sdf file", kMostModelFileBytes), file, name);
    if (source == nullptr) return {};
    parent_of_[source] = include.source;
    const Element root = {source->document.RootElement(), source};
    const Element model = root.child("model");
    if (!model || model.next("model")) {
      robot_.refuse(part, include,
                    fmt::format("names the file '{}', which has {}", name, model ? "several models" : "no model"),
                    "include a file with one <model>");
      return {};
    }
    return {model, include};
  }

  std::vector<Entry> entries_of(const Element& home) {
    std::vector<Entry> entries;
    for (const xml::XMLElement* e = home.at->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string_view tag = e->Name();
      if (tag == "model") entries.push_back({{e, home.source}, {}});
      if (tag != "include") continue;
      if (const Entry entry = open({e, home.source}); entry.model) entries.push_back(entry);
    }
    return entries;
  }

  bool is_static(const Entry& entry) {
    const std::string owner = fmt::format("model '{}'", entry.name());
    const bool own = robot_.truth(entry.model.child("static"), false, owner);
    return robot_.truth(entry.include.child("static"), own, owner);
  }

  // Which of the file's models are read: those that stand still, and one that moves or all of them.
  bool choose(std::vector<Entry>& entries, const Element& home) {
    std::vector<std::string> moving;
    for (const Entry& entry : entries) {
      if (!is_static(entry)) moving.push_back(entry.name());
    }
    const std::string& wanted = robot_.options.sdf_model;
    if (wanted.empty() || wanted == "*") {
      if (moving.size() > 1 && wanted.empty()) {
        std::vector<std::string> names;
        constexpr size_t kNamed = 8;
        for (const std::string& name : moving) {
          if (names.size() < kNamed) names.push_back(fmt::format("'{}'", name));
        }
        robot_.refuse("", home,
                      fmt::format("it has {} models that move: {}{}", moving.size(), join(names, ", "),
                                  moving.size() > kNamed ? " and others" : ""),
                      "name one with --sdf-model NAME, or take all with --sdf-model '*'");
        return false;
      }
    } else {
      std::vector<std::string> all;
      for (const Entry& entry : entries) all.push_back(entry.name());
      if (std::ranges::find(all, wanted) == all.end()) {
        robot_.refuse("", home, fmt::format("it has no model '{}'{}", wanted, did_you_mean(wanted, all)),
                      "correct --sdf-model");
        return false;
      }
      std::vector<std::string> left_out;
      std::erase_if(entries, [&](const Entry& entry) {
        if (entry.name() == wanted || is_static(entry)) return false;
        left_out.push_back(fmt::format("'{}'", entry.name()));
        return true;
      });
      if (!left_out.empty()) robot_.note(fmt::format("models are left out (--sdf-model): {}", join(left_out, ", ")));
      moving = {wanted};
    }
    plain_ = entries.size() == 1 ? entries.front().name() : moving.size() == 1 ? moving.front() : "";
    robot_.result.name = plain_.empty() ? attribute(home.at, "name") : plain_;
    return true;
  }

  // ---- elements

  static std::string relative_to(const Element& pose) {
    if (!pose) return "";
    const std::string own = attribute(pose.at, "relative_to");
    return own.empty() && pose.source->version < 107 ? attribute(pose.at, "frame") : own;
  }

  bool has_name(const Element& element, const std::string& name) {
    if (!name.empty()) return true;
    robot_.refuse(fmt::format("<{}>", element.at->Name()), element, "has no name", "give it one");
    return false;
  }

  // Adds a frame under its name. Its index, -1 where the name is taken.
  int add(Frame frame, const std::string& name, int scope) {
    Scope& home = robot_.scopes[scope];
    const int index = static_cast<int>(robot_.frames.size());
    if (!name.empty()) {
      const bool model = home.children.contains(name);
      // before 1.7 a joint may have a link's name, which then means the link
      const bool hidden = frame.kind == Frame::Kind::kJoint && frame.element.source->version < 107;
      if ((model || !home.frames.emplace(name, index).second) && !hidden) {
        robot_.refuse(frame.name, frame.element, "has the name of another element of its model",
                      "rename one of the two");
        return -1;
      }
    }
    robot_.frames.push_back(std::move(frame));
    return index;
  }

  void add_frame(const Element& element, int scope, int model) {
    const std::string name = attribute(element.at, "name");
    if (!has_name(element, name)) return;
    const std::string label = fmt::format("frame '{}{}'", robot_.scopes[scope].path, name);
    const Element pose = element.child("pose");
    add({.kind = Frame::Kind::kFrame,
         .name = label,
         .scope = scope,
         .element = element,
         .relative_to = relative_to(pose),
         .attached_to = attribute(element.at, "attached_to"),
         .raw = robot_.pose(pose, label),
         .model = model},
        name, scope);
  }

  void add_link(const Element& element, int scope, int model) {
    const std::string name = attribute(element.at, "name");
    if (!has_name(element, name)) return;
    if (robot_.links.size() >= kMostLinks) {
      if (robot_.links.size() == kMostLinks) {
        robot_.refuse("", element, fmt::format("it has more than {} links", kMostLinks), "simplify it");
        robot_.links.emplace_back();
      }
      return;
    }
    Scope& home = robot_.scopes[scope];
    const std::string full = home.path + name, label = fmt::format("link '{}'", full);
    const Element pose = element.child("pose");
    const int index = static_cast<int>(robot_.links.size());
    const int frame = add({.kind = Frame::Kind::kLink,
                           .name = label,
                           .scope = scope,
                           .index = index,
                           .element = element,
                           .relative_to = relative_to(pose),
                           .raw = robot_.pose(pose, label),
                           .model = model},
                          name, scope);
    if (frame < 0) return;
    Link link;
    link.name = unique(full);
    link.scope = scope;
    link.frame = frame;
    link.element = element;
    link.is_static = home.is_static;
    link.self_collide = robot_.truth(element.child("self_collide"), home.self_collide, label);
    link.has_gravity = robot_.truth(element.child("gravity"), true, label);
    robot_.links.push_back(std::move(link));
    home.links.push_back(index);
  }

  std::string unique(const std::string& name) {
    std::string result = name == "world" ? "world_link" : name;  // MuJoCo's name of the world
    for (int i = 2; !taken_.insert(result).second; ++i) result = fmt::format("{}_{}", name, i);
    return result;
  }

  void add_joint(const Element& element, int scope, int model) {
    const std::string name = attribute(element.at, "name");
    if (!has_name(element, name)) return;
    const std::string full = robot_.scopes[scope].path + name, label = fmt::format("joint '{}'", full);
    const Element pose = element.child("pose");
    const int index = static_cast<int>(robot_.joints.size());
    const int frame = add({.kind = Frame::Kind::kJoint,
                           .name = label,
                           .scope = scope,
                           .index = index,
                           .element = element,
                           .relative_to = relative_to(pose),
                           .attached_to = text_of(element.child("child").at),
                           .raw = robot_.pose(pose, label),
                           .model = model},
                          name, scope);
    if (frame < 0) return;
    Joint joint;
    joint.name = full;
    joint.type = attribute(element.at, "type");
    joint.scope = scope;
    joint.frame = frame;
    joint.element = element;
    robot_.joints.push_back(std::move(joint));
  }

  void read_model(const Entry& entry, int parent, int context, int depth) {
    const std::string name = entry.name();
    if (!has_name(entry.place(), name)) return;
    const std::string full = robot_.scopes[parent].path + name, label = fmt::format("model '{}'", full);
    if (depth > kMostDepth) {
      robot_.refuse(label, entry.place(), "is in too many models", fmt::format("nest at most {}", kMostDepth));
      return;
    }
    const int scope = static_cast<int>(robot_.scopes.size()), frame = static_cast<int>(robot_.frames.size());
    Scope& home = robot_.scopes[parent];
    if (home.frames.contains(name) || !home.children.emplace(name, scope).second) {
      robot_.refuse(label, entry.place(), "has the name of another element beside it", "rename one of the two");
      return;
    }
    home.nested.push_back(scope);
    Element pose = entry.include.child("pose");
    if (!pose) pose = entry.model.child("pose");
    const Element placed = entry.include.child("placement_frame");
    robot_.frames.push_back({.kind = Frame::Kind::kModel,
                             .name = label,
                             .scope = parent,
                             .index = scope,
                             .element = entry.place(),
                             .relative_to = relative_to(pose),
                             .raw = robot_.pose(pose, label),
                             .placement = placed ? text_of(placed.at) : attribute(entry.model.at, "placement_frame"),
                             .model = context});
    Scope own;
    own.path = parent == 0 && name == plain_ ? "" : full + "::";
    own.name = name;
    own.parent = parent;
    own.frame = frame;
    own.top = parent == 0 ? scope : home.top;
    own.is_static = home.is_static || is_static(entry);
    own.self_collide = robot_.truth(entry.model.child("self_collide"), false, label);
    own.canonical = attribute(entry.model.at, "canonical_link");
    robot_.scopes.push_back(std::move(own));
    read_contents(entry.model, scope, frame, depth);
  }

  void read_contents(const Element& model, int scope, int context, int depth) {
    for (const xml::XMLElement* e = model.at->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const Element element = {e, model.source};
      const std::string_view tag = e->Name();
      if (tag == "link") add_link(element, scope, context);
      if (tag == "joint") add_joint(element, scope, context);
      if (tag == "frame") add_frame(element, scope, context);
      if (tag == "model") read_model({element, {}}, scope, context, depth + 1);
      if (tag != "include") continue;
      const Entry entry = open(element);
      if (!entry.model) continue;
      const std::optional<bool> merge = sdf::truth(attribute(e, "merge"));
      if (merge.value_or(false)) {
        merge_model(entry, scope, context, depth + 1);
      } else {
        read_model(entry, scope, context, depth + 1);
      }
    }
  }

  // The elements of a model become those of the one around it; a frame without a name stands for its own.
  void merge_model(const Entry& entry, int scope, int context, int depth) {
    const std::string label = fmt::format("model '{}{}'", robot_.scopes[scope].path, entry.name());
    if (depth > kMostDepth) {
      robot_.refuse(label, entry.place(), "is in too many models", fmt::format("nest at most {}", kMostDepth));
      return;
    }
    Element pose = entry.include.child("pose");
    if (!pose) pose = entry.model.child("pose");
    const Element placed = entry.include.child("placement_frame");
    std::string canonical = attribute(entry.model.at, "canonical_link");
    if (canonical.empty()) canonical = attribute(entry.model.child("link").at, "name");
    const int frame = add({.kind = Frame::Kind::kFrame,
                           .name = label,
                           .scope = scope,
                           .element = entry.place(),
                           .relative_to = relative_to(pose),
                           .attached_to = canonical,
                           .raw = robot_.pose(pose, label),
                           .placement = placed ? text_of(placed.at) : attribute(entry.model.at, "placement_frame"),
                           .model = context},
                          "", scope);
    robot_.frames[frame].base = context;  // unless relative_to says another; not that of its canonical link
    read_contents(entry.model, scope, frame, depth);
  }

  Robot& robot_;
  std::string plain_;  // the model whose names have no scope before them
  std::set<std::string> taken_;
  std::map<const Source*, const Source*> parent_of_;
};

}  // namespace

bool read_models(Robot& robot, const std::string& text) { return Models(robot).read(text); }

bool may_read(const Robot& robot, const std::string& file, bool in_package) {
  if (in_package || robot.options.allow_external_files) return true;
  return is_below(file, robot.path.empty() ? fs::current_path().string() : model_root(robot.path));
}

}  // namespace assay::sdf
