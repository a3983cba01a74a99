// What in a state that comes from an engine, or from a file of its states, cannot be: "" for nothing, else words that
// follow "the engine gave".
#pragma once

#include <string>

#include "model/model.h"
#include "model/state.h"

namespace assay {

// Its shape: "3 bodies where the model has 5". `bodies` and `joints` are the model's.
std::string state_shape_fault(const State& state, size_t bodies, size_t joints);

// Its values: "a non-finite number", "an orientation of length 0". With the model, whose shape it has, and a time that
// is finite also of what and when: "a non-finite number as the position of joint 'knee' at 0.12 s".
std::string state_value_fault(const State& state, const Model* model = nullptr);

// Its time, which is finite, `steps` timesteps after `start_s`: "the time 1 s where 2 s was asked for". An engine may
// sum up its timesteps, but not lose or repeat one.
std::string state_time_fault(const State& state, double start_s, double timestep_s, long long steps);

}  // namespace assay
