// Convex decomposition of concave meshes (--decompose), by CoACD: X. Wei, M. Liu, Z. Ling, H. Su, "Approximate convex
// decomposition for 3D meshes with collision-aware concavity and tree search", ACM Transactions on Graphics 41 (2022).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "model/model.h"

namespace assay {

// At most kMostHulls closed hulls that together fill the mesh, in its frame; one where the mesh is convex. The result
// is kept in the user's cache under a hash of the mesh, because it takes seconds a mesh. Hull::name is empty. Throws
// InputError with the rest of a sentence that begins with the mesh's name when CoACD is not there or fails.
inline constexpr int kMostHulls = 16;
std::vector<Hull> decomposed(const std::vector<Vec3>& vertices, const std::vector<std::array<int, 3>>& faces);

}  // namespace assay
