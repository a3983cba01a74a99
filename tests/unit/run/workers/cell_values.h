// Values of a stored cell.
#pragma once

#include <cmath>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "results/store/store.h"

namespace assay {

inline std::optional<double> value(const Cell& cell, const std::string& name) {
  for (const Value& each : cell.values) {
    if (each.name == name) return each.value;
  }
  return std::nullopt;
}

// The same where it has to be there.
inline double number(const Cell& cell, const std::string& name) {
  const std::optional<double> found = value(cell, name);
  EXPECT_TRUE(found) << cell.contender << " " << cell.measure << ": no " << name << "; " << cell.reason;
  return found.value_or(std::nan(""));
}

}  // namespace assay
