// Cells of made-up results.
#pragma once

#include <string>
#include <vector>

#include "results/store/store.h"

namespace assay {

// Without values.
Cell cell(const std::string& system, const std::string& contender, double timestep_ms, const std::string& measure);

// Stores the cell as one that failed.
void fail(Store& store, Cell cell, Outcome outcome, const std::string& reason);

// Stores the cell with a speed whose interval goes to both sides by the share `wide` of it; samples are in us.
void put_speed(Store& store, Cell cell, double kilohertz, double wide, const std::vector<double>& samples);

}  // namespace assay
