// How computing time grows with the size of a system.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "measures/statistics.h"

namespace assay {

struct TimeAtSize {
  double size = 0;              // bodies
  std::vector<double> seconds;  // of repeated runs
};

// The exponent p of time ~ size^p: the slope of the least-squares line through the logarithms of the median times. The
// interval (95 %) is a bootstrap that draws sizes and, for each size, one of its runs. Empty with fewer than 3 sizes or
// a time that is not positive and finite.
std::optional<Interval> scaling_exponent(const std::vector<TimeAtSize>& points, std::uint64_t seed);

}  // namespace assay
