// The meshes behind a model's hulls: how big, whether closed, which volume.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "load/file_facts.h"
#include "load/mujoco_messages.h"
#include "load/urdf.h"
#include "model/model.h"

namespace assay {

// Edges of a surface that do not belong to exactly two triangles. Vertices at equal positions are one.
size_t open_edges(const std::vector<Vec3>& vertices, const std::vector<std::array<int, 3>>& faces);

// Enclosed by triangles that face outward, m^3.
double enclosed_volume(const std::vector<Vec3>& vertices, const std::vector<std::array<int, 3>>& faces);

// One entry for each mesh that a hull of `model` was made from. `folder` is the model's. `urdf` is empty for MJCF.
// Of a mesh that was attached, MeshFacts::in is the name of the model asset.
std::vector<MeshFacts> mesh_facts(const Model& model, const mjSpec* spec, const mjModel* compiled,
                                  const std::string& folder, const UrdfDocument& urdf);

}  // namespace assay
