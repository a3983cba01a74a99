// Meshes that a scene (scene.h) draws beside its shapes: triangles that are only looked at. They stand in the scene's
// text, and only what draws them reads them.
#pragma once

#include <array>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "model/model.h"

namespace assay {

// m, in the frame of the parts that use it.
struct PictureMesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<int, 3>> faces;  // indices into vertices, counter-clockwise from outside
};

struct PicturePart {
  int mesh = 0;       // index into Pictures::meshes
  int body = kWorld;  // index into the scene's bodies, or kWorld
  Pose X_BS;          // the mesh's frame in the body frame (world frame for static parts)
  std::array<float, 4> rgba = {0.7f, 0.7f, 0.7f, 1.0f};
};

struct Pictures {
  std::vector<PictureMesh> meshes;
  std::vector<PicturePart> parts;

  size_t triangles() const;
};

// Leaves at most about this many triangles; large meshes keep more than small ones. A mesh that has no more than its
// share stays as it is.
void simplify(Pictures& pictures, size_t most_triangles);

// {"meshes": [{"step", "v": [x, y, z, ...], "f": [three corners of a triangle, ...]}], "parts": [{"mesh", "body",
// "p": [x, y, z], "q": [w, x, y, z], "rgba"}]}; lengths of a mesh are whole numbers of its "step" m.
nlohmann::json pictures_json(const Pictures& pictures);

// Throws InputError for what is no such object.
Pictures parse_pictures(const nlohmann::json& parsed);

}  // namespace assay
