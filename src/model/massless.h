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

// The share that adapters use unless their user sets another.
inline constexpr double kLentShare = 0.02;
inline constexpr double kLargestLentShare = 0.1;

// A model without massless bodies that stands for one with them.
struct Lent {
  Model model;  // the copy: the same bodies, joints and shapes; the original's where it has no massless body
  std::vector<int> lender;  // by body: which body a massless one borrows from; -1 for a body that has its own mass
  bool any = false;         // whether there is a massless body

  // A state of the original as one of the copy, and back. They differ in the centres of the massless bodies, which are
  // their frames' origins in the original; joint coordinates are the same.
  void to_copy(State& state) const;
  void to_original(State& state) const;
};

// `share` is at most kLargestLentShare; a body that several massless ones lead to lends each of them that share, but
// never more than half of its mass in all.
Lent lend_mass(Model model, double share = kLentShare);

}  // namespace assay
