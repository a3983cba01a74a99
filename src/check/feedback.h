// What becomes of the position and velocity feedback of a model's actuators in a contender.
#pragma once

#include <vector>

#include "check/step_bounds.h"
#include "engines/engine.h"
#include "model/model.h"

namespace assay {

// Of a contender without actuators of its own: the feedback is part of the torque of the step's start. Contenders with
// actuators of their own say in Engine::check() what they do.
std::vector<Limitation> feedback_limitations(const Model& model, const Capabilities& capabilities);

// Adds the largest stable timestep to each limitation of an actuator's feedback.
void add_feedback_bound(std::vector<Limitation>& limitations, const StepBounds& bounds);

}  // namespace assay
