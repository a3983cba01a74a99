#include "match/log_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <optional>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "base/errors.h"
#include "base/quantity.h"
#include "base/text.h"
#include "check/parity/inverse_dynamics.h"
#include "match/windows.h"
#include "measures/violation.h"
#include "model/kinematics.h"

namespace assay::match {
namespace {

// ---- series of one quantity -------------------------------------------------------------------------------------------

double median_of(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

// Standard deviation of the noise about a course that is smooth over four samples: by third differences, of which a
// median is no glitch's.
double noise_of(const std::vector<double>& x) {
  constexpr double kToDeviation = 1.4826, kThird = 4.47213595499958;  // sqrt(1 + 9 + 9 + 1)
  std::vector<double> sizes;
  for (size_t i = 3; i < x.size(); ++i) sizes.push_back(std::abs(x[i] - 3 * x[i - 1] + 3 * x[i - 2] - x[i - 3]));
  return kToDeviation * median_of(std::move(sizes)) / kThird;
}

double step_of(const std::vector<double>& x) {
  constexpr double kRounding = 2e-6;  // of files with six decimals
  double least = 0;
  for (size_t i = 1; i < x.size(); ++i) {
    const double step = std::abs(x[i] - x[i - 1]);
    if (step > kRounding && (least == 0 || step < least)) least = step;
  }
  return least;
}

struct Range2 {
  double lower = 0, upper = 0;
  double width() const { return upper - lower; }
};
Range2 range_of(const std::vector<double>& x) {
  const auto [lower, upper] = std::ranges::minmax(x);
  return {lower, upper};
}

// Samples that are far from all around them.
std::vector<size_t> glitches_of(const std::vector<double>& x) {
  constexpr int kMedian = 9;
  constexpr double kNoises = 12, kOfWidth = 0.1;
  const std::vector<double> smooth = running_median(x, kMedian);
  std::vector<double> sizes;
  for (size_t i = 0; i < x.size(); ++i) sizes.push_back(std::abs(x[i] - smooth[i]));
  const double limit = std::max(kNoises * median_of(sizes), kOfWidth * range_of(smooth).width());
  std::vector<size_t> found;
  for (size_t i = 0; i < x.size(); ++i) {
    if (sizes[i] > limit && limit > 0) found.push_back(i);
  }
  return found;
}

// Of positions the samples, at most three in a row, that are away by more than `least` and far more than the steps
// before and behind. An impact turns a motion around too, but with steps like those around it.
std::vector<size_t> lone_samples_of(const std::vector<double>& x, double least) {
  constexpr size_t kMostInARow = 3;
  constexpr double kSteps = 5, kNoises = 12, kOfWidth = 0.05, kBack = 0.5;
  const double limit = std::max({least, kNoises * noise_of(x), kOfWidth * range_of(x).width()});
  const auto step = [&](size_t i) { return i >= 1 && i < x.size() ? std::abs(x[i] - x[i - 1]) : 0; };
  std::vector<size_t> found;
  for (size_t i = 1; i < x.size(); ++i) {
    if (step(i) <= limit) continue;
    for (size_t j = i + 1; j < x.size() && j <= i + kMostInARow; ++j) {
      const double away = std::min(step(i), step(j));
      if (away <= limit || std::abs(x[j] - x[i - 1]) > kBack * away) continue;
      const double around = std::max({step(i - 1), i >= 2 ? step(i - 2) : 0, step(j + 1), step(j + 2)});
      if (away <= kSteps * around) continue;
      for (size_t k = i; k < j; ++k) found.push_back(k);
      i = j;
      break;
    }
  }
  return found;
}

// Value and first two derivatives at each sample of the parabola that fits the samples within `half` seconds best.
struct Smooth {
  std::vector<double> value, rate, acceleration;
};
Smooth smoothed(const std::vector<double>& time, const std::vector<double>& x, double half) {
  const size_t n = time.size();
  Smooth out{std::vector<double>(n), std::vector<double>(n), std::vector<double>(n)};
  size_t from = 0, behind = 0;
  for (size_t i = 0; i < n; ++i) {
    while (time[i] - time[from] > half) ++from;
    while (behind < n && time[behind] - time[i] <= half) ++behind;
    // at least seven samples, where there are as many
    const size_t first = std::min(from, i >= 3 ? i - 3 : 0), last = std::max(behind, std::min(n, i + 4));
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    constexpr size_t kEnough = 200;  // a fast log has thousands within `half`
    for (size_t k = first; k < last; k += 1 + (last - first) / kEnough) {
      const double s = (time[k] - time[i]) / half;
      const Eigen::Vector4d row(1, s, s * s, s * s * s);
      normal += row * row.transpose();
      right += row * x[k];
    }
    const Eigen::Vector4d c = normal.ldlt().solve(right);
    out.value[i] = c[0];
    out.rate[i] = c[1] / half;
    out.acceleration[i] = 2 * c[2] / (half * half);
  }
  return out;
}

double rms(const std::vector<double>& x) {
  double sum = 0;
  for (const double value : x) sum += value * value;
  return x.empty() ? 0 : std::sqrt(sum / static_cast<double>(x.size()));
}

// Slope of y over x through the origin, and how much of y it explains.
struct Slope {
  double slope = 0, explained = 0;
};
Slope slope_of(const std::vector<double>& x, const std::vector<double>& y) {
  double xx = 0, xy = 0, yy = 0;
  for (size_t i = 0; i < x.size(); ++i) {
    xx += x[i] * x[i];
    xy += x[i] * y[i];
    yy += y[i] * y[i];
  }
  if (xx == 0 || yy == 0) return {};
  return {xy / xx, xy * xy / (xx * yy)};
}

// ---- balance of torques -----------------------------------------------------------------------------------------------

// Averages over spans of time, in which noise of accelerations is small, of what Newton and Euler's equations of one
// joint have: the torque that inertia takes, that of gravity and springs, the measured one, and what friction turns.
struct Balance {
  std::vector<double> time;  // middle of each span
  std::vector<double> inertial, still, torque, direction, rate;
};

void negate(std::vector<double>& values) {
  for (double& value : values) value = -value;
}

// `factor` times the angles: for the question whether they are degrees.
class Balancer {
 public:
  // Torques that nobody measured are those of the drives of `config`, where it has some.
  Balancer(Model model, const MatchConfig& config) : model_(std::move(model)), layout_(model_), config_(config) {
    for (Joint& joint : model_.joints) joint.damping = joint.dry_friction = 0;
    model_.tendons.clear();
    weightless_ = model_;
    weightless_.gravity = Vec3::Zero();
    for (Joint& joint : weightless_.joints) joint.stiffness = 0;
  }

  // Whether every joint is in the log, and nothing else moves.
  bool fits(const MeasuredLog& log) const {
    return log.joints.size() == model_.joints.size() && !log.joints.empty() && model_.balls.empty() &&
           std::ranges::none_of(model_.bodies, &Body::is_free) && model_.couplings.empty() && model_.connects.empty() &&
           model_.welds.empty();
  }

  std::vector<Balance> balances(const MeasuredLog& log, double factor) const {
    constexpr double kSpan = 0.3, kHalf = 0.02, kSlow = 0.05;
    const size_t joints = log.joints.size(), n = log.samples();
    const double dt = (log.time.back() - log.time.front()) / static_cast<double>(n - 1);
    std::vector<Smooth> motion;
    std::vector<std::vector<double>> torque;
    for (const MeasuredJoint& joint : log.joints) {
      std::vector<double> q = joint.position;
      for (double& value : q) value *= factor;
      motion.push_back(smoothed(log.time, q, std::max(kHalf, 4 * dt)));
      constexpr int kMedian = 9;
      torque.push_back(joint.torque.empty() ? std::vector<double>(n, 0.0) : running_median(joint.torque, kMedian));
      if (!joint.torque.empty() || joint.target.empty() || config_.law != DriveLaw::kPd) continue;
      const std::string& name = model_.joints[joint.joint].name;
      const double stiffness = gain_of(config_.stiffness, name), damping = gain_of(config_.damping, name);
      for (size_t i = 0; i < n; ++i) {
        torque.back()[i] =
            stiffness * (factor * joint.target[i] - motion.back().value[i]) - damping * motion.back().rate[i];
      }
    }
    std::vector<std::vector<double>> inertial(joints), still(joints);
    State state = model_.initial;
    for (size_t i = 0; i < n; ++i) {
      Eigen::VectorXd acceleration = Eigen::VectorXd::Zero(layout_.count), rest = acceleration;
      for (size_t j = 0; j < joints; ++j) {
        state.position[j] = motion[j].value[i];
        state.velocity[j] = motion[j].rate[i];
        acceleration[layout_.of_joint[j]] = motion[j].acceleration[i];
      }
      bodies_from_joints(model_, state);
      const Eigen::VectorXd moving = parity::inverse_dynamics(weightless_, layout_, state, acceleration);
      std::ranges::fill(state.velocity, 0.0);
      bodies_from_joints(model_, state);
      const Eigen::VectorXd held = parity::inverse_dynamics(model_, layout_, state, rest);
      for (size_t j = 0; j < joints; ++j) {
        inertial[j].push_back(moving[layout_.of_joint[j]]);
        still[j].push_back(held[layout_.of_joint[j]]);
      }
    }
    std::vector<Balance> balances(joints);
    const auto width = static_cast<size_t>(std::max(3.0, std::round(kSpan / dt)));
    for (size_t from = width / 2; from + width + width / 2 < n; from += width / 2) {
      const bool gap = log.time[from + width] - log.time[from] > 1.5 * kSpan + 4 * dt;
      if (gap) continue;
      for (size_t j = 0; j < joints; ++j) {
        double weights = 0;
        std::array<double, 5> sums{};
        for (size_t k = 0; k < width; ++k) {
          const double w = std::pow(std::sin(M_PI * static_cast<double>(k + 1) / static_cast<double>(width + 1)), 2);
          const size_t i = from + k;
          const double v = motion[j].rate[i];
          const std::array<double, 5> row = {inertial[j][i], still[j][i], torque[j][i], std::tanh(v / kSlow), v};
          for (size_t c = 0; c < row.size(); ++c) sums[c] += w * row[c];
          weights += w;
        }
        Balance& balance = balances[j];
        balance.time.push_back(log.time[from + width / 2]);
        balance.inertial.push_back(sums[0] / weights);
        balance.still.push_back(sums[1] / weights);
        balance.torque.push_back(sums[2] / weights);
        balance.direction.push_back(sums[3] / weights);
        balance.rate.push_back(sums[4] / weights);
      }
    }
    return balances;
  }

 private:
  Model model_, weightless_;
  parity::SpeedLayout layout_;
  const MatchConfig& config_;
};

// inertial = -weight still + gain torque - friction direction - damping rate + offset, by least squares.
struct Explained {
  size_t spans = 0;
  double weight = 0, gain = 0, gain_error = 0, weight_error = 0, friction = 0, damping = 0, offset = 0;
  double share = 0;                    // of the square of `inertial`
  std::vector<double> left_over = {};  // per span
};
Explained explained(const Balance& balance, bool torque) {
  const auto n = static_cast<Eigen::Index>(balance.time.size());
  Explained out{.spans = balance.time.size()};
  constexpr Eigen::Index kLeast = 12;
  if (n < kLeast) return out;
  const auto column = [&](const std::vector<double>& values) { return Eigen::VectorXd::Map(values.data(), n); };
  Eigen::MatrixXd rows(n, torque ? 5 : 4);
  rows.col(0) = -column(balance.still);
  rows.col(1) = -column(balance.direction);
  rows.col(2) = -column(balance.rate);
  rows.col(3).setOnes();
  if (torque) rows.col(4) = column(balance.torque);
  const Eigen::VectorXd y = column(balance.inertial);
  // scaled, so that what is nearly zero is told by the rank
  const Eigen::VectorXd sizes = rows.colwise().norm().cwiseMax(1e-12);
  const Eigen::MatrixXd scaled = rows * sizes.cwiseInverse().asDiagonal();
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(scaled);
  solver.setThreshold(1e-6);
  const Eigen::VectorXd c = sizes.cwiseInverse().asDiagonal() * solver.solve(y);
  const Eigen::VectorXd left = y - rows * c;
  const Eigen::MatrixXd inverse = solver.pseudoInverse();
  // neighbours share half of their samples, so a half of the spans counts
  const double variance = 2 * left.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(n - rows.cols(), 1));
  const auto error = [&](Eigen::Index k) { return std::sqrt(variance) * inverse.row(k).norm() / sizes[k]; };
  out.weight = c[0];
  out.weight_error = error(0);
  out.friction = c[1];
  out.damping = c[2];
  out.offset = c[3];
  if (torque) {
    out.gain = c[4];
    out.gain_error = error(4);
  }
  out.share = y.squaredNorm() > 0 ? 1 - left.squaredNorm() / y.squaredNorm() : 0;
  out.left_over.assign(left.begin(), left.end());
  return out;
}

// How far the model as it is stays from the balances, but for friction and offsets that fit best: root mean square over
// joints, in units of what inertia and weight take. Nothing where there are too few spans.
std::optional<double> misfit_of(const std::vector<Balance>& balances) {
  constexpr size_t kLeast = 12;
  double sum = 0;
  for (const Balance& balance : balances) {
    const size_t spans = balance.time.size();
    if (spans < kLeast) return std::nullopt;
    const auto n = static_cast<Eigen::Index>(spans);
    const auto column = [&](const std::vector<double>& values) { return Eigen::VectorXd::Map(values.data(), n); };
    const Eigen::VectorXd y = column(balance.inertial) + column(balance.still) - column(balance.torque);
    Eigen::MatrixXd rows(n, 3);
    rows.col(0) = -column(balance.direction);
    rows.col(1) = -column(balance.rate);
    rows.col(2).setOnes();
    Eigen::VectorXd left = y;
    for (int round = 0; round < 3; ++round) {
      const Eigen::VectorXd c = rows.completeOrthogonalDecomposition().solve(y);
      left = y - rows * c;
      // friction takes energy only
      if (c[0] >= 0 && c[1] >= 0) break;
      for (const int k : {0, 1}) {
        if (c[k] < 0) rows.col(k).setZero();
      }
    }
    const double size = column(balance.inertial).squaredNorm() + column(balance.still).squaredNorm();
    if (size == 0) return std::nullopt;
    sum += left.squaredNorm() / size / static_cast<double>(balances.size());
  }
  return std::sqrt(sum);
}

// ---- the check --------------------------------------------------------------------------------------------------------

// Acceleration and rates of a free body.
struct Flight {
  std::vector<Vec3> velocity, acceleration, angular;  // of the centre of mass; world axes
};

class Checker {
 public:
  Checker(const Model& model, const MatchConfig& config, const std::vector<MeasuredLog>& logs)
      : model_(model), config_(config), logs_(logs), balancer_(model, config) {}

