#include "base/run_bounds.h"

#include <algorithm>

#include <fmt/format.h>

#include "base/text.h"

namespace assay {

std::string milliseconds_obstacle(double ms) {
  if (ms < kLeastTimestepMs) return fmt::format("give at least {:.3g} ms", kLeastTimestepMs);
  if (ms > kMostTimestepMs) return fmt::format("give at most {:.3g} ms", kMostTimestepMs);
  return "";
}

std::string duration_obstacle(double duration_s, double timestep_ms) {
  const double most_s = std::min(kMostDurationS, 1e-3 * kMostRunSteps * timestep_ms);
  if (duration_s <= most_s) return "";
  // beyond the longest run of all, its steps are not what is wrong
  if (duration_s > kMostDurationS) return fmt::format("give at most {:.3g} s", most_s);
  return fmt::format("it takes {:.3g} timesteps of {} ms: give at most {:.3g} s", 1000 * duration_s / timestep_ms,
                     timestep_label(timestep_ms), most_s);
}

}  // namespace assay
