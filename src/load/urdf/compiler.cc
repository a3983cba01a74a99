#include "load/urdf/compiler.h"

#include <array>
#include <set>
#include <string_view>

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include "base/errors.h"
#include "base/text.h"
#include "load/mujoco_messages.h"
#include "load/spec_text.h"
#include "load/urdf/values.h"

namespace assay {
namespace {

namespace xml = tinyxml2;

// Attributes of MuJoCo's <compiler> that change nothing in a URDF document.
const std::set<std::string_view>& without_effect() {
  static const std::set<std::string_view> kNames = {
      "autolimits", "angle",      "fitaabb",          "eulerseq",         "discardvisual",
      "usethread",  "conflict",   "texturedir",       "alignfree",        "saveinertial",
      "convexhull", "coordinate", "exactmeshinertia", "inertiagrouprange"};
  return kNames;
}

class CompilerReader {
 public:
  CompilerReader(std::vector<Problem>& problems, std::vector<std::string>& notes)
      : problems_(problems), notes_(notes) {}

  void read(const xml::XMLElement& compiler) {
    element_ = &compiler;
    // of shapes that collide, which are in group 0
    std::vector<double> groups = urdf::numbers_of(&compiler, "inertiagrouprange");
    if (groups.size() == 2 && (groups[0] > 0 || groups[1] < 0)) weighs_ = false;
    for (const xml::XMLAttribute* a = compiler.FirstAttribute(); a != nullptr; a = a->Next())
      read(a->Name(), a->Value());
    if (!weighs_) result_.from_shapes = UrdfCompiler::FromShapes::kNever;
  }
  const UrdfCompiler& result() const { return result_; }

 private:
  void read(const std::string& name, const std::string& value) {
    if (name == "inertiafromgeom") {
      using From = UrdfCompiler::FromShapes;
      if (value == "auto") {
        result_.from_shapes = From::kMissing;
      } else {
        result_.from_shapes = truth(name, value, "true, false or auto") ? From::kAlways : From::kNever;
      }
    } else if (name == "balanceinertia") {
      result_.balance = truth(name, value, kEither);
    } else if (name == "fusestatic") {
      result_.fuses = truth(name, value, kEither);
    } else if (name == "strippath") {
      result_.strip_path = truth(name, value, kEither);
    } else if (name == "meshdir" || (name == "assetdir" && element_->Attribute("meshdir") == nullptr)) {
      result_.mesh_dir = value;
    } else if (name == "boundmass") {
      result_.bound_mass = least_zero(name, value);
    } else if (name == "boundinertia") {
      result_.bound_inertia = least_zero(name, value);
    } else if (name == "settotalmass") {
      const auto mass = parse_number(value);
      if (!mass) return refuse(name, value, "give a number of kg");
      result_.total_mass = *mass > 0 ? *mass : 0;  // -1 is MuJoCo's word for none
    } else if (name != "assetdir" && !without_effect().contains(name)) {
      notes_.push_back(
          fmt::format("attribute '{}' of <mujoco><compiler> (line {}) is not read", name, element_->GetLineNum()));
    }
  }

  static constexpr const char* kEither = "true or false";

  bool truth(const std::string& name, const std::string& value, const char* choices) {
    if (value != "true" && value != "false") refuse(name, value, fmt::format("give {}", choices));
    return value == "true";
  }
  double least_zero(const std::string& name, const std::string& value) {
    const auto number = parse_number(value);
    if (!number || *number < 0) refuse(name, value, "give a number that is not negative");
    return number.value_or(0);
  }
  void refuse(const std::string& name, const std::string& value, const std::string& mend) {
    problems_.push_back({.severity = Severity::kRefused,
                         .element = "<compiler> of <mujoco>",
                         .line = element_->GetLineNum(),
                         .message = fmt::format("has {}=\"{}\"", name, value),
                         .mend = mend,
                         .option = {}});
  }

