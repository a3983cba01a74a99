// The inertia that hinges and slides feel.
#pragma once

#include <Eigen/Core>

#include "model/model.h"

namespace assay {

// The joint-space inertia of hinges and slides in `state`, armature included, kg m^2 (kg for slides): what accelerates
// while free bodies and ball joints follow without force. Symmetric, one row per joint of the model. Only the positions
// of `state` are read.
Eigen::MatrixXd joint_inertia(const Model& model, const State& state);

}  // namespace assay
