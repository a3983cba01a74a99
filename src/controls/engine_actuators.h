// Which part of a control an engine computes itself.
#pragma once

#include "controls/control.h"

namespace assay {

// Leaves in the model, for which the engine is then created, what of the control the engine computes: Control::equip()
// adds springs and dampers of drives. Actuators stay, with the control's set points, only where they are the control
// and the engine has actuators of its own (Capabilities::actuators); they must not act besides another control. True
// where they stay: then no torques of the control are to be given.
bool equip_for(bool engine_actuators, const Control& control, Model& model);

}  // namespace assay