  LogCheck check() {
    for (number_ = 0; number_ < logs_.size(); ++number_) {
      const MeasuredLog& log = logs_[number_];
      facts(log);
      if (log.samples() < kLeastSamples) {
        find({.severity = FindingSeverity::kWarning,
              .kind = "short",
              .text = fmt::format("it has {}", counted(log.samples(), "sample")),
              .fix = fmt::format("give logs of at least {} samples", kLeastSamples)});
        continue;
      }
      if (time_unit()) continue;  // nothing else follows from a wrong time
      gaps(log);
      for (const MeasuredJoint& joint : log.joints) {
        turns(log, joint);
        lone_samples(log, joint_name(joint), joint.position, least_move(joint));
        held(log, joint_name(joint), joint.position);
        rates(log, joint);
        torque(log, joint);
      }
      rests(log);
      dynamics(log);
      for (const MeasuredBody& body : log.bodies) {
        poses(log, body);
        turning(log, body);
      }
    }
    excitation();
    flights();
    places();
    missing();
    copies();
    whole();
    std::ranges::stable_sort(out_.findings, {}, &LogFinding::severity);
    return std::move(out_);
  }

 private:
  static constexpr size_t kLeastSamples = 20;

  const std::string& joint_name(const MeasuredJoint& joint) const { return model_.joints[joint.joint].name; }

  // Of the log at hand.
  void find(LogFinding finding) {
    if (number_ < logs_.size()) {
      finding.log = logs_[number_].name;
      finding.source = logs_[number_].source;
    }
    out_.findings.push_back(std::move(finding));
  }
  size_t line_at(const MeasuredLog& log, double time) const {
    const auto at = std::ranges::lower_bound(log.time, time) - log.time.begin();
    return log.line[std::min(static_cast<size_t>(at), log.line.size() - 1)];
  }
  void spoil(const TimeSpan& span, const std::string& reason) { out_.spoiled.push_back({number_, span, reason}); }

  // -- numbers
  // -----------------------------------------------------------------------------------------------------------

  void channel(LogFacts& facts, const std::string& quantity, const std::vector<double>& x) const {
    if (x.empty()) return;
    const Range2 range = range_of(x);
    facts.channels.push_back({.quantity = quantity,
                              .lower = range.lower,
                              .upper = range.upper,
                              .noise = noise_of(x),
                              .step = step_of(x),
                              .glitches = static_cast<double>(glitches_of(x).size()) / static_cast<double>(x.size())});
  }

  void facts(const MeasuredLog& log) {
    LogFacts& facts = out_.logs.emplace_back();
    facts.name = log.name;
    facts.source = log.source;
    facts.samples = log.samples();
    if (log.samples() < 2) return;
    std::vector<double> steps;
    for (size_t i = 1; i < log.samples(); ++i) steps.push_back(log.time[i] - log.time[i - 1]);
    facts.duration = log.time.back() - log.time.front();
    const double step = median_of(steps);
    facts.rate = 1 / step;
    for (double& value : steps) value -= step;
    facts.jitter = rms(steps) / step;
    for (const MeasuredJoint& joint : log.joints) {
      channel(facts, joint_name(joint), joint.position);
      channel(facts, joint_name(joint) + ".velocity", joint.velocity);
      channel(facts, joint_name(joint) + ".torque", joint.torque);
      channel(facts, joint_name(joint) + ".target", joint.target);
    }
    for (const MeasuredBody& body : log.bodies) {
      for (int k = 0; k < 3; ++k) {
        std::vector<double> x;
        for (const Vec3& p : body.p_WB) x.push_back(p[k]);
        channel(facts, model_.bodies[body.body].name + "." + "xyz"[k], x);
      }
    }
  }

  // Whether the times can only be of another unit. No motion shows at two samples a second.
  bool time_unit() {
    constexpr double kSlowest = 0.5, kFastest = 1e-5, kLeast = 1e-4, kMost = 0.2;  // s between samples
    const double step = 1 / out_.logs.back().rate;
    if (step > kFastest && step < kSlowest) return false;
    constexpr std::array<std::pair<const char*, double>, 4> kUnits = {
        {{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}}};
    std::string fix = "correct the unit of the time in [units]";
    for (const auto& [name, factor] : kUnits) {
      const double as_unit = step / config_.time_scale * factor;
      if (as_unit < kLeast || as_unit > kMost) continue;
      fix = fmt::format("give time = \"{}\" in [units] if its times are in {}", name, name);
      break;
    }
    find({.severity = FindingSeverity::kWrong,
          .kind = "time unit",
          .column = "time",
          .text = fmt::format("it has a sample each {} over {}", quantity_text(step, "s"),
                              quantity_text(out_.logs.back().duration, "s")),
          .fix = std::move(fix)});
    return true;
  }

