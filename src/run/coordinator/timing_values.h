// Values of timings, and the order of turns.
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "measures/statistics.h"
#include "results/store/store.h"

namespace assay {

// The same order on every machine.
template <typename T>
void shuffle(std::vector<T>& items, std::mt19937_64& random) {
  for (size_t i = items.size(); i > 1; --i) std::swap(items[i - 1], items[(random() >> 32) * i >> 32]);
}

inline std::optional<double> finite(double number) {
  return std::isfinite(number) ? std::optional(number) : std::nullopt;
}

inline Value value_of(const std::string& name, const std::string& unit, double value) {
  return {name, unit, value, {}, {}};
}

inline Value value_of(const std::string& name, const std::string& unit, const Interval& interval) {
  return {name, unit, interval.value, finite(interval.low), finite(interval.high)};
}

inline Value inverse(const std::string& name, const std::string& unit, double scale, const Interval& interval) {
  // an interval that reaches to zero says nothing about the inverse
  const bool bounded = interval.low > 0;
  return {name, unit, scale / interval.value, bounded ? finite(scale / interval.high) : std::nullopt,
          bounded ? finite(scale / interval.low) : std::nullopt};
}

}  // namespace assay
