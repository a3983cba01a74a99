// <mujoco><compiler> in a URDF document: what MuJoCo's reader of URDF makes of it that changes masses and inertias, or
// where meshes lie. It ignores the others there: angles are radians, roll, pitch and yaw turn about fixed axes.
#pragma once

#include <string>
#include <vector>

#include <tinyxml2.h>

#include "load/inertia.h"
#include "load/mesh_file.h"
#include "load/problems.h"

namespace assay {

struct UrdfCompiler {
  enum class FromShapes {
    kNever,    // a link without <inertial> has no mass, as in ROS
    kMissing,  // inertiafromgeom="auto": those without <inertial> get the mass of their collision shapes
    kAlways,   // "true": all that have collision shapes
  };
  FromShapes from_shapes = FromShapes::kNever;
  double bound_mass = 0;     // kg, least mass of a link
  double bound_inertia = 0;  // kg m^2, least principal moment of a link
  double total_mass = 0;     // kg, to which all masses are scaled; 0 for none
  bool balance = false;      // moments that break the triangle inequality become their mean
  bool fuses = true;         // masses of fixed links are those of the world
  std::string mesh_dir;      // from the model's folder
  bool strip_path = true;    // of mesh names the last part counts

  bool changes_inertia() const {
    return from_shapes != FromShapes::kNever || bound_mass > 0 || bound_inertia > 0 || total_mass > 0 || balance;
  }
};

// Reads all <mujoco><compiler> elements; a later one overrides an earlier one. Values that MuJoCo does not take become
// problems, attributes that it does not know become notes.
UrdfCompiler read_compiler(const tinyxml2::XMLElement& robot, std::vector<Problem>& problems,
                           std::vector<std::string>& notes);

// A shape as a part of a link, of MuJoCo's density.
struct SolidShape {
  std::string type;  // URDF's element: "box", "cylinder", "capsule", "sphere", "mesh"
  Vec3 size;         // box: edges; else radius and length
  MeshData mesh;     // of type "mesh"
  Pose X_LS;         // its frame in the link's
};

// The mass and inertia that MuJoCo's compiler gives to a body of these shapes. Throws InputError where it refuses them.
RigidPart part_of_shapes(const std::vector<SolidShape>& shapes);

}  // namespace assay
