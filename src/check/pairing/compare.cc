#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "check/pairing/align.h"
#include "check/pairing/drafts.h"
#include "check/pairing/match.h"
#include "check/pairing/match_trees.h"
#include "check/pairing/surfaces.h"
#include "check/parity/experiments.h"
#include "load/inertia.h"
#include "model/joint.h"
#include "model/kinematics.h"
#include "model/shape.h"

namespace assay::pairing {
namespace {

constexpr double kDegree = M_PI / 180;

// A body by its own name, or by its joint's where it has no mass.
std::string body_element(const Model& model, int body) {
  if (body == kWorld) return "the world";
  return fmt::format("body '{}'", model.bodies[static_cast<size_t>(body)].name);
}

Draft plain(const std::string& element, const std::string& parameter, const std::string& unit, double a, double b) {
  Draft draft{.difference = {.element = element, .parameter = parameter, .unit = unit, .a = a, .b = b}};
  draft.difference.words = instead(a, b, unit);
  return draft;
}

// ---- masses ---------------------------------------------------------------------------------------------------------

// Second moments of mass about the body's origin with the first and the mass: adding a part adds its own, which has no
// negative eigenvalue.
Eigen::Matrix4d pseudo_inertia(const Body& body) {
  const Mat3 second = 0.5 * body.I_BBcm_B.trace() * Mat3::Identity() - body.I_BBcm_B +
                      body.mass * body.p_BBcm * body.p_BBcm.transpose();
  Eigen::Matrix4d J;
  J << second, body.mass * body.p_BBcm, (body.mass * body.p_BBcm).transpose(), body.mass;
  return J;
}

double about_line(const Body& body, const Vec3& p, const Vec3& axis) {
  const Vec3 arm = body.p_BBcm - p;
  return axis.dot(body.I_BBcm_B * axis) + body.mass * (arm.squaredNorm() - std::pow(arm.dot(axis), 2));
}

void compare_mass(const Model& a, const Model& b, int index, std::vector<Draft>& drafts) {
  const Body &of_a = a.bodies[static_cast<size_t>(index)], &of_b = b.bodies[static_cast<size_t>(index)];
  const std::string element = body_element(a, index);
  if (of_a.mass == 0 && of_b.mass == 0) return;
  const bool mass = differ(of_a.mass, of_b.mass);
  if (of_a.mass == 0 || of_b.mass == 0) {
    Draft draft = plain(element, "mass", "kg", of_a.mass, of_b.mass);
    draft.put = [=](Model& model) {
      Body& body = model.bodies[static_cast<size_t>(index)];
      body.mass = of_b.mass, body.p_BBcm = of_b.p_BBcm,
      body.I_BBcm_B = of_b.mass > 0 ? of_b.I_BBcm_B : Mat3(Mat3::Zero());
    };
    drafts.push_back(std::move(draft));
    return;
  }
  const Vec3 shift = of_b.p_BBcm - of_a.p_BBcm;
  const bool centre = shift.norm() > kRoundingLength;
  const double scale = of_b.mass / of_a.mass;
  const double rounding = 0.4 * kRoundingRelative * of_a.I_BBcm_B.norm();
  const bool turns = (of_b.I_BBcm_B - of_a.I_BBcm_B).norm() > rounding;
  const bool scaled = (of_b.I_BBcm_B - scale * of_a.I_BBcm_B).norm() <= rounding;

  std::string inertia;
  {
    const Vec3 m_a = principal_moments(of_a.I_BBcm_B), m_b = principal_moments(of_b.I_BBcm_B);
    inertia = fmt::format("principal moments {:.4g}, {:.4g}, {:.4g} instead of {:.4g}, {:.4g}, {:.4g} kg m^2", m_b[0],
                          m_b[1], m_b[2], m_a[0], m_a[1], m_a[2]);
    const Eigen::SelfAdjointEigenSolver<Mat3> axes_a(of_a.I_BBcm_B), axes_b(of_b.I_BBcm_B);
    double turned = 0;
    for (int k = 0; k < 3; ++k) {
      // axes of moments that are nearly equal have no direction
      double gap = m_a[2];
      for (int n = 0; n < 3; ++n) gap = n == k ? gap : std::min(gap, std::abs(m_a[n] - m_a[k]));
      if (gap < 0.05 * m_a[2]) continue;
      const double cosine = std::abs(axes_a.eigenvectors().col(k).dot(axes_b.eigenvectors().col(k)));
      turned = std::max(turned, std::acos(std::min(1.0, cosine)));
    }
    if (turned > 10 * kRoundingAngle) inertia += fmt::format(", axes turned by {:.3g} degrees", turned / kDegree);
    if (of_a.joint >= 0 && !slides(a, of_a)) {
      const Joint& joint = a.joints[static_cast<size_t>(of_a.joint)];
      const double i_a = about_line(of_a, joint.p_BJ, joint.axis_B), i_b = about_line(of_b, joint.p_BJ, joint.axis_B);
      inertia += fmt::format("; about its joint {}", instead(i_a, i_b, "kg m^2"));
    }
  }
  const auto centre_words = [&] {
    return fmt::format("{:.3g} mm away ({:.3g}, {:.3g}, {:.3g} mm in A's axes of the body)", 1e3 * shift.norm(),
                       1e3 * shift.x(), 1e3 * shift.y(), 1e3 * shift.z());
  };

  // one cause of all three: a part that is heavier, or one that is not there
  bool part = false;
  if (mass && (centre || turns)) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> change(pseudo_inertia(of_b) - pseudo_inertia(of_a));
    const Eigen::Vector4d values = (of_b.mass > of_a.mass ? 1 : -1) * change.eigenvalues();
    const double unit = of_a.I_BBcm_B.norm() + of_a.mass * of_a.p_BBcm.squaredNorm();
    part = values.minCoeff() > -1e-3 * std::abs(scale - 1) * unit - 1e-6 * unit;
  }
  if (mass && (scaled || part || !turns)) {
    Draft draft = plain(element, "mass", "kg", of_a.mass, of_b.mass);
    if (centre && part) draft.difference.words += ", centre of mass " + centre_words();
    if (turns && part && !scaled) draft.difference.words += ", " + inertia;
    if (turns && scaled) draft.difference.words += ", its inertia alike";
    const bool whole = part, with_inertia = scaled && turns;
    draft.put = [=](Model& model) {
      Body& body = model.bodies[static_cast<size_t>(index)];
      body.mass = of_b.mass;
      if (whole) body.p_BBcm = of_b.p_BBcm;
      if (whole || with_inertia) body.I_BBcm_B = of_b.I_BBcm_B;
    };
    drafts.push_back(std::move(draft));
    if (part) return;
  } else if (mass) {
    Draft draft = plain(element, "mass", "kg", of_a.mass, of_b.mass);
    draft.put = [=](Model& model) { model.bodies[static_cast<size_t>(index)].mass = of_b.mass; };
    drafts.push_back(std::move(draft));
  }
  if (centre) {
    Draft draft{.difference = {.element = element,
                               .parameter = "centre of mass",
                               .unit = "m",
                               .a = 0,
                               .b = shift.norm(),
                               .words = centre_words()}};
    draft.put = [=](Model& model) { model.bodies[static_cast<size_t>(index)].p_BBcm = of_b.p_BBcm; };
    drafts.push_back(std::move(draft));
  }
  if (turns && !(mass && scaled)) {
    Draft draft{.difference = {.element = element,
                               .parameter = "inertia",
                               .unit = "kg m^2",
                               .a = of_a.I_BBcm_B.norm(),
                               .b = of_b.I_BBcm_B.norm(),
                               .words = inertia}};
    draft.put = [=](Model& model) { model.bodies[static_cast<size_t>(index)].I_BBcm_B = of_b.I_BBcm_B; };
    drafts.push_back(std::move(draft));
  }
}

// ---- joints ---------------------------------------------------------------------------------------------------------

std::string millimetres(const Vec3& v) {
  return fmt::format("by {:.3g} mm ({:.3g}, {:.3g}, {:.3g})", 1e3 * v.norm(), 1e3 * v.x(), 1e3 * v.y(), 1e3 * v.z());
}

void compare_place(const Model& a, const Model& b, int index, std::vector<Draft>& drafts) {
  const Body &of_a = a.bodies[static_cast<size_t>(index)], &of_b = b.bodies[static_cast<size_t>(index)];
  if (of_a.is_free()) return;
  const std::string element = element_of(a, index);
  const Vec3 anchor = anchor_of(a, of_a);
  const bool hinge = of_a.joint >= 0 && !slides(a, of_a);
  const Vec3 axis = of_a.joint >= 0 ? a.joints[static_cast<size_t>(of_a.joint)].axis_B : Vec3(Vec3::Zero());

  const Vec3 offset = of_b.X_PB * anchor - of_a.X_PB * anchor;  // in the parent's axes
  if (offset.norm() > kRoundingLength) {
    const Vec3 in_child = of_a.X_PB.q.conjugate() * offset;
    const bool along = slides(a, of_a) && in_child.cross(axis).norm() < kRoundingLength;
    Draft draft{.difference = {.element = element,
                               .parameter = along ? "zero position" : "offset",
                               .unit = "m",
                               .a = 0,
                               .b = offset.norm()}};
    draft.difference.words = "moved on its parent " + millimetres(offset);
    draft.put = [=](Model& model) { model.bodies[static_cast<size_t>(index)].X_PB.p += offset; };
    drafts.push_back(std::move(draft));
  }
  const Quat turn = of_a.X_PB.q.conjugate() * of_b.X_PB.q;
  if (const double angle = angle_of(turn); angle > kRoundingAngle) {
    const Vec3 about = rotation_vector(turn.w() < 0 ? Quat(-turn.w(), -turn.x(), -turn.y(), -turn.z()) : turn);
    const bool zero = hinge && about.cross(axis).norm() < std::max(kRoundingAngle, 1e-3 * angle);
    Draft draft{.difference = {.element = element,
                               .parameter = zero ? "zero position" : "orientation",
                               .unit = "rad",
                               .a = 0,
                               .b = angle}};
    draft.difference.words =
        zero ? fmt::format("turned by {:.3g} degrees at position 0", about.dot(axis) / kDegree)
             : fmt::format("turned on its parent, with what it carries, by {:.3g} degrees", angle / kDegree);
    const Quat q = of_b.X_PB.q;
    draft.put = [=](Model& model) {
      Pose& X_PB = model.bodies[static_cast<size_t>(index)].X_PB;
      const Vec3 stays = X_PB * anchor;
      X_PB.q = q;
      X_PB.p = stays - q * anchor;
    };
    drafts.push_back(std::move(draft));
  }
  if (of_a.joint >= 0) {
    const auto j = static_cast<size_t>(of_a.joint);
    const Vec3 to = b.joints[j].axis_B;
    if (const double angle = std::atan2(axis.cross(to).norm(), axis.dot(to)); angle > kRoundingAngle) {
      Draft draft{.difference = {.element = element, .parameter = "axis", .unit = "rad", .a = 0, .b = angle}};
      draft.difference.words = fmt::format("turned by {:.3g} degrees", angle / kDegree);
      draft.put = [=](Model& model) { model.joints[j].axis_B = to; };
      drafts.push_back(std::move(draft));
    }
  }
  if (hinge || of_a.ball >= 0) {
    const Vec3 moved = anchor_of(b, of_b) - anchor;
    if (moved.norm() > kRoundingLength) {
      Draft draft{.difference = {.element = element, .parameter = "anchor", .unit = "m", .a = 0, .b = moved.norm()}};
      draft.difference.words = "its line moved in its body " + millimetres(moved);
      draft.put = [=](Model& model) {
        const Body& body = model.bodies[static_cast<size_t>(index)];
        (body.joint >= 0 ? model.joints[static_cast<size_t>(body.joint)].p_BJ
                         : model.balls[static_cast<size_t>(body.ball)].p_BJ) += moved;
      };
      drafts.push_back(std::move(draft));
    }
  }
}

template <typename SomeJoint>
void compare_joint(const SomeJoint& a, const SomeJoint& b, size_t index, std::vector<SomeJoint> Model::* list,
                   std::vector<Draft>& drafts) {
  const std::string element = fmt::format("{} '{}'", noun(a), a.name);
  const JointUnits& units = units_of(a);
  const auto number = [&](const char* parameter, auto SomeJoint::* member, const char* unit) {
    if (!differ(a.*member, b.*member)) return;
    Draft draft = plain(element, parameter, unit, a.*member, b.*member);
    draft.put = [=, value = b.*member](Model& model) { (model.*list)[index].*member = value; };
    drafts.push_back(std::move(draft));
  };
  number("damping", &SomeJoint::damping, units.damping);
  number("dry friction", &SomeJoint::dry_friction, units.force);
  number("armature", &SomeJoint::armature, units.inertia);
  number("stiffness", &SomeJoint::stiffness, units.stiffness);
  const double unit = is_slide(a) ? 1 : kDegree;
  const char* unit_name = is_slide(a) ? "m" : "degrees";
  if constexpr (std::is_same_v<SomeJoint, Joint>) {
    if (a.stiffness != 0 && b.stiffness != 0 && std::abs(a.spring_reference - b.spring_reference) > 2e-4) {
      Draft draft = plain(element, "spring rest", units.position, a.spring_reference, b.spring_reference);
      draft.put = [=, value = b.spring_reference](Model& model) { model.joints[index].spring_reference = value; };
      drafts.push_back(std::move(draft));
    }
  }
  if (a.limited != b.limited) {
    Draft draft{.difference = {.element = element, .parameter = "limits", .unit = units.position, .effect = 1}};
    const auto text = [&](const SomeJoint& joint) {
      if (!joint.limited) return std::string("none");
      if constexpr (std::is_same_v<SomeJoint, Joint>) {
        return fmt::format("{:.4g} to {:.4g} {}", joint.lower / unit, joint.upper / unit, unit_name);
      } else {
        return fmt::format("{:.4g} degrees", joint.upper / kDegree);
      }
    };
    draft.difference.words = fmt::format("{} instead of {}", text(b), text(a));
    drafts.push_back(std::move(draft));
  } else if (a.limited) {
    double range = a.upper;
    if constexpr (std::is_same_v<SomeJoint, Joint>) range = a.upper - a.lower;
    const auto limit = [&](const char* parameter, double of_a, double of_b) {
      const double rounding = std::max(is_slide(a) ? kRoundingLength : 2e-4, 2e-5 * range);
      if (std::abs(of_b - of_a) <= rounding) return;
      Draft draft{
          .difference = {.element = element, .parameter = parameter, .unit = units.position, .a = of_a, .b = of_b}};
      draft.difference.words = instead(of_a / unit, of_b / unit, unit_name);
      draft.difference.effect = range > 0 ? std::abs(of_b - of_a) / range : 1;
      drafts.push_back(std::move(draft));
    };
    if constexpr (std::is_same_v<SomeJoint, Joint>) limit("lower limit", a.lower, b.lower);
    limit("upper limit", a.upper, b.upper);
  }
}

// ---- contacts -------------------------------------------------------------------------------------------------------

std::vector<const Shape*> colliding(const Model& model, int body, bool also_others = false) {
  std::vector<const Shape*> shapes;
  for (const Shape& shape : model.shapes) {
    if (shape.body == body && (shape.collides || also_others) && !is_ground(shape)) shapes.push_back(&shape);
  }
  return shapes;
}

void compare_shapes(const Aligned& models, std::vector<Draft>& drafts) {
  for (size_t i = 0; i < models.a.bodies.size(); ++i) {
    const auto index = static_cast<int>(i);
    const ShapeSet a{&models.a, colliding(models.a, index)}, b{&models.b, colliding(models.b, index)};
    if (a.shapes.empty() && b.shapes.empty()) continue;
    Draft draft{.difference = {.element = body_element(models.a, index), .parameter = "collision shape", .unit = "m"}};
    Difference& d = draft.difference;
    const auto rounding = [](double size) { return std::max(2 * kRoundingLength, 1e-5 * size); };
    if (a.shapes.empty() || b.shapes.empty()) {
      // a shape that finds nothing to touch counts as drawn only: then the filter differs, not the shape
      const ShapeSet all_a{&models.a, colliding(models.a, index, true)},
          all_b{&models.b, colliding(models.b, index, true)};
      const ShapeSet &of_a = a.shapes.empty() ? all_a : a, &of_b = b.shapes.empty() ? all_b : b;
      if (!of_a.shapes.empty() && !of_b.shapes.empty() && surface_distance(of_a, of_b) <= rounding(0)) continue;
      d.words = fmt::format("{} instead of {}", b.shapes.empty() ? "none" : counted(b.shapes.size(), "shape"),
                            a.shapes.empty() ? "none" : counted(a.shapes.size(), "shape"));
      d.effect = 1;
      drafts.push_back(std::move(draft));
      continue;
    }
    const double apart = surface_distance(a, b);
    Box around;
    for (const Shape* shape : a.shapes) around.extend(box_around(models.a, *shape, shape->X_BS));
    const double size = around.diagonal().norm();
    if (apart <= rounding(size)) continue;
    d.a = 0, d.b = apart;
    d.words = fmt::format("surfaces up to {:.3g} mm apart", 1e3 * apart);
    if (a.shapes.size() != b.shapes.size()) {
      d.words += fmt::format(" ({} instead of {})", counted(b.shapes.size(), "shape"), a.shapes.size());
    }
    d.effect = apart / size;
    drafts.push_back(std::move(draft));
  }
}

// Contact pairs by the bodies that they belong to, smaller index first.
using BodyPairKey = std::pair<int, int>;
struct PairValues {
  std::set<double> friction, torsional, rolling;
};
std::map<BodyPairKey, PairValues> pairs_of(const Model& model, bool ground) {
  std::map<BodyPairKey, PairValues> pairs;
  for (const ContactPair& pair : model.contacts) {
    const Shape &a = model.shapes[static_cast<size_t>(pair.shape_a)],
                &b = model.shapes[static_cast<size_t>(pair.shape_b)];
    if (!ground && (is_ground(a) || is_ground(b))) continue;
    PairValues& values = pairs[std::minmax(a.body, b.body)];
    values.friction.insert(pair.friction), values.torsional.insert(pair.torsional), values.rolling.insert(pair.rolling);
  }
  return pairs;
}

std::string pair_text(const Model& model, const BodyPairKey& key) {
  const auto name = [&](int body) { return body == kWorld ? "world" : model.bodies[static_cast<size_t>(body)].name; };
  return fmt::format("'{}' and '{}'", name(key.first), name(key.second));
}

// One number of contacts, by the bodies that explain where it differs.
void compare_friction(const Aligned& models, const std::map<BodyPairKey, PairValues>& a,
                      const std::map<BodyPairKey, PairValues>& b, std::set<double> PairValues::* member,
                      const char* parameter, const char* unit, std::vector<Draft>& drafts) {
  std::map<BodyPairKey, std::pair<double, double>> open;  // the values that differ
  std::map<int, size_t> touched;                          // pairs of a body
  for (const auto& [key, of_a] : a) {
    const auto found = b.find(key);
    if (found == b.end()) continue;
    for (const int body : {key.first, key.second}) ++touched[body];
    const auto &values_a = of_a.*member, &values_b = found->second.*member;
    if (values_a.size() == values_b.size()) {
      for (auto i = values_a.begin(), j = values_b.begin(); i != values_a.end(); ++i, ++j) {
        if (differ(*i, *j) && (!open.contains(key) || relative(*i, *j) > relative(open[key].first, open[key].second)))
          open[key] = {*i, *j};
      }
    } else if (differ(*values_a.rbegin(), *values_b.rbegin())) {
      open[key] = {*values_a.rbegin(), *values_b.rbegin()};
    } else if (differ(*values_a.begin(), *values_b.begin())) {
      open[key] = {*values_a.begin(), *values_b.begin()};
    }
  }
  // a body explains its pairs; one with friction of its own that differs comes first
  const auto own = [&](int body) {
    std::set<double> of_a, of_b;
    for (const Shape& shape : models.a.shapes) {
      if (shape.body == body && shape.collides) of_a.insert(shape.friction);
    }
    for (const Shape& shape : models.b.shapes) {
      if (shape.body == body && shape.collides) of_b.insert(shape.friction);
    }
    return of_a != of_b;
  };
  while (!open.empty()) {
    std::map<int, size_t> count;
    for (const auto& [key, values] : open) {
      ++count[key.first];
      if (key.second != key.first) ++count[key.second];
    }
    const auto rank = [&](int body) {
      return std::tuple(own(body), static_cast<double>(count[body]) / static_cast<double>(touched[body]), count[body],
                        body != kWorld);
    };
    int best = count.begin()->first;
    for (const auto& [body, pairs] : count) {
      if (rank(body) > rank(best)) best = body;
    }
    std::pair<double, double> largest = {0, 0};
    size_t covered = 0;
    for (auto it = open.begin(); it != open.end();) {
      if (it->first.first != best && it->first.second != best) {
        ++it;
        continue;
      }
      if (covered == 0 || relative(it->second.first, it->second.second) > relative(largest.first, largest.second)) {
        largest = it->second;
      }
      ++covered;
      it = open.erase(it);
    }
    Draft draft = plain(body_element(models.a, best), parameter, unit, largest.first, largest.second);
    draft.difference.effect = relative(largest.first, largest.second);
    if (covered > 1) draft.difference.words += fmt::format(", in contacts with {}", counted(covered, "body", "bodies"));
    drafts.push_back(std::move(draft));
  }
}

void compare_contacts(const Side& side_a, const Side& side_b, const Aligned& models, Comparison& out,
                      std::vector<Draft>& drafts) {
  const bool ground_a = has_ground(models.a), ground_b = has_ground(models.b);
  if (ground_a != ground_b) {
    out.notes.push_back(fmt::format("a ground in {} alone: contacts with it are not compared", ground_a ? "A" : "B"));
  }
  auto a = pairs_of(models.a, ground_a && ground_b), b = pairs_of(models.b, ground_a && ground_b);
  std::vector<std::string> only_a, only_b;
  const auto comparable = [&](const BodyPairKey& key) {
    for (const int body : {key.first, key.second}) {
      // the world is not the robot; a body without shapes in one file is told as that
      if (body == kWorld) return ground_a && ground_b;
      if (colliding(models.a, body).empty() || colliding(models.b, body).empty()) return false;
    }
    return true;
  };
  for (const auto& [key, values] : a) {
    if (!b.contains(key) && comparable(key)) only_a.push_back(pair_text(models.a, key));
  }
  for (const auto& [key, values] : b) {
    if (!a.contains(key) && comparable(key)) only_b.push_back(pair_text(models.a, key));
  }
  const size_t all = std::max<size_t>(1, std::max(a.size(), b.size()));
  for (const auto& [pairs, where] : {std::pair(&only_a, "A"), std::pair(&only_b, "B")}) {
    if (pairs->empty()) continue;
    constexpr size_t kShown = 3;
    Draft draft{.difference = {.element = counted(pairs->size(), "contact pair"), .parameter = "contact filter"}};
    draft.difference.words = fmt::format(
        "touch in {} alone: {}", where,
        join({pairs->begin(), pairs->begin() + static_cast<std::ptrdiff_t>(std::min(kShown, pairs->size()))}, "; "));
    if (pairs->size() > kShown) draft.difference.words += "; ...";
    draft.difference.effect = static_cast<double>(pairs->size()) / static_cast<double>(all);
    drafts.push_back(std::move(draft));
  }
  if (!side_a.format.contact_friction || !side_b.format.contact_friction) {
    if (side_a.format.contact_friction != side_b.format.contact_friction) {
      out.format_findings.push_back(
          {"contact friction", fmt::format("{} has none, so that it is not compared",
                                           side_a.format.contact_friction ? side_b.format.name : side_a.format.name)});
    }
    return;
  }
  compare_friction(models, a, b, &PairValues::friction, "contact friction", "", drafts);
  compare_friction(models, a, b, &PairValues::torsional, "torsional friction", "m", drafts);
  compare_friction(models, a, b, &PairValues::rolling, "rolling friction", "m", drafts);
}

// ---- constraints ----------------------------------------------------------------------------------------------------

// A coupling of two joints holds either way round: the later joint follows.
Coupling ordered(Coupling coupling) {
  if (coupling.terms.size() == 1 && coupling.terms[0].joint > coupling.joint && coupling.terms[0].coefficient != 0) {
    const JointTerm term = coupling.terms[0];
    coupling.terms[0] = {.joint = coupling.joint, .coefficient = 1 / term.coefficient};
    coupling.offset = -coupling.offset / term.coefficient;
    coupling.joint = term.joint;
  }
  std::ranges::sort(coupling.terms, {}, &JointTerm::joint);
  return coupling;
}

std::vector<int> joints_in(const std::vector<JointTerm>& terms) {
  std::vector<int> joints;
  for (const JointTerm& term : terms) joints.push_back(term.joint);
  std::ranges::sort(joints);
  return joints;
}

// Pairs the elements of two lists that `same` says are one, calls `both` with them, and tells of the others.
template <typename T, typename Same, typename Both, typename Name>
void match_lists(const std::vector<T>& a, const std::vector<T>& b, const Same& same, const Both& both, const Name& name,
                 Comparison& out) {
  std::vector<bool> taken(b.size());
  for (const T& x : a) {
    bool found = false;
    for (size_t j = 0; j < b.size() && !found; ++j) {
      if (!taken[j] && same(x, b[j])) found = taken[j] = true, both(x, b[j]);
    }
    if (!found) out.findings.push_back({name(x), "only in A"});
  }
  for (size_t j = 0; j < b.size(); ++j) {
    if (!taken[j]) out.findings.push_back({name(b[j]), "only in B"});
  }
}

void compare_constraints(const Aligned& models, Comparison& out, std::vector<Draft>& drafts) {
  const auto joint_name_of = [&](int joint) { return models.a.joints[static_cast<size_t>(joint)].name; };
  const auto add = [&](const std::string& element, const char* parameter, double a, double b, const std::string& unit,
                       double effect) {
    Draft draft = plain(element, parameter, unit, a, b);
    draft.difference.effect = effect;
    drafts.push_back(std::move(draft));
  };
  std::vector<Coupling> couplings_a, couplings_b;
  for (const Coupling& c : models.a.couplings) couplings_a.push_back(ordered(c));
  for (const Coupling& c : models.b.couplings) couplings_b.push_back(ordered(c));
  const auto coupling_name = [&](const Coupling& c) {
    std::vector<std::string> leaders;
    for (const JointTerm& term : c.terms) leaders.push_back(fmt::format("'{}'", joint_name_of(term.joint)));
    return fmt::format("coupling of joint '{}'{}", joint_name_of(c.joint),
                       leaders.empty() ? "" : " to " + join(leaders, ", "));
  };
  match_lists(
      couplings_a, couplings_b,
      [](const Coupling& x, const Coupling& y) {
        return x.joint == y.joint && joints_in(x.terms) == joints_in(y.terms);
      },
      [&](const Coupling& x, const Coupling& y) {
        for (size_t k = 0; k < x.terms.size(); ++k) {
          const double a = x.terms[k].coefficient, b = y.terms[k].coefficient;
          if (differ(a, b)) add(coupling_name(x), "ratio", a, b, "", relative(a, b));
        }
        if (std::abs(x.offset - y.offset) > 2e-4) {
          add(coupling_name(x), "offset", x.offset, y.offset,
              units_of(models.a.joints[static_cast<size_t>(x.joint)]).position,
              std::min(1.0, std::abs(x.offset - y.offset)));
        }
      },
      coupling_name, out);

  const auto acts = [](const Tendon& tendon) {
    return tendon.has_spring() || tendon.limited || tendon.dry_friction != 0;
  };
  std::vector<Tendon> tendons_a, tendons_b;
  for (size_t k = 0; k < models.a.tendons.size(); ++k) {
    if (acts(models.a.tendons[k])) tendons_a.push_back(models.a.tendons[k]);
  }
  std::ranges::copy_if(models.b.tendons, std::back_inserter(tendons_b), acts);
  match_lists(
      tendons_a, tendons_b, [](const Tendon& x, const Tendon& y) { return joints_in(x.terms) == joints_in(y.terms); },
      [&](const Tendon& x, const Tendon& y) {
        const std::string element = fmt::format("tendon '{}'", x.name);
        const auto index =
            static_cast<size_t>(std::ranges::find(models.a.tendons, x.name, &Tendon::name) - models.a.tendons.begin());
        const auto number = [&](const char* parameter, double Tendon::* member, const char* unit) {
          if (!differ(x.*member, y.*member)) return;
          Draft draft = plain(element, parameter, unit, x.*member, y.*member);
          draft.put = [=, value = y.*member](Model& model) { model.tendons[index].*member = value; };
          drafts.push_back(std::move(draft));
        };
        number("stiffness", &Tendon::stiffness, "");
        number("damping", &Tendon::damping, "");
        number("dry friction", &Tendon::dry_friction, "");
        if (x.stiffness != 0)
          number("rest, lower", &Tendon::rest_lower, ""), number("rest, upper", &Tendon::rest_upper, "");
        for (const JointTerm& term : x.terms) {
          const double b = std::ranges::find(y.terms, term.joint, &JointTerm::joint)->coefficient;
          if (differ(term.coefficient, b))
            add(element, "coefficient", term.coefficient, b, "", relative(term.coefficient, b));
        }
        if (x.limited != y.limited) {
          add(element, "limited (1) or not (0)", x.limited ? 1 : 0, y.limited ? 1 : 0, "", 1);
        } else if (x.limited) {
          const double range = x.upper - x.lower;
          const auto limit = [&](const char* name, double a, double b) {
            if (std::abs(a - b) > 1e-3 * range) add(element, name, a, b, "", std::abs(a - b) / range);
          };
          limit("lower limit", x.lower, y.lower), limit("upper limit", x.upper, y.upper);
        }
      },
      [](const Tendon& tendon) { return fmt::format("tendon '{}'", tendon.name); }, out);

  const auto bodies = [&](int first, int second) { return pair_text(models.a, {first, second}); };
  match_lists(
      models.a.connects, models.b.connects,
      [](const Connect& x, const Connect& y) {
        return std::minmax(x.body_a, x.body_b) == std::minmax(y.body_a, y.body_b);
      },
      [&](const Connect& x, Connect y) {
        if (x.body_a != y.body_a) std::swap(y.p_A, y.p_B);
        const double apart = std::max((x.p_A - y.p_A).norm(), (x.p_B - y.p_B).norm());
        if (apart > 2 * kRoundingLength) {
          add("connection of " + bodies(x.body_a, x.body_b), "point", 0, apart, "m", std::min(1.0, apart / 0.1));
        }
      },
      [&](const Connect& c) { return "connection of " + bodies(c.body_a, c.body_b); }, out);
  match_lists(
      models.a.welds, models.b.welds,
      [](const Weld& x, const Weld& y) { return std::minmax(x.body_a, x.body_b) == std::minmax(y.body_a, y.body_b); },
      [&](const Weld& x, const Weld& y) {
        const Pose other = x.body_a == y.body_a ? y.X_AB : y.X_AB.inverse();
        const double apart = (x.X_AB.p - other.p).norm(), turned = angle_of(x.X_AB.q.conjugate() * other.q);
        const std::string element = "weld of " + bodies(x.body_a, x.body_b);
        if (apart > 2 * kRoundingLength) add(element, "place", 0, apart, "m", std::min(1.0, apart / 0.1));
        if (turned > kRoundingAngle) add(element, "orientation", 0, turned, "rad", std::min(1.0, turned));
      },
      [&](const Weld& weld) { return "weld of " + bodies(weld.body_a, weld.body_b); }, out);
}

// ---- what it does to the motion -------------------------------------------------------------------------------------

// Forces that A needs for random motions, and what changes of A do to them.
class ForceTest {
 public:
  ForceTest(const Model& a, const Options& options)
      : bench_(a, {.samples = options.samples, .seed = options.seed}), model_(bench_.with_gravity), a_(a) {
    std::mt19937_64 random(options.seed);
    const auto uniform = [&] { return 2 * static_cast<double>(random() >> 11U) * 0x1p-53 - 1; };
    for (const parity::Experiment& experiment : bench_.experiments) {
      if (experiment.load != parity::Load::kMotion) continue;
      states_.push_back(experiment.state);
      Eigen::VectorXd acceleration(bench_.layout.count);
      for (Eigen::Index k = 0; k < acceleration.size(); ++k)
        acceleration[k] = 5 * (uniform() < 0 ? -1 : 1) * (0.5 + 0.5 * std::abs(uniform()));
      accelerations_.push_back(std::move(acceleration));
    }
    forces_ = forces(model_);
  }

