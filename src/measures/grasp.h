// Whether an object stays in a hand.
#pragma once

#include <optional>
#include <vector>

#include "model/model.h"

namespace assay {

// Which object a system grasps, and in which hand.
struct GraspBodies {
  int object = -1, hand = -1;  // indices into Model::bodies; -1: the system has no grasp
  double drop_m = 0.1;         // a larger slip is a drop
};

// How far the object's centre of mass has moved in the hand's body frame since the run's first state, m. `object` and
// `hand` are indices into Model::bodies.
double slip(const State& start, const State& state, int object, int hand);

struct Grasp {
  double slip = 0;                   // m, the largest of the run
  std::optional<double> dropped_at;  // s, the first state's time at which the slip exceeds `drop_m`
  bool held() const { return !dropped_at; }
};
// Takes note of one more state of a run that began with `start`.
void add_to_grasp(Grasp& grasp, const State& start, const State& state, const GraspBodies& bodies);

// From the timesteps at which a contender held or dropped the object, ascending: the largest at which it held, and the
// largest up to which it held at every smaller one too. Empty when there is none.
struct HeldAt {
  double timestep_ms = 0;
  bool held = false;
};
struct LargestHeld {
  std::optional<double> any, without_hole;
};
LargestHeld largest_held(const std::vector<HeldAt>& timesteps);

}  // namespace assay