  void gaps(const MeasuredLog& log) {
    constexpr double kSteps = 5, kLeast = 0.01;
    const double step = 1 / out_.logs.back().rate;
    size_t count = 0;
    for (size_t i = 1; i < log.samples(); ++i) {
      const double width = log.time[i] - log.time[i - 1];
      if (width <= std::max(kSteps * step, kLeast)) continue;
      const TimeSpan span{log.time[i - 1], log.time[i]};
      spoil(span, "gap");
      if (++count > kMostOfAKind) continue;
      find({.severity = FindingSeverity::kWarning,
            .kind = "gap",
            .line = log.line[i],
            .column = "time",
            .span = span,
            .text = fmt::format("{:.3g} s without a sample, in a log of one each {:.3g} ms", width, 1e3 * step),
            .fix = "windows that touch it are left out; log without loss if it happens often"});
    }
    constexpr double kJitter = 0.25;
    if (count == 0 && out_.logs.back().jitter > kJitter) {
      find({.severity = FindingSeverity::kRemark,
            .kind = "jitter",
            .column = "time",
            .text = fmt::format("the time between samples scatters by {:.0f} %", 100 * out_.logs.back().jitter),
            .fix = "log the time of the measurement, and not that of its arrival"});
    }
  }

  // -- one joint
  // ---------------------------------------------------------------------------------------------------------

  // A sensor of one turn.
  void turns(const MeasuredLog& log, const MeasuredJoint& joint) {
    if (!joint.turns.empty()) {
      find({.severity = FindingSeverity::kRemark,
            .kind = "turns",
            .line = log.line[std::min(joint.turns.front(), log.line.size() - 1)],
            .column = joint_name(joint),
            .text = fmt::format("it jumps by a whole turn {}: it is read as going on",
                                counted(joint.turns.size(), "time"))});
    }
    if (model_.joints[joint.joint].is_slide()) return;
    constexpr double kTurn = 360;
    const std::vector<size_t> jumps = jumps_of_turn(joint.position, kTurn);
    if (jumps.empty()) return;
    find({.severity = FindingSeverity::kWrong,
          .kind = "degrees",
          .line = log.line[jumps.front()],
          .column = joint_name(joint),
          .text = fmt::format("it jumps by 360, a whole turn in degrees, {}", counted(jumps.size(), "time")),
          .fix = "give angle = \"deg\" in [units]"});
  }

  // What a joint moves at least, beyond noise.
  double least_move(const MeasuredJoint& joint) const {
    return model_.joints[joint.joint].is_slide() ? 5e-4 : 0.5 * kDegree;
  }
  bool moves(const MeasuredJoint& joint) const {
    return range_of(joint.position).width() > std::max(least_move(joint), 4 * noise_of(joint.position));
  }

  // Positions that stand alone.
  void lone_samples(const MeasuredLog& log, const std::string& quantity, const std::vector<double>& x, double least) {
    constexpr double kMostShare = 0.05;
    const std::vector<size_t> found = lone_samples_of(x, least);
    if (found.empty() || static_cast<double>(found.size()) > kMostShare * static_cast<double>(x.size())) return;
    lone(log, quantity, found);
  }
  void lone(const MeasuredLog& log, const std::string& quantity, const std::vector<size_t>& found) {
    for (const size_t i : found) {
      spoil({log.time[i > 0 ? i - 1 : i], log.time[std::min(i + 1, log.samples() - 1)]}, "glitches");
    }
    find({.severity = FindingSeverity::kWarning,
          .kind = "glitches",
          .line = log.line[found.front()],
          .column = quantity,
          .span = {log.time[found.front()], log.time[found.back()]},
          .text = fmt::format("{} of {} are far from all around them, the first at {:.4g} s", found.size(),
                              counted(log.samples(), "sample"), log.time[found.front()]),
          .fix = "windows that touch them are left out; remove or correct these lines"});
  }

  // Values that stay the same to the last digit, and then jump: a slower sensor's, or of one that lost its target.
  void held(const MeasuredLog& log, const std::string& quantity, const std::vector<double>& x) {
    constexpr size_t kLeastRun = 3;
    constexpr double kSteps = 8, kOfWidth = 0.01, kPervasive = 0.3;
    const double jump = std::max(kSteps * step_of(x), kOfWidth * range_of(x).width());
    if (jump == 0) return;
    std::vector<TimeSpan> spans;
    size_t count = 0, line = 0;
    for (size_t from = 0; from + 1 < x.size();) {
      size_t last = from;
      while (last + 1 < x.size() && x[last + 1] == x[from]) ++last;
      if (last - from + 1 >= kLeastRun && last + 1 < x.size() && std::abs(x[last + 1] - x[last]) > jump) {
        if (spans.empty()) line = log.line[from];
        spans.push_back({log.time[from], log.time[last + 1]});
        count += last - from + 1;
      }
      from = last + 1;
    }
    if (spans.empty()) return;
    const bool pervasive = static_cast<double>(count) > kPervasive * static_cast<double>(x.size());
    if (!pervasive) {
      for (const TimeSpan& span : spans) spoil(span, "held");
    }
    find({.severity = FindingSeverity::kWarning,
          .kind = "held",
          .line = line,
          .column = quantity,
          .span = {spans.front().from, spans.back().to},
          .text = fmt::format("{} of {} repeat the one before, and jump then, first from {:.4g} to {:.4g} s", count,
                              counted(x.size(), "sample"), spans.front().from, spans.front().to),
          .fix = pervasive ? "log each value when it is measured, or keep only the lines with a new one"
                           : "windows that touch them are left out"});
  }

  // Position and velocity say the same motion.
  void rates(const MeasuredLog& log, const MeasuredJoint& joint) {
    if (joint.velocity.empty()) return;
    const std::string name = joint_name(joint) + ".velocity";
    const double dt = 1 / out_.logs.back().rate;
    const Smooth smooth = smoothed(log.time, joint.position, std::max(0.02, 4 * dt));
    const std::vector<double> logged = running_median(joint.velocity, 5);
    const Slope slope = slope_of(logged, smooth.rate);
    constexpr double kExplained = 0.5, kNear = 0.25, kFar = 0.2;
    if (slope.explained < kExplained) {
      if (rms(smooth.rate) > 10 * noise_of(joint.position) / dt || rms(logged) == 0) return;
      return;
    }
    const auto near = [&](double factor) { return std::abs(slope.slope / factor - 1) < kNear; };
    const bool hinge = !model_.joints[joint.joint].is_slide();
    LogFinding finding{.severity = FindingSeverity::kWrong, .column = name};
    if (slope.slope < 0) {
      finding.kind = "velocity sign";
      finding.text = fmt::format("'{}' changes by {:.3g} times '{}': one of the two has the wrong sign",
                                 joint_name(joint), slope.slope, name);
      finding.fix = fmt::format("give \"{}\" = -1 in [scale], or the position's if that is the wrong one", name);
    } else if (hinge && near(1 / kDegree)) {
      finding.kind = "degrees";
      finding.column = joint_name(joint);
      finding.text = fmt::format(
          "'{}' changes by {:.3g} times '{}': the position is in degrees and the velocity in "
          "rad/s",
          joint_name(joint), slope.slope, name);
      finding.fix = "give angle = \"deg\" and angular_velocity = \"rad/s\" in [units]";
      if (log.joints.size() > 1) {
        finding.fix += fmt::format("; if no other is in degrees, \"{}\" = 0.0174533 in [scale]", joint_name(joint));
      }
    } else if (hinge && near(kDegree)) {
      finding.kind = "degrees";
      finding.text = fmt::format("'{}' changes by {:.3g} times '{}': the velocity is in deg/s and the position in rad",
                                 joint_name(joint), slope.slope, name);
      finding.fix = "give angular_velocity = \"deg/s\" in [units]";
    } else if (hinge && near(2 * M_PI / 60)) {
      finding.severity = FindingSeverity::kWarning;
      finding.kind = "velocity scale";
      finding.text = fmt::format("'{}' changes by {:.3g} times '{}': the velocity is in revolutions a minute",
                                 joint_name(joint), slope.slope, name);
      finding.fix = "give angular_velocity = \"rpm\" in [units]";
    } else if (std::abs(slope.slope - 1) > kFar) {
      finding.severity = FindingSeverity::kWarning;
      finding.kind = "velocity scale";
      finding.text = fmt::format("'{}' changes by {:.3g} times '{}'", joint_name(joint), slope.slope, name);
      finding.fix = "nothing is fitted to logged velocities; give the right unit in [units], or a gear in [scale]";
    } else {
      return;
    }
    find(std::move(finding));
  }

