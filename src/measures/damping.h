// Hidden damping: the decay of an energy that should be conserved.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "measures/statistics.h"

namespace assay {

// The rate c, 1/s, of dv/dt = -c v that explains how the kinetic energy of an otherwise conserved motion decays:
// E(t) = E(0) exp(-2 c t), fitted by least squares to the logarithm; negative when energy is gained. The interval (95
// %) is a bootstrap of the residuals in blocks, because neighbouring samples are correlated. Empty with fewer than 8
// samples, an energy that is not positive and finite, or times that are all the same. Both series have one length
// (assert).
std::optional<Interval> damping_rate(std::span<const double> time_s, std::span<const double> energy,
                                     std::uint64_t seed);

}  // namespace assay
