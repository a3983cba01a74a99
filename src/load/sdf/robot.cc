#include "load/sdf/robot.h"

#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "base/text.h"
#include "load/sdf/values.h"

namespace assay::sdf {
namespace {

// "<mass> of link 'a'"
std::string element_of(const Element& element, const std::string& owner) {
  return fmt::format("<{}> of {}", element.at->Name(), owner);
}

}  // namespace

Element Element::child(const char* name) const {
  return {at == nullptr ? nullptr : at->FirstChildElement(name), source};
}

Element Element::next(const char* name) const { return {at->NextSiblingElement(name), source}; }

void Robot::refuse(const std::string& part, const Element& where, std::string message, std::string mend,
                   std::string option) {
  result.parts.problems.push_back({.severity = Severity::kRefused,
                                   .element = part,
                                   .line = where.line(),
                                   .file = where.source == nullptr ? "" : where.source->name,
                                   .message = std::move(message),
                                   .mend = std::move(mend),
                                   .option = std::move(option)});
}

bool Robot::unsupported(const std::string& part, const Element& where, const std::string& message,
                        const std::string& mend, const std::string& costs) {
  if (!options.drop_unsupported) {
    refuse(part, where, message, mend, "--drop-unsupported: it " + costs);
    return false;
  }
  Problem problem = {.severity = Severity::kLeftOut,
                     .element = part,
                     .line = where.line(),
                     .file = where.source == nullptr ? "" : where.source->name,
                     .message = fmt::format("{}: it {}", message, costs)};
  note(problem_text(problem));
  result.parts.problems.push_back(std::move(problem));
  return true;
}

std::string Robot::place(const Element& where) const {
  return place_text(where.source == nullptr ? "" : where.source->name, where.line());
}

int Robot::line_of(const std::string& label, const Element& where) {
  if (where.source == nullptr || where.source->name.empty()) return where.line();
  result.included.emplace(label, IncludedPlace{.file = where.source->name, .line = where.line()});
  return 0;
}

double Robot::number(const Element& element, double otherwise, const std::string& owner) {
  if (!element) return otherwise;
  const std::string text = text_of(element.at);
  if (const std::optional<double> value = sdf::number(text)) return *value;
  refuse(element_of(element, owner), element, fmt::format("is '{}'", text), "give a number");
  return otherwise;
}

bool Robot::truth(const Element& element, bool otherwise, const std::string& owner) {
  if (!element) return otherwise;
  const std::string text = text_of(element.at);
  if (const std::optional<bool> value = sdf::truth(text)) return *value;
  refuse(element_of(element, owner), element, fmt::format("is '{}'", text), "give true or false");
  return otherwise;
}

std::vector<double> Robot::numbers(const Element& element, size_t count, const std::string& owner) {
  const std::string text = text_of(element.at);
  std::optional<std::vector<double>> values = sdf::numbers(text);
  bool good = values && values->size() == count;
  for (size_t i = 0; good && i < count; ++i) good = std::isfinite((*values)[i]);
  if (good) return std::move(*values);
  refuse(element_of(element, owner), element, fmt::format("is '{}'", text), fmt::format("give {} numbers", count));
  return {};
}

Vec3 Robot::vector(const Element& element, const Vec3& otherwise, const std::string& owner) {
  if (!element) return otherwise;
  const std::vector<double> v = numbers(element, 3, owner);
  return v.empty() ? otherwise : Vec3(v[0], v[1], v[2]);
}

// Roll, pitch and yaw turn about fixed axes.
Pose Robot::pose(const Element& element, const std::string& owner) {
  if (!element || text_of(element.at).empty()) return {};
  const std::string format = attribute(element.at, "rotation_format");
  const bool quaternion = format == "quat_xyzw";
  if (!format.empty() && !quaternion && format != "euler_rpy") {
    refuse(element_of(element, owner), element, fmt::format("has rotation_format=\"{}\"", format),
           "give euler_rpy or quat_xyzw");
    return {};
  }
  const std::string degrees = attribute(element.at, "degrees");
  const std::optional<bool> in_degrees = degrees.empty() ? std::optional(false) : sdf::truth(degrees);
  if (!in_degrees || (*in_degrees && quaternion)) {
    refuse(element_of(element, owner), element, fmt::format("has degrees=\"{}\"", degrees),
           quaternion ? "remove it: a quaternion has no degrees" : "give true or false");
    return {};
  }
  const std::vector<double> v = numbers(element, quaternion ? 7 : 6, owner);
  if (v.empty()) return {};
  Pose X;
  X.p = Vec3(v[0], v[1], v[2]);
  if (quaternion) {
    const Quat q(v[6], v[3], v[4], v[5]);
    if (q.norm() < 1e-9) {
      refuse(element_of(element, owner), element, "has the quaternion 0", "give one of length 1");
      return {};
    }
    X.q = q.normalized();
  } else {
    const double unit = *in_degrees ? std::numbers::pi / 180 : 1;
    X.q = Eigen::AngleAxisd(unit * v[5], Vec3::UnitZ()) * Eigen::AngleAxisd(unit * v[4], Vec3::UnitY()) *
          Eigen::AngleAxisd(unit * v[3], Vec3::UnitX());
  }
  return X;
}

}  // namespace assay::sdf
