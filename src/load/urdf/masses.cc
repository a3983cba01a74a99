#include "load/urdf/masses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>
#include <tinyxml2.h>

#include "base/errors.h"
#include "base/text.h"
#include "load/urdf/shapes.h"
#include "load/urdf/values.h"

namespace assay::urdf {
namespace {

namespace xml = tinyxml2;

// How a robot without masses gets them.
constexpr const char* kMassOfShapes =
    "<mujoco><compiler inertiafromgeom=\"auto\"/></mujoco>, which takes the mass of its collision shapes";

constexpr const char* kMendInertia =
    "correct <inertia>, give --repair, or write a mended file with `assay check FILE --repair OUT`";

// MuJoCo takes less for nothing.
bool compiles(const RigidPart& part) {
  constexpr double kLeast = 1e-12;  // kg, kg m^2
  return part.mass > kLeast && principal_moments(part.I)[0] > kLeast;
}

void add_inertial(xml::XMLElement* link, const RigidPart& part) {
  xml::XMLElement* inertial = link->InsertNewChildElement("inertial");
  inertial->InsertNewChildElement("origin")->SetAttribute("xyz", triple(part.p).c_str());
  inertial->InsertNewChildElement("mass")->SetAttribute("value", digits17(part.mass).c_str());
  xml::XMLElement* inertia = inertial->InsertNewChildElement("inertia");
  for (const auto& [name, at] : kInertiaEntries) {
    inertia->SetAttribute(name, digits17(part.I(at.first, at.second)).c_str());
  }
}

}  // namespace

Mat3 inertia_of(const xml::XMLElement& inertial) {
  const xml::XMLElement* e = inertial.FirstChildElement("inertia");
  const double xy = number_of(e, "ixy", 0), xz = number_of(e, "ixz", 0), yz = number_of(e, "iyz", 0);
  Mat3 I;
  I << number_of(e, "ixx", 0), xy, xz, xy, number_of(e, "iyy", 0), yz, xz, yz, number_of(e, "izz", 0);
  return I;
}

std::string moments_text(const Vec3& e) { return fmt::format("{:.3g}, {:.3g}, {:.3g}", e[0], e[1], e[2]); }

void Masses::read() {
  for (Link& link : robot_.links) {
    if (const xml::XMLElement* inertial = link.element->FirstChildElement("inertial")) {
      link.mass = number_of(inertial->FirstChildElement("mass"), "value", 0);
      link.I = inertia_of(*inertial);
      link.X_LI = origin_of(*inertial);
    }
  }
  update_groups();
  if (!robot_.compiler.changes_inertia()) return;
  take_shapes();
  for (Link& link : robot_.links) bound(link);
  update_groups();
}

// The mass of shapes, of fixed links together where MuJoCo fuses them: then those without shapes lose theirs.
void Masses::take_shapes() {
  using From = UrdfCompiler::FromShapes;
  if (robot_.compiler.from_shapes == From::kNever) return;
  const bool always = robot_.compiler.from_shapes == From::kAlways;
  std::vector<bool> has_shapes(robot_.links.size()), in_group(robot_.links.size());
  for (size_t i = 0; i < robot_.links.size(); ++i) {
    has_shapes[i] = robot_.links[i].element->FirstChildElement("collision") != nullptr;
    if (has_shapes[i]) in_group[static_cast<size_t>(head_[i])] = true;
  }
  size_t count = 0;
  for (size_t i = 0; i < robot_.links.size(); ++i) {
    Link& link = robot_.links[i];
    const bool has_own = link.element->FirstChildElement("inertial") != nullptr;
    if (always && !has_shapes[i] && has_own && robot_.compiler.fuses && in_group[static_cast<size_t>(head_[i])]) {
      link.mass = 0;
      link.I = Mat3::Zero();
      link.computed = true;
    }
    if (!has_shapes[i] || (!always && has_own)) continue;
    take_shapes(link);
    ++count;
  }
  robot_.note(
      fmt::format("{} mass and inertia of {} shapes, as <mujoco><compiler inertiafromgeom=\"{}\"> "
                  "says",
                  count == 1 ? "1 link has the" : fmt::format("{} links have the", count), count == 1 ? "its" : "their",
                  always ? "true" : "auto"));
}

void Masses::take_shapes(Link& link) {
  const std::vector<SolidShape> shapes = shapes_of(robot_, link);
  if (shapes.empty()) return;
  try {
    const RigidPart part = part_of_shapes(shapes);
    link.mass = part.mass;
    link.I = part.I;
    link.X_LI = {part.p, Quat::Identity()};
    link.computed = true;
  } catch (const InputError& error) {
    robot_.refuse(fmt::format("link '{}'", link.name), link.element->GetLineNum(),
                  fmt::format("has shapes without a mass: {}", error.what()),
                  "give it an <inertial>, and leave inertiafromgeom out of <mujoco><compiler>");
  }
}

// boundmass, boundinertia and balanceinertia of a link, in MuJoCo's order.
void Masses::bound(Link& link) const {
  if (link.mass < robot_.compiler.bound_mass) {
    link.mass = robot_.compiler.bound_mass;
    link.computed = true;
  }
  if (robot_.compiler.bound_inertia == 0 && !robot_.compiler.balance) return;
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(link.I);
  Vec3 m = solver.eigenvalues();
  const Vec3 as_written = m;
  if (link.mass > 0) m = m.cwiseMax(robot_.compiler.bound_inertia);
  if (robot_.compiler.balance && m[0] > 0 && m[0] + m[1] < m[2]) m.setConstant(m.mean());
  if (m == as_written) return;
  link.I = solver.eigenvectors() * m.asDiagonal() * solver.eigenvectors().transpose();
  link.computed = true;
}

void Masses::scale_to_total() {
  update_groups();
  if (robot_.compiler.total_mass == 0) return;
  double mass = 0;
  for (size_t i = 0; i < robot_.links.size(); ++i) {
    if (!robot_.compiler.fuses || !is_static(static_cast<int>(i))) mass += robot_.links[i].mass;
  }
  if (mass <= 0) return;
  const double scale = robot_.compiler.total_mass / mass;
  for (Link& link : robot_.links) {
    link.mass *= scale;
    link.I *= scale;
    link.computed = true;
  }
  update_groups();
  robot_.note(
      fmt::format("masses and inertias are scaled by {:.6g}, as <mujoco><compiler "
                  "settotalmass=\"{:g}\"> says",
                  scale, robot_.compiler.total_mass));
}

void Masses::update_groups() {
  head_.assign(robot_.links.size(), -1);
  X_HL_.assign(robot_.links.size(), Pose{});
  for (const int i : robot_.order) {
    const Link& link = robot_.links[i];
    if (link.joint < 0 || robot_.moves(link)) {
      head_[i] = i;
      continue;
    }
    const int parent = robot_.joints[link.joint].parent;
    head_[i] = head_[parent];
    X_HL_[i] = X_HL_[parent] * origin_of(*robot_.joints[link.joint].element);
  }
  whole_.assign(robot_.links.size(), RigidPart{});
  for (const int i : robot_.order) {
    const Link& link = robot_.links[i];
    const Pose X_HI = X_HL_[i] * link.X_LI;
    const Mat3 R = X_HI.q.toRotationMatrix();
    whole_[head_[i]] = joined(whole_[head_[i]], {link.mass, X_HI.p, R * link.I * R.transpose()});
  }
}

void Masses::find_idle() {
  for (const int i : robot_.order) {
    const Link& link = robot_.links[i];
    if (!robot_.moves(link) || robot_.carried_mass(i) > 0) continue;
    idle_.insert(link.joint);
  }
}

void Masses::check() {
  for (const int joint : idle_) {
    Joint& j = robot_.joints[joint];
    if (robot_.options.drop_unsupported) {
      set_type(j, "fixed");
      robot_.leave_out(label(j), line_of(j),
                       "moves no mass and is fixed: it has no dynamics, and what is drawn there does not move");
    } else {
      robot_.refuse(label(j), line_of(j),
                    "moves no mass: link '" + robot_.links[j.child].name + "' and what it carries have none",
                    fmt::format("give the link an <inertial>{}, or make the joint fixed",
                                robot_.carries_shapes(j.child) ? fmt::format(" or the robot {}", kMassOfShapes) : ""),
                    "--drop-unsupported, which fixes it");
    }
  }
  if (!idle_.empty()) update_groups();
  for (const int i : robot_.order) check_link(i);
}

void Masses::check_link(int i) {
  const Link& link = robot_.links[i];
  const xml::XMLElement* inertial = link.element->FirstChildElement("inertial");
  const std::string name = fmt::format("link '{}'", link.name);
  const int line = inertial == nullptr ? link.element->GetLineNum() : inertial->GetLineNum();
  if (link.mass < 0) {
    robot_.refuse(name, line, fmt::format("has the mass {} kg", shortest(link.mass)), "give a positive mass");
    return;
  }
  if (is_static(i)) return;
  if (head_[i] == i && whole_[i].mass == 0 && robot_.joints[link.joint].type == "floating") {
    robot_.refuse(name, line, "is free and has no mass",
                  fmt::format("give it an <inertial>{}, or leave out --floating-base",
                              robot_.carries_shapes(i) ? fmt::format(" or the robot {}", kMassOfShapes) : ""));
    return;
  }
  const bool whole_valid = whole_[head_[i]].mass == 0 || inertia_valid(whole_[head_[i]].I);
  const Vec3 own = principal_moments(link.I);
  const bool own_zero = link.I.isZero(0);
  const bool own_valid = own_zero ? true : inertia_possible(link.I);
  if (!own_valid || (link.mass == 0 && !own_zero)) {
    std::string fault = "has inertia without mass";
    if (link.mass != 0 && own[0] <= 0) {
      fault = fmt::format("has an inertia that is not positive (principal moments {} kg m^2)", moments_text(own));
    } else if (link.mass != 0) {
      fault = fmt::format(
          "has an inertia that breaks the triangle inequality (principal moments {} kg m^2: {:.3g} + {:.3g} < "
          "{:.3g})",
          moments_text(own), own[0], own[1], own[2]);
    }
    if (whole_valid) {
      robot_.note(fmt::format(
          "{} (line {}) {}; it stays, because the inertia of all links that are fixed to each other is valid", name,
          line, fault));
    } else {
      robot_.refuse(name, line, fault, link.mass == 0 ? "give it a <mass>, or remove its <inertial>" : kMendInertia);
    }
    return;
  }
  if (head_[i] == i && whole_[i].mass > 0 && !whole_valid) {
    // every part may be possible and the whole still be a point or a line
    for (size_t k = 0; k < robot_.links.size(); ++k) {
      if (head_[k] != i) continue;
      if (robot_.links[k].mass < 0 || (!inertia_possible(robot_.links[k].I) && !robot_.links[k].I.isZero(0)))
        return;  // named there
    }
    const bool missing = inertial != nullptr && inertial->FirstChildElement("inertia") == nullptr;
    robot_.refuse(name, line,
                  missing ? "has a mass and no <inertia>"
                          : fmt::format("has an inertia that is not positive (principal moments {} kg m^2)",
                                        moments_text(principal_moments(whole_[i].I))),
                  missing ? "give it one, or give --repair, which computes it from the link's shapes" : kMendInertia);
  }
}

void Masses::write() {
  for (const int h : robot_.order) {
    if (head_[h] != h) continue;
    std::vector<int> parts;
    for (const int i : robot_.order) {
      if (head_[i] == h) parts.push_back(i);
    }
    const bool fixed = h == robot_.order.front();
    const bool plain = std::ranges::all_of(parts, [&](int i) {
      if (robot_.links[i].computed) return false;
      return robot_.links[i].element->FirstChildElement("inertial") == nullptr ||
             (robot_.links[i].mass > 0 && inertia_valid(robot_.links[i].I) &&
              compiles({robot_.links[i].mass, {}, robot_.links[i].I}));
    });
    if (plain && !fixed && robot_.links[h].mass > 0) continue;
    for (const int i : parts) {
      if (xml::XMLElement* own = robot_.links[i].element->FirstChildElement("inertial"))
        robot_.links[i].element->DeleteChild(own);
    }
    if (fixed) continue;
    RigidPart whole = whole_[h];
    if (whole.mass == 0) {
      robot_.result.massless.insert(robot_.links[h].name);
      whole = {1, Vec3::Zero(), Mat3::Identity()};
    } else if (!compiles(whole)) {
      robot_.result.inertia.emplace(robot_.links[h].name, whole);
      whole = {1, Vec3::Zero(), Mat3::Identity()};
    }
    add_inertial(robot_.links[h].element, whole);
  }
}

}  // namespace assay::urdf
