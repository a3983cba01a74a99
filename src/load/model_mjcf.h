// A model as the text of an MJCF file: what a fit has changed, for MuJoCo and all that reads its format.
#pragma once

#include <string>

#include "model/model.h"

namespace assay {

// The text from which load_model_text() reads the same robot, to rounding: bodies, joints, shapes, contact pairs,
// actuators and the initial state. Throws InputError for constraints, tendons and height fields, which are not written.
std::string model_mjcf(const Model& model);

}  // namespace assay
