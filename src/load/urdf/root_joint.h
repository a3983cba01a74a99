// How the robot is connected to the world.
#pragma once

#include "load/urdf/robot.h"

namespace assay::urdf {

// --floating-base hangs the robot on the link "world", which MuJoCo takes for the world; --fixed-base fixes it there.
void apply_root_joint(Robot& robot);

}  // namespace assay::urdf
