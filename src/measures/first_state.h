// The state in which a measured motion begins, from the positions around that moment alone: logged rates are filtered,
// delayed and noisier than what positions say.
#pragma once

#include <span>
#include <vector>

#include "model/model.h"

namespace assay {

// Of one coordinate at a moment, with the standard deviations that its samples' noise leaves.
struct FirstCoordinate {
  double position = 0, velocity = 0;
  double position_sd = 0, velocity_sd = 0;
  double sample_sd = 0;  // of a sample about the polynomial
};

// From the cubic (with fewer than 6 samples the parabola or line) of least squares through `positions` at `times`,
// relative to the moment, s. At least two samples at different times. With fewer than three the deviations are 0.
FirstCoordinate first_coordinate(std::span<const double> times, std::span<const double> positions);

// Samples of a body that nothing touches: its frame's poses in the world, at times from the moment on, s.
struct FlightSamples {
  std::vector<double> times;
  std::vector<Vec3> p_WB;
  std::vector<Quat> q_WB;
};

// The state of `body` (its inertia and centre of mass) at time 0 by which free flight under `gravity` comes closest to
// the samples: the centre of mass on a parabola, the rotation with constant angular momentum. One sample is at rest.
struct FirstFlight {
  BodyState state;
  double position_sd = 0;  // m, of a sample about the flight, a component; so below
  double rotation_sd = 0;  // rad
  // Of the state itself, a component: position, velocity, rotation vector, angular velocity.
  double p_sd = 0, v_sd = 0, q_sd = 0, w_sd = 0;
};
FirstFlight first_flight(const FlightSamples& samples, const Body& body, const Vec3& gravity);

// How many of the samples, from the first one on, are free flight: those before the first one that is more than
// `factor` times the noise off what the samples before it predict. At least `least`, or all that there are.
size_t flight_length(const FlightSamples& samples, const Body& body, size_t least, double factor = 6);

// Rotation and angular velocity (world axes) after `duration` s without a torque, by Runge-Kutta 4 in steps of at most
// 2 ms.
void turn_freely(const Mat3& I_BBcm_B, double duration, Quat& q_WB, Vec3& w_WB);

}  // namespace assay
