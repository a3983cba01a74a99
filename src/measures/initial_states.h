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
  double joint_position = 0.02;
  double joint_rate = 0.2;
  double slide_position = 0.002, slide_rate = 0.02;
  double position = 0.005;
  double rotation = 0.05;
  double velocity = 0.05;
  double spin = 0.2;

  bool operator==(const Perturbation&) const = default;
};

// The names of these widths in files.
struct PerturbationPart {
  const char* name;
  double Perturbation::* member;
  const char* meaning;
};
inline constexpr std::array<PerturbationPart, 8> kPerturbationParts = {
    {{"joint_position", &Perturbation::joint_position, "rad; of hinges and ball joints, of these about a random axis"},
     {"joint_rate", &Perturbation::joint_rate, "rad/s; of hinges and ball joints"},
     {"slide_position", &Perturbation::slide_position, "m; of slides"},
     {"slide_rate", &Perturbation::slide_rate, "m/s; of slides"},
     {"position", &Perturbation::position, "m along each axis; of free bodies"},
     {"rotation", &Perturbation::rotation, "rad about a random axis; of free bodies"},
     {"velocity", &Perturbation::velocity, "m/s along each axis; of free bodies"},
     {"spin", &Perturbation::spin, "rad/s about each axis; of free bodies"}}};

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
