// The law of an actuator (model.h), for those who compute it: controls, which give it to engines as torques, and
// adapters of engines that have actuators of their own.
#pragma once

#include "model/model.h"

namespace assay {

// amplitude sin(2 pi frequency time + phase)
double value_at(const Sine& sine, double time);

// Whether what multiplies the gain changes with time.
bool follows_time(const Actuator& actuator);

// What multiplies an actuator's gain at `time` when its control is `control` plus its sine: the clamped control, or the
// activation that has followed it from time 0, in closed form.
double actuator_input(const Actuator& actuator, double control, double time);

// Force of one actuator for such an input at a length and speed of its transmission, as model.h says, clamped. Each
// joint of it gets its coefficient times that.
double actuator_force(const Actuator& actuator, double input, double length, double speed);

}  // namespace assay
