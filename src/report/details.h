// What the page shows of a system and of a cell beyond their values: pictures, who agrees with whom, samples. Compact:
// numbers have as few digits as a picture needs. web/src/data.ts names the fields.
#pragma once

#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "results/results.h"

namespace assay {

// The samples of a cell that have a distribution worth a look (times of steps and runs, errors of pieces):
// [{"name", "count", "values": [...]}] where they are few, else
// [{"name", "count", "from", "to", "bins": [counts], "above"}] with bins of equal width over [from, to] and a count of
// what lies above. Values have the unit that the name ends with.
nlohmann::json sample_data(const std::vector<SampleSeries>& samples);

// [{"system", "image": PNG as a data URL or null, "start": [shape], "end": {"contender", "time_s", "shapes": [shape]}
// or null, "ground": z or null}] of the systems whose scene was stored; those that are more than capsules and spheres
// have an image of the start. A shape is {"a": [x, y, z], "b": [x, y, z], "r": radius, "c": "#rrggbb"} in the world
// frame, m: a capsule between two points, or a sphere where they are equal. "end" is the last state of the first run
// that is kept.
nlohmann::json picture_data(const Results& results);

// [{"system", "timestep_ms", "contenders": [name], "time_s": [...], "distance_m": [[...] or null], "parting_s": [...]}]
// of the systems that were measured by agreement. The last two have an entry per pair (0, 1), (0, 2), ..., (1, 2), ...:
// the distance at each time, and the time from the start at which they part, which is the run's length when they never
// do (null: not measured).
nlohmann::json agreement_data(const Results& results);

}  // namespace assay
