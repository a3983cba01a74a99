// The uniform state: what every engine reports and every measure reads.
#pragma once

#include <vector>

#include "model/geometry.h"

namespace assay {

// One rigid body, world frame. Position and linear velocity are those of the centre of mass; the orientation is that of
// the body's MJCF frame (not of its principal axes).
struct BodyState {
  Vec3 p_WBcm = Vec3::Zero();  // m
  Quat q_WB = Quat::Identity();
  Vec3 v_WBcm = Vec3::Zero();  // m/s
  Vec3 w_WB = Vec3::Zero();    // rad/s, expressed in the world frame
};

// `bodies` is in the order of Model::bodies; `position` and `velocity`, in the order of Model::joints, are those of
// hinges and slides. Angles are unwrapped (they continue past pi); positions are measured from the MJCF zero: the
// reference configuration has position = Joint::reference. Free and ball joints have their state in `bodies`.
struct State {
  double time = 0;  // s
  std::vector<BodyState> bodies;
  std::vector<double> position;  // rad, m for slides
  std::vector<double> velocity;  // rad/s, m/s for slides
};

}  // namespace assay
