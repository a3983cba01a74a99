// Small pictures of robots that have meshes, computed here, because a report is made where there may be no OpenGL.
#pragma once

#include <string>
#include <vector>

#include "model/geometry.h"
#include "results/store/pictures.h"
#include "results/store/scene.h"

namespace assay {

// A PNG file's bytes: the meshes, and the shapes of bodies that no mesh shows, in parallel projection from
// `azimuth_deg` (deg, 0 looks along x), 15 degrees downwards, on a transparent ground. `poses` are of the scene's
// bodies. "" where there is nothing to draw. Throws SystemError.
std::string thumbnail_png(const Scene& scene, const std::vector<Pose>& poses, const Pictures& pictures,
                          double azimuth_deg);

}  // namespace assay
