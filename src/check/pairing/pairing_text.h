// A comparison for people and for programs.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "check/pairing/pairing.h"

namespace assay::pairing {

// {"a": {"file", "format", "hash", "joints", "bodies", "mass"}, "b", "verdict": "same"|"differs", "joints_matched",
// "matches": [{"kind", "a", "b", "how", "reversed"}], "findings": [{"element", "what"}], "differences": [{"element",
// "parameter", "unit", "a", "b", "words", "effect", "share", "felt"}], "total_effect", "not_in_a_format", "notes",
// "motion": {"contender", "failure", "distance", "body", "travelled", "note"}}, lengths in m, angles in rad
nlohmann::ordered_json comparison_json(const Side& a, const Side& b, const Comparison& comparison);

// For standard output: worst first. `matches`: all matches; else their number and those that are not by name. `all`:
// every difference; else the largest twenty.
std::string comparison_text(const nlohmann::ordered_json& comparison, bool matches, bool all);

}  // namespace assay::pairing
