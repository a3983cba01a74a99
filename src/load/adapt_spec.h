// What the loader changes in MuJoCo's parsed document before it is compiled.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "load/load_options.h"
#include "load/mujoco_messages.h"
#include "load/problems.h"
#include "load/urdf.h"

namespace assay {

// Gives the meshes of a URDF document their vertices, and their faces where a hull does not need them `with_faces`.
// Mass does not come from them, so that they need not be closed.
void give_vertices(mjSpec* spec, const std::map<std::string, UrdfMesh>& meshes, bool with_faces);

// A motor on each of these joints, named as the joint; the compiler clamps its force to the joint's actuatorfrcrange.
void add_motors(mjSpec* spec, const std::vector<std::string>& joints);

// Textures and skins, which only pictures need, and missing mesh files of geoms that cannot collide and do not add to
// an inertia, are left out; other missing mesh files become problems, or are left out with `drop_missing`. `folder` is
// the model's. Without `drawn_meshes` tetrahedra stand for the other meshes that are only drawn, because compiling
// these takes most of a model's time.
void leave_out_pictures(mjSpec* spec, const std::string& folder, bool drawn_meshes, bool drop_missing,
                        LoadReport& report, std::vector<std::string>& notes);

// What MuJoCo 4 does not compile and what keeps its meaning in another form: shellinertia of mesh geoms, which is the
// mesh's own since MuJoCo 3.3; and lengths of muscles, which no model has.
void adapt_to_compiler(mjSpec* spec, std::vector<std::string>& notes);

// --floating-base and --fixed-base for MJCF. Keyframes are left out, because their size is another.
void apply_root_joint(mjSpec* spec, RootJoint root, LoadReport& report, std::vector<std::string>& notes);

// Adds a plane that every shape with a contact bit touches; its name. Empty when the file has a plane in the world.
std::string add_ground(mjSpec* spec, std::vector<std::string>& notes);

}  // namespace assay
