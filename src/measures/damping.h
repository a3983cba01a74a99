// Damping that nobody asked for, from the energy of a motion that should keep it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "measures/statistics.h"

namespace assay {

// The rate c, 1/s, of dv/dt = -c v that explains how the kinetic energy of an otherwise conserved motion decays:
// E(t) = E(0) exp(-2 c t), fitted by least squares to the logarithm; negative when energy is gained. The interval (95
// %) is a bootstrap of the residuals in blocks, for neighbouring samples err together. Empty with fewer than 8 samples,
// an energy that is not positive and finite, or times that are all the same. As many times as energies (assert).
std::optional<Interval> damping_rate(std::span<const double> time_s, std::span<const double> energy,
                                     std::uint64_t seed);

}  // namespace assay