  void torque(const MeasuredLog& log, const MeasuredJoint& joint) {
    if (joint.torque.empty()) return;
    const std::string name = joint_name(joint) + ".torque";
    const std::vector<size_t> glitches = glitches_of(joint.torque);
    if (!glitches.empty()) {
      find({.severity = FindingSeverity::kRemark,
            .kind = "glitches",
            .line = log.line[glitches.front()],
            .column = name,
            .span = {log.time[glitches.front()], log.time[glitches.back()]},
            .text = fmt::format("{} of {} are far from all around them, the first at {:.4g} s", glitches.size(),
                                counted(joint.torque.size(), "sample"), log.time[glitches.front()]),
            .fix = config_.torque_median > 1
                       ? fmt::format("each is replaced by the median of {} samples around it ('median' in [drive])",
                                     config_.torque_median)
                       : "remove them by 'median' in [drive]"});
    }
    const std::vector<double> smooth = running_median(joint.torque, 9);
    // what holds a joint at rest is no limit of its drive
    const std::vector<TimeSpan> rests = rests_of(log, joint);
    const auto rests_at = [&](size_t i) {
      return std::ranges::any_of(rests,
                                 [&](const auto& span) { return log.time[i] >= span.from && log.time[i] <= span.to; });
    };
    const Range2 range = range_of(smooth);
    constexpr double kOfWidth = 0.005, kShare = 0.05;
    for (const double end : {range.lower, range.upper}) {
      if (range.width() == 0 || std::abs(end) < 0.5 * std::max(std::abs(range.lower), std::abs(range.upper))) continue;
      size_t there = 0;
      for (size_t i = 0; i < smooth.size(); ++i) {
        there += static_cast<size_t>(std::abs(smooth[i] - end) <= kOfWidth * range.width() && !rests_at(i));
      }
      if (static_cast<double>(there) < kShare * static_cast<double>(smooth.size())) continue;
      find({.severity = FindingSeverity::kRemark,
            .kind = "saturation",
            .column = name,
            .text = fmt::format("it is at its end, {:.4g}, in {:.0f} % of the time", end,
                                100.0 * static_cast<double>(there) / static_cast<double>(smooth.size())),
            .fix = "use the measured torque, not the commanded one, if the drive clips it"});
    }
  }

  // Longest spans of at least `least` seconds in which a joint stays within `width`.
  static std::vector<TimeSpan> still_spans(const MeasuredLog& log, const MeasuredJoint& joint, double width,
                                           double least) {
    constexpr double kStride = 0.1;  // s, between beginnings that are tried
    std::vector<TimeSpan> spans;
    for (size_t from = 0; from < log.samples();) {
      double lower = joint.position[from], upper = lower;
      size_t behind = from + 1;
      for (; behind < log.samples(); ++behind) {
        lower = std::min(lower, joint.position[behind]);
        upper = std::max(upper, joint.position[behind]);
        if (upper - lower > width) break;
      }
      const TimeSpan span{log.time[from], log.time[behind - 1]};
      if (span.to - span.from >= least) {
        spans.push_back(span);
        from = behind;
      } else {
        const double next = log.time[from] + kStride;
        while (from < log.samples() && log.time[from] < next) ++from;
      }
    }
    return spans;
  }

  // No more than noise and the sensor's steps.
  std::vector<TimeSpan> rests_of(const MeasuredLog& log, const MeasuredJoint& joint) const {
    constexpr double kLeast = 1;
    const double width = std::max({4 * noise_of(joint.position), 2.5 * step_of(joint.position),
                                   model_.joints[joint.joint].is_slide() ? 2e-4 : 0.15 * kDegree});
    return still_spans(log, joint, width, kLeast);
  }

  void rests(const MeasuredLog& log) {
    if (log.joints.empty()) return;
    std::vector<TimeSpan> common = rests_of(log, log.joints.front());
    for (size_t j = 1; j < log.joints.size(); ++j) {
      std::vector<TimeSpan> both;
      for (const TimeSpan& a : common) {
        for (const TimeSpan& b : rests_of(log, log.joints[j])) {
          const TimeSpan span{std::max(a.from, b.from), std::min(a.to, b.to)};
          if (span.to > span.from) both.push_back(span);
        }
      }
      common = std::move(both);
    }
    for (size_t i = 0; i < common.size(); ++i) {
      spoil(common[i], "rest");
      if (i >= kMostOfAKind) continue;
      find({.severity = FindingSeverity::kRemark,
            .kind = "rest",
            .line = line_at(log, common[i].from),
            .span = common[i],
            .text = fmt::format("nothing moves from {:.4g} to {:.4g} s", common[i].from, common[i].to),
            .fix = "windows in it are left out"});
    }
    for (const MeasuredJoint& joint : log.joints) sticks(log, joint);
  }

  // A joint that stays where it is, but for what its belt or gear gives way, while others move.
  void sticks(const MeasuredLog& log, const MeasuredJoint& joint) {
    constexpr double kShare = 0.04, kOthers = 0.3, kLeast = 1.5;
    const double width = kShare * range_of(joint.position).width();
    if (width < 4 * noise_of(joint.position)) return;
    for (const TimeSpan& span : still_spans(log, joint, width, kLeast)) {
      const auto begin = std::ranges::lower_bound(log.time, span.from) - log.time.begin();
      const auto end = std::ranges::upper_bound(log.time, span.to) - log.time.begin();
      const bool others = std::ranges::any_of(log.joints, [&](const MeasuredJoint& other) {
        const std::vector<double> part(other.position.begin() + begin, other.position.begin() + end);
        return other.joint != joint.joint && range_of(part).width() > kOthers * range_of(other.position).width();
      });
      if (!others) continue;
      find({.severity = FindingSeverity::kWarning,
            .kind = "sticks",
            .line = line_at(log, span.from),
            .column = joint_name(joint),
            .span = span,
            .text = fmt::format("'{}' sticks from {:.4g} to {:.4g} s, while others move", joint_name(joint), span.from,
                                span.to),
            .fix = "only an engine with static friction can follow it: fit dry_friction, or leave the span out by "
                   "[rows]"});
    }
  }

  // -- all joints together
  // -----------------------------------------------------------------------------------------------

  void dynamics(const MeasuredLog& log) {
    if (!balancer_.fits(log)) return;
    if (std::ranges::none_of(log.joints, [&](const MeasuredJoint& joint) { return moves(joint); })) return;
    const bool pd = config_.law == DriveLaw::kPd && !log.has_torque();
    const bool torques = log.has_torque() || pd;
    const std::vector<Balance> balances = balancer_.balances(log, 1);
    std::vector<Explained> as_given;
    for (const Balance& balance : balances) as_given.push_back(explained(balance, torques));
    // one finding of degrees a log is enough, and nothing else follows from wrong angles
    const bool known = std::ranges::any_of(
        out_.findings, [&](const LogFinding& finding) { return finding.kind == "degrees" && finding.log == log.name; });
    if (known || degrees(log, as_given, torques)) return;
    if (another_reading(log, balances)) return;
    constexpr double kErrors = 4, kShare = 0.4;
    for (size_t j = 0; j < balances.size(); ++j) {
      const Explained& joint = as_given[j];
      const std::string& name = joint_name(log.joints[j]);
      if (joint.spans == 0 || joint.share < kShare || !moves(log.joints[j])) continue;
      const std::string quantity = name + (pd ? ".target" : ".torque");
      const char* what = pd ? "what the drive's gains make of " : "";
      if (torques && joint.gain + kErrors * joint.gain_error < 0) {
        find({.severity = FindingSeverity::kWrong,
              .kind = "torque sign",
              .column = quantity,
              .text = fmt::format(
                  "the motion goes best with {:.3g} times {}'{}' (standard error {:.2g}): its sign is wrong",
                  joint.gain, what, quantity, joint.gain_error),
              .fix = fmt::format("give \"{}\" = -1 in [scale], or -1 for \"{}\" if the position is flipped", quantity,
                                 name)});
      } else if (torques && (joint.gain - kErrors * joint.gain_error > 4 ||
                             (joint.gain + kErrors * joint.gain_error < 0.25 && joint.gain > 0))) {
        find({.severity = FindingSeverity::kWarning,
              .kind = "torque scale",
              .column = quantity,
              .text = fmt::format("the motion goes best with {:.3g} times {}'{}' (standard error {:.2g})", joint.gain,
                                  what, quantity, joint.gain_error),
              .fix = pd ? "correct the gains in [drive], or the masses of the model"
                        : "give its unit in [units], or the gear in [scale], or correct the masses of the model"});
      }
      if (joint.weight + kErrors * joint.weight_error < 0) {
        find({.severity = FindingSeverity::kWrong,
              .kind = "zero",
              .column = name,
              .text = fmt::format("gravity acts on '{}' with {:.3g} times what the model says: its zero or its axis is "
                                  "turned",
                                  name, joint.weight),
              .fix = fmt::format(
                  "give \"{}\" = 3.14159 in [offset] if the robot's zero points up, or correct the model", name)});
      }
    }
    hands(log, balances);
  }

