#include "load/urdf/robot.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

#include <fmt/format.h>

namespace assay::urdf {
namespace {

namespace xml = tinyxml2;

// Keeps with each element how many of its name begin in its line before it, while all are there.
void count_elements(xml::XMLElement& element, std::map<std::pair<int, std::string>, std::uintptr_t>& counted) {
  element.SetUserData(reinterpret_cast<void*>(counted[{element.GetLineNum(), element.Name()}]++));
  for (xml::XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    count_elements(*e, counted);
  }
}

}  // namespace

int line_of(const Joint& joint) { return joint.element->GetLineNum(); }

std::string label(const Joint& joint) { return fmt::format("joint '{}'", joint.name); }

void set_type(Joint& joint, const char* type) {
  joint.type = type;
  joint.element->SetAttribute("type", type);
}

std::string triple(const Vec3& v) { return fmt::format("{:.17g} {:.17g} {:.17g}", v.x(), v.y(), v.z()); }

Robot::Robot(const std::string& text, std::string from, const LoadOptions& how) : path(std::move(from)), options(how) {
  document.Parse(text.data(), text.size());
  if (document.Error()) return;
  std::map<std::pair<int, std::string>, std::uintptr_t> counted;
  count_elements(*document.RootElement(), counted);
  element = document.FirstChildElement("robot");
}

void Robot::refuse(const std::string& part, int line, std::string message, std::string mend, std::string option) {
  result.problems.push_back({.severity = Severity::kRefused,
                             .element = part,
                             .line = line,
                             .message = std::move(message),
                             .mend = std::move(mend),
                             .option = std::move(option)});
}

void Robot::leave_out(const std::string& part, int line, const std::string& message) {
  result.problems.push_back(
      {.severity = Severity::kLeftOut, .element = part, .line = line, .message = message, .mend = {}, .option = {}});
  note(fmt::format("{} {}", part, message));
}

std::vector<int> Robot::tree_of(int root) const {
  std::vector<int> tree = {root};
  for (size_t k = 0; k < tree.size(); ++k) {
    for (const int joint : links[tree[k]].children) tree.push_back(joints[joint].child);
  }
  return tree;
}

double Robot::carried_mass(int link) const {
  double mass = std::abs(links[link].mass);
  for (const int joint : links[link].children) mass += carried_mass(joints[joint].child);
  return mass;
}

bool Robot::carries_shapes(int link) const {
  return links[link].element->FirstChildElement("collision") != nullptr ||
         std::ranges::any_of(links[link].children, [&](int joint) { return carries_shapes(joints[joint].child); });
}

int index_of(const xml::XMLElement& element) {
  return static_cast<int>(reinterpret_cast<std::uintptr_t>(element.GetUserData()));
}

void Repairs::change(const xml::XMLElement& element, const char* attribute, const std::string& value) {
  edits.push_back({element.GetLineNum(), index_of(element), element.Name(), attribute, value});
}

}  // namespace assay::urdf
