// What has to change in a URDF document for its inertias, limits and joints to be valid.
#pragma once

#include <string>

#include "load/urdf/robot.h"

namespace assay::urdf {

// Also what has to change for meshes to be found from `out`. Throws InputError for what cannot be mended.
Repairs repairs_of(Robot& robot, const std::string& out);

}  // namespace assay::urdf
