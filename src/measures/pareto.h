// Speed against error: who is worth using.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <vector>

#include "measures/statistics.h"

namespace assay {

struct SpeedAndError {
  double speed = 0;  // the more, the better
  double error = 0;  // the less, the better
};

// Indices of the points that no other beats in one respect without being worse in the other, the fastest first. Of
// equal points all are in it. Points with a number that is not finite are not.
std::vector<size_t> pareto_front(const std::vector<SpeedAndError>& points);

// The fastest point whose error is at most `limit`; of equally fast ones the more accurate. Empty when there is none.
std::optional<size_t> fastest_within(const std::vector<SpeedAndError>& points, double limit);

// Realtime factors by timestep (ms), where they were measured.
using SpeedCurve = std::map<double, Interval>;

// The realtime factor at a timestep: between those that were measured the step's time is interpolated, logarithmically
// in both; beyond them it is the nearest one's. Empty when none was measured.
std::optional<Interval> speed_at(const SpeedCurve& speeds, double timestep_ms);

}  // namespace assay
