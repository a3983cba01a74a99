#include "measures/reference/closed_form.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>

#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <boost/math/special_functions/ellint_1.hpp>
#include <boost/math/special_functions/jacobi_elliptic.hpp>

namespace assay {
namespace math = boost::math;

TorqueFreeTop::TorqueFreeTop(const Vec3& moments, const Vec3& w_B) : moments_(moments) {
  // ascending moments; an odd permutation turns the frame left-handed, which reverses Euler's equations
  double parity = 1;
  auto order = [&](int a, int b) {
    if (moments[axis_[a]] <= moments[axis_[b]]) return;
    std::swap(axis_[a], axis_[b]);
    parity = -parity;
  };
  order(0, 1);
  order(1, 2);
  order(0, 1);

  const double energy2 = w_B.cwiseAbs2().dot(moments);  // twice the kinetic energy
  const double momentum2 = w_B.cwiseProduct(moments).squaredNorm();
  momentum_ = std::sqrt(momentum2);

  // the third role goes to the axis about which the momentum circulates, so that dn never changes its sign
  if (momentum2 < energy2 * moments[axis_[1]]) std::swap(axis_[0], axis_[2]);
  const double i1 = moments[axis_[0]], i2 = moments[axis_[1]], i3 = moments[axis_[2]];
  assert(i1 != i2 && i2 != i3);
  const double from3 = energy2 * i3 - momentum2, from1 = momentum2 - energy2 * i1;
  amplitude_[0] = std::sqrt(from3 / (i1 * (i3 - i1)));
  amplitude_[1] = std::sqrt(from3 / (i2 * (i3 - i2)));
  amplitude_[2] = std::copysign(std::sqrt(from1 / (i3 * (i3 - i1))), w_B[axis_[2]]);
  amplitude_[1] *= parity * std::copysign(1.0, amplitude_[2]);
  assert(amplitude_[0] > 0 && amplitude_[1] != 0 && amplitude_[2] != 0);
  rate_ = std::sqrt((i3 - i2) * from1 / (i1 * i2 * i3));
  modulus_ = std::sqrt(std::clamp((i2 - i1) * from3 / ((i3 - i2) * from1), 0.0, 1.0));
  const double amplitude_angle = std::atan2(w_B[axis_[1]] / amplitude_[1], w_B[axis_[0]] / amplitude_[0]);
  phase_ = math::ellint_1(modulus_, amplitude_angle);
}

Vec3 TorqueFreeTop::angular_velocity(double time) const {
  double cn = 0, dn = 0;
  const double sn = math::jacobi_elliptic(modulus_, phase_ + rate_ * time, &cn, &dn);
  Vec3 w;
  w[axis_[0]] = amplitude_[0] * cn;
  w[axis_[1]] = amplitude_[1] * sn;
  w[axis_[2]] = amplitude_[2] * dn;
  return w;
}

double TorqueFreeTop::period() const { return 4 * math::ellint_1(modulus_) / rate_; }

double TorqueFreeTop::precession_rate(double time) const {
  const Vec3 w = angular_velocity(time);
  const int a = axis_[0], b = axis_[1];
  const double energy = moments_[a] * w[a] * w[a] + moments_[b] * w[b] * w[b];
  const double momentum2 = std::pow(moments_[a] * w[a], 2) + std::pow(moments_[b] * w[b], 2);
  return momentum_ * energy / momentum2;
}

// Euler angles (z, x, z) about the angular momentum, the last axis being the one of the third role.
Mat3 TorqueFreeTop::euler_rotation(double time, double precession) const {
  const Vec3 direction = angular_velocity(time).cwiseProduct(moments_) / momentum_;
  // x, y, z: a right-handed renaming of the caller's axes that ends with the third role
  const int z = axis_[2], x = (z + 1) % 3, y = (z + 2) % 3;
  const double nutation = std::atan2(std::hypot(direction[x], direction[y]), direction[z]);
  const double spin = std::atan2(direction[x], direction[y]);
  const Mat3 rotation = (Eigen::AngleAxisd(precession, Vec3::UnitZ()) * Eigen::AngleAxisd(nutation, Vec3::UnitX()) *
                         Eigen::AngleAxisd(spin, Vec3::UnitZ()))
                            .toRotationMatrix();
  Mat3 columns;
  columns.col(x) = rotation.col(0);
  columns.col(y) = rotation.col(1);
  columns.col(z) = rotation.col(2);
  return columns;
}

Quat TorqueFreeTop::orientation(double time) const {
  // the integrand has half the period of the velocities: whole panels, each a quarter of it, keep the rule exact
  double precession = 0;
  const double panel = period() / 8;
  const int panels = std::max(1, static_cast<int>(std::ceil(std::abs(time) / panel)));
  for (int i = 0; i < panels; ++i) {
    precession += math::quadrature::gauss_kronrod<double, 31>::integrate(
        [this](double t) { return precession_rate(t); }, time * i / panels, time * (i + 1) / panels, 10, 1e-14);
  }
  return Quat(Mat3(euler_rotation(0, 0).transpose() * euler_rotation(time, precession))).normalized();
}

double Pendulum::period() const { return 4 * math::ellint_1(std::sin(amplitude_ / 2)) / frequency_; }

double Pendulum::angle(double time) const {
  const double k = std::sin(amplitude_ / 2);
  const double u = math::ellint_1(k) + frequency_ * time;
  return 2 * std::asin(k * math::jacobi_sn(k, u));
}

double Pendulum::rate(double time) const {
  const double k = std::sin(amplitude_ / 2);
  return 2 * k * frequency_ * math::jacobi_cn(k, math::ellint_1(k) + frequency_ * time);
}

Motion damped_oscillator(double mass, double stiffness, double damping, Motion start, double time) {
  const double decay = damping / (2 * mass), natural2 = stiffness / mass;
  const double gap = natural2 - decay * decay;
  const double x0 = start.position, v0 = start.velocity, slope = v0 + decay * x0;
  const double envelope = std::exp(-decay * time);
  if (gap > 0) {
    const double w = std::sqrt(gap), c = std::cos(w * time), s = std::sin(w * time);
    return {envelope * (x0 * c + slope / w * s), envelope * (v0 * c - (decay * v0 + natural2 * x0) / w * s)};
  }
  if (gap < 0) {
    const double w = std::sqrt(-gap), c = std::cosh(w * time), s = std::sinh(w * time);
    return {envelope * (x0 * c + slope / w * s), envelope * (v0 * c - (decay * v0 + natural2 * x0) / w * s)};
  }
  return {envelope * (x0 + slope * time), envelope * (v0 - decay * slope * time)};
}

Motion uniform_acceleration(Motion start, double acceleration, double time) {
  return {start.position + start.velocity * time + acceleration * time * time / 2,
          start.velocity + acceleration * time};
}

double sliding_distance(double speed, double friction, double gravity) {
  return speed * speed / (2 * friction * gravity);
}

double sliding_time(double speed, double friction, double gravity) { return speed / (friction * gravity); }

double rolling_speed(double speed) { return speed * 5 / 7; }

double rolling_time(double speed, double friction, double gravity) { return 2 * speed / (7 * friction * gravity); }

}  // namespace assay