  // Whether the model moves so with a joint's targets or its axis turned around, with two joints exchanged, or with an
  // angle that is measured against the world.
  bool another_reading(const MeasuredLog& log, const std::vector<Balance>& balances) {
    constexpr size_t kMostJoints = 6, kMostSamples = 20'000;
    constexpr double kFits = 0.15, kGood = 0.35, kBetter = 0.5;  // of misfit_of(); times
    const size_t joints = log.joints.size();
    const std::optional<double> given = misfit_of(balances);
    if (!given || *given < kFits || joints > kMostJoints || log.samples() > kMostSamples) return false;
    LogFinding best;
    double least = std::min(kGood, kBetter * *given);
    const auto attempt = [&](const auto& change, LogFinding finding) {
      MeasuredLog read = log;
      change(read.joints);
      const std::optional<double> misfit = misfit_of(balancer_.balances(read, 1));
      if (!misfit || *misfit >= least) return;
      least = *misfit;
      finding.severity = FindingSeverity::kWrong;
      finding.text +=
          fmt::format(" (left over: {:.0f} % of the torques in place of {:.0f} %)", 100 * *misfit, 100 * *given);
      best = std::move(finding);
    };
    const auto slide = [&](size_t j) { return model_.joints[log.joints[j].joint].is_slide(); };
    for (size_t j = 0; j < joints; ++j) {
      const std::string& name = joint_name(log.joints[j]);
      if (log.joints[j].torque.empty() && !log.joints[j].target.empty()) {
        attempt(
            [&](std::vector<MeasuredJoint>& read) { negate(read[j].target); },
            {.kind = "torque sign",
             .column = name + ".target",
             .text = fmt::format("the robot moves so with '{}.target' the other way round: its sign is wrong", name),
             .fix = fmt::format("give \"{}.target\" = -1 in [scale]", name)});
      }
      if (joints < 2) continue;  // gravity alone tells its axis, and may have another cause
      attempt(
          [&](std::vector<MeasuredJoint>& read) {
            for (auto* values : {&read[j].position, &read[j].torque, &read[j].target}) negate(*values);
          },
          {.kind = "flipped axis",
           .column = name,
           .text = fmt::format("the robot moves so with '{}' the other way round", name),
           .fix = fmt::format(
               "give -1 for \"{}\" and each of its other columns in [scale], or turn its axis in the model", name)});
      for (size_t k = j + 1; k < joints; ++k) {
        if (slide(j) != slide(k)) continue;
        const std::string& other = joint_name(log.joints[k]);
        attempt(
            [&](std::vector<MeasuredJoint>& read) {
              std::swap(read[j].position, read[k].position);
              std::swap(read[j].torque, read[k].torque);
              std::swap(read[j].target, read[k].target);
            },
            {.kind = "exchanged",
             .column = name,
             .text = fmt::format("the robot moves so with '{}' and '{}' exchanged", name, other),
             .fix = "exchange their columns in [columns]"});
        attempt([&](std::vector<MeasuredJoint>& read) { std::swap(read[j].torque, read[k].torque); },
                {.kind = "exchanged",
                 .column = name + ".torque",
                 .text = fmt::format("the robot moves so with the torques of '{}' and '{}' exchanged", name, other),
                 .fix = "exchange their columns in [columns]"});
      }
      const int parent = model_.bodies[model_.joints[log.joints[j].joint].body].parent;
      if (slide(j) || parent == kWorld) continue;
      for (size_t k = 0; k < joints; ++k) {
        if (log.joints[k].joint != model_.bodies[parent].joint || slide(k)) continue;
        attempt(
            [&](std::vector<MeasuredJoint>& read) {
              for (size_t i = 0; i < log.samples(); ++i) read[j].position[i] -= log.joints[k].position[i];
            },
            {.kind = "absolute angle",
             .column = name,
             .text = fmt::format("the robot moves so with '{}' less '{}': it is measured against the world", name,
                                 joint_name(log.joints[k])),
             .fix = "log the angle between the two links"});
      }
    }
    if (best.kind.empty()) return false;
    find(std::move(best));
    return true;
  }

  // Whether the angles make sense only as degrees.
  bool degrees(const MeasuredLog& log, const std::vector<Explained>& as_given, bool torques) {
    double widest = 0;
    for (const MeasuredJoint& joint : log.joints) {
      if (!model_.joints[joint.joint].is_slide()) widest = std::max(widest, range_of(joint.position).width());
    }
    constexpr double kWide = 8;  // a joint that turns less is none of degrees
    if (widest < kWide) return false;
    const std::vector<Balance> balances = balancer_.balances(log, kDegree);
    double given = 0, turned = 0;
    for (size_t j = 0; j < balances.size(); ++j) {
      const Explained as_degrees = explained(balances[j], torques);
      given += as_given[j].share;
      turned += as_degrees.share;
      // degrees give gravity the weight that the model says; a push that turns a joint far does not
      constexpr double kLeast = 0.3, kMost = 3;
      if (rms(balances[j].still) > 0 && (as_degrees.weight < kLeast || as_degrees.weight > kMost)) return false;
    }
    const auto joints = static_cast<double>(balances.size());
    constexpr double kGood = 0.6, kBetter = 0.15;
    if (turned / joints < kGood || turned - given < kBetter * joints) return false;
    find({.severity = FindingSeverity::kWrong,
          .kind = "degrees",
          .text = fmt::format("its angles reach over {:.4g}, and equations of motion explain {:.0f} % of the "
                              "accelerations as radians, {:.0f} % as degrees: they are degrees",
                              widest, 100 * std::max(0.0, given / joints), 100 * turned / joints),
          .fix = "give angle = \"deg\" in [units]"});
    return true;
  }

  // Work that no torque does, and friction cannot: somebody pushes. Inertia, the weight of gravity, friction and an
  // offset are fitted first, so that a wrong mass is no hand.
  void hands(const MeasuredLog& log, const std::vector<Balance>& balances) {
    for (size_t j = 0; j < balances.size(); ++j) {
      const Balance& balance = balances[j];
      const size_t n = balance.time.size();
      constexpr size_t kLeast = 12;
      if (n < kLeast || !moves(log.joints[j])) continue;
      const std::vector<double> outside = outside_torque(balance);
      // the inertia that turns with the joint, to compare its work with the energy of the motion
      const Slope inertia = inertia_of(log, j);
      double energy = 0;
      for (const double rate : balance.rate) energy = std::max(energy, 0.5 * inertia.slope * rate * rate);
      constexpr double kShare = 0.5;
      TimeSpan span{};
      double work = 0;
      const auto finish = [&] {
        if (energy > 0 && work > kShare * energy) {
          spoil(span, "hands");
          spans_.push_back({span, work / energy});
        }
        work = 0;
      };
      spans_.clear();
      for (size_t k = 0; k < n; ++k) {
        const double power = outside[k] * balance.rate[k];
        const double width = k + 1 < n ? balance.time[k + 1] - balance.time[k] : 0;
        if (power <= 0) {
          finish();
          continue;
        }
        if (work == 0) span.from = balance.time[k] - width;
        span.to = balance.time[k] + width;
        work += power * width;
      }
      finish();
      if (spans_.empty()) continue;
      std::ranges::sort(spans_, std::greater(), [](const Push& push) { return push.share; });
      double total = 0;
      for (const Push& push : spans_) total += push.span.to - push.span.from;
      const TimeSpan& worst = spans_.front().span;
      find({.severity = FindingSeverity::kWarning,
            .kind = "hands",
            .line = line_at(log, worst.from),
            .column = joint_name(log.joints[j]),
            .span = worst,
            .text = fmt::format("in {} ({:.3g} s) '{}' gains energy that its torque does not give, most from {:.4g} to "
                                "{:.4g} s: hands or a contact push it, or the model is not this robot",
                                counted(spans_.size(), "span"), total, joint_name(log.joints[j]), worst.from, worst.to),
            .fix = "windows that touch them are left out; say in [rows] what counts if they are the model's fault"});
    }
  }

  // The torque that nothing of the robot explains: what its inertia, weight, friction and an offset take, less what is
  // measured. Where the inertia that fits is far from the model's, forces that nobody measured move the robot, and the
  // model's is taken.
  static std::vector<double> outside_torque(const Balance& balance) {
    constexpr double kLeast = 0.2, kMost = 6;
    double inertia = 0;
    std::vector<double> left = outside_torque(balance, true, inertia);
    return inertia >= kLeast && inertia <= kMost ? left : outside_torque(balance, false, inertia);
  }
  static std::vector<double> outside_torque(const Balance& balance, bool fit_inertia, double& inertia) {
    const auto n = static_cast<Eigen::Index>(balance.time.size());
    constexpr Eigen::Index kColumns = 5;
    Eigen::MatrixXd rows(n, kColumns);
    Eigen::VectorXd y(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const auto i = static_cast<size_t>(k);
      rows.row(k) << balance.inertial[i], balance.still[i], balance.direction[i], balance.rate[i], 1;
      y[k] = balance.torque[i] - (fit_inertia ? 0 : balance.inertial[i]);
    }
    // by reweighting, because pushes are to stay what they are
    Eigen::VectorXd weights = Eigen::VectorXd::Ones(n), left = y;
    std::array<bool, kColumns> used = {fit_inertia, true, true, true, true};
    for (int round = 0; round < 12; ++round) {
      const Eigen::VectorXd root = weights.cwiseSqrt();
      Eigen::MatrixXd weighted = root.asDiagonal() * rows;
      for (Eigen::Index c = 0; c < kColumns; ++c) {
        if (!used[static_cast<size_t>(c)]) weighted.col(c).setZero();
      }
      const Eigen::VectorXd c =
          weighted.completeOrthogonalDecomposition().solve(Eigen::VectorXd(root.asDiagonal() * y));
      left = rows * c - y;
      inertia = c[0];
      // friction takes energy only
      for (const Eigen::Index k : {2, 3}) used[static_cast<size_t>(k)] = used[static_cast<size_t>(k)] && c[k] >= 0;
      std::vector<double> sizes;
      for (const double value : left) sizes.push_back(std::abs(value));
      const double scale = std::max(1.345 * 1.4826 * median_of(sizes), 1e-12);
      for (Eigen::Index k = 0; k < n; ++k) weights[k] = std::abs(left[k]) <= scale ? 1 : scale / std::abs(left[k]);
    }
    return {left.begin(), left.end()};
  }

  // Inertia about joint j where the log begins, all others at rest.
  Slope inertia_of(const MeasuredLog& log, size_t j) const {
    Model model = model_;
    model.gravity = Vec3::Zero();
    for (Joint& joint : model.joints) joint.stiffness = joint.damping = joint.dry_friction = 0;
    model.tendons.clear();
    State state = model.initial;
    for (size_t k = 0; k < log.joints.size(); ++k) {
      state.position[k] = log.joints[k].position.front();
      state.velocity[k] = 0;
    }
    bodies_from_joints(model, state);
    const parity::SpeedLayout layout(model);
    const int at = layout.of_joint[j];
    return {parity::inverse_dynamics(model, layout, state, Eigen::VectorXd::Unit(layout.count, at))[at], 1};
  }

