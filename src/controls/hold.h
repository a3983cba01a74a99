// Controls that fit any model: their gains and amplitudes follow from its joint-space inertia.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "controls/control.h"

namespace assay {

// The largest torque (N for slides) that the model's actuators can give each joint: infinite where nothing limits it, 0
// for a joint that no actuator drives. A model without actuators has all its joints driven, without limits.
std::vector<double> effort_limits(const Model& model);

// A PD that holds every driven hinge and slide at the start pose: torque = -kp (q - q0) - kd dq/dt, within the effort
// limits. With the joint-space inertia A of the driven joints at the start pose (the others follow) and w = 2 pi
// natural_frequency: torques = -A (w^2 (q - q0) + 2 w dq/dt), so that every mode of the coupled joints is critically
// damped, and none is stiffer than the others. With natural_frequency 0 it is 10 Hz: velocities decay with 126/s, which
// torques that are held for 8 ms stand, and a legged robot carries its weight.
std::unique_ptr<Control> hold_control(const Model& model, double natural_frequency = 0);

// On each driven joint three sines of time, 0.5 to 3 Hz, whose frequencies and phases follow from the seed. Their
// amplitudes are A_jj (2 pi f)^2 motion / 3, scaled down to stay within the effort limits. The same seed gives the same
// torques on every machine.
std::unique_ptr<Control> random_control(const Model& model, double motion, std::uint64_t seed);

}  // namespace assay
