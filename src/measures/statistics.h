// Statistics of samples.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace assay {

struct Interval {
  double value = 0, low = 0, high = 0;
};

// All of these need at least one sample (assert) and do not change their input.
double median(std::span<const double> samples);
double mean(std::span<const double> samples);
// Linear interpolation between order statistics; q in [0, 1].
double quantile(std::span<const double> samples, double q);

// Median and mean with the 95 % percentile bootstrap interval over the samples. The same samples and seed give the same
// interval on every machine. One sample gives an interval of no width.
inline constexpr int kBootstrapResamples = 2000;
Interval bootstrap_median(std::span<const double> samples, std::uint64_t seed, int resamples = kBootstrapResamples);
Interval bootstrap_mean(std::span<const double> samples, std::uint64_t seed, int resamples = kBootstrapResamples);

// Only the means of the resamples, in the order of drawing. Series of equal length with the same seed are resampled
// with the same indices, so paired samples stay paired.
std::vector<double> resampled_means(std::span<const double> samples, std::uint64_t seed,
                                    int resamples = kBootstrapResamples);

// The 0.975 quantile of Student's t distribution with `freedom` degrees of freedom (at least 1).
double student_t_975(int freedom);

// How likely |T| would be at least |t|, for Student's t distribution with `freedom` > 0 degrees of freedom.
double student_t_p(double t, double freedom);

// Mean of a few samples, in the order in which they were taken, with its 95 % t-interval. It is wider where neighbours
// are alike: the variance of the mean grows by 1 + 2 (n - 1) / n times their correlation (lag 1, its bias of -1/n taken
// off, never negative). Fewer than two samples give no interval: both ends are NaN.
Interval t_interval(std::span<const double> samples);

// Root mean square of a series in time with a 95 % interval: a circular block bootstrap in blocks of sqrt(n) samples,
// because neighbours are correlated. It estimates how far another stretch of the same motion would differ, and says
// nothing about other motions. Fewer than 8 samples give no interval: both ends are NaN.
Interval bootstrap_rms_of_series(std::span<const double> series, std::uint64_t seed,
                                 int resamples = kBootstrapResamples);

// Interquartile range divided by the median: how far samples scatter. 0 for equal samples.
double relative_spread(std::span<const double> samples);

// Indices of samples more than 3 interquartile ranges outside the quartiles: flagged in reports, never dropped.
std::vector<int> outliers(std::span<const double> samples);

}  // namespace assay
