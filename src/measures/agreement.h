// Whether two runs of one system are the same motion, and when they part.
#pragma once

#include <optional>
#include <vector>

#include "model/model.h"

namespace assay {

// Mean distance of the bodies' centres of mass at each sample that both have, m. Both start at the same time and are
// sampled alike (assert).
std::vector<double> distances(const std::vector<State>& a, const std::vector<State>& b);

// Two runs have parted from the first sample on at which they are farther apart than this.
inline constexpr double kPartedMetres = 1e-3;

// Time from the start, s, up to which they have not parted: linear in the logarithm between the samples around it.
// Empty when they never do.
std::optional<double> parting_time(const std::vector<double>& time_s, const std::vector<double>& distance_m,
                                   double parted_m = kPartedMetres);

}  // namespace assay
