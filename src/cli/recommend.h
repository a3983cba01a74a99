// Limits on the command line of `assay recommend` and `assay run ROBOT`.
#pragma once

#include <CLI/App.hpp>

#include "results/limits.h"

namespace assay::cli {

// Adds --error, --measure, --penetration, --slip, --realtime and --limit.
void add_limits(CLI::App& command, LimitOptions& options);

}  // namespace assay::cli
