// Motions with a closed-form solution, with which engines are compared. Plain functions of numbers in SI units, angles
// in radians, independent of models and engines.
#pragma once

#include "model/geometry.h"

namespace assay {

// Torque-free rotation of a rigid body with three different principal moments, by Jacobi's elliptic functions.
// Source: Landau and Lifshitz, Mechanics, section 37 (velocities, precession about the angular momentum).
class TorqueFreeTop {
 public:
  // `moments` are the principal moments in kg m^2, in any order; `w_B` the angular velocity at time 0 in principal
  // axes. The moments must differ and the rotation must not be about a principal axis (assert).
  TorqueFreeTop(const Vec3& moments, const Vec3& w_B);

  // In principal axes, rad/s.
  Vec3 angular_velocity(double time) const;

  // The rotation from principal axes at `time` to principal axes at time 0. The precession about the angular momentum
  // has no elementary form and is a quadrature of the closed form (error 1e-14).
  Quat orientation(double time) const;

  // Period of the angular velocity in body axes, s.
  double period() const;

 private:
  double precession_rate(double time) const;
  Mat3 euler_rotation(double time, double precession) const;

  Vec3 moments_;
  int axis_[3] = {0, 1, 2};  // the caller's axes that take the roles of L&L's axes 1, 2, 3
  double amplitude_[3];
  double rate_ = 0, modulus_ = 0, phase_ = 0;
  double momentum_ = 0;
};

// Angle of a physical pendulum released at rest, theta'' = -(m g d / I) sin theta, d from the pivot to the centre of
// mass, I about the pivot. Source: NIST Digital Library of Mathematical Functions, 22.19(i); Landau and Lifshitz,
// section 11.
class Pendulum {
 public:
  // `frequency` = sqrt(m g d / I) in rad/s, that of small swings; `amplitude` in (0, pi).
  Pendulum(double frequency, double amplitude) : frequency_(frequency), amplitude_(amplitude) {}
  double period() const;            // s
  double angle(double time) const;  // rad from hanging, amplitude at time 0
  double rate(double time) const;   // rad/s

 private:
  double frequency_, amplitude_;
};

struct Motion {
  double position = 0, velocity = 0;
};

// x'' = -(k/m) x - (b/m) x' from (x0, v0): under-, critically or overdamped. Holds for linear and angular motion.
// Source: Landau and Lifshitz, section 25.
Motion damped_oscillator(double mass, double stiffness, double damping, Motion start, double time);

// Constant acceleration: free fall along one axis, constant torque on a hinge (torque over inertia).
Motion uniform_acceleration(Motion start, double acceleration, double time);

// A body that slides with Coulomb friction mu on a level plane without turning, from speed v.
// Source: Goldstein, Classical Mechanics, section 1 (work of a constant force).
double sliding_distance(double speed, double friction, double gravity);  // m, v^2 / (2 mu g)
double sliding_time(double speed, double friction, double gravity);      // s, v / (mu g)

// A homogeneous sphere that starts to slide without turning: speed and time when it begins to roll.
// Source: Kleppner and Kolenkow, An Introduction to Mechanics, chapter 6 (bowling ball).
double rolling_speed(double speed);                                  // m/s, 5/7 v for any friction
double rolling_time(double speed, double friction, double gravity);  // s, 2 v / (7 mu g)

}  // namespace assay
