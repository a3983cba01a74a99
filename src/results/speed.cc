#include "results/speed.h"

#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "base/text.h"

namespace assay {

std::string caveat(const Speed& speed) {
  constexpr double kMuch = 0.25;
  if (!speed.coverage) return "timed by version 0.1: a median over some moments of the run, not the mean over it";
  if (*speed.coverage >= kMuch) return "";
  return fmt::format("{:.2g} % of the run was timed", 100 * *speed.coverage);
}

std::optional<Speed> speed_at(const SpeedCurve& speeds, double timestep_ms) {
  for (const auto& [step, factor] : speeds) {
    if (same_timestep(step, timestep_ms)) return Speed{factor, true, step, step};
  }
  const auto above = speeds.upper_bound(timestep_ms);
  if (above == speeds.end() || above == speeds.begin()) return std::nullopt;
  const auto below = std::prev(above);
  const double weight = std::log(timestep_ms / below->first) / std::log(above->first / below->first);
  // per timestep the factor is the inverse of the step's time
  const auto blend = [&](double Interval::* bound) {
    return timestep_ms * std::pow(below->second.*bound / below->first, 1 - weight) *
           std::pow(above->second.*bound / above->first, weight);
  };
  return Speed{
      {blend(&Interval::value), blend(&Interval::low), blend(&Interval::high)}, false, below->first, above->first};
}

}  // namespace assay
