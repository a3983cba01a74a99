// What `assay snapshot` and `assay movie` share.
#pragma once

#include <string>
#include <utility>

#include "report/render/renderer.h"
#include "results/store/scene.h"
#include "results/store/store.h"

namespace assay::cli {

// "1280x720": pixels, each from 16 to 8192 and even. Throws InputError.
std::pair<int, int> parse_size(const std::string& text);

// The stored scene of a system. Throws InputError for a name that the results do not have, with the nearest one, and
// for results that have no scenes.
Scene scene_named(const Store& store, const std::string& system);

// "1/64 ms, 3.1 x realtime\nconsistency 1.2e-05 m": what was measured of a contender at a timestep.
std::string figures_text(const std::vector<Cell>& cells, const std::string& system, const std::string& contender,
                         double timestep_ms);

}  // namespace assay::cli
