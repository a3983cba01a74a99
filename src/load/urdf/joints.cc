#include "load/urdf/joints.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <tinyxml2.h>

#include "base/text.h"
#include "load/urdf/values.h"

namespace assay::urdf {
namespace {

namespace xml = tinyxml2;

bool is_scalar(const Joint& joint) { return joint.type == "revolute" || joint.type == "prismatic"; }

// What mimics a joint that is held, is held too.
void add_followers(const Robot& robot, std::map<std::string, double>& held) {
  for (size_t round = 0, before = 0; before != held.size() && round <= robot.joints.size(); ++round) {
    before = held.size();
    for (const Joint& joint : robot.joints) {
      const xml::XMLElement* mimic = joint.element->FirstChildElement("mimic");
      const auto leader = held.find(text_of(mimic, "joint"));
      const bool follows = mimic != nullptr && leader != held.end() && (is_scalar(joint) || joint.type == "continuous");
      if (!follows || held.contains(joint.name)) continue;
      held[joint.name] = number_of(mimic, "multiplier", 1) * leader->second + number_of(mimic, "offset", 0);
    }
  }
}

// Fixes a joint at this position.
void hold(Joint& joint, double position) {
  const Vec3 axis = vector_of(joint.element->FirstChildElement("axis"), "xyz", Vec3::UnitX());
  if (axis.norm() == 0) return;  // refused elsewhere
  Pose moved;
  if (joint.type == "prismatic") {
    moved.p = position * axis.normalized();
  } else {
    moved.q = Eigen::AngleAxisd(position, axis.normalized());
  }
  const Pose X = origin_of(*joint.element) * moved;
  xml::XMLElement* origin = joint.element->FirstChildElement("origin");
  if (origin == nullptr) origin = joint.element->InsertNewChildElement("origin");
  const Mat3 R = X.q.toRotationMatrix();
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  const bool level = std::hypot(R(0, 0), R(1, 0)) > 1e-9;  // else roll and yaw turn about one axis
  const double roll = level ? std::atan2(R(2, 1), R(2, 2)) : std::atan2(-R(1, 2), R(1, 1));
  const double yaw = level ? std::atan2(R(1, 0), R(0, 0)) : 0;
  origin->SetAttribute("xyz", triple(X.p).c_str());
  origin->SetAttribute("rpy", triple(Vec3(roll, pitch, yaw)).c_str());
  if (xml::XMLElement* mimic = joint.element->FirstChildElement("mimic")) joint.element->DeleteChild(mimic);
  set_type(joint, "fixed");
}

void refuse_mimic(Robot& robot, Joint& joint, xml::XMLElement& mimic, const std::string& fault,
                  const std::string& mend) {
  if (robot.options.drop_unsupported) {
    robot.leave_out(label(joint), mimic.GetLineNum(), fault + ": its <mimic> is left out, so that it moves freely");
    joint.element->DeleteChild(&mimic);
  } else {
    robot.refuse(label(joint), mimic.GetLineNum(), fault, mend,
                 "--drop-unsupported, which removes it, so that the joint moves freely");
  }
}

// Joints that mimic each other in a circle: their position follows from nothing, and may contradict itself.
void open_mimic_cycles(Robot& robot) {
  std::map<std::string, int> index_of;
  for (size_t j = 0; j < robot.joints.size(); ++j) index_of.emplace(robot.joints[j].name, static_cast<int>(j));
  std::vector<int> leader(robot.joints.size(), -1);
  for (size_t j = 0; j < robot.joints.size(); ++j) {
    const xml::XMLElement* mimic = robot.joints[j].element->FirstChildElement("mimic");
    const auto found = index_of.find(text_of(mimic, "joint"));
    if (mimic == nullptr || robot.joints[j].type == "fixed" || found == index_of.end()) continue;
    if (robot.joints[found->second].type != "fixed") leader[j] = found->second;
  }
  std::vector<size_t> walk_of(robot.joints.size(), 0);  // the walk that came there first, from 1
  for (size_t start = 0; start < robot.joints.size(); ++start) {
    std::vector<int> way;
    int j = static_cast<int>(start);
    for (; j >= 0 && walk_of[j] == 0; j = leader[j]) {
      walk_of[j] = start + 1;
      way.push_back(j);
    }
    if (j < 0 || walk_of[j] != start + 1) continue;
    std::vector<std::string> between;
    for (auto k = std::ranges::find(way, j) + 1; k != way.end(); ++k) {
      between.push_back(fmt::format("'{}'", robot.joints[*k].name));
    }
    const std::string through = between.empty() ? "" : fmt::format(" by way of {}", join(between, ", "));
    refuse_mimic(robot, robot.joints[j], *robot.joints[j].element->FirstChildElement("mimic"),
                 "mimics itself" + through,
                 between.empty() ? "name another joint in <mimic>" : "remove <mimic> from one of them");
  }
}

void adapt_mimic(Robot& robot, Joint& joint) {
  xml::XMLElement* mimic = joint.element->FirstChildElement("mimic");
  if (mimic == nullptr) return;
  const std::string target = text_of(mimic, "joint");
  const auto found = std::ranges::find(robot.joints, target, &Joint::name);
  if (joint.type == "fixed") {
    joint.element->DeleteChild(mimic);
  } else if (found == robot.joints.end()) {
    std::vector<std::string> names;
    names.reserve(robot.joints.size());
    for (const Joint& other : robot.joints) names.push_back(other.name);
    refuse_mimic(robot, joint, *mimic,
                 fmt::format("mimics the unknown joint '{}'{}", target,
                             nearest_name(target, names) ? did_you_mean(target, names) : ""),
                 "correct <mimic>");
  } else if (found->type == "fixed") {
    if (robot.options.drop_unsupported) {
      robot.leave_out(label(joint), mimic->GetLineNum(),
                      fmt::format("mimics joint '{}', which is fixed: it moves freely instead", target));
      joint.element->DeleteChild(mimic);
    } else {
      robot.refuse(label(joint), mimic->GetLineNum(), fmt::format("mimics joint '{}', which is fixed", target),
                   "make both fixed or remove <mimic>",
                   "--drop-unsupported, which removes it, so that the joint moves freely");
    }
  }
}

}  // namespace

void lock_joints(Robot& robot) {
  constexpr double kNoWay = 1e-6;      // rad or m
  std::map<std::string, double> held;  // joint -> where
  for (const Joint& joint : robot.joints) {
    xml::XMLElement* limit = joint.element->FirstChildElement("limit");
    if (!is_scalar(joint) || limit == nullptr) continue;
    if (limit->Attribute("lower") == nullptr && limit->Attribute("upper") == nullptr) continue;
    const double lower = number_of(limit, "lower", 0), upper = number_of(limit, "upper", 0);
    if (std::abs(upper - lower) > kNoWay) continue;
    if (joint.element->FirstChildElement("mimic") != nullptr) {
      limit->DeleteAttribute("lower");
      limit->DeleteAttribute("upper");
      robot.note(fmt::format("{} (line {}) has equal limits and mimics a joint: the limits are left out", label(joint),
                             limit->GetLineNum()));
      continue;
    }
    held[joint.name] = (lower + upper) / 2;
  }
  if (held.empty()) return;
  robot.result.locked = held;
  add_followers(robot, held);
  const bool others_move = std::ranges::any_of(
      robot.joints, [&](const Joint& joint) { return joint.type != "fixed" && !held.contains(joint.name); });
  for (Joint& joint : robot.joints) {
    const auto found = held.find(joint.name);
    if (found == held.end()) continue;
    xml::XMLElement* limit = joint.element->FirstChildElement("limit");
    if (others_move) {
      hold(joint, found->second);
    } else if (joint.element->FirstChildElement("mimic") == nullptr) {
      // something has to move: a range that engines take for one
      limit->SetAttribute("lower", digits17(found->second - kNoWay).c_str());
      limit->SetAttribute("upper", digits17(found->second + kNoWay).c_str());
      robot.result.starts[joint.name] = found->second;
    }
  }
  std::vector<std::string> names;
  names.reserve(robot.result.locked.size());
  for (const auto& [name, position] : robot.result.locked)
    names.push_back(fmt::format("'{}' at {:.4g}", name, position));
  constexpr size_t kNamed = 5;
  const size_t others = names.size() > kNamed ? names.size() - kNamed : 0;
  names.resize(names.size() - others);
  robot.note(fmt::format("joints {} by their equal limits: {}{}", others_move ? "that are fixed" : "that are held",
                         join(names, ", "), others > 0 ? fmt::format(" and {} more", others) : ""));
}

void adapt_joints(Robot& robot) {
  open_mimic_cycles(robot);
  size_t velocities = 0, unlimited = 0;
  for (Joint& joint : robot.joints) {
    xml::XMLElement* limit = joint.element->FirstChildElement("limit");
    if (limit != nullptr && (joint.type == "continuous" || joint.type == "fixed" || joint.type == "floating")) {
      limit->DeleteAttribute("lower");
      limit->DeleteAttribute("upper");
    } else if (limit != nullptr && (limit->Attribute("lower") != nullptr || limit->Attribute("upper") != nullptr)) {
      const double lower = number_of(limit, "lower", 0), upper = number_of(limit, "upper", 0);
      if (lower > upper) {
        robot.refuse(label(joint), limit->GetLineNum(),
                     fmt::format("has a lower limit {} above its upper limit {}", shortest(lower), shortest(upper)),
                     "swap them, give --repair, or write a mended file with `assay check FILE --repair OUT`");
      }
      if (limit->Attribute("lower") == nullptr) limit->SetAttribute("lower", "0");
      if (limit->Attribute("upper") == nullptr) limit->SetAttribute("upper", "0");
    }
    if (joint.type == "spherical" && limit != nullptr && number_of(limit, "lower", 0) != 0) {
      robot.note(
          fmt::format("{} (line {}) is spherical, and its limits are not read: only a largest "
                      "angle, with lower=\"0\", is one",
                      label(joint), limit->GetLineNum()));
      limit->DeleteAttribute("lower");
      limit->DeleteAttribute("upper");
    }
    const xml::XMLElement* axis = joint.element->FirstChildElement("axis");
    if (joint.type != "fixed" && joint.type != "floating" && axis != nullptr &&
        vector_of(axis, "xyz", Vec3::UnitX()).norm() < 1e-9) {
      robot.refuse(label(joint), axis->GetLineNum(), fmt::format("has the axis {}", text_of(axis, "xyz")),
                   "give a direction that is not zero");
    }
    if (joint.type == "floating" && joint.parent != robot.order.front()) {
      robot.refuse(label(joint), line_of(joint), "is floating and not at the root",
                   "make it fixed, or make its parent the root link");
    }
    adapt_mimic(robot, joint);
    if (joint.type != "revolute" && joint.type != "continuous" && joint.type != "prismatic") continue;
    if (limit != nullptr && limit->Attribute("velocity") != nullptr) {
      ++velocities;
      robot.result.velocity_limits[joint.name] = number_of(limit, "velocity", 0);
    }
    if (joint.element->FirstChildElement("mimic") != nullptr) continue;
    robot.result.driven.push_back(joint.name);
    if (number_of(limit, "effort", 0) <= 0) ++unlimited;
  }
  if (unlimited > 0) {
    robot.note(fmt::format("motors without a limit, because the effort limit is not above 0: {}", unlimited));
  }
  if (velocities > 0) {
    robot.note(fmt::format("velocity limits are not used, because no engine here has them: {}", velocities));
  }
}

}  // namespace assay::urdf
