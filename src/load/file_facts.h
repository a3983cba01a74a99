// What a model's file says and the neutral Model does not keep: where its elements are, and the meshes behind its
// hulls. For messages about the model; no physics depends on it.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace assay {

// The mesh that one of Model::hulls was computed from, as it is compiled (scaled).
struct MeshFacts {
  std::string name;          // Hull::name; of a mesh in several hulls without their numbers
  std::string file;          // empty where the model's file holds the vertices
  int line = 0;              // of its first use or its asset; 0 when it is not known
  std::string in = {};       // the included file that has the line; empty for the model's own
  std::uintmax_t bytes = 0;  // of `file`
  size_t triangles = 0;
  size_t open_edges = 0;  // edges that do not belong to exactly two triangles: 0 for a watertight mesh
  double volume = 0;      // m^3, enclosed by the triangles; only of a watertight mesh a volume
};

struct FileFacts {
  bool is_urdf = false, is_sdf = false;
  // Line of each body, joint, geom, actuator, tendon, coupling, connect and weld of the Model by its label, "joint
  // 'knee'". What the loader made up is missing.
  std::map<std::string, int> lines;
  // The included file of each that has its line in one, as the <include> or <model> writes it.
  std::map<std::string, std::string> files;
  std::vector<MeshFacts> meshes;
  std::map<std::string, double> velocity_limits;  // of a URDF or SDF file, by joint: rad/s, m/s
  std::map<std::string, double>
      locked;  // joints of a URDF or SDF file that their equal limits hold, and where (rad, m)
  // How far what is drawn of a body of a URDF file lies from its centre of mass, m. Meshes are not looked at.
  std::map<std::string, double> drawn_reach;
  std::set<std::string> drawn;  // names of shapes that the file lets collide with nothing

  // Of an element as limitations name it, "joint 'knee' armature"; 0 when it is not known.
  int line_of(const std::string& element) const;
  // The included file that has that line; empty for the model's own.
  std::string file_of(const std::string& element) const;
};

}  // namespace assay
