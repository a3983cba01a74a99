// What stands in the document and is not read: a note for each kind, with the line of the first.
#include <algorithm>
#include <cstddef>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "base/text.h"
#include "load/sdf/robot.h"
#include "load/sdf/values.h"

namespace assay::sdf {
namespace {

namespace xml = tinyxml2;

using Names = std::vector<std::string>;

struct Known {
  Names attributes, elements;
};

// Of the elements that are read.
const std::map<std::string, Known>& known_parts() {
  static const std::map<std::string, Known> kKnown = {
      {"sdf", {{"version"}, {"world", "model", "include"}}},
      {"world", {{"name"}, {"model", "include", "frame", "joint", "gravity"}}},
      {"model",
       {{"name", "canonical_link", "placement_frame"},
        {"static", "self_collide", "pose", "link", "joint", "frame", "model", "include"}}},
      {"include", {{"merge"}, {"uri", "name", "pose", "static", "placement_frame"}}},
      {"frame", {{"name", "attached_to"}, {"pose"}}},
      {"pose", {{"relative_to", "frame", "rotation_format", "degrees"}, {}}},
      {"link", {{"name"}, {"pose", "inertial", "collision", "self_collide", "gravity"}}},
      {"inertial", {{"auto"}, {"mass", "density", "pose", "inertia", "fluid_added_mass"}}},
      {"inertia", {{}, {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}}},
      {"collision", {{"name"}, {"pose", "geometry", "surface", "density"}}},
      {"geometry",
       {{},
        {"empty", "box", "sphere", "cylinder", "capsule", "cone", "ellipsoid", "plane", "polyline", "mesh", "heightmap",
         "image"}}},
      {"box", {{}, {"size"}}},
      {"sphere", {{}, {"radius"}}},
      {"cylinder", {{}, {"radius", "length"}}},
      {"capsule", {{}, {"radius", "length"}}},
      {"cone", {{}, {"radius", "length"}}},
      {"ellipsoid", {{}, {"radii"}}},
      {"plane", {{}, {"normal", "size"}}},
      {"polyline", {{}, {"point", "height"}}},
      {"mesh", {{"optimization"}, {"uri", "scale", "submesh"}}},
      {"submesh", {{}, {"name", "center"}}},
      {"surface", {{}, {"friction", "contact"}}},
      {"contact", {{}, {"collide_bitmask", "collide_without_contact"}}},
      {"joint",
       {{"name", "type"},
        {"parent", "child", "pose", "axis", "axis2", "thread_pitch", "screw_thread_pitch", "gearbox_ratio",
         "gearbox_reference_body"}}},
      {"axis", {{}, {"xyz", "dynamics", "limit", "mimic", "use_parent_model_frame"}}},
      {"axis2", {{}, {"xyz", "dynamics", "limit", "mimic", "use_parent_model_frame"}}},
      {"xyz", {{"expressed_in"}, {}}},
      {"dynamics", {{}, {"damping", "friction", "spring_stiffness", "spring_reference"}}},
      {"limit", {{}, {"lower", "upper", "effort", "velocity"}}},
      {"mimic", {{"joint", "axis"}, {"multiplier", "offset", "reference"}}}};
  return kKnown;
}

// What is drawn, sensed or shown, and what only its program needs.
bool is_silent(std::string_view tag) {
  static const std::set<std::string_view> kSilent = {"visual",
                                                     "sensor",
                                                     "light",
                                                     "projector",
                                                     "audio_sink",
                                                     "audio_source",
                                                     "battery",
                                                     "particle_emitter",
                                                     "laser_retro",
                                                     "max_contacts",
                                                     "gui",
                                                     "scene",
                                                     "road",
                                                     "spherical_coordinates",
                                                     "magnetic_field",
                                                     "atmosphere",
                                                     "population",
                                                     "allow_auto_disable",
                                                     "must_be_base_link",
                                                     "audio",
                                                     "plugin"};
  return kSilent.contains(tag);
}

// Softness and solvers, which the contender decides.
bool is_of_solver(std::string_view parent, std::string_view tag) {
  if (parent == "world") return tag == "physics";
  if (parent == "contact")
    return tag == "ode" || tag == "bullet" || tag == "poissons_ratio" || tag == "elastic_modulus";
  if (parent == "joint") return tag == "physics";
  if (parent == "limit") return tag == "stiffness" || tag == "dissipation";
  return parent == "surface" && (tag == "bounce" || tag == "soft_contact");
}

class Reader {
 public:
  explicit Reader(Robot& robot) : robot_(robot) {
    for (const Frame& frame : robot.frames) models_.insert(frame.element.at);
  }

