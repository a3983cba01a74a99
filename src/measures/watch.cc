#include "measures/watch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace assay {
namespace {

constexpr auto kParts = std::to_array<Violation ViolationSummary::*>(
    {&ViolationSummary::largest, &ViolationSummary::rms, &ViolationSummary::rms_low, &ViolationSummary::rms_high});
constexpr double kNever = -1;  // in place of a time of dropping

}  // namespace

long long watch_steps(double timestep_ms) {
  constexpr double kRounding = 1e-9;
  return std::max(1LL, static_cast<long long>(std::floor(kWatchMs / timestep_ms + kRounding)));
}

std::vector<double> Watched::numbers() const {
  std::vector<double> all;
  for (const auto part : kParts) {
    for (const auto kind : kViolationKinds) {
      const double number = violation.*part.*kind;
      all.push_back(std::isfinite(number) ? number : kNever);  // of few samples there is no interval
    }
  }
  all.insert(all.end(), {violation.has_penetration ? 1.0 : 0.0, grasp.slip, grasp.dropped_at.value_or(kNever)});
  return all;
}

std::optional<Watched> Watched::of(const std::vector<double>& numbers) {
  constexpr size_t kCount = kParts.size() * kViolationKinds.size() + 3;
  if (numbers.size() != kCount) return std::nullopt;
  Watched watched;
  auto next = numbers.begin();
  for (const auto part : kParts) {
    for (const auto kind : kViolationKinds) {
      const double number = *next++;
      watched.violation.*part.*kind = number < 0 ? std::numeric_limits<double>::quiet_NaN() : number;
    }
  }
  watched.violation.has_penetration = *next++ > 0;
  watched.grasp.slip = *next++;
  if (*next >= 0) watched.grasp.dropped_at = *next;
  return watched;
}

Watch::Watch(const Model& model, const State& start, const GraspBodies& bodies)
    : violation_(model, start), bodies_(bodies), start_(start) {
  violation_.add(start);
}

void Watch::look(const State& state) {
  violation_.add(state);
  if (bodies_.object >= 0) add_to_grasp(grasp_, start_, state, bodies_);
}

Watched Watch::watched(std::uint64_t seed) const { return {violation_.summary(seed), grasp_}; }

}  // namespace assay
