// The joints of a URDF document as MuJoCo's reader takes them: limits, mimicry, motors.
#pragma once

#include "load/urdf/robot.h"

namespace assay::urdf {

// Equal limits hold a joint where they are. MuJoCo's reader takes them for none.
void lock_joints(Robot& robot);

// Limits, axes and mimicry that MuJoCo's reader takes otherwise, and UrdfDocument::driven.
void adapt_joints(Robot& robot);

}  // namespace assay::urdf
