// A look at each contender's speed before a campaign's cells are measured.
#pragma once

#include "run/coordinator/run_time_left.h"

namespace assay {

// Adds to `speeds` how long a step takes, roughly, for the estimate of the time left. Three systems of a family of
// sizes are probed, and of the others those that take little time; the rest is interpolated by the number of bodies.
void probe_speeds(RunShared& run, const Work& work, Speeds& speeds);

}  // namespace assay
