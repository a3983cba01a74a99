// The collision shapes of links.
#pragma once

#include <vector>

#include "load/urdf/compiler.h"
#include "load/urdf/robot.h"

namespace assay::urdf {

// What MuJoCo refuses without a place: shapes that URDF does not know, and sizes that are not positive.
void check_shapes(Robot& robot);

// A link's collision shapes that have a volume.
std::vector<SolidShape> shapes_of(const Robot& robot, const Link& link);

// Finds and reads mesh files: UrdfDocument::meshes, and their names in the document.
void adapt_meshes(Robot& robot);

}  // namespace assay::urdf