  struct Effect {
    double relative = 0;
    std::string felt;
  };
  Effect of(const std::vector<const Draft*>& drafts) const {
    Model changed = model_;
    for (const Draft* draft : drafts) draft->put(changed);
    const std::vector<Eigen::VectorXd> others = forces(changed);
    Effect effect;
    for (size_t i = 0; i < a_.bodies.size(); ++i) {
      const int count = speeds_of(a_.bodies[i]);
      for (int part = 0; part < count; part += 3) {
        const int first = bench_.layout.first[i] + part, size = std::min(3, count - part);
        double change = 0, whole = 0;
        for (size_t k = 0; k < forces_.size(); ++k) {
          change += (others[k] - forces_[k]).segment(first, size).squaredNorm();
          whole += forces_[k].segment(first, size).squaredNorm();
        }
        if (change == 0) continue;
        const double share = whole > 0 ? std::sqrt(change / whole) : 1;
        if (share > effect.relative) effect = {share, element_of(a_, static_cast<int>(i))};
      }
    }
    return effect;
  }

 private:
  std::vector<Eigen::VectorXd> forces(const Model& model) const {
    std::vector<Eigen::VectorXd> all;
    for (size_t k = 0; k < states_.size(); ++k) {
      State state = states_[k];
      for (size_t i = 0; i < model.bodies.size(); ++i) {
        // a free body's frame stays where it is
        if (model.bodies[i].is_free())
          state.bodies[i].p_WBcm += state.bodies[i].q_WB * (model.bodies[i].p_BBcm - model_.bodies[i].p_BBcm);
      }
      bodies_from_joints(model, state);
      all.push_back(parity::inverse_dynamics(model, bench_.layout, state, accelerations_[k]));
    }
    return all;
  }

