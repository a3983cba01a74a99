// Differences while they are collected. Internal to src/check/pairing.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "check/pairing/pairing.h"

namespace assay::pairing {

struct Draft {
  Difference difference;
  // Gives A this one value of B's; empty for what no joint's force depends on: `difference.effect` is set then.
  std::function<void(Model&)> put = {};
};

// Two models of one tree: B's is in A's frames (align.h).
struct Aligned {
  Model a, b;
};

// "1.01 kg instead of 1 kg (+1 %)": B's value, then A's.
std::string instead(double a, double b, const std::string& unit);
// Both beyond rounding: relative to the larger one, and `least` apart.
bool differ(double a, double b, double least = 1e-9);
// Relative to A's value, 1 where that is 0.
double relative(double a, double b);

// Actuators, matched by `map`, joints and names; matches and what only one has go to `out`.
void compare_actuators(const Side& side_a, const Side& side_b, const Aligned& models,
                       const std::vector<std::pair<std::string, std::string>>& map, Comparison& out,
                       std::vector<Draft>& drafts);
// A's actuator -> B's, -1 for none: on the same joints, by `map` and names first.
std::vector<int> match_actuators(const Model& a, const Model& b,
                                 const std::vector<std::pair<std::string, std::string>>& map);

}  // namespace assay::pairing
