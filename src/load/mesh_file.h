// Mesh files as triangles: what the loader needs of .stl (binary or text), MuJoCo's .msh, .obj, .dae and .glb. No
// other file is opened, whatever the mesh names.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "model/geometry.h"

namespace assay {

// Vertices at equal positions are one. Of a .dae or .glb file the unit and the nodes' transformations are applied
// and the up axis is not, as ROS does: URDF gives the pose of the mesh's own axes.
struct MeshData {
  std::vector<Vec3> vertices;             // m
  std::vector<std::array<int, 3>> faces;  // indices into vertices
  size_t open_edges = 0;                  // edges that do not belong to exactly two faces; 0 for a watertight mesh

  // How thick the mesh is in its thinnest of three perpendicular directions, against its longest extent: 0 when flat.
  double flatness() const;
};

inline constexpr size_t kMostTriangles = 1'000'000;

// Throws InputError with the rest of a sentence that begins with the mesh's name: "cannot be read: ...; mend". It is
// thrown for a file that is missing, broken or empty, of another format, that has more than kMostTriangles or 256 MiB,
// or numbers that are not finite. `part` is the name of a mesh or node in the file: only that is read; "" for all.
MeshData read_mesh(const std::string& path, const std::string& part = "");

}  // namespace assay
