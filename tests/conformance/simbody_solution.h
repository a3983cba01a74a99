// The motion of a smooth model by Simbody: an independent check of src/reference.
#pragma once

#include "model/model.h"

namespace assay {

// Bodies' poses after `duration` s by Simbody's own joints, forces and Runge-Kutta-Merson integrator with an accuracy
// of 1e-12. Hinges, free joints, springs, dampers and gravity; no armature.
State simbody_solution(const Model& model, const State& start, double duration);

}  // namespace assay
