// How long and how fine a run may be, the same in a campaign and for one run: beyond that a number is a slip.
#pragma once

#include <string>

namespace assay {

inline constexpr double kLeastTimestepMs = 1e-6, kMostTimestepMs = 1e12;
inline constexpr double kMostDurationS = 1e9;  // thirty years
inline constexpr double kMostRunSteps = 1e12;
inline constexpr double kLeastTimeLimitS = 0.01, kMostTimeLimitS = 1e7;  // of a cell; four months

// What is wrong with a number of milliseconds (a timestep, a distance of samples), as the rest of a sentence that
// begins with it: "give at least 1e-06 ms"; "" for nothing.
std::string milliseconds_obstacle(double ms);

// The same of the length of a run with so many timesteps.
std::string duration_obstacle(double duration_s, double timestep_ms);

}  // namespace assay
