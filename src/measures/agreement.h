// How far two runs of one system are apart, and when they separate.
#pragma once

#include <optional>
#include <vector>

#include "model/model.h"

namespace assay {

// Mean distance of the bodies' centres of mass at each sample that both have, m. Both start at the same time and have
// the same sampling interval (assert).
std::vector<double> distances(const std::vector<State>& a, const std::vector<State>& b);

// Two runs have separated at the first sample at which their distance exceeds this.
inline constexpr double kPartedMetres = 1e-3;

// The separation time: seconds from the start until the distance exceeds the limit, interpolated linearly in the
// distance's logarithm between two samples. Empty when the runs never separate.
std::optional<double> parting_time(const std::vector<double>& time_s, const std::vector<double>& distance_m,
                                   double parted_m = kPartedMetres);

}  // namespace assay