  parity::Bench bench_;
  Model model_;
  const Model& a_;
  std::vector<State> states_;
  std::vector<Eigen::VectorXd> accelerations_, forces_;
};

void rank(const Model& a, const Options& options, std::vector<Draft>& drafts, Comparison& out) {
  const ForceTest test(a, options);
  std::vector<const Draft*> of_forces;
  for (Draft& draft : drafts) {
    if (!draft.put) continue;
    of_forces.push_back(&draft);
    const ForceTest::Effect effect = test.of({&draft});
    draft.difference.effect = effect.relative;
    draft.difference.felt = effect.felt;
  }
  if (!of_forces.empty()) out.total = test.of(of_forces).relative;
  double sum = 0;
  for (const Draft& draft : drafts) sum += draft.difference.effect;
  for (Draft& draft : drafts) {
    draft.difference.share = sum > 0 ? draft.difference.effect / sum : 0;
    out.differences.push_back(std::move(draft.difference));
  }
  std::ranges::stable_sort(out.differences, std::greater<>(), &Difference::effect);
}

}  // namespace

std::string instead(double a, double b, const std::string& unit) {
  // as many digits as it takes to see the difference
  std::string of_a, of_b;
  for (int digits = 4; digits <= 9; ++digits) {
    of_a = fmt::format("{:.{}g}", a, digits), of_b = fmt::format("{:.{}g}", b, digits);
    if (of_a != of_b) break;
  }
  std::string text = fmt::format("{} instead of {}{}{}", of_b, of_a, unit.empty() ? "" : " ", unit);
  if (a != 0 && b / a > 0) text += fmt::format(" ({:+.3g} %)", 100 * (b / a - 1));
  return text;
}

