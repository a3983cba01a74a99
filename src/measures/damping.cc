#include "measures/damping.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <random>
#include <vector>

namespace assay {
namespace {

constexpr size_t kFewest = 8;

struct Line {
  double offset = 0, slope = 0;
};

// y = offset + slope (x - mean x), and the sum of squares that stays the same over all resamples.
class Regression {
 public:
  explicit Regression(std::span<const double> x) : mean_(mean(x)) {
    for (const double each : x) {
      centred_.push_back(each - mean_);
      squares_ += centred_.back() * centred_.back();
    }
  }
  double squares() const { return squares_; }
  double centred(size_t i) const { return centred_[i]; }
  Line fit(std::span<const double> y) const {
    double slope = 0;
    for (size_t i = 0; i < y.size(); ++i) slope += centred_[i] * y[i];
    return {mean(y), slope / squares_};
  }

 private:
  double mean_;
  std::vector<double> centred_;
  double squares_ = 0;
};

}  // namespace

std::optional<Interval> damping_rate(std::span<const double> time_s, std::span<const double> energy,
                                     std::uint64_t seed) {
  assert(time_s.size() == energy.size());
  const size_t count = energy.size();
  const auto usable = [](double e) { return std::isfinite(e) && e > 0; };
  if (count < kFewest || !std::ranges::all_of(energy, usable)) return std::nullopt;
  // Relative to the first energy, so that a decay of 1e-12 is not lost in the rounding of a large logarithm.
  std::vector<double> logarithm(count);
  for (size_t i = 0; i < count; ++i) logarithm[i] = std::log1p((energy[i] - energy[0]) / energy[0]);
  const Regression regression(time_s);
  if (!(regression.squares() > 0)) return std::nullopt;
  const Line line = regression.fit(logarithm);

  std::vector<double> fitted(count), residual(count);
  for (size_t i = 0; i < count; ++i) {
    fitted[i] = line.offset + line.slope * regression.centred(i);
    residual[i] = logarithm[i] - fitted[i];
  }
  const auto block = static_cast<size_t>(std::ceil(std::sqrt(static_cast<double>(count))));
  std::mt19937_64 random(seed);
  std::vector<double> resample(count), rates(kBootstrapResamples);
  for (double& rate : rates) {
    for (size_t i = 0; i < count; i += block) {
      const size_t from = (random() >> 32) * count >> 32;
      for (size_t k = 0; k < block && i + k < count; ++k)
        resample[i + k] = fitted[i + k] + residual[(from + k) % count];
    }
    rate = -0.5 * regression.fit(resample).slope;
  }
  return Interval{-0.5 * line.slope, quantile(rates, 0.025), quantile(rates, 0.975)};
}

}  // namespace assay
