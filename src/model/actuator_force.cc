#include "model/actuator_force.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace assay {

double value_at(const Sine& sine, double time) {
  return sine.amplitude * std::sin(2 * std::numbers::pi * sine.frequency * time + sine.phase);
}

bool follows_time(const Actuator& actuator) { return actuator.has_activation() || actuator.sine.amplitude != 0; }

double actuator_input(const Actuator& actuator, double control, double time) {
  const Sine& sine = actuator.sine;
  if (!actuator.has_activation()) {
    const double u = control + value_at(sine, time);
    return actuator.control_limited ? std::clamp(u, actuator.control_lower, actuator.control_upper) : u;
  }
  if (actuator.control_limited) control = std::clamp(control, actuator.control_lower, actuator.control_upper);
  const double w = 2 * std::numbers::pi * sine.frequency;
  double activation = actuator.activation_start;
  if (actuator.activation == ActivationType::kFilter) {
    const double decay = std::exp(-time / actuator.time_constant);
    activation = control + (activation - control) * decay;
    if (sine.amplitude != 0) {
      const double lag = std::atan(w * actuator.time_constant);
      activation +=
          sine.amplitude * std::cos(lag) * (std::sin(w * time + sine.phase - lag) - std::sin(sine.phase - lag) * decay);
    }
  } else {
    activation += control * time;
    if (sine.amplitude != 0) {
      activation += w == 0 ? sine.amplitude * std::sin(sine.phase) * time
                           : sine.amplitude / w * (std::cos(sine.phase) - std::cos(w * time + sine.phase));
    }
  }
  // without a sine it moves one way only, so that a clamp of the result equals one of the motion
  return actuator.activation_limited ? std::clamp(activation, actuator.activation_lower, actuator.activation_upper)
                                     : activation;
}

double actuator_force(const Actuator& actuator, double input, double length, double speed) {
  const auto& [constant, of_length, of_speed] = actuator.bias;
  // a position actuator's error first, so that a small one keeps its digits
  double force =
      of_length == -actuator.gain ? actuator.gain * (input - length) : actuator.gain * input + of_length * length;
  force += of_speed * speed + constant;
  if (actuator.force_limited) force = std::clamp(force, actuator.force_lower, actuator.force_upper);
  return force;
}

}  // namespace assay
