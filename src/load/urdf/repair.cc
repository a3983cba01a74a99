#include "load/urdf/repair.h"

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <tinyxml2.h>

#include "base/errors.h"
#include "base/text.h"
#include "load/package_paths.h"
#include "load/urdf/masses.h"
#include "load/urdf/numbers.h"
#include "load/urdf/shapes.h"
#include "load/urdf/tree.h"
#include "load/urdf/unread.h"
#include "load/urdf/values.h"

namespace assay::urdf {
namespace {

namespace fs = std::filesystem;
namespace xml = tinyxml2;

// Names of meshes that mean another file, or none, in the folder of `out`.
void move_meshes(const Robot& robot, const std::string& out, Repairs& repairs) {
  size_t moved = 0;
  for (const Link& link : robot.links) {
    for (const char* kind : {"visual", "collision"}) {
      for (const xml::XMLElement* e = link.element->FirstChildElement(kind); e != nullptr;
           e = e->NextSiblingElement(kind)) {
        const xml::XMLElement* geometry = e->FirstChildElement("geometry");
        const xml::XMLElement* mesh = geometry == nullptr ? nullptr : geometry->FirstChildElement("mesh");
        const std::string uri = text_of(mesh, "filename");
        const MeshFolder as_mujoco{robot.compiler.mesh_dir, robot.compiler.strip_path};
        const std::string found =
            uri.empty() ? "" : find_resource(uri, robot.path, robot.options.packages, as_mujoco).path;
        if (found.empty() || find_resource(uri, out, robot.options.packages, as_mujoco).path == found) continue;
        repairs.change(*mesh, "filename", fs::absolute(found).lexically_normal().string());
        ++moved;
      }
    }
  }
  if (moved > 0)
    repairs.mends.push_back({0, fmt::format("names of mesh files that are absolute paths now: {}", moved)});
}

int heaviest_part(const Robot& robot, const Masses& masses, int head) {
  int heaviest = head;
  for (size_t i = 0; i < robot.links.size(); ++i) {
    if (masses.head(static_cast<int>(i)) == head && robot.links[i].mass > robot.links[heaviest].mass)
      heaviest = static_cast<int>(i);
  }
  return heaviest;
}

// Of a mass that fills the link's collision shapes, in the axes of its inertia; of a ball of water without such.
Mat3 inertia_of_shapes(const Robot& robot, const Link& link, double mass) {
  const std::vector<SolidShape> shapes = shapes_of(robot, link);
  try {
    const RigidPart part = shapes.empty() ? RigidPart{} : part_of_shapes(shapes);
    const Mat3 R = link.X_LI.q.toRotationMatrix();
    const Mat3 I = part.mass > 0 ? Mat3(R.transpose() * part.I * R * (mass / part.mass)) : Mat3(Mat3::Zero());
    if (inertia_valid(I)) return I;
  } catch (const InputError&) {  // shapes that MuJoCo gives no mass
  }
  return nearest_valid_inertia(Mat3::Zero(), mass);
}

void mend_inertia(const Robot& robot, const Masses& masses, const Link& link, Repairs& repairs) {
  const xml::XMLElement* inertial = link.element->FirstChildElement("inertial");
  if (inertial == nullptr || link.mass <= 0) return;
  if (inertia_possible(link.I)) {
    // points and lines of mass are valid as parts, not as a whole: the heaviest part gets an extent
    const int head = masses.head(robot.link_of.at(link.name));
    if (inertia_valid(masses.whole(head).I) || heaviest_part(robot, masses, head) != robot.link_of.at(link.name))
      return;
  }
  const xml::XMLElement* inertia = inertial->FirstChildElement("inertia");
  const double mass = number_of(inertial->FirstChildElement("mass"), "value", 0);
  const Mat3 written = inertia_of(*inertial);
  const Mat3 mended = written.isZero(0) ? inertia_of_shapes(robot, link, mass) : nearest_valid_inertia(written, mass);
  std::string entries;
  for (const auto& [name, at] : kInertiaEntries) {
    const double value = mended(at.first, at.second);
    entries += fmt::format(" {}=\"{}\"", name, shortest(value));
    if (inertia != nullptr && value != written(at.first, at.second)) repairs.change(*inertia, name, shortest(value));
  }
  if (inertia == nullptr) {
    repairs.edits.push_back({.line = inertial->GetLineNum(),
                             .index = index_of(*inertial),
                             .element = "inertial",
                             .attribute = "",
                             .value = fmt::format("<inertia{}/>", entries)});
  }
  repairs.mends.push_back({(inertia == nullptr ? inertial : inertia)->GetLineNum(),
                           fmt::format("inertia of link '{}': principal moments {} -> {} kg m^2", link.name,
                                       inertia == nullptr ? "missing" : moments_text(principal_moments(written)),
                                       moments_text(principal_moments(mended)))});
}

void mend_joint(const Robot& robot, const Masses& masses, const Joint& joint, Repairs& repairs) {
  if (masses.idle().contains(robot.links[joint.child].joint)) {
    repairs.change(*joint.element, "type", "fixed");
    repairs.mends.push_back(
        {line_of(joint), fmt::format("joint '{}' moves no mass: {} -> fixed", joint.name, joint.type)});
    return;
  }
  const xml::XMLElement* limit = joint.element->FirstChildElement("limit");
  if (limit == nullptr || (joint.type != "revolute" && joint.type != "prismatic")) return;
  const double lower = number_of(limit, "lower", 0), upper = number_of(limit, "upper", 0);
  if (lower <= upper || limit->Attribute("lower") == nullptr || limit->Attribute("upper") == nullptr) return;
  repairs.change(*limit, "lower", text_of(limit, "upper"));
  repairs.change(*limit, "upper", text_of(limit, "lower"));
  repairs.mends.push_back({limit->GetLineNum(), fmt::format("limits of joint '{}': swapped, {} to {}", joint.name,
                                                            shortest(upper), shortest(lower))});
}

}  // namespace

Repairs repairs_of(Robot& robot, const std::string& out) {
  Repairs repairs;
  if (robot.document.Error()) {
    throw InputError(fmt::format("{}: it is not well-formed XML and cannot be mended", robot.path));
  }
  if (refuse_xacro(robot) || !read_elements(robot) || !check_numbers(robot, &repairs) || !build_tree(robot)) {
    throw InputError(fmt::format("{}: {}", robot.path, problem_text(robot.result.problems.front())));
  }
  read_compiler_settings(robot);
  Masses masses(robot);
  masses.read();
  masses.find_idle();
  for (const Link& link : robot.links) mend_inertia(robot, masses, link, repairs);
  for (const Joint& joint : robot.joints) mend_joint(robot, masses, joint, repairs);
  if (!repairs.mends.empty()) move_meshes(robot, out, repairs);
  return repairs;
}

}  // namespace assay::urdf
