// Seeded initial states of a system: where contacts make a motion chaotic, one state decides every figure, so campaigns
// measure from several.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "model/model.h"

namespace assay {

// Half widths of uniform distributions around the model's initial state.
struct Perturbation {
  double joint_position = 0.02;                      // rad; of hinges and ball joints, of these about a random axis
  double joint_rate = 0.2;                           // rad/s
  double slide_position = 0.002, slide_rate = 0.02;  // m, m/s; of slides
  double position = 0.005;                           // m, along each axis; of free bodies, as the next three
  double rotation = 0.05;                            // rad, about a random axis
  double velocity = 0.05;                            // m/s, along each axis
  double spin = 0.2;                                 // rad/s, about each axis

  bool operator==(const Perturbation&) const = default;
};

// The names of these widths in files.
struct PerturbationPart {
  const char* name;
  double Perturbation::* member;
};
inline constexpr std::array<PerturbationPart, 8> kPerturbationParts = {
    {{"joint_position", &Perturbation::joint_position},
     {"joint_rate", &Perturbation::joint_rate},
     {"slide_position", &Perturbation::slide_position},
     {"slide_rate", &Perturbation::slide_rate},
     {"position", &Perturbation::position},
     {"rotation", &Perturbation::rotation},
     {"velocity", &Perturbation::velocity},
     {"spin", &Perturbation::spin}}};

struct InitialStates {
  int count = 1;  // the model's own initial state is the first of them
  std::uint64_t seed = 1;
  Perturbation around;
};

// Why the model cannot be started from other states, as the end of a sentence about the system; "" when it can.
std::string perturbation_obstacle(const Model& model);

// State `index` of a system: 0 is Model::initial itself, the others are drawn, the same on every machine. Positions
// stay within their limits, joints that follow others in a coupling go on doing so, and no pair of shapes overlaps
// deeper than in Model::initial: a draw that does is repeated, after some attempts with half of the widths of
// positions. Pairs whose distance has no closed form (violation.h: separation) are not checked.
State initial_state(const Model& model, const InitialStates& states, int index);

// `base` with other rates and velocities, drawn around its own by the same widths; its positions stay.
State with_other_rates(const Model& model, const State& base, const InitialStates& states, int index);

}  // namespace assay
