// MJCF and URDF files into the neutral Model, by MuJoCo's own parser and compiler: includes, defaults, frames, angle
// units and inertia inference are MuJoCo's, so a file means here what it means there.
//
// Carried over exactly: mass and inertia, hinge and free joints, limits, joint springs, dampers and armature, spheres,
// capsules, planes fixed to the world, MuJoCo's collision filter written out as contact pairs with their combined
// friction, motor and position actuators on hinges, gravity, keyframes. MJCF has no element for a control that changes
// in time; here <custom><numeric name="assay:sine:ACTUATOR" data="amplitude frequency phase"/> (control's unit, Hz,
// rad) adds a sine to an actuator's control. Bodies without a joint are fused into their parent. What a contender
// decides (integrator, timestep, solver, contact softness, friction cone) is left to it and becomes a note. Everything
// else is refused.
#pragma once

#include <string>

#include "model/model.h"

namespace assay {

struct LoadOptions {
  // Leave collision shapes that are neither sphere, capsule nor plane out instead of refusing the file; Model::notes
  // says which. Mass and inertia that they contribute stay. Nothing else is dropped.
  bool drop_unsupported = false;
};

// Loads `path`, an .xml (MJCF) or .urdf file; capsules-N.xml that is not there is made (model/capsules.h). Throws
// InputError for a file that is missing, unreadable, malformed or outside the common subset: one sentence with element,
// name, line where it is known, and what to do about it. Two calls at once wait for each other: MuJoCo's message
// handler belongs to the process.
Model load_model(const std::string& path, const LoadOptions& options = {});

// The same for the text of an MJCF or URDF document. `name` stands for the file in messages, and for the model where
// the text does not name it. Model::source is empty. Files that the text refers to are looked up from the current
// directory.
Model load_model_text(const std::string& xml, const std::string& name, const LoadOptions& options = {});

}  // namespace assay
