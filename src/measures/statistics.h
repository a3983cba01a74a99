// Statistics of samples.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace assay {

struct Interval {
  double value = 0, low = 0, high = 0;
};

// All of these need at least one sample (assert) and leave their input alone.
double median(std::span<const double> samples);
double mean(std::span<const double> samples);
// Linear interpolation between order statistics; q in [0, 1].
double quantile(std::span<const double> samples, double q);

// Median and mean with the 95 % percentile bootstrap interval over the samples. The same samples and seed give the same
// interval on every machine. One sample gives an interval of no width.
inline constexpr int kBootstrapResamples = 2000;
Interval bootstrap_median(std::span<const double> samples, std::uint64_t seed, int resamples = kBootstrapResamples);
Interval bootstrap_mean(std::span<const double> samples, std::uint64_t seed, int resamples = kBootstrapResamples);

// Means of the resamples alone, in the order in which they were drawn. Series of equal length and the same seed are
// drawn alike: with samples that belong together one by one, the n-th means are of the same resample of pairs.
std::vector<double> resampled_means(std::span<const double> samples, std::uint64_t seed,
                                    int resamples = kBootstrapResamples);

// Median over all samples of all rounds; whole rounds are drawn, for samples of one round share that round's moment. No
// round may be empty (assert).
Interval bootstrap_median_of_rounds(const std::vector<std::vector<double>>& rounds, std::uint64_t seed,
                                    int resamples = kBootstrapResamples);

// Root mean square of a series in time with a 95 % interval: a circular block bootstrap, in blocks of sqrt(n) samples,
// for neighbours are alike. It says how far another stretch of the same length of the same motion would differ, and
// nothing of other motions. Fewer than 8 samples give none: both ends are NaN.
Interval bootstrap_rms_of_series(std::span<const double> series, std::uint64_t seed,
                                 int resamples = kBootstrapResamples);

// Distance between the quartiles over the median: how far a typical sample is from its neighbours. 0 for equal samples.
double relative_spread(std::span<const double> samples);

// Indices of samples farther than 3 distances between quartiles outside them: flagged in reports, never dropped.
std::vector<int> outliers(std::span<const double> samples);

}  // namespace assay