  // -- free bodies
  // -------------------------------------------------------------------------------------------------------

  Flight flight_of(const MeasuredLog& log, const MeasuredBody& body) const { return flight_of(log, body, body.q_WB); }
  Flight flight_of(const MeasuredLog& log, const MeasuredBody& body, const std::vector<Quat>& q_WB) const {
    const size_t n = log.samples();
    const double dt = 1 / out_.logs[number_].rate, half = std::max(0.03, 4 * dt);
    Flight flight{std::vector<Vec3>(n), std::vector<Vec3>(n), std::vector<Vec3>(n)};
    const Vec3& centre = model_.bodies[body.body].p_BBcm;
    for (int k = 0; k < 3; ++k) {
      std::vector<double> x;
      for (size_t i = 0; i < n; ++i) x.push_back((body.p_WB[i] + q_WB[i] * centre)[k]);
      const Smooth smooth = smoothed(log.time, x, half);
      for (size_t i = 0; i < n; ++i) {
        flight.velocity[i][k] = smooth.rate[i];
        flight.acceleration[i][k] = smooth.acceleration[i];
      }
    }
    std::array<Smooth, 4> q;
    for (int k = 0; k < 4; ++k) {
      std::vector<double> x;
      for (const Quat& each : q_WB) x.push_back(each.coeffs()[k]);
      q[k] = smoothed(log.time, x, half);
    }
    for (size_t i = 0; i < n; ++i) {
      const Quat rate(q[3].rate[i], q[0].rate[i], q[1].rate[i], q[2].rate[i]);
      flight.angular[i] = 2 * (rate * q_WB[i].conjugate()).vec();
    }
    return flight;
  }

  // Poses that stand alone, that are held, or that never change.
  void poses(const MeasuredLog& log, const MeasuredBody& body) {
    constexpr double kOfWay = 0.05, kLeastWay = 2e-3, kLeastTurn = 2 * kDegree;
    const std::string& name = model_.bodies[body.body].name;
    std::array<std::vector<double>, 3> x;
    double way = 0, turn = 0;
    for (int k = 0; k < 3; ++k) {
      for (const Vec3& p : body.p_WB) x[k].push_back(p[k]);
      way = std::max(way, range_of(x[k]).width());
    }
    for (const Quat& q : body.q_WB) turn = std::max(turn, q.angularDistance(body.q_WB.front()));
    if (way < kLeastWay && turn < kLeastTurn) {
      const TimeSpan all{log.time.front(), log.time.back()};
      spoil(all, "rest");
      if (++resting_logs_ > kMostOfAKind) return;
      find({.severity = FindingSeverity::kWarning,
            .kind = "rest",
            .line = log.line.front(),
            .column = name,
            .span = all,
            .text =
                fmt::format("'{}' moves by {} and {:.2g} deg at most", name, quantity_text(way, "m"), turn / kDegree),
            .fix = "it tells nothing and is left out; log a motion"});
      return;
    }
    for (int k = 0; k < 3; ++k) {
      const std::string quantity = name + "." + "xyz"[k];
      lone_samples(log, quantity, x[k], kOfWay * way);
    }
    std::vector<size_t> lone_turns;
    constexpr double kLeast = 0.3, kBack = 0.3, kAround = 0.2;  // rad; shares of it
    const auto angle = [&](size_t i, size_t j) { return body.q_WB[i].angularDistance(body.q_WB[j]); };
    for (size_t i = 2; i + 2 < log.samples(); ++i) {
      const double there = std::min(angle(i - 1, i), angle(i, i + 1));
      if (there <= kLeast || angle(i - 1, i + 1) > kBack * there) continue;
      if (std::max(angle(i - 2, i - 1), angle(i + 1, i + 2)) < kAround * there) lone_turns.push_back(i);
    }
    if (!lone_turns.empty()) lone(log, name + ".qw", lone_turns);
    const auto widest =
        std::ranges::max_element(x, {}, [](const std::vector<double>& values) { return range_of(values).width(); });
    held(log, name + "." + "xyz"[widest - x.begin()], *widest);
  }

  // Flattened, for slopes.
  template <typename Get>
  static std::vector<double> flat(size_t n, const Get& get) {
    std::vector<double> out;
    out.reserve(3 * n);
    for (size_t i = 0; i < n; ++i) {
      const Vec3 value = get(i);
      for (int k = 0; k < 3; ++k) out.push_back(value[k]);
    }
    return out;
  }

  // What the log says of its velocities, gathered over all logs, because one toss may be short.
  struct Spin {
    // share of the turning that each reading explains, times samples; `reordered`: quaternions as x, y, z, w
    double as_given = 0, from_body = 0, to_body = 0, reordered = 0;
    double slope = 0, linear_slope = 0, linear = 0, samples = 0;
  };

  // Share of the turning that is explained where the columns of w, x, y, z have x, y, z, w.
  double reordered(const MeasuredLog& log, const MeasuredBody& body) const {
    std::vector<Quat> real;
    for (const Quat& q : body.q_WB) {
      real.emplace_back(q.z(), q.w(), q.x(), q.y());
      if (real.size() > 1 && real.back().dot(real[real.size() - 2]) < 0) real.back().coeffs() *= -1;
    }
    const Flight flight = flight_of(log, body, real);
    const size_t n = log.samples();
    const std::vector<double> turning = flat(n, [&](size_t i) { return flight.angular[i]; });
    const auto share = [&](const auto& get) { return slope_of(flat(n, get), turning).explained; };
    const auto logged = [&](size_t i) -> Vec3 {
      return config_.angular_velocity_in_body ? Vec3(body.q_WB[i].conjugate() * body.w_WB[i]) : body.w_WB[i];
    };
    return std::max(share(logged), share([&](size_t i) { return Vec3(real[i] * logged(i)); }));
  }

  void turning(const MeasuredLog& log, const MeasuredBody& body) {
    const Flight flight = flight_of(log, body);
    const size_t n = log.samples();
    const auto weight = static_cast<double>(n);
    Spin& spin = spins_[body.body];
    spin.samples += weight;
    if (!body.w_WB.empty()) {
      const std::vector<double> real = flat(n, [&](size_t i) { return flight.angular[i]; });
      const auto share = [&](const auto& get) { return slope_of(flat(n, get), real); };
      const Slope given = share([&](size_t i) { return body.w_WB[i]; });
      spin.as_given += weight * given.explained;
      spin.slope += weight * given.slope;
      spin.from_body += weight * share([&](size_t i) { return Vec3(body.q_WB[i] * body.w_WB[i]); }).explained;
      spin.to_body += weight * share([&](size_t i) { return Vec3(body.q_WB[i].conjugate() * body.w_WB[i]); }).explained;
      spin.reordered += weight * reordered(log, body);
    }
    if (!body.v_WB.empty() && model_.bodies[body.body].p_BBcm.isZero()) {
      const Slope linear = slope_of(flat(n, [&](size_t i) { return body.v_WB[i]; }),
                                    flat(n, [&](size_t i) { return flight.velocity[i]; }));
      spin.linear_slope += weight * linear.slope;
      spin.linear += weight * linear.explained;
    }
    free_fall(log, body, flight);
    constexpr double kStill = 0.05, kOfGravity = 0.2;  // m/s; of what is at rest on something
    for (size_t i = 0; i < n; ++i) {
      if (flight.velocity[i].norm() < kStill && flight.acceleration[i].norm() < kOfGravity * model_.gravity.norm()) {
        resting_[body.body].emplace_back(number_, i);
      }
    }
  }