  void read() {
    for (const auto& source : robot_.sources) {
      if (source->document.RootElement() != nullptr) walk({source->document.RootElement(), source.get()}, "");
    }
    constexpr size_t kMostKinds = 30;
    for (size_t i = 0; i < kinds_.size() && i < kMostKinds; ++i) {
      const Kind& kind = kinds_[i];
      const std::string more = kind.count > 1 ? fmt::format(" and {} more are", kind.count - 1) : " is";
      robot_.note(fmt::format("{}{} not read{}", kind.what, more, kind.hint));
    }
    if (kinds_.size() > kMostKinds) {
      robot_.note(
          fmt::format("other kinds of elements and attributes that are not read: {}", kinds_.size() - kMostKinds));
    }
    if (!plugins_.empty()) {
      constexpr size_t kNamed = 8;
      const size_t others = plugins_.size() > kNamed ? plugins_.size() - kNamed : 0;
      plugins_.resize(plugins_.size() - others);
      robot_.note(fmt::format("plugins are left out, because they are programs: {}{}", join(plugins_, ", "),
                              others > 0 ? fmt::format(" and {} more", others) : ""));
    }
    if (solver_ > 0) {
      robot_.note(
          fmt::format("softness, restitution and solver settings are not read, because the contender decides "
                      "them: {} (first in {})",
                      solver_, first_solver_));
    }
  }

 private:
  struct Kind {
    std::string what;  // "<kinematic> of link 'a' (line 3)"
    std::string hint;
    size_t count = 1;
  };

  void walk(const Element& element, const std::string& owner) {
    const std::string tag = element.at->Name();
    const auto known = known_parts().find(tag);
    if (known == known_parts().end()) return;
    const std::string name = attribute(element.at, "name");
    const std::string own = name.empty() ? owner : fmt::format("{} '{}'", tag, name);
    for (const xml::XMLAttribute* a = element.at->FirstAttribute(); a != nullptr; a = a->Next()) {
      const std::string key = a->Name();
      if (key.starts_with("xmlns") || contains(known->second.attributes, key)) continue;
      add(fmt::format("@{} {}", key, tag), fmt::format("attribute '{}' of <{}>", key, tag), own, element, key,
          known->second.attributes);
    }
    for (const xml::XMLElement* e = element.at->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const Element inner = {e, element.source};
      const std::string child = e->Name();
      if (child == "plugin") {
        const std::string called = attribute(e, "name");
        plugins_.push_back(
            fmt::format("'{}' ({})", called.empty() ? attribute(e, "filename") : called, robot_.place(inner)));
      }
      if (is_silent(child)) continue;
      if (is_of_solver(tag, child)) {
        if (solver_++ == 0) first_solver_ = robot_.place(inner);
        continue;
      }
      if (tag == "surface" && child == "friction") {
        friction(inner, own);
      } else if (!contains(known->second.elements, child)) {
        add(child + " " + tag, fmt::format("<{}>", child), own, inner, child, known->second.elements);
      } else if (child != "model" || models_.contains(e)) {
        walk(inner, own);
      }
    }
  }

  // Of two engines, with other names in each.
  void friction(const Element& element, const std::string& owner) {
    static const Names kRead = {"mu", "mu2", "friction", "friction2"};
    for (const xml::XMLElement* e = element.at->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string engine = e->Name();
      for (const xml::XMLElement* v = e->FirstChildElement(); v != nullptr; v = v->NextSiblingElement()) {
        const std::string name = v->Name();
        const Element at = {v, element.source};
        if ((engine == "ode" || engine == "bullet") && contains(kRead, name)) continue;
        if (sdf::number(text_of(v)).value_or(1) == 0) continue;  // 0 is none
        add(name + " " + engine, fmt::format("<{}> of <{}>", name, engine), owner, at, name, {});
      }
    }
  }

  static bool contains(const Names& names, const std::string& name) {
    return std::ranges::find(names, name) != names.end();
  }

  void add(const std::string& key, const std::string& what, const std::string& owner, const Element& at,
           const std::string& word, const Names& candidates) {
    const auto [found, fresh] = index_of_.try_emplace(key, kinds_.size());
    if (!fresh) {
      ++kinds_[found->second].count;
      return;
    }
    Kind kind;
    kind.what = fmt::format("{}{} ({})", what, owner.empty() ? "" : " of " + owner, robot_.place(at));
    if (const auto nearest = nearest_name(word, candidates)) kind.hint = fmt::format(" (did you mean '{}'?)", *nearest);
    kinds_.push_back(std::move(kind));
  }

  Robot& robot_;
  std::set<const xml::XMLElement*> models_;  // those that were read, and other elements
  std::map<std::string, size_t> index_of_;
  std::vector<Kind> kinds_;
  std::vector<std::string> plugins_;
  size_t solver_ = 0;
  std::string first_solver_;
};

}  // namespace

void note_unread_parts(Robot& robot) { Reader(robot).read(); }

}  // namespace assay::sdf
