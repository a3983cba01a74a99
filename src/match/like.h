// Motion of one contender in place of measured one, to fit the others to it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "match/log.h"
#include "model/model.h"
#include "run/messages/messages.h"

namespace assay::match {

struct Like {
  std::string contender;
  double timestep_ms = 1;
  std::uint64_t seed = 1;
  int jobs = 1;
};

// Six motions of 4 s from drawn initial states (measures/initial_states.h), whose joints are driven by the control
// "random" (controls/hold.h); of a model without joints 24 motions of 1 s, thrown upwards. A sample every 5 ms: joints
// with their torques, and free bodies. Throws InputError for a model of which nothing moves, EngineError where the
// contender refuses the model or a motion does not come to its end, SystemError when it is interrupted.
std::vector<MeasuredLog> motions_like(const ModelSpec& spec, const Model& model, const Like& like);

}  // namespace assay::match