  // Whether free bodies are where they can be: not deep in the world's shapes, nor at rest above them.
  void places() {
    number_ = logs_.size();
    const auto known = [&](const std::string& name) {
      return std::ranges::any_of(out_.findings, [&](const LogFinding& finding) {
        return finding.column.starts_with(name + ".") &&
               (finding.kind == "length unit" || finding.kind == "flipped axis" || finding.kind == "quaternion order");
      });
    };
    for (const auto& [body, spin] : spins_) {
      if (!known(model_.bodies[body].name)) place_of(body);
    }
  }
  void place_of(int body) {
    std::vector<int> pairs;
    bool planes = true;
    for (size_t p = 0; p < model_.contacts.size(); ++p) {
      const Shape &a = model_.shapes[model_.contacts[p].shape_a], &b = model_.shapes[model_.contacts[p].shape_b];
      if (!((a.body == kWorld && b.body == body) || (b.body == kWorld && a.body == body))) continue;
      pairs.push_back(static_cast<int>(p));
      planes = planes && (a.body == kWorld ? a : b).type == ShapeType::kPlane;
    }
    if (pairs.empty()) return;
    const Separations separations(model_);
    if (!separations.has_all()) return;
    const Body& own = model_.bodies[body];
    const double size = std::sqrt(2 * own.I_BBcm_B.trace() / own.mass);  // the side of a cube of this inertia
    State state = model_.initial;
    const auto clearance = [&](const Vec3& p_WB, const Quat& q_WB) {
      state.bodies[body].q_WB = q_WB;
      state.bodies[body].p_WBcm = p_WB + q_WB * own.p_BBcm;
      double least = std::numeric_limits<double>::infinity();
      for (const int pair : pairs) least = std::min(least, separations.of(pair, state));
      return least;
    };
    // as given, with the columns of w, x, y, z as x, y, z, w, and turned the other way
    constexpr double kDeep = 0.1, kShare = 0.1, kBetter = 0.25;  // of the size; of the samples; times
    constexpr size_t kSamples = 20'000;
    std::array<size_t, 3> deep{};
    size_t count = 0, all = 0;
    for (const MeasuredLog& log : logs_) all += log.body(body) == nullptr ? 0 : log.samples();
    double deepest = 0;
    for (const MeasuredLog& log : logs_) {
      const MeasuredBody* measured = log.body(body);
      if (measured == nullptr) continue;
      for (size_t i = 0; i < log.samples(); i += 1 + all / kSamples) {
        const Vec3& p = measured->p_WB[i];
        const Quat& q = measured->q_WB[i];
        const std::array<double, 3> above = {clearance(p, q), clearance(p, Quat(q.z(), q.w(), q.x(), q.y())),
                                             clearance(p, q.conjugate())};
        for (size_t k = 0; k < above.size(); ++k) deep[k] += static_cast<size_t>(above[k] < -kDeep * size);
        deepest = std::max(deepest, -above[0]);
        ++count;
      }
    }
    const auto share = [&](size_t k) { return static_cast<double>(deep[k]) / static_cast<double>(count); };
    const std::string fix =
        "correct what x, y, z are of ([frames] point, [offset]), or the height of the ground in the model";
    if (count > 0 && share(0) > kShare) {
      LogFinding finding{.severity = FindingSeverity::kWrong, .kind = "inside", .column = own.name + ".z"};
      finding.text = fmt::format("'{}' is up to {} deep in the world's shapes, in {:.0f} % of the samples far",
                                 own.name, quantity_text(deepest, "m"), 100 * share(0));
      finding.fix = fix;
      for (const size_t k : {1, 2}) {
        if (share(k) > kBetter * share(0)) continue;
        finding.kind = "quaternion order";
        finding.column = own.name + ".qw";
        finding.text += k == 1 ? ", and is not where the columns of qw, qx, qy, qz have x, y, z, w"
                               : ", and is not where its rotation is turned the other way";
        finding.fix = k == 1 ? "name the column of each of qw, qx, qy, qz in [columns]"
                             : "give the rotation from the body to the world: -1 for qx, qy and qz in [scale]";
        break;
      }
      find(std::move(finding));
      return;
    }
    // at rest on nothing
    constexpr size_t kLeastResting = 20;
    std::vector<double> heights;
    for (const auto& [log, i] : resting_[body]) {
      if (heights.size() >= kSamples) break;
      const MeasuredBody& measured = *logs_[log].body(body);
      heights.push_back(clearance(measured.p_WB[i], measured.q_WB[i]));
    }
    if (!planes || heights.size() < kLeastResting) return;
    if (const double height = median_of(heights); height > kDeep * size) {
      find({.severity = FindingSeverity::kWarning,
            .kind = "floats",
            .column = own.name + ".z",
            .text = fmt::format("'{}' rests {} above the world's shapes", own.name, quantity_text(height, "m")),
            .fix = fix});
    }
  }

  // Accelerations of the first third of a motion, before most of its contacts.
  void free_fall(const MeasuredLog& log, const MeasuredBody& body, const Flight& flight) {
    const size_t n = log.samples(), end = std::max<size_t>(n / 3, std::min<size_t>(n, 12));
    for (size_t i = std::min<size_t>(2, n); i < end; ++i) falls_[body.body].push_back(flight.acceleration[i]);
    const double g = model_.gravity.norm();
    if (g == 0) return;
    size_t falling = 0;
    for (const Vec3& a : flight.acceleration) falling += static_cast<size_t>((a - model_.gravity).norm() < 0.3 * g);
    constexpr double kLeast = 0.05;  // s
    if (static_cast<double>(falling) / out_.logs[number_].rate < kLeast) grounded_.push_back(number_);
  }
  void flights() {
    number_ = logs_.size();
    for (const auto& [body, spin] : spins_) {
      const std::string& name = model_.bodies[body].name;
      const double given = spin.as_given / spin.samples, slope = spin.slope / spin.samples;
      const double from_body = spin.from_body / spin.samples, to_body = spin.to_body / spin.samples;
      constexpr double kBetter = 0.1, kGood = 0.5;
      const double reordered = spin.reordered / spin.samples;
      if (reordered > std::max(kGood, std::max({given, from_body, to_body}) + kBetter)) {
        find({.severity = FindingSeverity::kWrong,
              .kind = "quaternion order",
              .column = name + ".qw",
              .text =
                  fmt::format("the angular velocity of '{}' explains {:.0f} % of its turning where the columns of qw, "
                              "qx, qy, qz have x, y, z, w, and {:.0f} % as given",
                              name, 100 * reordered, 100 * given),
              .fix = "name the column of each of qw, qx, qy, qz in [columns]"});
      } else if (std::max(from_body, to_body) > std::max(kGood, given + kBetter)) {
        const bool was_body = from_body > to_body;
        find({.severity = FindingSeverity::kWrong,
              .kind = "axes",
              .column = name + ".wx",
              .text =
                  fmt::format("the angular velocity of '{}' goes with its turning in axes of the {}: {:.0f} % of it, "
                              "and {:.0f} % as given",
                              name, was_body ? "body" : "world", 100 * std::max(from_body, to_body), 100 * given),
              .fix = fmt::format("give angular_velocity = \"{}\" in [frames]", was_body ? "body" : "world")});
      } else if (given > kGood && std::abs(slope * kDegree - 1) > 0.3 && std::abs(slope - 1) > 0.3) {
        const bool degrees = std::abs(slope / kDegree - 1) < 0.3;
        find({.severity = FindingSeverity::kWrong,
              .kind = degrees ? "degrees" : "velocity scale",
              .column = name + ".wx",
              .text = fmt::format("'{}' turns with {:.3g} times its angular velocity", name, slope),
              .fix = degrees ? "give angular_velocity = \"deg/s\" in [units]"
                             : "correct its unit or sign in [units] or [scale]"});
      }
      const double linear = spin.linear_slope / spin.samples;
      if (spin.linear / spin.samples > kGood && std::abs(linear - 1) > 0.3) {
        find({.severity = FindingSeverity::kWarning,
              .kind = "velocity scale",
              .column = name + ".vx",
              .text = fmt::format("'{}' moves with {:.3g} times its velocity", name, linear),
              .fix = "correct its unit, axes or sign in [units], [frames] or [scale]"});
      }
    }
    for (const auto& [body, falls] : falls_) gravity(body, falls);
    if (!grounded_.empty() && !spins_.empty()) {
      std::vector<std::string> names;
      for (const size_t log : grounded_) {
        if (names.size() < 5) names.push_back(logs_[log].name);
      }
      find({.severity = grounded_.size() * 2 > logs_.size() ? FindingSeverity::kWarning : FindingSeverity::kRemark,
            .kind = "no flight",
            .text =
                fmt::format("{} no free flight: {}{}",
                            grounded_.size() == 1 ? "1 motion has" : fmt::format("{} motions have", grounded_.size()),
                            join(names, ", "), names.size() < grounded_.size() ? ", ..." : ""),
            .fix = "its first state is fitted to samples in contact; begin the log in flight"});
    }
  }

  // Which unit of length and which axis upward make free fall of it.
  void gravity(int body, const std::vector<Vec3>& falls) {
    const double g = model_.gravity.norm();
    if (g == 0 || falls.size() < kLeastSamples) return;
    struct Reading {
      double scale = 1;
      Vec3 direction;
      const char* text;
      const char* fix;
      size_t count = 0;
    };
    const Vec3 down = model_.gravity / g;
    const std::array<std::pair<double, std::pair<const char*, const char*>>, 4> units = {
        {{1, {"", ""}},
         {1e-3, {"millimetres", "give length = \"mm\" in [units]"}},
         {1e-2, {"centimetres", "give length = \"cm\" in [units]"}},
         {1e3, {"kilometres", "correct the unit of the positions by [scale]"}}}};
    Reading best;
    size_t as_given = 0;
    for (const auto& [scale, words] : units) {
      for (int axis = 0; axis < 6; ++axis) {
        const Vec3 direction = (axis % 2 == 0 ? 1 : -1) * Vec3::Unit(axis / 2);
        const auto count = static_cast<size_t>(
            std::ranges::count_if(falls, [&](const Vec3& a) { return (scale * a - g * direction).norm() < 0.25 * g; }));
        const bool given = scale == 1 && direction.dot(down) > 0.99;
        if (given) as_given = count;
        if (count > best.count) best = {scale, direction, words.first, words.second, count};
      }
    }
    const auto share = [&](size_t count) { return static_cast<double>(count) / static_cast<double>(falls.size()); };
    constexpr double kShare = 0.3;
    const std::string& name = model_.bodies[body].name;
    if (share(best.count) < kShare || share(as_given) > 0.5 * share(best.count)) return;
    if (best.scale != 1) {
      find({.severity = FindingSeverity::kWrong,
            .kind = "length unit",
            .column = name + ".x",
            .text =
                fmt::format("'{}' falls with {:.4g} m/s^2: its positions are in {}", name, g / best.scale, best.text),
            .fix = best.fix});
    }
    if (best.direction.dot(down) < 0.99) {
      const char axis =
          "xyz"[std::distance(best.direction.data(), std::find_if(best.direction.data(), best.direction.data() + 3,
                                                                  [](double value) { return value != 0; }))];
      find({.severity = FindingSeverity::kWrong,
            .kind = "flipped axis",
            .column = name + "." + axis,
            .text = fmt::format("'{}' falls along {}{}, and the model's gravity is ({:.3g}, {:.3g}, {:.3g})", name,
                                best.direction.sum() > 0 ? '+' : '-', axis, model_.gravity.x(), model_.gravity.y(),
                                model_.gravity.z()),
            .fix = "map the columns to other axes in [columns], flip them by [scale], or turn the model's gravity"});
    }
  }

