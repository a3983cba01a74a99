#include "load/urdf/unread.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <tinyxml2.h>

#include "base/text.h"
#include "load/urdf/values.h"

namespace assay::urdf {
namespace {

namespace xml = tinyxml2;

struct KnownParts {
  std::vector<std::string> attributes, elements;
};
// Of the elements that are read. What stands in others is not looked at: a <material>, an extension.
const std::map<std::string, KnownParts>& known_parts() {
  static const std::map<std::string, KnownParts> kKnown = {
      {"robot",
       {{"name", "version"},
        {"link", "joint", "material", "loop_joint", "transmission", "gazebo", "ros2_control", "mujoco"}}},
      {"link", {{"name"}, {"inertial", "visual", "collision"}}},
      {"inertial", {{}, {"origin", "mass", "inertia"}}},
      {"visual", {{"name"}, {"origin", "geometry", "material"}}},
      {"collision", {{"name"}, {"origin", "geometry", "material"}}},
      {"geometry", {{}, {"box", "cylinder", "capsule", "sphere", "mesh"}}},
      {"joint", {{"name", "type"}, {"origin", "parent", "child", "axis", "limit", "dynamics", "mimic"}}},
      {"origin", {{"xyz", "rpy"}, {}}},
      {"mass", {{"value"}, {}}},
      {"inertia", {{"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}, {}}},
      {"box", {{"size"}, {}}},
      {"cylinder", {{"radius", "length"}, {}}},
      {"capsule", {{"radius", "length"}, {}}},
      {"sphere", {{"radius"}, {}}},
      {"mesh", {{"filename", "scale"}, {}}},
      {"parent", {{"link"}, {}}},
      {"child", {{"link"}, {}}},
      {"axis", {{"xyz"}, {}}},
      {"limit", {{"lower", "upper", "effort", "velocity"}, {}}},
      {"dynamics", {{"damping", "friction"}, {}}},
      {"mimic", {{"joint", "multiplier", "offset"}, {}}}};
  return kKnown;
}

// Elements or attributes of one kind that are not read.
struct Unread {
  std::string what;   // "attribute 'low' of <limit>"
  std::string where;  // the first: " of joint 'j' (line 3)"
  std::string hint;   // " (did you mean 'lower'?)"
  size_t count = 1;
};

// `owner` is the link or joint that the element belongs to, "joint 'j'"; `add` gets each kind, and returns what is to
// be filled in where it is the first.
template <typename Add>
void collect_unread(const xml::XMLElement& element, const std::string& owner, const Add& add) {
  const auto known = known_parts().find(element.Name());
  if (known == known_parts().end()) return;
  const auto& [attributes, elements] = known->second;
  const std::string tag = element.Name();
  const std::string inside = tag == "link" || tag == "joint" ? "" : fmt::format(" of <{}>", tag);
  const auto report = [&](const std::string& what, const std::string& of, const std::string& name, int line,
                          const std::vector<std::string>& candidates) {
    Unread* unread = add(fmt::format("{} in {}", what, tag));
    if (unread == nullptr) return;
    unread->what = what + of;
    unread->where = fmt::format("{} (line {})", owner.empty() ? "" : " of " + owner, line);
    if (const auto nearest = nearest_name(name, candidates))
      unread->hint = fmt::format(" (did you mean '{}'?)", *nearest);
  };
  for (const xml::XMLAttribute* a = element.FirstAttribute(); a != nullptr; a = a->Next()) {
    const std::string name = a->Name();
    if (name.starts_with("xmlns") || std::ranges::find(attributes, name) != attributes.end()) continue;
    report(fmt::format("attribute '{}'", name), inside, name, element.GetLineNum(), attributes);
  }
  for (const xml::XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    const std::string name = e->Name();
    if (std::ranges::find(elements, name) == elements.end()) {
      report(fmt::format("<{}>", name), tag == "robot" ? "" : inside, name, e->GetLineNum(), elements);
      continue;
    }
    const bool owns = name == "link" || name == "joint";
    collect_unread(*e, owns ? fmt::format("{} '{}'", name, text_of(e, "name")) : owner, add);
  }
}

void note_elements(Robot& robot, const char* name, const char* plural, const char* why) {
  size_t count = 0;
  for (const xml::XMLElement* e = robot.element->FirstChildElement(name); e != nullptr;
       e = e->NextSiblingElement(name)) {
    ++count;
  }
  if (count > 0) robot.note(fmt::format("{} are not read ({}): {}", plural, count, why));
}

}  // namespace

// One note for each kind; extensions of many robots have a few of them, a file that is no robot has any number.
void note_unread_parts(Robot& robot) {
  constexpr size_t kMostKinds = 30;
  std::map<std::string, size_t> index_of;
  std::vector<Unread> kinds;
  size_t others = 0;
  collect_unread(*robot.element, "", [&](const std::string& kind) -> Unread* {
    const auto found = index_of.find(kind);
    if (found != index_of.end()) {
      ++kinds[found->second].count;
      return nullptr;
    }
    if (kinds.size() == kMostKinds) {
      ++others;
      return nullptr;
    }
    index_of.emplace(kind, kinds.size());
    return &kinds.emplace_back();
  });
  for (const Unread& unread : kinds) {
    robot.note(unread.count == 1 ? fmt::format("{}{} is not read{}", unread.what, unread.where, unread.hint)
                                 : fmt::format("{}{} and {} more are not read{}", unread.what, unread.where,
                                               unread.count - 1, unread.hint));
  }
  if (others > 0) robot.note(fmt::format("other elements and attributes that are not read: {}", others));
}

void refuse_loops(Robot& robot) {
  for (const xml::XMLElement* e = robot.element->FirstChildElement("loop_joint"); e != nullptr;
       e = e->NextSiblingElement("loop_joint")) {
    const std::string element = fmt::format("loop_joint '{}'", text_of(e, "name"));
    if (robot.options.drop_unsupported) {
      robot.leave_out(element, e->GetLineNum(), "closes a loop of links and is left out, so that the loop is open");
    } else {
      robot.refuse(element, e->GetLineNum(), "closes a loop of links, which is not supported in URDF",
                   "write the robot as MJCF with a <connect> or <weld> there",
                   "--drop-unsupported, which leaves it out, so that the loop is open");
    }
  }
}

void read_compiler_settings(Robot& robot) {
  robot.compiler = read_compiler(*robot.element, robot.result.problems, robot.result.notes);
  for (xml::XMLElement* m = robot.element->FirstChildElement("mujoco"); m != nullptr;
       m = m->NextSiblingElement("mujoco")) {
    xml::XMLElement* next = nullptr;
    for (xml::XMLElement* e = m->FirstChildElement(); e != nullptr; e = next) {
      next = e->NextSiblingElement();
      const std::string name = e->Name();
      if (name == "option") continue;
      if (name != "compiler" && name != "size") {
        robot.note(
            fmt::format("<{}> of <mujoco> (line {}) is not read: in URDF MuJoCo reads <compiler> "
                        "and <option>",
                        name, e->GetLineNum()));
      }
      m->DeleteChild(e);
    }
  }
}

void note_extensions(Robot& robot) {
  note_elements(robot, "transmission", "transmissions", "every joint that is not fixed and mimics none has a motor");
  note_elements(robot, "gazebo", "gazebo extensions", "they are another program's");
  note_elements(robot, "ros2_control", "ros2_control blocks", "they are another program's");
}

}  // namespace assay::urdf
