// Which bodies of the model share a body of MuJoCo's: MuJoCo has several joints in one body, the model a chain of
// massless bodies.
#pragma once

#include <vector>

#include "model/model.h"

namespace assay::mujoco {

// All by the model's bodies.
struct Tree {
  // The body whose MuJoCo body has this one's joint: itself, or the body that its chain of massless bodies leads to.
  std::vector<int> carrier;
  std::vector<Pose> X_BC;  // the carrier's frame in the body's, at the reference configuration

  // Of a carrier: the carrier that MuJoCo has as its parent, or kWorld, and its frame in that one's.
  std::vector<int> parent;
  std::vector<Pose> X_PC;

  bool is_carrier(int body) const { return carrier[body] == body; }
};

// A massless body joins the next of its chain unless it has several children or an end of a connect or weld, or MuJoCo
// cannot have the chain's joints in one body: those of more than 6 degrees of freedom, a rotation after a ball joint.
Tree share_bodies(const Model& model);

}  // namespace assay::mujoco
