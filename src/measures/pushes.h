// Seeded pushes of a robot during a run: velocities that are added to its state at drawn times, as Isaac Lab's
// push_by_setting_velocity does in training. They follow from the seed and the initial state's number alone, so every
// contender gets the same.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "model/model.h"

namespace assay {

struct Pushes {
  double velocity = 0;  // m/s; of a hinge rad/s; 0: none
  double every_s = 3;   // one push in each interval of this length
  std::string joint;    // hinge or slide that is pushed; "": the free body
  std::uint64_t seed = 1;

  bool any() const { return velocity > 0; }
  bool operator==(const Pushes&) const = default;
};

struct Push {
  double time_s = 0;             // from the run's start
  Vec3 velocity = Vec3::Zero();  // m/s, that the free body and what it carries gain: horizontal
  double rate = 0;               // rad/s or m/s, that the joint gains
};

// Why the model cannot be pushed so, as the end of a sentence about it: "has no free body: name a joint"; "" when it
// can.
std::string push_obstacle(const Model& model, const Pushes& pushes);

// The pushes of the run from initial state `state`, in the order of their times: in each interval of `every_s` one, at
// a time and in a direction drawn uniformly, at the sample that follows. None at the start and at the end.
std::vector<Push> draw_pushes(const Pushes& pushes, int state, double duration_s, double sample_s);

// The state just after: positions stay, joints go on being satisfied. The model can be pushed so (assert).
State pushed(const Model& model, const State& state, const Pushes& pushes, const Push& push);

}  // namespace assay
