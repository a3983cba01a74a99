// A certificate as JSON, for files, the report and the process that examined.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "check/parity/parity.h"

namespace assay::parity {

// {"contender", "engine", "beside", "verdict": "same"|"differs"|"unexplained"|"not settled"|"not examined", "error",
// "noise", "tolerance", "unexplained", "raised", "declared": [text], "failure", "joints": [{"element", "inertia":
// {"error", "noise"}, ...}], "limits": [{"joint", "upper", "expected", "found", "place"}], "causes": [{"element",
// "parameter", "seen", "change", "effect", "explains", "alike": [text]}]}
nlohmann::ordered_json certificate_json(const Model& model, const Certificate& certificate);

// A cause of a certificate in words: "joint 'ankle': armature 0 kg m^2 instead of 0.01".
std::string cause_text(const nlohmann::ordered_json& cause);

// "same", "differs" (by the causes), "unexplained" (differs, but no single parameter explains it), "not settled" (the
// contender's own error hides any difference below 5 %), "not examined".
std::string verdict_of(const Certificate& certificate);

}  // namespace assay::parity
