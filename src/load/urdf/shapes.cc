#include "load/urdf/shapes.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <tinyxml2.h>

#include "base/errors.h"
#include "base/text.h"
#include "load/outside_files.h"
#include "load/package_paths.h"
#include "load/urdf/values.h"

namespace assay::urdf {
namespace {

namespace fs = std::filesystem;
namespace xml = tinyxml2;

using MeshNames = std::map<std::string, std::string>;  // path and scale -> name in the document

FoundFile find_mesh(const Robot& robot, const xml::XMLElement& mesh) {
  return find_resource(text_of(&mesh, "filename"), robot.path, robot.options.packages,
                       {robot.compiler.mesh_dir, robot.compiler.strip_path});
}

MeshData scaled_mesh(const std::string& path, const Vec3& scale) {
  MeshData mesh = read_mesh(path);
  for (Vec3& p : mesh.vertices) p = p.cwiseProduct(scale);
  if (scale.prod() < 0) {
    for (auto& face : mesh.faces) std::swap(face[1], face[2]);  // mirrored: outward stays outward
  }
  return mesh;
}

bool may_be_read(const Robot& robot, const FoundFile& found) {
  return found.in_package || robot.options.allow_external_files || is_below(found.path, model_root(robot.path));
}

std::string add_mesh(Robot& robot, const std::string& path, const Vec3& scale) {
  UrdfMesh mesh{path, scaled_mesh(path, scale)};
  constexpr double kFlat = 1e-6;
  if (mesh.data.flatness() < kFlat) {
    throw InputError("is flat, so that it has no convex hull; give it a thickness, or use a thin box");
  }
  std::string stem = fs::path(path).stem().string();
  std::ranges::replace(stem, '.', '_');  // MuJoCo takes what follows the last one for an ending
  std::string name = stem;
  for (int i = 2; robot.result.meshes.contains(name); ++i) name = fmt::format("{}_{}", stem, i);
  robot.result.meshes.emplace(name, std::move(mesh));
  return name;
}

// False for a collision that is left out or refused.
bool keeps_shape(Robot& robot, const Link& link, xml::XMLElement& collision) {
  static const std::map<std::string_view, std::vector<const char*>> kSizes = {{"box", {"size"}},
                                                                              {"cylinder", {"radius", "length"}},
                                                                              {"capsule", {"radius", "length"}},
                                                                              {"sphere", {"radius"}},
                                                                              {"mesh", {}}};
  xml::XMLElement* geometry = collision.FirstChildElement("geometry");
  xml::XMLElement* shape = geometry == nullptr ? nullptr : geometry->FirstChildElement();
  if (shape == nullptr) {
    robot.leave_out(fmt::format("a collision of link '{}'", link.name), collision.GetLineNum(),
                    "has no shape and is left out");
    return false;
  }
  const std::string element = fmt::format("<{}> of link '{}'", shape->Name(), link.name);
  while (xml::XMLElement* again = shape->NextSiblingElement()) {
    robot.note(
        fmt::format("{} is followed by another shape in its <geometry> (line {}): the first one "
                    "counts, as in ROS",
                    element, again->GetLineNum()));
    geometry->DeleteChild(again);
  }
  const auto fail = [&](const std::string& fault, const std::string& mend) {
    if (robot.options.drop_unsupported) {
      robot.leave_out(element, shape->GetLineNum(), fault + "; it is left out, so this link does not collide there");
    } else {
      robot.refuse(element, shape->GetLineNum(), fault, mend, "--drop-unsupported, which leaves it out");
    }
    return false;
  };
  const auto sizes = kSizes.find(shape->Name());
  if (sizes == kSizes.end()) return fail("is no shape of URDF", "use box, cylinder, capsule, sphere or mesh");
  for (const char* attribute : sizes->second) {
    const std::vector<double> numbers = numbers_of(shape, attribute);
    if (numbers.empty()) return fail(fmt::format("has no {}", attribute), "give it one");
    const bool negative = std::ranges::any_of(numbers, [](double v) { return v < 0; });
    if (!negative && std::ranges::all_of(numbers, [](double v) { return v > 0; })) continue;
    const std::string fault = fmt::format("has {}=\"{}\"", attribute, text_of(shape, attribute));
    if (negative) return fail(fault, numbers.size() == 1 ? "give a positive number" : "give positive numbers");
    robot.leave_out(element, shape->GetLineNum(), fault + " and is left out: what has no volume touches nothing");
    return false;
  }
  return true;
}

// False when the mesh cannot be used and was left out or refused.
bool adapt_mesh(Robot& robot, MeshNames& names, const Link& link, xml::XMLElement& mesh) {
  const std::string uri = text_of(&mesh, "filename");
  const std::string element = fmt::format("collision mesh '{}' of link '{}'", uri, link.name);
  const auto fail = [&](const std::string& message, const std::string& mend) {
    if (robot.options.drop_unsupported) {
      robot.leave_out(element, mesh.GetLineNum(), message + "; it is left out, so this link does not collide there");
    } else {
      robot.refuse(element, mesh.GetLineNum(), message, mend, "--drop-unsupported, which leaves it out");
    }
    return false;
  };
  const FoundFile found = find_mesh(robot, mesh);
  if (found.path.empty() && uri.find("$(") != std::string::npos) {
    return fail("names an argument of xacro", kExpand);
  }
  if (found.path.empty()) {
    const std::string package =
        uri.substr(0, uri.find('/', uri.find("//") == std::string::npos ? 0 : uri.find("//") + 2));
    return fail(fmt::format("is not found (looked for: {})", join(found.looked, ", ")),
                uri.find("://") == std::string::npos ? "put the file there"
                                                     : fmt::format("name its package's folder with --package {}=DIR",
                                                                   package.substr(package.find("//") + 2)));
  }
  if (!may_be_read(robot, found)) {
    return fail(fmt::format("lies outside the model's folder '{}'", model_root(robot.path)),
                "copy it there, or give --allow-external-files if you trust the model");
  }
  if (!found.taken_for.empty()) {
    robot.note(fmt::format("{} (line {}) is '{}', {}", element, mesh.GetLineNum(), found.path, found.taken_for));
  }
  const Vec3 scale = vector_of(&mesh, "scale", Vec3::Ones());
  mesh.DeleteAttribute("scale");
  const std::string key = fmt::format("{} {}", found.path, triple(scale));
  const auto [known, fresh] = names.try_emplace(key, "");
  if (fresh) {
    try {
      known->second = add_mesh(robot, found.path, scale);
    } catch (const InputError& error) {
      names.erase(known);
      const std::string text = error.what();
      const size_t mend = text.rfind("; ");
      return fail(text.substr(0, mend), mend == std::string::npos ? "export it again" : text.substr(mend + 2));
    }
  }
  mesh.SetAttribute("filename", (known->second + ".stl").c_str());
  return true;
}

}  // namespace

void check_shapes(Robot& robot) {
  for (const Link& link : robot.links) {
    xml::XMLElement* next = nullptr;
    for (xml::XMLElement* c = link.element->FirstChildElement("collision"); c != nullptr; c = next) {
      next = c->NextSiblingElement("collision");
      if (!keeps_shape(robot, link, *c)) link.element->DeleteChild(c);
    }
  }
}

std::vector<SolidShape> shapes_of(const Robot& robot, const Link& link) {
  std::vector<SolidShape> shapes;
  for (const xml::XMLElement* c = link.element->FirstChildElement("collision"); c != nullptr;
       c = c->NextSiblingElement("collision")) {
    const xml::XMLElement* geometry = c->FirstChildElement("geometry");
    const xml::XMLElement* element = geometry == nullptr ? nullptr : geometry->FirstChildElement();
    if (element == nullptr) continue;
    SolidShape shape{.type = element->Name(), .size = Vec3::Zero(), .mesh = {}, .X_LS = origin_of(*c)};
    if (shape.type == "mesh") {
      const FoundFile found = find_mesh(robot, *element);
      if (found.path.empty() || !may_be_read(robot, found)) continue;  // named where it is needed
      try {
        shape.mesh = scaled_mesh(found.path, vector_of(element, "scale", Vec3::Ones()));
      } catch (const InputError&) {
        continue;
      }
    } else if (shape.type == "box") {
      shape.size = vector_of(element, "size", Vec3::Zero());
    } else {
      shape.size = Vec3(number_of(element, "radius", 0), number_of(element, "length", 0), 0);
    }
    shapes.push_back(std::move(shape));
  }
  return shapes;
}

void adapt_meshes(Robot& robot) {
  MeshNames names;
  for (Link& link : robot.links) {
    xml::XMLElement* next = nullptr;
    for (xml::XMLElement* c = link.element->FirstChildElement("collision"); c != nullptr; c = next) {
      next = c->NextSiblingElement("collision");
      xml::XMLElement* geometry = c->FirstChildElement("geometry");
      xml::XMLElement* mesh = geometry == nullptr ? nullptr : geometry->FirstChildElement("mesh");
      if (mesh != nullptr && !adapt_mesh(robot, names, link, *mesh)) link.element->DeleteChild(c);
    }
  }
}

}  // namespace assay::urdf
