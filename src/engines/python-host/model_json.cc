#include "model_json.h"

#include <nlohmann/json.hpp>

#include "base/json.h"

namespace assay::python {
namespace {

using nlohmann::json;

json of(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
json of(const Quat& q) { return {q.w(), q.x(), q.y(), q.z()}; }
json of(const Pose& X) { return {{"p", of(X.p)}, {"q", of(X.q)}}; }
json of(const Mat3& M) { return {of(Vec3(M.row(0))), of(Vec3(M.row(1))), of(Vec3(M.row(2)))}; }

json of(const Body& b) {
  return {{"name", b.name},         {"parent", b.parent},
          {"joint", b.joint},       {"ball", b.ball},
          {"X_PB", of(b.X_PB)},     {"mass", b.mass},
          {"p_BBcm", of(b.p_BBcm)}, {"I_BBcm_B", of(b.I_BBcm_B)},
          {"is_free", b.is_free()}, {"is_massless", b.is_massless()}};
}

json of(const Joint& j) {
  return {{"name", j.name},
          {"body", j.body},
          {"p_BJ", of(j.p_BJ)},
          {"axis_B", of(j.axis_B)},
          {"reference", j.reference},
          {"limited", j.limited},
          {"lower", j.lower},
          {"upper", j.upper},
          {"stiffness", j.stiffness},
          {"spring_reference", j.spring_reference},
          {"damping", j.damping},
          {"armature", j.armature},
          {"is_slide", j.is_slide()},
          {"dry_friction", j.dry_friction},
          {"has_spring", j.has_spring()}};
}

json of(const BallJoint& b) {
  return {{"name", b.name},
          {"body", b.body},
          {"p_BJ", of(b.p_BJ)},
          {"limited", b.limited},
          {"upper", b.upper},
          {"stiffness", b.stiffness},
          {"spring_reference", of(b.spring_reference)},
          {"damping", b.damping},
          {"armature", b.armature},
          {"dry_friction", b.dry_friction},
          {"has_spring", b.has_spring()}};
}

const char* type_name(ShapeType type) {
  switch (type) {
    case ShapeType::kSphere:
      return "sphere";
    case ShapeType::kCapsule:
      return "capsule";
    case ShapeType::kPlane:
      return "plane";
    case ShapeType::kBox:
      return "box";
    case ShapeType::kCylinder:
      return "cylinder";
    case ShapeType::kEllipsoid:
      return "ellipsoid";
    case ShapeType::kHull:
      return "hull";
    case ShapeType::kHeightField:
      return "height-field";
  }
  return "";
}

json of(const Shape& s) {
  return {{"name", s.name},
          {"type", type_name(s.type)},
          {"body", s.body},
          {"X_BS", of(s.X_BS)},
          {"radius", s.radius},
          {"half_length", s.half_length},
          {"half_size", of(s.half_size)},
          {"data", s.data}};
}

json of(const Hull& h) {
  json vertices = json::array();
  for (const Vec3& vertex : h.vertices) vertices.push_back(of(vertex));
  return {{"name", h.name}, {"vertices", std::move(vertices)}, {"faces", h.faces}};
}

json of(const HeightField& f) {
  return {{"name", f.name},     {"rows", f.rows}, {"columns", f.columns}, {"half_x", f.half_x},
          {"half_y", f.half_y}, {"base", f.base}, {"heights", f.heights}};
}

json of(const ContactPair& c) {
  return {{"shape_a", c.shape_a},
          {"shape_b", c.shape_b},
          {"friction", c.friction},
          {"torsional", c.torsional},
          {"rolling", c.rolling}};
}

json of(const JointTerm& t) { return {{"joint", t.joint}, {"coefficient", t.coefficient}}; }

json terms(const std::vector<JointTerm>& all) {
  json list = json::array();
  for (const JointTerm& each : all) list.push_back(of(each));
  return list;
}

json of(const Coupling& c) {
  return {{"name", c.name}, {"joint", c.joint}, {"terms", terms(c.terms)}, {"offset", c.offset}};
}

json of(const Connect& c) {
  return {{"name", c.name}, {"body_a", c.body_a}, {"body_b", c.body_b}, {"p_A", of(c.p_A)}, {"p_B", of(c.p_B)}};
}

json of(const Weld& w) { return {{"name", w.name}, {"body_a", w.body_a}, {"body_b", w.body_b}, {"X_AB", of(w.X_AB)}}; }

json of(const Tendon& t) {
  return {{"name", t.name},
          {"terms", terms(t.terms)},
          {"stiffness", t.stiffness},
          {"rest_lower", t.rest_lower},
          {"rest_upper", t.rest_upper},
          {"damping", t.damping},
          {"limited", t.limited},
          {"lower", t.lower},
          {"upper", t.upper},
          {"dry_friction", t.dry_friction},
          {"has_spring", t.has_spring()}};
}

template <typename T>
json list(const std::vector<T>& all) {
  json result = json::array();
  for (const T& each : all) result.push_back(of(each));
  return result;
}

}  // namespace

std::string model_json(const Model& m) {
  const json all = {{"name", m.name},
                    {"hash", m.hash},
                    {"gravity", of(m.gravity)},
                    {"bodies", list(m.bodies)},
                    {"joints", list(m.joints)},
                    {"balls", list(m.balls)},
                    {"shapes", list(m.shapes)},
                    {"hulls", list(m.hulls)},
                    {"height_fields", list(m.height_fields)},
                    {"contacts", list(m.contacts)},
                    {"couplings", list(m.couplings)},
                    {"connects", list(m.connects)},
                    {"welds", list(m.welds)},
                    {"tendons", list(m.tendons)}};
  return dump_json(all);
}

}  // namespace assay::python
