// The values of a results directory as tidy rows: system, contender, timestep, measure, value, unit, outcome, bounds.
#pragma once

#include <functional>
#include <string>

#include "results/store/store.h"

namespace assay {

enum class ValuesFormat { kCsv, kJson };

// A name as a field of the CSV.
using TextField = std::function<std::string(const std::string&)>;

// A row for each value of each cell, and for each cell that failed before it had one. Numbers that are missing or not
// finite are empty in CSV and null in JSON.
std::string exported_values(const Store& store, ValuesFormat format, const TextField& field);

}  // namespace assay