bool differ(double a, double b, double least) {
  return std::abs(a - b) > std::max(least, kRoundingRelative * std::max(std::abs(a), std::abs(b)));
}

double relative(double a, double b) { return a == 0 ? 1 : std::abs(b - a) / std::abs(a); }

bool Comparison::differs_above(double share) const {
  return !findings.empty() ||
         std::ranges::any_of(differences, [share](const Difference& d) { return d.effect >= share; });
}

Comparison compare(const Side& side_a, const Side& side_b, const Options& options) {
  Comparison out;
  const Trees trees = match_trees(side_a, side_b, options, out);
  Aligned models{.a = trees.a.model, .b = in_frames_of(trees.a.model, trees.b.model, trees.placement)};
  const Model &a = models.a, &b = models.b;
  std::vector<Draft> drafts;
  const Vec3 pull = b.gravity - a.gravity;
  if (pull.norm() > kRoundingRelative * std::max(a.gravity.norm(), b.gravity.norm())) {
    Draft draft{.difference = {.element = "gravity",
                               .parameter = "gravity",
                               .unit = "m/s^2",
                               .a = a.gravity.norm(),
                               .b = b.gravity.norm()}};
    draft.difference.words =
        fmt::format("{:.4g}, {:.4g}, {:.4g} instead of {:.4g}, {:.4g}, {:.4g} m/s^2 in A's axes", b.gravity.x(),
                    b.gravity.y(), b.gravity.z(), a.gravity.x(), a.gravity.y(), a.gravity.z());
    draft.put = [value = b.gravity](Model& model) { model.gravity = value; };
    drafts.push_back(std::move(draft));
  }
  for (size_t i = 0; i < a.bodies.size(); ++i) {
    const auto index = static_cast<int>(i);
    compare_place(a, b, index, drafts);
    compare_mass(a, b, index, drafts);
  }
  for (size_t j = 0; j < a.joints.size(); ++j) compare_joint(a.joints[j], b.joints[j], j, &Model::joints, drafts);
  for (size_t j = 0; j < a.balls.size(); ++j) compare_joint(a.balls[j], b.balls[j], j, &Model::balls, drafts);
  compare_actuators(side_a, side_b, models, options.map, out, drafts);
  if (side_a.format.velocity_limits && side_b.format.velocity_limits) {
    for (size_t i = 0; i < a.bodies.size(); ++i) {
      if (a.bodies[i].joint < 0) continue;
      const auto j = static_cast<size_t>(trees.placement.b_of[i]);
      const std::string name_a = name_of(a, static_cast<int>(i)), name_b = name_of(trees.b.model, static_cast<int>(j));
      const auto of_a = side_a.velocity_limits.find(name_a), of_b = side_b.velocity_limits.find(name_b);
      if (of_a == side_a.velocity_limits.end() || of_b == side_b.velocity_limits.end()) continue;
      if (!differ(of_a->second, of_b->second)) continue;
      Draft draft = plain(element_of(a, static_cast<int>(i)), "velocity limit",
                          slides(a, a.bodies[i]) ? "m/s" : "rad/s", of_a->second, of_b->second);
      draft.difference.effect = relative(of_a->second, of_b->second);
      drafts.push_back(std::move(draft));
    }
  }
  compare_constraints(models, out, drafts);
  compare_shapes(models, drafts);
  compare_contacts(side_a, side_b, models, out, drafts);
  rank(a, options, drafts, out);
  return out;
}

}  // namespace assay::pairing
