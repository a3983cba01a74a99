// Realtime factors between the timesteps that were timed.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "measures/statistics.h"

namespace assay {

// Realtime factors by timestep (ms), where they were measured.
using SpeedCurve = std::map<double, Interval>;

struct Speed {
  Interval factor;                    // times real time
  bool timed = true;                  // at this very timestep; else interpolated
  double below_ms = 0, above_ms = 0;  // the timed timesteps that it is from
  // Share of the run that was timed, the smaller one of the two timesteps. Empty in results of version 0.1: their step
  // time is a median over pooled slices of some states and no mean over the run.
  std::optional<double> coverage = std::nullopt;
};

// What of it a reader has to know: that little of the run was timed, or by which estimate. "" when there is nothing.
std::string caveat(const Speed& speed);

// Between two timed timesteps the time of a step is interpolated, logarithmically in both. Empty outside of what was
// timed: there is no telling what a step costs there.
std::optional<Speed> speed_at(const SpeedCurve& speeds, double timestep_ms);

}  // namespace assay
