// Where a series of figures changed its level.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace assay {

// Indices of the first figure after each change of the mean, ascending, by optimal partitioning (Jackson et al. 2005):
// the exact minimum over all divisions of the sum of squares about the segments' means over `noise` squared, plus
// `penalty` a change. A segment has at least `shortest` figures.
std::vector<size_t> change_points(std::span<const double> series, double noise, double penalty, size_t shortest = 2);

// Standard deviation of the noise of a series with few changes of level: from the median of the absolute differences of
// neighbours, which a change of level touches once. 0 for fewer than three figures.
double noise_of(std::span<const double> series);

}  // namespace assay
