#include "measures/agreement.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "measures/accuracy.h"

namespace assay {

std::vector<double> distances(const std::vector<State>& a, const std::vector<State>& b) {
  std::vector<double> found;
  const size_t count = std::min(a.size(), b.size());
  found.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    assert(std::abs(a[i].time - b[i].time) <= 1e-6 * std::max(1.0, std::abs(a[i].time)));
    found.push_back(position_error(a[i], b[i]));
  }
  return found;
}

std::optional<double> parting_time(const std::vector<double>& time_s, const std::vector<double>& distance_m,
                                   double parted_m) {
  assert(time_s.size() >= distance_m.size() && parted_m > 0);
  for (size_t i = 0; i < distance_m.size(); ++i) {
    if (distance_m[i] <= parted_m) continue;
    if (i == 0) return 0;
    const double before = distance_m[i - 1], after = distance_m[i];
    // Runs that are bit-equal until now have no logarithm: the separation is put at the end of this interval.
    const double share = before > 0 ? std::log(parted_m / before) / std::log(after / before) : 1;
    return time_s[i - 1] + share * (time_s[i] - time_s[i - 1]) - time_s[0];
  }
  return std::nullopt;
}

}  // namespace assay
