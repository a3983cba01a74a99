#include "load/urdf/tree.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <tinyxml2.h>

#include "base/text.h"
#include "load/urdf/values.h"

namespace assay::urdf {
namespace {

namespace fs = std::filesystem;
namespace xml = tinyxml2;

const xml::XMLElement* xacro_in(const xml::XMLElement& element) {
  if (std::string_view(element.Name()).starts_with("xacro:")) return &element;
  for (const xml::XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    if (const xml::XMLElement* found = xacro_in(*e)) return found;
  }
  return nullptr;
}

// Of an element that stands twice where one is meant, ROS's reader takes the first; MuJoCo's reads no such file.
void keep_first(Robot& robot, xml::XMLElement& of, const std::string& owner, const std::vector<const char*>& kinds) {
  for (const char* kind : kinds) {
    xml::XMLElement* const first = of.FirstChildElement(kind);
    while (xml::XMLElement* const again = first == nullptr ? nullptr : first->NextSiblingElement(kind)) {
      robot.note(fmt::format("{} has a second <{}> in line {}: the first one counts, as in ROS", owner, kind,
                             again->GetLineNum()));
      of.DeleteChild(again);
    }
  }
}

void keep_first_elements(Robot& robot) {
  keep_first(robot, *robot.element, "the robot", {"mujoco"});
  if (xml::XMLElement* own = robot.element->FirstChildElement("mujoco"))
    keep_first(robot, *own, "<mujoco>", {"compiler", "option"});
  for (const Link& link : robot.links) {
    const std::string owner = fmt::format("link '{}'", link.name);
    keep_first(robot, *link.element, owner, {"inertial"});
    if (xml::XMLElement* inertial = link.element->FirstChildElement("inertial")) {
      keep_first(robot, *inertial, owner, {"origin", "mass", "inertia"});
    }
    for (xml::XMLElement* e = link.element->FirstChildElement("collision"); e != nullptr;
         e = e->NextSiblingElement("collision")) {
      keep_first(robot, *e, owner, {"origin", "geometry"});
    }
    for (xml::XMLElement* e = link.element->FirstChildElement("visual"); e != nullptr;
         e = e->NextSiblingElement("visual")) {
      keep_first(robot, *e, fmt::format("a visual of {}", owner), {"origin", "geometry", "material"});
    }
  }
  for (const Joint& joint : robot.joints) {
    keep_first(robot, *joint.element, label(joint),
               {"origin", "parent", "child", "axis", "limit", "dynamics", "mimic", "calibration", "safety_controller"});
  }
}

// The names of a large robot help nobody who has misspelled one of them.
std::string likely(const std::string& word, const std::vector<std::string>& names) {
  constexpr size_t kMost = 12;
  return names.size() <= kMost || nearest_name(word, names) ? did_you_mean(word, names) : "";
}

// Some files hang their root on a world that they do not write down, as Drake's reader lets them.
void add_world(Robot& robot) {
  if (robot.link_of.contains("world")) return;
  const auto hangs = [](const Joint& joint) {
    return text_of(joint.element->FirstChildElement("parent"), "link") == "world";
  };
  const auto first = std::ranges::find_if(robot.joints, hangs);
  if (first == robot.joints.end()) return;
  robot.note(fmt::format("{} (line {}) has the parent 'world', which is no link: it is the world", label(*first),
                         line_of(*first)));
  xml::XMLElement* world = robot.document.NewElement("link");
  world->SetAttribute("name", "world");
  robot.element->InsertEndChild(world);
  robot.link_of.emplace("world", static_cast<int>(robot.links.size()));
  robot.links.emplace_back();
  robot.links.back().element = world;
  robot.links.back().name = "world";
}

// Leaves out the links and joints that are not reached from this root.
void keep_tree(Robot& robot, int root) {
  const std::vector<int> tree = robot.tree_of(root);
  const std::set<int> kept(tree.begin(), tree.end());
  for (size_t i = 0; i < robot.links.size(); ++i) {
    if (kept.contains(static_cast<int>(i))) continue;
    const Link& link = robot.links[i];
    if (link.joint < 0) {
      robot.leave_out(
          fmt::format("link '{}'", link.name), link.element->GetLineNum(),
          fmt::format("has no parent and is left out with all that hangs on it: the robot is that of link '{}'",
                      robot.links[root].name));
    }
    robot.element->DeleteChild(link.element);
  }
  for (const Joint& joint : robot.joints) {
    if (!kept.contains(joint.child)) robot.element->DeleteChild(joint.element);
  }
  robot.links.clear();
  robot.joints.clear();
  robot.link_of.clear();
  robot.order.clear();
  read_elements(robot);
  build_tree(robot);
}

// Parents before children; what is not reached from a root is a cycle.
bool find_order(Robot& robot) {
  std::vector<int> roots;
  for (size_t i = 0; i < robot.links.size(); ++i) {
    if (robot.links[i].joint < 0) roots.push_back(static_cast<int>(i));
  }
  robot.order = roots;
  for (size_t k = 0; k < robot.order.size(); ++k) {
    for (const int joint : robot.links[robot.order[k]].children) robot.order.push_back(robot.joints[joint].child);
  }
  if (robot.order.size() < robot.links.size()) {
    std::set<int> reached(robot.order.begin(), robot.order.end());
    for (const Joint& joint : robot.joints) {
      if (reached.contains(joint.child)) continue;
      robot.refuse(label(joint), line_of(joint),
                   fmt::format("closes a cycle: link '{}' is its own ancestor", robot.links[joint.child].name),
                   "remove it: a URDF is a tree");
      return false;
    }
  }
  if (roots.size() > 1) {
    const int largest = *std::ranges::max_element(roots, {}, [&robot](int root) { return robot.tree_of(root).size(); });
    if (robot.options.drop_unsupported) {
      keep_tree(robot, largest);
      return !robot.result.refused();
    }
    robot.refuse("", 0,
                 fmt::format("two links have no parent, '{}' (line {}) and '{}' (line {})", robot.links[roots[0]].name,
                             robot.links[roots[0]].element->GetLineNum(), robot.links[roots[1]].name,
                             robot.links[roots[1]].element->GetLineNum()),
                 "join them: a URDF has one root",
                 fmt::format("--drop-unsupported, which leaves out all but link '{}' and what hangs on it",
                             robot.links[largest].name));
    return false;
  }
  return true;
}

}  // namespace

bool refuse_xacro(Robot& robot) {
  const xml::XMLElement* macro = xacro_in(*robot.element);
  if (macro == nullptr) return false;
  // never the file itself: the shell empties it first
  const fs::path own = fs::path(robot.path).filename();
  std::string expanded = own.stem().extension() == ".urdf" ? own.stem().string() : own.stem().string() + ".urdf";
  if (expanded == own) expanded = own.stem().string() + "-expanded.urdf";
  robot.refuse(fmt::format("element '{}'", macro->Name()), macro->GetLineNum(), "is a xacro macro, not URDF",
               fmt::format("expand the file first: xacro {} > {}", robot.path, expanded));
  return true;
}

bool read_elements(Robot& robot) {
  std::map<std::string, int> joint_lines;
  for (xml::XMLElement* e = robot.element->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    const std::string kind = e->Name(), name = text_of(e, "name");
    if (kind != "link" && kind != "joint") continue;
    if (name.empty()) {
      robot.refuse(fmt::format("a {}", kind), e->GetLineNum(), "has no name", "give it one");
      continue;
    }
    if (kind == "link") {
      if (const auto [other, fresh] = robot.link_of.try_emplace(name, static_cast<int>(robot.links.size())); !fresh) {
        robot.refuse(
            fmt::format("link '{}'", name), e->GetLineNum(),
            fmt::format("has the name of the link in line {}", robot.links[other->second].element->GetLineNum()),
            "rename one of the two");
        continue;
      }
      robot.links.emplace_back();
      robot.links.back().element = e;
      robot.links.back().name = name;
    } else {
      if (const auto [other, fresh] = joint_lines.try_emplace(name, e->GetLineNum()); !fresh) {
        robot.refuse(fmt::format("joint '{}'", name), e->GetLineNum(),
                     fmt::format("has the name of the joint in line {}", other->second), "rename one of the two");
        continue;
      }
      robot.joints.push_back({e, name, text_of(e, "type"), -1, -1});
    }
  }
  if (robot.links.empty() && robot.result.problems.empty()) {
    robot.refuse("", robot.element->GetLineNum(), "the robot has no link", "give it a <link> and a <joint>");
  }
  keep_first_elements(robot);
  return !robot.result.refused();
}

bool build_tree(Robot& robot) {
  static const std::set<std::string> kTypes = {"revolute", "continuous", "prismatic", "fixed",
                                               "floating", "planar",     "spherical"};
  add_world(robot);
  std::vector<std::string> names;
  names.reserve(robot.links.size());
  for (const Link& link : robot.links) names.push_back(link.name);
  for (size_t j = 0; j < robot.joints.size(); ++j) {
    Joint& joint = robot.joints[j];
    if (!kTypes.contains(joint.type)) {
      robot.refuse(label(joint), line_of(joint),
                   joint.type.empty() ? "has no type" : fmt::format("has the type '{}'", joint.type),
                   "use revolute, continuous, prismatic, fixed, floating, planar or spherical");
    }
    for (const auto& [end, index] : {std::pair("parent", &joint.parent), std::pair("child", &joint.child)}) {
      const std::string link = text_of(joint.element->FirstChildElement(end), "link");
      const auto found = robot.link_of.find(link);
      if (found == robot.link_of.end()) {
        robot.refuse(label(joint), line_of(joint),
                     link.empty() ? fmt::format("has no {} link", end)
                                  : fmt::format("names the unknown {} link '{}'{}", end, link, likely(link, names)),
                     link.empty() ? fmt::format("give it a <{} link=\"NAME\"/>", end) : "correct it, or add that link");
      } else {
        *index = found->second;
      }
    }
    if (joint.parent < 0 || joint.child < 0) continue;
    Link& child = robot.links[joint.child];
    if (child.joint >= 0) {
      robot.refuse(
          fmt::format("link '{}'", child.name), child.element->GetLineNum(),
          fmt::format("is the child of two joints, '{}' (line {}) and '{}' (line {})", robot.joints[child.joint].name,
                      line_of(robot.joints[child.joint]), joint.name, line_of(joint)),
          "remove one: a URDF is a tree");
      continue;
    }
    child.joint = static_cast<int>(j);
    robot.links[joint.parent].children.push_back(static_cast<int>(j));
  }
  if (robot.result.refused()) return false;
  return find_order(robot);
}

void note_lines(Robot& robot) {
  for (const Link& link : robot.links)
    robot.result.lines[fmt::format("body '{}'", link.name)] = link.element->GetLineNum();
  for (const Joint& joint : robot.joints) {
    robot.result.lines[label(joint)] = line_of(joint);
    if (const xml::XMLElement* mimic = joint.element->FirstChildElement("mimic")) {
      robot.result.lines[fmt::format("coupling '{}'", joint.name)] = mimic->GetLineNum();
    }
  }
}

}  // namespace assay::urdf
