// How a robot stands in the world where neither its file nor the user says so.
#pragma once

#include <string>
#include <vector>

#include "load/load_options.h"
#include "model/model.h"

namespace assay {

struct Stance {
  LoadOptions load;                // as given, with what was decided
  Model model;                     // loaded with it
  std::vector<std::string> notes;  // a sentence for each decision, with the switch that turns it off
};

// Loads `file` for a run. URDF has no word for a base that is free: it is taken to be free when the robot stands on two
// or more of its limbs or wheels, or has no joint, and its root is not called 'world'. A robot with a free or sliding
// base that gravity pulls down and that nothing in the world can stop gets a plane under its lowest point. Joints that
// start beyond their limits, where no pose was asked for, start at the limit. Throws InputError as load_model().
Stance stand(const std::string& file, const LoadOptions& given);

// The body of the world that carries `body`, or `body` itself.
int root_of(const Model& model, int body);

// Whether a moving shape may touch one that is fixed to the world.
bool can_land(const Model& model);

// Whether the robot's base moves freely: most of its bodies hang on one free body. A free object beside a robot on a
// fixed base does not count.
bool has_free_base(const Model& model);

// Whether a joint of a root slides without a spring and an actuator, as the bases of planar robots do.
bool has_free_slide(const Model& model);

}  // namespace assay
