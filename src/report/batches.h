// Many worlds at once: the report's table and plot of them.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "results/results.h"

namespace assay {

// For each system with cells of the measure 'batch': {"system", "devices": {"cpu": "..."}, "rows": [{"contender",
// "timestep_ms", "worlds", "device", "outcome", "reason", "values": {"batch_rate": {"value", "low", "high"}, ...}}]},
// rows by contender as listed, timestep, device and number of worlds.
nlohmann::json batch_data(const Results& results);

}  // namespace assay
