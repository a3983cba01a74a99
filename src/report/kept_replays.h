// Runs that are made again for a report's replays.
#pragma once

#include <string>
#include <vector>

namespace assay {

// For each system in `dir`: runs the contenders of the report's replays at each of `timesteps` (ms) that fits the
// system's samples, and keeps their states. Skips runs that are kept already; says on standard error what it did.
void keep_replays(const std::string& dir, const std::vector<double>& timesteps);

}  // namespace assay
