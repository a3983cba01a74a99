#include "measures/first_state.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include <Eigen/Dense>

#include "model/kinematics.h"

namespace assay {
namespace {

constexpr double kFreeTurnStep = 2e-3;  // s

Quat turned(const Vec3& rotation) {
  const double angle = rotation.norm();
  if (angle < 1e-12) return Quat(1, 0.5 * rotation.x(), 0.5 * rotation.y(), 0.5 * rotation.z()).normalized();
  return Quat(Eigen::AngleAxisd(angle, rotation / angle));
}

// The line of least squares through each component: the value at 0, the slope, and the residuals' standard deviation.
struct Line {
  Vec3 value = Vec3::Zero(), slope = Vec3::Zero();
  double sd = 0;  // of a sample
  double value_sd = 0, slope_sd = 0;
};

Line line_through(const std::vector<double>& times, const std::vector<Vec3>& points) {
  Line line;
  const auto n = static_cast<double>(times.size());
  double mean_t = 0, spread = 0;
  Vec3 mean = Vec3::Zero(), moment = Vec3::Zero();
  for (size_t i = 0; i < times.size(); ++i) {
    mean_t += times[i] / n;
    mean += points[i] / n;
  }
  for (size_t i = 0; i < times.size(); ++i) {
    spread += (times[i] - mean_t) * (times[i] - mean_t);
    moment += (times[i] - mean_t) * (points[i] - mean);
  }
  if (spread > 0) line.slope = moment / spread;
  line.value = mean - mean_t * line.slope;
  double squares = 0;
  for (size_t i = 0; i < times.size(); ++i) squares += (points[i] - line.value - times[i] * line.slope).squaredNorm();
  if (times.size() > 2) line.sd = std::sqrt(squares / (3 * (n - 2)));
  if (spread > 0) {
    line.slope_sd = line.sd / std::sqrt(spread);
    line.value_sd = line.sd * std::sqrt((1 / n) + (mean_t * mean_t / spread));
  }
  return line;
}

}  // namespace

FirstCoordinate first_coordinate(std::span<const double> times, std::span<const double> positions) {
  assert(times.size() == positions.size() && times.size() >= 2);
  const auto n = static_cast<Eigen::Index>(times.size());
  const Eigen::Index terms = n >= 6 ? 4 : std::min<Eigen::Index>(n - 1, 3);
  const double scale = std::max(std::abs(times.front()), std::abs(times.back()));
  Eigen::MatrixXd powers(n, terms);
  Eigen::VectorXd values(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    double power = 1;
    for (Eigen::Index k = 0; k < terms; ++k, power *= times[static_cast<size_t>(i)] / scale) powers(i, k) = power;
    values(i) = positions[static_cast<size_t>(i)];
  }
  const Eigen::MatrixXd normal = powers.transpose() * powers;
  const Eigen::VectorXd found = normal.ldlt().solve(powers.transpose() * values);
  FirstCoordinate first{.position = found(0), .velocity = found(1) / scale};
  if (n <= terms) return first;
  const double variance = (values - powers * found).squaredNorm() / static_cast<double>(n - terms);
  const Eigen::MatrixXd covariance = variance * normal.inverse();
  first.sample_sd = std::sqrt(variance);
  first.position_sd = std::sqrt(std::max(0.0, covariance(0, 0)));
  first.velocity_sd = std::sqrt(std::max(0.0, covariance(1, 1))) / scale;
  return first;
}

void turn_freely(const Mat3& I_BBcm_B, double duration, Quat& q_WB, Vec3& w_WB) {
  const auto steps = std::max(1, static_cast<int>(std::ceil(std::abs(duration) / kFreeTurnStep)));
  const double h = duration / steps;
  // in the body's axes: I w' = -w x I w
  const Eigen::LDLT<Mat3> inertia(I_BBcm_B);
  const auto rate = [&](const Vec3& w) -> Vec3 { return inertia.solve(-w.cross(I_BBcm_B * w)); };
  Vec3 w = q_WB.conjugate() * w_WB;
  for (int i = 0; i < steps; ++i) {
    const Vec3 k1 = rate(w), k2 = rate(w + 0.5 * h * k1), k3 = rate(w + 0.5 * h * k2), k4 = rate(w + h * k3);
    const Vec3 after = w + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    const Vec3 middle = 0.5 * (w + after) + h / 8 * (k1 - rate(after));
    // Simpson's mean of the rates, with Magnus' second term for that they do not commute
    const Vec3 turn = h / 6 * (w + 4 * middle + after) - h * h / 12 * after.cross(w);
    q_WB = (q_WB * turned(turn)).normalized();
    w = after;
  }
  w_WB = q_WB * w;
}

FirstFlight first_flight(const FlightSamples& samples, const Body& body, const Vec3& gravity) {
  assert(!samples.times.empty() && samples.times.size() == samples.p_WB.size());
  FirstFlight first;
  const size_t n = samples.times.size();
  // the centre of mass, without what gravity gives it
  std::vector<Vec3> points(n);
  for (size_t i = 0; i < n; ++i) {
    const double t = samples.times[i];
    points[i] = samples.p_WB[i] + samples.q_WB[i] * body.p_BBcm - 0.5 * t * t * gravity;
  }
  const Line centre = line_through(samples.times, points);
  first.state.p_WBcm = centre.value;
  first.state.v_WBcm = centre.slope;
  first.position_sd = centre.sd, first.p_sd = centre.value_sd, first.v_sd = centre.slope_sd;
  // the rotation: each sample, turned back by what free rotation turns until then, is at the start
  first.state.q_WB = samples.q_WB.front();
  if (n < 2) return first;
  first.state.w_WB = (samples.q_WB.front() * rotation_vector(samples.q_WB.front().conjugate() * samples.q_WB[1])) /
                     (samples.times[1] - samples.times.front());
  // Gauss and Newton: rotations of the start turn the whole motion, angular velocities change it
  const auto errors = [&](const Quat& start, const Vec3& rate) {
    Eigen::VectorXd found(3 * static_cast<Eigen::Index>(n));
    Quat q = start;
    Vec3 w = rate;
    double at = 0;
    for (size_t i = 0; i < n; ++i) {
      turn_freely(body.I_BBcm_B, samples.times[i] - at, q, w);
      at = samples.times[i];
      Quat off = samples.q_WB[i] * q.conjugate();
      if (off.w() < 0) off.coeffs() *= -1;
      found.segment<3>(3 * static_cast<Eigen::Index>(i)) = rotation_vector(off);
    }
    return found;
  };
  const auto moved = [&](const Eigen::Matrix<double, 6, 1>& by) {
    const Quat turn = turned(by.head<3>());
    return errors((turn * first.state.q_WB).normalized(), turn * first.state.w_WB + by.tail<3>());
  };
  constexpr int kIterations = 6;
  constexpr double kDifference = 1e-4, kSmallest = 1e-12;
  Eigen::MatrixXd slopes(3 * static_cast<Eigen::Index>(n), 6);
  Eigen::VectorXd left;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    if (iteration < 2) {  // from there on it hardly changes
      for (int k = 0; k < 6; ++k) {
        const Eigen::Matrix<double, 6, 1> by = kDifference * Eigen::Matrix<double, 6, 1>::Unit(k);
        slopes.col(k) = (moved(by) - moved(-by)) / (2 * kDifference);
      }
    }
    left = errors(first.state.q_WB, first.state.w_WB);
    const Eigen::Matrix<double, 6, 1> step = (slopes.transpose() * slopes).ldlt().solve(-slopes.transpose() * left);
    if (!step.allFinite()) break;
    const Quat turn = turned(step.head<3>());
    first.state.q_WB = (turn * first.state.q_WB).normalized();
    first.state.w_WB = turn * first.state.w_WB + step.tail<3>();
    if (step.norm() < kSmallest) break;
  }
  if (n < 3) return first;
  first.rotation_sd = left.norm() / std::sqrt(static_cast<double>((3 * n) - 6));
  const Eigen::MatrixXd covariance = (slopes.transpose() * slopes).inverse();
  first.q_sd = first.rotation_sd * std::sqrt(covariance.topLeftCorner<3, 3>().trace() / 3);
  first.w_sd = first.rotation_sd * std::sqrt(covariance.bottomRightCorner<3, 3>().trace() / 3);
  return first;
}

