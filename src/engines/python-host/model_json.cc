#include "model_json.h"

#include <type_traits>
#include <utility>

#include <nlohmann/json.hpp>

#include "base/json.h"
#include "model/fields.h"

namespace assay::python {
namespace {

using nlohmann::json;

json of(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
json of(const Quat& q) { return {q.w(), q.x(), q.y(), q.z()}; }
json of(const Pose& X) { return {{"p", of(X.p)}, {"q", of(X.q)}}; }
json of(const std::vector<Vec3>& points) {
  json list = json::array();
  for (const Vec3& point : points) list.push_back(of(point));
  return list;
}
json of(const Mat3& M) { return {of(Vec3(M.row(0))), of(Vec3(M.row(1))), of(Vec3(M.row(2)))}; }

json of(ShapeType type) {
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

json of(JointType type) { return type == JointType::kSlide ? "slide" : "hinge"; }

template <typename Part>
json parts_json(const std::vector<Part>& all);

// Visits fields (model/fields.h).
struct Writer {
  json object = json::object();

  template <typename T>
  Writer& operator()(const char* name, const T& member) {
    if constexpr (std::is_same_v<T, std::vector<JointTerm>>) {
      object[name] = parts_json(member);
    } else if constexpr (requires { of(member); }) {
      object[name] = of(member);
    } else {
      object[name] = member;
    }
    return *this;
  }
  Writer& list(int) { return *this; }
  template <typename Default, typename T, typename... Rows>
  void later(const Default& otherwise, const char* name, const T& member, const Rows&... rows) {
    (*this)(name, member);
    if constexpr (sizeof...(rows) > 0) later(otherwise, rows...);
  }
  template <typename T>
  void unhashed(const char* name, const T& member) {
    (*this)(name, member);
  }
};

template <typename Part>
json parts_json(const std::vector<Part>& all) {
  json parts = json::array();
  for (const Part& part : all) {
    Writer writer;
    fields(writer, part);
    json& object = parts.emplace_back(std::move(writer.object));
    if constexpr (requires { part.is_free(); }) object["is_free"] = part.is_free();
    if constexpr (requires { part.is_massless(); }) object["is_massless"] = part.is_massless();
    if constexpr (requires { part.is_slide(); }) object["is_slide"] = part.is_slide();
    if constexpr (requires { part.has_spring(); }) object["has_spring"] = part.has_spring();
  }
  return parts;
}

}  // namespace

std::string model_json(const Model& m) {
  const json all = {{"name", m.name},
                    {"hash", m.hash},
                    {"gravity", of(m.gravity)},
                    {"bodies", parts_json(m.bodies)},
                    {"joints", parts_json(m.joints)},
                    {"balls", parts_json(m.balls)},
                    {"shapes", parts_json(m.shapes)},
                    {"hulls", parts_json(m.hulls)},
                    {"height_fields", parts_json(m.height_fields)},
                    {"contacts", parts_json(m.contacts)},
                    {"couplings", parts_json(m.couplings)},
                    {"connects", parts_json(m.connects)},
                    {"welds", parts_json(m.welds)},
                    {"tendons", parts_json(m.tendons)}};
  return dump_json(all);
}

}  // namespace assay::python
