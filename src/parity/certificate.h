// A certificate as JSON, for files, the report and the process that examined.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "parity/parity.h"

namespace assay::parity {

// {"contender", "engine", "verdict": "same"|"differs"|"unexplained"|"not settled"|"not examined", "error", "noise",
// "tolerance", "unexplained", "raised", "declared": [text], "failure", "joints": [{"element", "inertia": {"error",
// "noise"}, ...}], "limits": [{"joint", "upper", "expected", "found", "place"}], "causes": [{"element", "parameter",
// "seen", "change", "effect", "explains"}]}
nlohmann::ordered_json certificate_json(const Model& model, const Certificate& certificate);

// "same", "differs" (by the causes), "unexplained" (differs, but no single parameter explains it), "not settled" (the
// contender's own error hides any difference below 5 %), "not examined".
std::string verdict_of(const Certificate& certificate);

}  // namespace assay::parity
