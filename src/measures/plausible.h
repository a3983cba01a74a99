// Whether a state can belong to the model's motion: separates the outcomes `unstable` and `diverged` from a large
// error.
#pragma once

#include <string>

#include "model/model.h"

namespace assay {

// The version of these rules, stored with results: results/soundness.h judges older ones again. 1: not stored, a hinge
// may pass its limit any number of times or once (versions before 0.3). 2: all scales are positive, ball joints count.
inline constexpr int kSoundnessRules = 2;

// Bounds that follow from a model and its initial state. `work`, J, is the most energy that a control can have added.
class Plausibility {
 public:
  Plausibility(const Model& model, const State& start, double duration_s, double work = 0);

  // Why the run has diverged: a non-finite number, or a body farther from the origin than 1000 times its reach. "" when
  // the run may continue.
  std::string divergence(const State& state) const;

  // Why no motion of the model reaches this finite state: more than kEnergyFactor times the available kinetic energy, a
  // joint torn apart by more than its body's size, a hinge more than a turn beyond its limit, or a body's shape that
  // lies as a whole below the ground that it collides with: less deep it is a penetration, which has a measure of its
  // own. "" for a possible state.
  std::string impossibility(const State& state) const;

  double reach() const { return reach_; }                        // m
  double available_energy() const { return available_energy_; }  // J

  // Corresponds to twice the possible speed, far beyond the drift of a working method.
  static constexpr double kEnergyFactor = 4;

 private:
  const Model& model_;
  double reach_ = 0;
  double available_energy_ = 0;
  double size_ = 0;  // largest distance between a hinge's anchor and a centre of mass that it moves or carries, m
};

}  // namespace assay
