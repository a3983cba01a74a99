// What is read of a run between its samples: joints, surfaces and a held object, at the same physical instants whatever
// the campaign stores. A hard contact's depth lasts for a step or two, so one look a sample would leave it to chance.
#pragma once

#include <optional>
#include <vector>

#include "measures/grasp.h"
#include "measures/violation.h"
#include "model/model.h"

namespace assay {

// Instants are this far apart, or one timestep where that is longer.
inline constexpr double kWatchMs = 1;

// Steps from one instant to the next, at least 1: as many as fit into kWatchMs.
long long watch_steps(double timestep_ms);

// What all instants say together.
struct Watched {
  ViolationSummary violation;
  Grasp grasp;  // nothing slipped where nothing is held

  // All of it as numbers, to be kept with a run, and back. Absent for numbers that are not of this kind.
  std::vector<double> numbers() const;
  static std::optional<Watched> of(const std::vector<double>& numbers);
};

class Watch {
 public:
  // `start` is the run's first state, and its first instant. The model has to stay.
  Watch(const Model& model, const State& start, const GraspBodies& bodies);

  void look(const State& state);
  Watched watched(std::uint64_t seed) const;

 private:
  ViolationSeries violation_;
  GraspBodies bodies_;
  State start_;
  Grasp grasp_;
};

}  // namespace assay
