// Who is unbeaten in speed and error together.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "measures/statistics.h"

namespace assay {

struct FrontPoint {
  std::string contender;
  double timestep_ms = 0;
  Interval speed;    // the more, the better
  double error = 0;  // not negative; the less, the better
};

struct FrontMember {
  size_t point = 0;                 // index into the points
  std::vector<std::string> equals;  // contenders that no figure tells apart from it: same timestep, same error, speeds
                                    // whose intervals overlap
};

// Errors that differ by less than this share count as equal.
inline constexpr double kSameError = 0.01;

// Errors below this count as equal: the reference solution is good to it, and rounding decides further down.
double error_resolution(const std::string& unit);

// Points that no other beats in speed without being less accurate, the fastest first. Of points that no figure tells
// apart the first in the list stands for all. Points with a number that is not finite are not in it.
std::vector<FrontMember> pareto_front(const std::vector<FrontPoint>& points, double resolution = 0);

}  // namespace assay
