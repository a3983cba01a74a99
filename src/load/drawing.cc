#include "load/drawing.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <tinyxml2.h>

#include "base/errors.h"
#include "base/text.h"
#include "load/outside_files.h"
#include "load/package_paths.h"
#include "load/urdf/compiler.h"
#include "load/urdf/values.h"
#include "model/ellipsoid.h"

namespace assay {
namespace {

namespace xml = tinyxml2;
using urdf::number_of;
using urdf::numbers_of;
using urdf::origin_of;
using urdf::text_of;
using urdf::vector_of;

MeshData box_mesh(const Vec3& half) {
  MeshData mesh;
  for (int i = 0; i < 8; ++i) {
    const Vec3 corner((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
    mesh.vertices.emplace_back(corner.cwiseProduct(half));
  }
  mesh.faces = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

MeshData cylinder_mesh(double radius, double half_length) {
  constexpr int kAround = 24;
  MeshData mesh;
  for (int i = 0; i < kAround; ++i) {
    const double angle = 2 * std::numbers::pi * i / kAround;
    const Vec3 rim(radius * std::cos(angle), radius * std::sin(angle), half_length);
    mesh.vertices.push_back(rim);
    mesh.vertices.emplace_back(rim.x(), rim.y(), -half_length);
  }
  mesh.vertices.emplace_back(0, 0, half_length);
  mesh.vertices.emplace_back(0, 0, -half_length);
  constexpr int kTop = 2 * kAround, kBottom = kTop + 1;
  for (int i = 0; i < kAround; ++i) {
    const int up = 2 * i, next = 2 * ((i + 1) % kAround);
    mesh.faces.push_back({up, up + 1, next});
    mesh.faces.push_back({next, up + 1, next + 1});
    mesh.faces.push_back({kTop, up, next});
    mesh.faces.push_back({kBottom, next + 1, up + 1});
  }
  return mesh;
}

class Visuals {
 public:
  Visuals(const std::string& path, const LoadOptions& options, Drawing& drawing)
      : path_(path), options_(options), drawing_(drawing) {}

  void add(const xml::XMLElement& robot) {
    std::vector<Problem> problems;  // of the model, which has loaded
    std::vector<std::string> notes;
    const UrdfCompiler compiler = read_compiler(robot, problems, notes);
    as_mujoco_ = {compiler.mesh_dir, compiler.strip_path};
    for (const auto* m = robot.FirstChildElement("material"); m != nullptr; m = m->NextSiblingElement("material")) {
      if (const xml::XMLElement* colour = m->FirstChildElement("color"))
        colours_[text_of(m, "name")] = rgba_of(*colour);
    }
    for (const auto* link = robot.FirstChildElement("link"); link != nullptr; link = link->NextSiblingElement("link")) {
      const std::string name = text_of(link, "name");
      const auto place = drawing_.links.find(name);
      for (const auto* v = link->FirstChildElement("visual"); v != nullptr; v = v->NextSiblingElement("visual")) {
        // the root link is the world there when it is fixed
        add_visual(*v, name, place == drawing_.links.end() ? Drawing::Link{} : place->second);
      }
    }
  }

 private:
  static constexpr const char* kNotFinite = "has numbers that are not finite";

  static std::array<float, 4> rgba_of(const xml::XMLElement& colour) {
    std::vector<double> v = numbers_of(&colour, "rgba");
    if (v.size() != 4 || !std::ranges::all_of(v, [](double each) { return std::isfinite(each); }))
      v = {0.7, 0.7, 0.7, 1};
    return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]), static_cast<float>(v[3])};
  }

  void add_visual(const xml::XMLElement& visual, const std::string& link, const Drawing::Link& place) {
    const xml::XMLElement* geometry = visual.FirstChildElement("geometry");
    const xml::XMLElement* shape = geometry == nullptr ? nullptr : geometry->FirstChildElement();
    if (shape == nullptr) return;
    DrawnPart part;
    part.body = place.body;
    part.X_BS = place.X_BL * origin_of(visual);
    if (const xml::XMLElement* material = visual.FirstChildElement("material")) {
      const xml::XMLElement* colour = material->FirstChildElement("color");
      const auto known = colours_.find(text_of(material, "name"));
      if (colour != nullptr) {
        part.rgba = rgba_of(*colour);
      } else if (known != colours_.end()) {
        part.rgba = known->second;
      }
    }
    if (part.rgba[3] == 0) return;  // not seen
    try {
      if (!part.X_BS.p.allFinite() || !part.X_BS.q.coeffs().allFinite()) throw InputError(kNotFinite);
      part.mesh = mesh_of(*shape);
    } catch (const InputError& error) {
      drawing_.notes.push_back(fmt::format("visual mesh '{}' of link '{}' is not drawn: it {}",
                                           text_of(shape, "filename"), link, error.what()));
      return;
    }
    if (part.mesh >= 0) drawing_.parts.push_back(part);
  }

  // Index into Drawing::meshes; -1 for what URDF does not know. Throws InputError.
  int mesh_of(const xml::XMLElement& shape) {
    const std::string type = shape.Name();
    const double radius = number_of(&shape, "radius", 0), length = number_of(&shape, "length", 0);
    const Vec3 size = vector_of(&shape, "size", Vec3::Zero()), scale = vector_of(&shape, "scale", Vec3::Ones());
    const bool finite = std::isfinite(radius) && std::isfinite(length) && size.allFinite() && scale.allFinite();
    if (!finite) throw InputError(kNotFinite);
    std::string file;
    if (type == "mesh") {
      const FoundFile found = find_resource(text_of(&shape, "filename"), path_, options_.packages, as_mujoco_);
      if (found.path.empty()) throw InputError(fmt::format("is not found (looked for: {})", join(found.looked, ", ")));
      if (!found.in_package && !options_.allow_external_files && !is_below(found.path, model_root(path_))) {
        throw InputError("lies outside the model's folder; --allow-external-files takes it");
      }
      file = found.path;
    }
    const std::string key = fmt::format("{} {} {} {} {} {} {} {} {} {}", type, file, radius, length, size.x(), size.y(),
                                        size.z(), scale.x(), scale.y(), scale.z());
    const auto known = numbers_.find(key);
    if (known != numbers_.end()) return known->second;
    MeshData mesh;
    if (type == "box") {
      mesh = box_mesh(size / 2);
    } else if (type == "cylinder") {
      mesh = cylinder_mesh(radius, length / 2);
    } else if (type == "sphere") {
      const Hull ball = ellipsoid_hull(Vec3::Constant(radius), 2);
      mesh.vertices = ball.vertices;
      mesh.faces = ball.faces;
    } else if (type == "mesh") {
      mesh = read_mesh(file);
      for (Vec3& p : mesh.vertices) p = p.cwiseProduct(scale);
      if (scale.prod() < 0) {
        for (auto& face : mesh.faces) std::swap(face[1], face[2]);  // mirrored: outward stays outward
      }
    } else {
      return -1;
    }
    drawing_.meshes.push_back(std::move(mesh));
    return numbers_[key] = static_cast<int>(drawing_.meshes.size()) - 1;
  }

  const std::string& path_;
  const LoadOptions& options_;
  Drawing& drawing_;
  MeshFolder as_mujoco_;
  std::map<std::string, std::array<float, 4>> colours_;  // of the robot's materials
  std::map<std::string, int> numbers_;                   // of meshes that are there, by what they are made from
};

}  // namespace

void add_urdf_visuals(const std::string& text, const std::string& path, const LoadOptions& options, Drawing& drawing) {
  // collision meshes of URDF are drawn as the hulls that they stand for
  drawing.meshes.clear();
  drawing.parts.clear();
  xml::XMLDocument document;
  if (document.Parse(text.data(), text.size()) != xml::XML_SUCCESS) return;
  if (const xml::XMLElement* robot = document.FirstChildElement("robot")) Visuals(path, options, drawing).add(*robot);
}

}  // namespace assay
