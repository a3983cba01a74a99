// A model as the text of an MJCF file: what a fit has changed, for MuJoCo and all that reads its format.
#pragma once

#include <string>

#include "model/model.h"

namespace assay {

// The text from which load_model_text() reads the same robot, to rounding: bodies, joints, shapes, contact pairs,
// constraints, tendons and actuators. Throws InputError for height fields, for springs of ball joints that rest
// elsewhere than at the reference, and for massless bodies that carry several, which MJCF cannot say or which are not
// written.
std::string model_mjcf(const Model& model);

}  // namespace assay