size_t flight_length(const FlightSamples& samples, const Body& body, size_t least, double factor) {
  const size_t n = samples.times.size();
  if (n <= least) return n;
  // Where the parabola and the free rotation of the samples before are at sample `i`, in noises of that prediction. The
  // parabola is a free one: the scale of a measurement, or air, may make gravity another one.
  FlightSamples part;
  const auto off = [&](size_t i) {
    const auto count = static_cast<Eigen::Index>(i);
    Eigen::MatrixXd powers(count, 3), points(count, 3);
    for (Eigen::Index k = 0; k < count; ++k) {
      const auto at = static_cast<size_t>(k);
      powers.row(k) << 1, samples.times[at], samples.times[at] * samples.times[at];
      points.row(k) = (samples.p_WB[at] + samples.q_WB[at] * body.p_BBcm).transpose();
    }
    const Eigen::MatrixXd normal = (powers.transpose() * powers).inverse();
    const Eigen::MatrixXd found = normal * powers.transpose() * points;
    const double sd = std::sqrt((points - powers * found).squaredNorm() / (3.0 * static_cast<double>(i - 3)));
    const double t = samples.times[i];
    const Eigen::RowVector3d power(1, t, t * t);
    const double ahead = std::sqrt(1 + (power * normal * power.transpose()).value());
    const Vec3 seen = samples.p_WB[i] + samples.q_WB[i] * body.p_BBcm;
    const double moved = (seen - (power * found).transpose()).norm() / (ahead * std::max(sd, 1e-9));
    for (size_t k = part.times.size(); k < i; ++k) {
      part.times.push_back(samples.times[k]);
      part.p_WB.push_back(samples.p_WB[k]);
      part.q_WB.push_back(samples.q_WB[k]);
    }
    const FirstFlight flight = first_flight(part, body, Vec3::Zero());
    Quat q = flight.state.q_WB;
    Vec3 w = flight.state.w_WB;
    turn_freely(body.I_BBcm_B, t, q, w);
    return std::max(moved, q.angularDistance(samples.q_WB[i]) / (ahead * std::max(flight.rotation_sd, 1e-9)));
  };
  size_t length = std::max<size_t>(least, 5);
  // one sample may be a glitch of the measurement
  while (length + 1 < n && (off(length) < factor || off(length + 1) < factor)) ++length;
  return length + 1 < n ? length : n;
}

}  // namespace assay
