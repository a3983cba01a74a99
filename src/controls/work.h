// What a control can put into a motion.
#pragma once

#include "controls/control.h"
#include "model/model.h"

namespace assay {

// At the most, J, within `duration_s`: on every hinge its largest torque at any time and limit, along the joint's range
// (a turn where it has none) twice a second. Loose; what has blown up is beyond it within moments.
double largest_work(const Model& model, const Control& control, double duration_s);

}  // namespace assay
