// The secular part of a series: its slope over the whole run, which an oscillation does not have.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "measures/statistics.h"

namespace assay {

// Theil-Sen slope of `values` over `time_s`, in the unit of the values a second: the median of the slopes between all
// pairs of samples, which outliers and a bounded oscillation move little. Of more than 256 samples, evenly spread ones
// are used. The interval (95 %) is a bootstrap of the residuals in blocks of sqrt(n) samples, because neighbours are
// correlated. Empty with fewer than 8 samples, a number that is not finite, or times that do not ascend. Both series
// have one length (assert).
std::optional<Interval> robust_slope(std::span<const double> time_s, std::span<const double> values,
                                     std::uint64_t seed);

}  // namespace assay
