// Statistics over initial states. Figures of one motion depend on each other, those of different motions do not: so
// whole motions are drawn.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "measures/statistics.h"

namespace assay {

// Mean over all samples, and its 95 % interval: a bootstrap that draws whole groups. Its percentiles are widened as
// Student's t demands of few groups (T. Hesterberg, What Teachers Should Know About the Bootstrap, The American
// Statistician 69, 2015): plain ones cover too little. With one group the samples themselves are drawn. No group may be
// empty, and there has to be one (assert).
Interval bootstrap_mean_of_groups(const std::vector<std::vector<double>>& groups, std::uint64_t seed,
                                  int resamples = kBootstrapResamples);

// The same of the median over all samples.
Interval bootstrap_median_of_groups(const std::vector<std::vector<double>>& groups, std::uint64_t seed,
                                    int resamples = kBootstrapResamples);

// Share of samples that are at most `limit`, and its 95 % interval: as the mean above, and where all or none are, as of
// a probability (below) with as many trials as there are groups, or samples of a single group.
Interval share_within_of_groups(const std::vector<std::vector<double>>& groups, double limit, std::uint64_t seed,
                                int resamples = kBootstrapResamples);

// Only the means of the resamples, in the order of drawing, without the widening. Samples in groups of equal sizes with
// the same seed are drawn alike.
std::vector<double> resampled_means_of_groups(const std::vector<std::vector<double>>& groups, std::uint64_t seed,
                                              int resamples = kBootstrapResamples);

// Which quantile of a bootstrap's estimates from `groups` groups bounds 95 % below; 1 minus it above. 0.025 for many.
double bootstrap_tail(size_t groups);

// Samples by their group's number. Both series have one length (assert). Without numbers each sample is a group.
std::vector<std::vector<double>> grouped(std::span<const double> samples, std::span<const double> group);

// Probability of an event that happened in `hits` of `trials` (at least 1) independent trials, with the 95 % interval
// of Clopper and Pearson (Biometrika 26, 1934), which covers at least that often.
Interval probability(int hits, int trials);

}  // namespace assay
