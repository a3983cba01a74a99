#include "engines/describe.h"

#include <gtest/gtest.h>

namespace assay {
namespace {

TEST(Approximations, WhatIsAlikeStandsOnOneLine) {
  const std::string spring = "explicit torque", hull = "at most 255 vertices";
  const std::vector<std::string> lines = approximations({
      {Fidelity::kApproximated, "joint 'knee' damping", spring},
      {Fidelity::kRefused, "joint 'knee' armature", "has none"},
      {Fidelity::kApproximated, "geom 'foot'", hull},
      {Fidelity::kApproximated, "joint 'hip' damping", spring},
      {Fidelity::kApproximated, "joint 'hip' damping", spring},
      {Fidelity::kExact, "joint 'hip' limit", spring},
  });
  EXPECT_EQ(lines, (std::vector<std::string>{"joint 'knee' damping and 1 more: " + spring, "geom 'foot': " + hull}));
}

}  // namespace
}  // namespace assay
