// Capabilities as data for the command line, the store and the report.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "engines/engine.h"

namespace assay {

std::string precision_text(Precision precision);        // "single", "double"
std::string coordinates_text(Coordinates coordinates);  // "joint", "maximal"
std::string springs_text(SpringKind springs);           // "none", "explicit", "native"

// "not given: ...", "along the normal, no friction: ...", "normal and friction: ..."
inline constexpr const char* kForcesNotGiven = "not given";
std::string contact_forces_text(const Capabilities& capabilities);
std::string contact_forces_given(ContactForces forces);  // "none", "normal", "all"

// Every field under its own name, in the order of the fairness ledger.
nlohmann::ordered_json describe(const Capabilities& capabilities);

// What in `settings` differs from the adapter's defaults, in the order of the declaration:
// [{"setting", "value", "default", "unit", "meaning"}], values as in `--set`.
nlohmann::ordered_json describe_changes(const std::vector<Setting>& declared, const Settings& settings);

// What of a model is not carried over exactly, things alike on one line: "joint 'knee' damping and 28 more: HOW". In
// the order in which they come; each thing once.
std::vector<std::string> approximations(const std::vector<Limitation>& limitations);

}  // namespace assay
