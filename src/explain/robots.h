// What parity (check/parity) sees of the robot in both contenders, and an explanation as JSON.
#pragma once

#include <functional>
#include <vector>

#include <nlohmann/json.hpp>

#include "explain/explain.h"
#include "explain/question.h"

namespace assay {

// Parameters that differ, from a certificate of each side, in processes of their own; `certificates` gets these.
// `progress` is called before each. Throws SystemError where it is interrupted.
std::vector<SeenParameter> seen_parameters(const ExplainQuestion& question, nlohmann::ordered_json& certificates,
                                           const std::function<void(const Side&)>& progress);

// What rounding explains of a gap, in a run of some seconds: m.
double rounding_gap(const ExplainQuestion& question);

nlohmann::ordered_json explanation_json(const ExplainQuestion& question, const Explanation& found, const Swaps& swaps,
                                        double tolerance, const nlohmann::ordered_json& certificates);

}  // namespace assay
