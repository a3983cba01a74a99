// What stands in a URDF document and is not read, so that nothing is ignored in silence.
#pragma once

#include "load/urdf/robot.h"

namespace assay::urdf {

// Elements and attributes that are no part of URDF.
void note_unread_parts(Robot& robot);

// <loop_joint>: not part of URDF, which is a tree, but written by some programs.
void refuse_loops(Robot& robot);

// <mujoco>: reads <compiler> into Robot::compiler, and leaves only <option> in the document.
void read_compiler_settings(Robot& robot);

// <transmission>, <gazebo>, <ros2_control>.
void note_extensions(Robot& robot);

}  // namespace assay::urdf
