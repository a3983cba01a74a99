// Whom a movie or a replay shows when nobody is named.
#pragma once

#include <string>
#include <vector>

namespace assay {

// At most `most` of `present`: the paper's contenders under their names of today first (MuJoCo's two integrators, both
// of Bullet, ODE, PhysX, Havok), then one of each other engine and formulation, then the rest as they come.
std::vector<std::string> line_up(const std::vector<std::string>& present, size_t most);

}  // namespace assay
