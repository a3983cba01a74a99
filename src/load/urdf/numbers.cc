#include "load/urdf/numbers.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>
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

namespace xml = tinyxml2;

// The number of a bound, which may be infinite; NaN for what is none.
double bound_of(const xml::XMLElement& limit, const char* attribute) {
  std::string word = text_of(&limit, attribute);
  std::erase_if(word, [](unsigned char c) { return std::isspace(c) != 0; });
  std::ranges::transform(word, word.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const double sign = word.starts_with('-') ? -1 : 1;
  if (word.starts_with('-') || word.starts_with('+')) word.erase(0, 1);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (word == "inf" || word == "infinity") return sign * kInfinity;
  const auto number = parse_number(word);
  return number ? sign * *number : std::nan("");
}

// A bound that no robot reaches is none, which is what people write it for. One alone becomes a number that engines
// in single precision can hold.
void check_limit(Robot& robot, const Joint& joint, xml::XMLElement& limit) {
  constexpr double kNone = 1e9, kFar = 1e4;  // rad or m
  for (const char* attribute : {"lower", "upper", "effort"}) {
    if (limit.Attribute(attribute) == nullptr || !std::isnan(bound_of(limit, attribute))) continue;
    robot.refuse(fmt::format("<limit> of {}", label(joint)), limit.GetLineNum(),
                 fmt::format("has {}=\"{}\"", attribute, text_of(&limit, attribute)),
                 "give a number, or inf for no limit");
    return;
  }
  if (limit.Attribute("effort") != nullptr && bound_of(limit, "effort") >= kNone) limit.DeleteAttribute("effort");
  const bool bounded = limit.Attribute("lower") != nullptr || limit.Attribute("upper") != nullptr;
  if (!bounded) return;
  const double lower = limit.Attribute("lower") == nullptr ? 0 : bound_of(limit, "lower");
  const double upper = limit.Attribute("upper") == nullptr ? 0 : bound_of(limit, "upper");
  if (lower <= -kNone && upper >= kNone) {
    limit.DeleteAttribute("lower");
    limit.DeleteAttribute("upper");
    return;
  }
  for (const auto& [attribute, bound] : {std::pair("lower", lower), std::pair("upper", upper)}) {
    if (std::abs(bound) < kNone) continue;
    limit.SetAttribute(attribute, bound < 0 ? -kFar : kFar);
    robot.note(fmt::format("{} (line {}) has {}=\"{:g}\": {:g} is taken", label(joint), limit.GetLineNum(), attribute,
                           bound, bound < 0 ? -kFar : kFar));
  }
}

// True where the numbers are all there with commas between them, which a repair takes out.
bool separated_by_commas(Robot& robot, xml::XMLElement& element, const std::string& attribute, size_t count,
                         const std::string& owner, Repairs* repairs) {
  const std::string value = text_of(&element, attribute.c_str());
  std::string blanks = value;
  std::ranges::replace_if(blanks, [](char c) { return c == ',' || c == ';'; }, ' ');
  if (blanks == value) return false;
  element.SetAttribute(attribute.c_str(), blanks.c_str());
  const std::vector<double> numbers = numbers_of(&element, attribute.c_str());
  if (numbers.size() != count || !std::ranges::all_of(numbers, [](double v) { return std::isfinite(v); })) {
    element.SetAttribute(attribute.c_str(), value.c_str());
    return false;
  }
  const std::string place = fmt::format("<{}> of {}", element.Name(), owner);
  if (repairs != nullptr) {
    repairs->change(element, attribute.c_str(), blanks);
    repairs->mends.push_back(
        {element.GetLineNum(), fmt::format("{}: {}=\"{}\" -> \"{}\"", place, attribute, value, blanks)});
  } else {
    robot.refuse(place, element.GetLineNum(),
                 fmt::format("has {}=\"{}\", with commas between its numbers", attribute, value),
                 "write blanks, give --repair, or write a mended file with `assay check FILE --repair OUT`");
  }
  return true;
}

// Numbers that every URDF reader takes from these attributes.
void check_numbers_below(Robot& robot, xml::XMLElement& element, const std::string& owner, Repairs* repairs) {
  static const std::map<std::string, std::vector<std::pair<std::string, size_t>>> kAttributes = {
      {"origin", {{"xyz", 3}, {"rpy", 3}}},
      {"axis", {{"xyz", 3}}},
      {"mass", {{"value", 1}}},
      {"inertia", {{"ixx", 1}, {"ixy", 1}, {"ixz", 1}, {"iyy", 1}, {"iyz", 1}, {"izz", 1}}},
      {"dynamics", {{"damping", 1}, {"friction", 1}}},
      {"mimic", {{"multiplier", 1}, {"offset", 1}}},
      {"box", {{"size", 3}}},
      {"cylinder", {{"radius", 1}, {"length", 1}}},
      {"capsule", {{"radius", 1}, {"length", 1}}},
      {"sphere", {{"radius", 1}}},
      {"mesh", {{"scale", 3}}}};
  if (const auto known = kAttributes.find(element.Name()); known != kAttributes.end()) {
    for (const auto& [attribute, count] : known->second) {
      if (element.Attribute(attribute.c_str()) == nullptr) continue;
      const std::vector<double> numbers = numbers_of(&element, attribute.c_str());
      if (numbers.size() == count && std::ranges::all_of(numbers, [](double v) { return std::isfinite(v); })) continue;
      if (separated_by_commas(robot, element, attribute, count, owner, repairs)) continue;
      robot.refuse(fmt::format("<{}> of {}", element.Name(), owner), element.GetLineNum(),
                   fmt::format("has {}=\"{}\"", attribute, text_of(&element, attribute.c_str())),
                   text_of(&element, attribute.c_str()).find("$(") != std::string::npos
                       ? kExpand
                       : fmt::format("give {} finite {}", count, count == 1 ? "number" : "numbers"));
    }
  }
  for (xml::XMLElement* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    if (std::string_view(e->Name()) != "visual") check_numbers_below(robot, *e, owner, repairs);
  }
}

}  // namespace

bool check_numbers(Robot& robot, Repairs* repairs) {
  for (const Link& link : robot.links)
    check_numbers_below(robot, *link.element, fmt::format("link '{}'", link.name), repairs);
  for (const Joint& joint : robot.joints) {
    check_numbers_below(robot, *joint.element, label(joint), repairs);
    if (xml::XMLElement* limit = joint.element->FirstChildElement("limit")) check_limit(robot, joint, *limit);
  }
  return !robot.result.refused();
}

}  // namespace assay::urdf
