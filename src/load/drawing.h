// What a model file draws beside its collision shapes: meshes that are only looked at. They are no part of the Model,
// and nothing that is missing here keeps a model from being simulated.
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

#include "load/load_options.h"
#include "load/mesh_file.h"
#include "model/model.h"

namespace assay {

// One use of a mesh.
struct DrawnPart {
  int mesh = 0;       // index into Drawing::meshes
  int body = kWorld;  // index into Model::bodies, or kWorld
  Pose X_BS;          // the mesh's frame in the body frame (world frame for static parts)
  std::array<float, 4> rgba = {0.7f, 0.7f, 0.7f, 1.0f};
};

struct Drawing {
  // Where a link (URDF) or body (MJCF) of the file is in the Model, which fuses links that are fixed to each other.
  struct Link {
    int body = kWorld;  // index into Model::bodies, or kWorld
    Pose X_BL;          // the link's frame in that body
  };

  std::map<std::string, Link> links;
  std::vector<MeshData> meshes;  // m
  std::vector<DrawnPart> parts;
  std::vector<std::string> notes;  // what is not drawn, and why: a sentence each
};

// Reads the file again, with the same options as its model. Meshes of MJCF are those of its geoms: the ones that are
// only drawn, and of a body without such the ones that collide; of URDF those of <visual>, boxes, cylinders and spheres
// as triangles too. Empty for a file that does not load.
Drawing read_drawing(const std::string& path, const LoadOptions& options = {});

// The part of read_drawing() for URDF: needs Drawing::links.
void add_urdf_visuals(const std::string& text, const std::string& path, const LoadOptions& options, Drawing& drawing);

}  // namespace assay
