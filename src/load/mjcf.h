// Loads MJCF, URDF, SDF (sdf.h) and USD (usd.h) files into the neutral Model with MuJoCo's own parser and compiler.
// Includes, defaults, frames, angle units and inertia inference are MuJoCo's, so a file has the same meaning as in
// MuJoCo.
//
// Carried over: mass and inertia; free, ball, hinge and slide joints, any number in a body, with limits, springs,
// dampers, armature and dry friction; spheres, capsules, boxes, cylinders, ellipsoids, planes, height fields, and
// meshes as MuJoCo's convex hull of them; MuJoCo's collision filter written out as contact pairs with their combined
// friction; linear equality of joints and of fixed tendons, connect, weld; fixed tendons; actuators on hinges, slides
// and fixed tendons whose force is an affine function; gravity, keyframes. Bodies without a joint are fused into their
// parent. Contact margins inflate their shapes and limit margins narrow their ranges, which is what they do in MuJoCo.
// MJCF has no element for a control that changes in time; assay reads <custom><numeric name="assay:sine:ACTUATOR"
// data="amplitude frequency phase"/> (control's unit, Hz, rad), which adds a sine to an actuator's control. Settings
// that the contender decides (integrator, timestep, solver, contact softness, friction cone) are ignored with a note.
// Everything else is refused, or left out with LoadOptions::drop_unsupported.
#pragma once

#include <string>

#include "load/file_facts.h"
#include "load/load_options.h"
#include "load/problems.h"
#include "model/model.h"

namespace assay {

// The text of a model's file, of at most kMostModelFileBytes. Throws InputError.
std::string model_text(const std::string& path);

// Loads `path`, an .xml (MJCF), .urdf, .sdf or .usd file; a missing capsules-N.xml is generated (load/capsules.h).
// Throws InputError for a file that is missing, unreadable, malformed or outside the common subset: one sentence with
// element, name, line where it is known, and how to mend it. Concurrent calls wait for each other: MuJoCo's message
// handler belongs to the process.
Model load_model(const std::string& path, const LoadOptions& options = {});

// The same for the text of an MJCF, URDF or SDF document. `name` replaces the file's name in messages, and the model's
// name where the text gives none. Model::source is empty. Files that the text refers to are looked up in the current
// directory.
Model load_model_text(const std::string& xml, const std::string& name, const LoadOptions& options = {});

// The same, with every problem of the file and not only the first. Throws InputError only for a file that is missing or
// cannot be read. `facts`, where given, is filled for a model that is not refused.
LoadReport inspect_model(const std::string& path, const LoadOptions& options = {}, FileFacts* facts = nullptr);
LoadReport inspect_model_text(const std::string& xml, const std::string& name, const LoadOptions& options = {},
                              FileFacts* facts = nullptr);

}  // namespace assay
