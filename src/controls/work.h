// An upper bound of the energy that a control can put into a motion.
#pragma once

#include "controls/control.h"
#include "model/model.h"

namespace assay {

// In J, within `duration_s`: on every hinge its largest torque at any time, along the joint's range (a turn where it
// has none) twice a second each way; on a hinge or slide without limits, at least the energy that torques of time alone
// give its inertia. The bound is loose: a motion that blows up exceeds it at once.
double largest_work(const Model& model, const Control& control, double duration_s);

}  // namespace assay