  const xml::XMLElement* element_ = nullptr;
  UrdfCompiler result_;
  bool weighs_ = true;
  std::vector<Problem>& problems_;
  std::vector<std::string>& notes_;
};

mjtGeom geom_type(std::string_view type) {
  if (type == "box") return mjGEOM_BOX;
  if (type == "cylinder") return mjGEOM_CYLINDER;
  if (type == "capsule") return mjGEOM_CAPSULE;
  return type == "sphere" ? mjGEOM_SPHERE : mjGEOM_MESH;
}

void add_mesh(mjSpec* spec, const std::string& name, const MeshData& data) {
  mjsMesh* mesh = mjs_addMesh(spec, nullptr);
  mjs_setName(mesh->element, name.c_str());
  std::vector<float> vertices;
  std::vector<int> faces;
  vertices.reserve(3 * data.vertices.size());
  faces.reserve(3 * data.faces.size());
  for (const Vec3& p : data.vertices) {
    for (int k = 0; k < 3; ++k) vertices.push_back(static_cast<float>(p[k]));
  }
  for (const auto& face : data.faces) faces.insert(faces.end(), face.begin(), face.end());
  mjs_setFloat(mesh->uservert, vertices.data(), static_cast<int>(vertices.size()));
  mjs_setInt(mesh->userface, faces.data(), static_cast<int>(faces.size()));
}

}  // namespace

UrdfCompiler read_compiler(const xml::XMLElement& robot, std::vector<Problem>& problems,
                           std::vector<std::string>& notes) {
  CompilerReader reader(problems, notes);
  for (const auto* m = robot.FirstChildElement("mujoco"); m != nullptr; m = m->NextSiblingElement("mujoco")) {
    for (const auto* c = m->FirstChildElement("compiler"); c != nullptr; c = c->NextSiblingElement("compiler")) {
      reader.read(*c);
    }
  }
  return reader.result();
}

RigidPart part_of_shapes(const std::vector<SolidShape>& shapes) {
  const MessageGuard guard;
  const SpecPtr spec(mj_makeSpec());
  mjsBody* body = mjs_addBody(mjs_findBody(spec.get(), "world"), nullptr);
  spec->compiler.fusestatic = false;
  for (size_t i = 0; i < shapes.size(); ++i) {
    const SolidShape& shape = shapes[i];
    mjsGeom* geom = mjs_addGeom(body, nullptr);
    geom->type = geom_type(shape.type);
    if (geom->type == mjGEOM_MESH) {
      const std::string name = fmt::format("{}", i);
      add_mesh(spec.get(), name, shape.mesh);
      mjs_setString(geom->meshname, name.c_str());
    } else if (geom->type == mjGEOM_BOX) {
      for (int k = 0; k < 3; ++k) geom->size[k] = shape.size[k] / 2;
    } else {
      geom->size[0] = shape.size[0];
      geom->size[1] = shape.size[1] / 2;
    }
    const Quat& q = shape.X_LS.q;
    const std::array<double, 4> quat = {q.w(), q.x(), q.y(), q.z()};
    for (int k = 0; k < 3; ++k) geom->pos[k] = shape.X_LS.p[k];
    for (size_t k = 0; k < 4; ++k) geom->quat[k] = quat[k];
  }
  const CompiledPtr compiled(mj_compile(spec.get(), nullptr));
  if (compiled == nullptr) throw InputError(one_line(mjs_getError(spec.get())));
  const mjModel& m = *compiled;
  constexpr ptrdiff_t kBody = 1;
  const mjtNum *pos = m.body_ipos + 3 * kBody, *quat = m.body_iquat + 4 * kBody, *I = m.body_inertia + 3 * kBody;
  const Mat3 R = Quat(quat[0], quat[1], quat[2], quat[3]).toRotationMatrix();
  return {m.body_mass[kBody], Vec3(pos[0], pos[1], pos[2]), R * Vec3(I[0], I[1], I[2]).asDiagonal() * R.transpose()};
}

}  // namespace assay
