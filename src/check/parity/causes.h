// From residual forces back to parameters of the model: which single change of it would make the contender's
// accelerations right.
#pragma once

#include <vector>

#include "check/parity/parity.h"

namespace assay::parity {

// The causes of `responses`' residuals, first the one that explains most; none when no change explains a good part of
// what is above `tolerance` (relative to Bench::scale). `unexplained` gets the largest relative residual that is left.
std::vector<Cause> find_causes(const Bench& bench, const std::vector<Response>& responses, double tolerance,
                               double& unexplained);

}  // namespace assay::parity