  // -- all logs
  // ----------------------------------------------------------------------------------------------------------

  void excitation() {
    number_ = logs_.size();
    constexpr double kLeastAngle = 2 * kDegree, kLeastWay = 2e-3;
    for (size_t j = 0; j < model_.joints.size(); ++j) {
      double width = 0;
      bool logged = false;
      for (const MeasuredLog& log : logs_) {
        const MeasuredJoint* joint = log.joint(static_cast<int>(j));
        if (joint == nullptr) continue;
        logged = true;
        width = std::max(width, range_of(joint->position).width());
      }
      const bool slide = model_.joints[j].is_slide();
      if (!logged || width >= (slide ? kLeastWay : kLeastAngle)) continue;
      find({.severity = FindingSeverity::kWarning,
            .kind = "excitation",
            .column = model_.joints[j].name,
            .text = fmt::format("'{}' moves by {} at most in all logs: they tell nothing of its friction and inertia",
                                model_.joints[j].name,
                                slide ? quantity_text(width, "m") : fmt::format("{:.3g} deg", width / kDegree)),
            .fix = "log a motion in which it moves, or fit nothing of it"});
    }
  }

  // What some logs have and others do not, or none has.
  void missing() {
    number_ = logs_.size();
    const auto names_of = [](const std::vector<std::string>& all) {
      constexpr size_t kMost = 5;
      std::vector<std::string> some(all.begin(),
                                    all.begin() + static_cast<std::ptrdiff_t>(std::min(all.size(), kMost)));
      if (all.size() > kMost) some.push_back(fmt::format("{} more", all.size() - kMost));
      return join(some, ", ");
    };
    const DriveLaw law = drive_law(logs_, config_);
    std::vector<std::string> unlogged, undriven;
    bool driven = false;
    for (size_t j = 0; j < model_.joints.size(); ++j) {
      const std::string& name = model_.joints[j].name;
      const bool follows = std::ranges::any_of(
          model_.couplings, [&](const Coupling& coupling) { return coupling.joint == static_cast<int>(j); });
      std::vector<std::string> without, without_drive;
      size_t with = 0, with_drive = 0;
      for (const MeasuredLog& log : logs_) {
        const MeasuredJoint* joint = log.joint(static_cast<int>(j));
        if (joint == nullptr) {
          without.push_back(log.name);
          continue;
        }
        ++with;
        const bool has = law == DriveLaw::kPd ? !joint->target.empty() : !joint->torque.empty();
        if (has) {
          ++with_drive;
        } else {
          without_drive.push_back(log.name);
        }
      }
      if (with == 0) {
        if (!follows) unlogged.push_back(name);
        continue;
      }
      if (!without.empty()) {
        find({.severity = FindingSeverity::kWrong,
              .kind = "missing",
              .column = name,
              .text = fmt::format("'{}' is not in {}, and in other logs: there it would start where the model has it",
                                  name, names_of(without)),
              .fix = "give its column, or leave these logs out"});
      }
      if (law == DriveLaw::kNone) continue;
      driven = driven || with_drive > 0;
      if (with_drive == 0) {
        undriven.push_back(name);
      } else if (!without_drive.empty()) {
        const std::string quantity = name + (law == DriveLaw::kPd ? ".target" : ".torque");
        find({.severity = FindingSeverity::kWrong,
              .kind = "drive",
              .column = quantity,
              .text = fmt::format("'{}' is not in {}, and in other logs: there nothing would drive the joint", quantity,
                                  names_of(without_drive)),
              .fix = "give its column, or leave these logs out"});
      }
    }
    const bool joints = std::ranges::any_of(logs_, [](const MeasuredLog& log) { return !log.joints.empty(); });
    if (joints && !unlogged.empty()) {
      find({.severity = FindingSeverity::kWarning,
            .kind = "missing",
            .text = fmt::format("no log has {}: each window starts where the model has {}, at rest", names_of(unlogged),
                                unlogged.size() == 1 ? "it" : "them"),
            .fix = "give the columns, or fix these joints in the model"});
    }
    if (driven && !undriven.empty()) {
      find(
          {.severity = FindingSeverity::kRemark,
           .kind = "drive",
           .text = fmt::format("no log has the {} of {}: nothing drives {}", law == DriveLaw::kPd ? "target" : "torque",
                               names_of(undriven), undriven.size() == 1 ? "it" : "them")});
    }
  }

  // Logs of the same samples: one of them would judge what was fitted to the other.
  void copies() {
    const auto same = [](const MeasuredLog& a, const MeasuredLog& b) {
      if (a.samples() != b.samples() || a.joints.size() != b.joints.size() || a.bodies.size() != b.bodies.size()) {
        return false;
      }
      for (size_t i = 0; i < a.joints.size(); ++i) {
        if (a.joints[i].position != b.joints[i].position) return false;
      }
      for (size_t i = 0; i < a.bodies.size(); ++i) {
        if (a.bodies[i].p_WB != b.bodies[i].p_WB) return false;
      }
      return true;
    };
    size_t found = 0;
    for (number_ = 0; number_ < logs_.size(); ++number_) {
      const MeasuredLog& log = logs_[number_];
      if (log.samples() < kLeastSamples) continue;
      const auto earlier = std::ranges::find_if(logs_.begin(), logs_.begin() + static_cast<std::ptrdiff_t>(number_),
                                                [&](const MeasuredLog& other) { return same(log, other); });
      if (earlier == logs_.begin() + static_cast<std::ptrdiff_t>(number_) || ++found > kMostOfAKind) continue;
      find({.severity = FindingSeverity::kRemark,
            .kind = "copy",
            .text = fmt::format("it has the samples of '{}'", earlier->name),
            .fix = "give it once: a log that is fitted to judges nothing"});
    }
    number_ = logs_.size();
  }

  void whole() {
    number_ = logs_.size();
    const DriveLaw law = drive_law(logs_, config_);
    for (const MeasuredLog& log : logs_) {
      if (law == DriveLaw::kTorque && !log.has_torque()) {
        find({.severity = FindingSeverity::kWrong,
              .kind = "drive",
              .text = fmt::format("'{}' has no torque, which drives the robot by [drive]", log.name),
              .fix = "give the log's columns of torque, or law = \"none\" where nothing drives"});
      }
      if (law == DriveLaw::kPd &&
          std::ranges::all_of(log.joints, [](const auto& joint) { return joint.target.empty(); })) {
        find({.severity = FindingSeverity::kWrong,
              .kind = "drive",
              .text = fmt::format("'{}' has no targets, which drive the robot by law = \"pd\"", log.name),
              .fix = "name the columns of the targets, JOINT.target in [columns]"});
      }
    }
    const bool targets = std::ranges::any_of(logs_, [](const MeasuredLog& log) {
      return std::ranges::any_of(log.joints, [](const MeasuredJoint& joint) { return !joint.target.empty(); });
    });
    if (!config_.law && law == DriveLaw::kNone && targets) {
      find({.severity = FindingSeverity::kWrong,
            .kind = "drive",
            .text = "the logs have targets, and no gains are given, so nothing drives the robot",
            .fix = "give law = \"pd\" with stiffness and damping in [drive], or law = \"none\""});
    }
    if (!config_.law && law == DriveLaw::kNone &&
        std::ranges::any_of(logs_, [](const MeasuredLog& log) { return log.has_torque(); })) {
      find({.severity = FindingSeverity::kWrong,
            .kind = "drive",
            .text = "some logs have torques and others none, so nothing drives the robot",
            .fix = "give law = \"torque\" or \"none\" in [drive]"});
    }
    const bool motions = config_.whole_motions.value_or(!model_.contacts.empty());
    if (logs_.size() == 1 && motions) {
      find({.severity = FindingSeverity::kWrong,
            .kind = "one log",
            .text = "there is one motion, and a fit has to be judged by another one",
            .fix = "give more logs, or the column that tells motions apart, 'motion' in [columns]"});
    } else if (logs_.size() == 1) {
      find({.severity = FindingSeverity::kWarning,
            .kind = "one log",
            .text = "there is one log, so what is held out is its last third",
            .fix = "give several logs: a fit that is tried on its own log says little"});
    }
    const bool timed =
        std::ranges::none_of(out_.findings, [](const LogFinding& finding) { return finding.kind == "time unit"; });
    if (timed) windows();
  }

  // Whether anything is left to be fitted to.
  void windows() {
    try {
      static_cast<void>(Windows(model_, logs_, config_, out_));
    } catch (const InputError& error) {
      find({.severity = FindingSeverity::kWrong,
            .kind = "windows",
            .text = fmt::format("nothing can be fitted to them: {}", error.what())});
    }
  }

  static constexpr size_t kMostOfAKind = 5;

  struct Push {
    TimeSpan span;
    double share = 0;
  };

  const Model& model_;
  const MatchConfig& config_;
  const std::vector<MeasuredLog>& logs_;
  const Balancer balancer_;
  size_t number_ = 0;
  LogCheck out_;
  std::vector<Push> spans_;
  std::map<int, Spin> spins_;
  std::map<int, std::vector<Vec3>> falls_;
  std::vector<size_t> grounded_;
  std::map<int, std::vector<std::pair<size_t, size_t>>> resting_;  // by body: log and sample
  size_t resting_logs_ = 0;
};

}  // namespace

LogCheck check_logs(const Model& model, const MatchConfig& config, const std::vector<MeasuredLog>& logs) {
  return Checker(model, config, logs).check();
}

}  // namespace assay::match
