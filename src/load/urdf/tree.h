// The links and joints of a URDF document and the tree that they make.
#pragma once

#include "load/urdf/robot.h"

namespace assay::urdf {

// True when the document has macros of xacro, which refuse it.
bool refuse_xacro(Robot& robot);

// Fills Robot::links and joints; of an element that stands twice where one is meant the first one stays. False when
// the document is refused.
bool read_elements(Robot& robot);

// Fills parents, children and Robot::order. False when the document is refused: it is no tree.
bool build_tree(Robot& robot);

// UrdfDocument::lines.
void note_lines(Robot& robot);

}  // namespace assay::urdf
