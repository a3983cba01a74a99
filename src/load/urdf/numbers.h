// The numbers in the attributes of a URDF document.
#pragma once

#include "load/urdf/robot.h"

namespace assay::urdf {

// Refuses what is no number, with its line. A bound that no robot reaches becomes none. With `repairs`, commas between
// numbers are changed instead of refused. False when the document is refused.
bool check_numbers(Robot& robot, Repairs* repairs);

}  // namespace assay::urdf
