// Pictures of a system's shapes in a figure.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "report/figures/axes.h"
#include "results/results.h"

namespace assay::figures {

// From where a picture shows the system best, in degrees (models/views.toml).
double azimuth_of(const std::string& system);

// Parallel projection, the far shapes first; the camera looks down by 15 degrees. Of all shapes the `share` that is
// nearest to their middle fills the box. Returns how many lie outside it.
size_t picture(Canvas& canvas, const Box& box, const Scene& scene, const std::vector<Pose>& poses,
               double azimuth_degrees, double share = 1);

std::vector<Pose> start_of(const Scene& scene);

// Nothing where the results have no shapes of the system.
void start_picture(Canvas& canvas, const Results& results, const Box& box, const std::string& system);

}  // namespace assay::figures
