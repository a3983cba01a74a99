// Words and figures of verdicts.
#pragma once

#include <string>

#include "measures/statistics.h"
#include "results/claims/claims.h"

namespace assay {

std::string figure_text(double value);                // three digits
std::string interval_text(const Interval& interval);  // "2.1 [2.0, 2.2]"
// What a value's name means, "step time", with a capital letter at a sentence's start.
std::string value_text(const std::string& value, bool capital = true);
std::string bound_text(const ClaimBound& bound);  // "above 10"
// "2.31 times (2.15 to 2.35)"
std::string times_text(const Interval& ratio);

}  // namespace assay
