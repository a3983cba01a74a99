// Massless bodies for engines in maximal coordinates, which need mass and inertia in every body.
//
// A body that has mass lends a share of it to each massless body whose chain leads to it. The lent part has the share
// of the mass and of the inertia, its centre lies at the lender's centre of mass at the reference configuration, and
// the lender keeps the rest. So at the reference the composite mass, centre of mass and inertia are exact; elsewhere
// they differ by the share at most, because the lent part does not follow the joints between it and its lender.
#pragma once

#include <vector>

#include "model/model.h"

namespace assay {

// The shares that adapters use unless their user sets another. A light body between heavy ones is what iterative
// solvers converge slowly on, so for them the best share is where both errors are alike. Measured on an arm whose
// shoulder has three oblique hinges (2 kg, anchors up to 0.1 m apart; position after 0.5 s, ODE, 1 ms):
//
//   share            5 %      2 %      1 %      0.3 %    0.1 %    0.001 %
//   20 iterations    84 mm    38 mm    24 mm    25 mm    56 mm
//   200 iterations   83 mm    36 mm    19 mm    7 mm     7 mm
//   exact            83 mm    36 mm    18 mm    5 mm     1.5 mm   0.4 mm (0.005 mm at 1/64 ms)
//
// Where the joints' axes meet, as in a hip of two legs on a floating body, 1 % is 0.1 mm and not to be seen beside the
// timestep's error of 2.5 mm.
inline constexpr double kLentShare = 0.01;
inline constexpr double kLentShareDirect = 1e-5;  // for solvers that solve the joints' equations exactly
inline constexpr double kLargestLentShare = 0.1;

// A model without massless bodies that stands for one with them.
struct Lent {
  Model model;  // the copy: the same bodies, joints and shapes; the original's where it has no massless body
  std::vector<int> lender;  // by body: which body a massless one borrows from; -1 for a body that has its own mass
  bool any = false;         // whether there is a massless body
  std::vector<double> inertia_kept = {};  // by body: the part of its inertia that a lender keeps, 1 for the others

  // A state of the original as one of the copy, and back. They differ in the centres of the massless bodies, which are
  // their frames' origins in the original; joint coordinates are the same.
  void to_copy(State& state) const;
  void to_original(State& state) const;
  State of_copy(State state) const {
    to_copy(state);
    return state;
  }
};

// `share` is at most kLargestLentShare; a body that several massless ones lead to lends each of them that share, but
// never more than half of its mass in all.
Lent lend_mass(Model original, double share = kLentShare);

}  // namespace assay
