// Whether a state can be one of the model's motion at all: tells `unstable` and `diverged` from a mere error.
#pragma once

#include <string>

#include "model/model.h"

namespace assay {

// Bounds that follow from a model and the state it starts in. `work`, J, is what a control can have put in at the most.
class Plausibility {
 public:
  Plausibility(const Model& model, const State& start, double duration_s, double work = 0);

  // Why the run is over: a non-finite number, or a body farther from the origin than 1000 times what it could reach. ""
  // when it may go on.
  std::string divergence(const State& state) const;

  // Why no motion of the model reaches this state, although it is finite: more than kEnergyFactor times the kinetic
  // energy that is there to be had, a hinge torn apart by more than its body's size, a body's centre below the ground
  // it collides with. "" for a possible state.
  std::string impossibility(const State& state) const;

  double reach() const { return reach_; }                        // m
  double available_energy() const { return available_energy_; }  // J

  // Twice the possible speed: far from any drift of a method that still works.
  static constexpr double kEnergyFactor = 4;

 private:
  const Model& model_;
  double reach_ = 0;
  double available_energy_ = 0;
  double size_ = 0;  // largest distance between a hinge's anchor and a centre of mass that it moves or carries, m
};

}  // namespace assay
