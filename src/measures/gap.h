// How far two contenders are apart on paired runs, while the cause still decides and chaos does not yet; and which
// share of that a change closes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "measures/statistics.h"
#include "model/model.h"

namespace assay {

// Positions of the bodies' centres of mass along a run, sample by sample, all bodies of a sample together.
struct Track {
  size_t bodies = 0;
  std::vector<Vec3> positions;  // world frame, m

  size_t samples() const { return bodies == 0 ? 0 : positions.size() / bodies; }
};
Track track_of(const std::vector<State>& states);

// Two runs have parted at the first sample at which the mean distance of their bodies is this or more. It is also the
// most that a sample counts: beyond it the distance says how chaotic the motion is, not how large the cause.
inline constexpr double kFarMetres = 0.01;

// The mean distance of the bodies at each of `samples` samples, at most kFarMetres, m. A sample that one of the runs
// lacks because it ended early counts kFarMetres.
std::vector<double> gap_curve(const Track& a, const Track& b, size_t samples);

// Samples of a pair that count, of its unchanged runs: all up to the one at which they part, or all.
size_t gap_window(std::span<const double> curve);

// The gap of one pair: the mean of the curve's first `window` samples but the initial one, m.
double gap_of(std::span<const double> curve, size_t window);

// 1 - mean(after) / mean(before) of the gaps of paired starts, with the 95 % bootstrap interval over starts: a resample
// takes both gaps of a start. Gaps that are all 0 have no share: 0.
Interval share_closed(std::span<const double> before, std::span<const double> after, std::uint64_t seed);

}  // namespace assay
