#include "controls/hold.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "base/text.h"
#include "model/joint_inertia.h"

namespace assay {
namespace {

constexpr double kHoldFrequency = 10;  // Hz

// The joint-space inertia of the driven joints while the others follow. Rows and columns of the others are zero but for
// a 1 on the diagonal.
Eigen::MatrixXd driven_inertia(const Model& model) {
  Eigen::MatrixXd all = joint_inertia(model, model.initial);
  const std::vector<double> limits = effort_limits(model);
  std::vector<Eigen::Index> driven, others;
  for (size_t j = 0; j < limits.size(); ++j) {
    (limits[j] > 0 ? driven : others).push_back(static_cast<Eigen::Index>(j));
  }
  if (others.empty()) return all;
  const Eigen::MatrixXd coupling = all(others, driven);
  const Eigen::MatrixXd own = all(driven, driven) - coupling.transpose() * all(others, others).ldlt().solve(coupling);
  Eigen::MatrixXd inertia = Eigen::MatrixXd::Identity(all.rows(), all.cols());
  inertia(driven, driven) = own;
  return inertia;
}

class HoldControl final : public Control {
 public:
  HoldControl(const Model& model, double frequency)
      : frequency_(frequency), start_(model.initial.position), limit_(effort_limits(model)) {
    const double w = 2 * std::numbers::pi * frequency;
    const Eigen::MatrixXd inertia = driven_inertia(model);
    stiffness_ = w * w * inertia;
    damping_ = 2 * w * inertia;
  }

  void torques(const State& state, std::span<double> torques) const override {
    const auto count = static_cast<Eigen::Index>(start_.size());
    using Column = Eigen::Map<const Eigen::VectorXd>;
    const Eigen::VectorXd wanted = stiffness_ * (Column(start_.data(), count) - Column(state.position.data(), count)) -
                                   damping_ * Column(state.velocity.data(), count);
    for (size_t j = 0; j < start_.size(); ++j) {
      torques[j] = std::clamp(wanted[static_cast<Eigen::Index>(j)], -limit_[j], limit_[j]);
    }
  }
  ControlInput input() const override { return start_.empty() ? ControlInput::kNothing : ControlInput::kState; }
  bool is_zero() const override { return start_.empty(); }
  std::string description() const override {
    return start_.empty() ? "passive" : fmt::format("hold at the start pose, {} Hz", shortest(frequency_));
  }

 private:
  double frequency_;
  std::vector<double> start_, limit_;
  Eigen::MatrixXd stiffness_, damping_;
};

class RandomControl final : public Control {
 public:
  RandomControl(const Model& model, double motion, std::uint64_t seed)
      : motion_(motion), seed_(seed), sines_(model.joints.size()) {
    const Eigen::VectorXd inertia = driven_inertia(model).diagonal();
    const std::vector<double> limit = effort_limits(model);
    for (size_t j = 0; j < sines_.size(); ++j) {
      double sum = 0;
      for (size_t k = 0; k < kSines; ++k) {
        Sine& sine = sines_[j][k];
        sine.frequency = 0.5 + 2.5 * uniform(kSines * 2 * j + 2 * k);
        sine.phase = 2 * std::numbers::pi * uniform(kSines * 2 * j + 2 * k + 1);
        const double w = 2 * std::numbers::pi * sine.frequency;
        sine.amplitude = inertia[static_cast<Eigen::Index>(j)] * w * w * motion / kSines;
        sum += std::abs(sine.amplitude);
      }
      if (sum <= limit[j]) continue;
      for (Sine& sine : sines_[j]) sine.amplitude *= limit[j] / sum;
    }
  }

  void torques(const State& state, std::span<double> torques) const override {
    for (size_t j = 0; j < sines_.size(); ++j) {
      torques[j] = 0;
      for (const Sine& sine : sines_[j]) {
        torques[j] += sine.amplitude * std::sin(2 * std::numbers::pi * sine.frequency * state.time + sine.phase);
      }
    }
  }
  ControlInput input() const override { return is_zero() ? ControlInput::kNothing : ControlInput::kTime; }
  bool is_zero() const override { return sines_.empty() || motion_ == 0; }
  std::string description() const override {
    if (is_zero()) return "passive";
    return fmt::format("random, seed {}, motion {}", seed_, shortest(motion_));
  }

 private:
  static constexpr size_t kSines = 3;

  // In [0, 1): SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", 2014).
  double uniform(std::uint64_t index) const {
    std::uint64_t z = (seed_ + 1) * 0x9E3779B97F4A7C15U + index * 0xD1B54A32D192ED03U;
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
    z ^= z >> 31U;
    return static_cast<double>(z >> 11U) * 0x1p-53;
  }

  double motion_;
  std::uint64_t seed_;
  std::vector<std::array<Sine, kSines>> sines_;
};

// The largest force of an actuator; infinite when its feedback or its control has no bound.
double largest_force(const Actuator& actuator) {
  constexpr double kNoBound = std::numeric_limits<double>::infinity();
  const auto bound = [](bool limited, double lower, double upper) {
    return limited ? std::max(std::abs(lower), std::abs(upper)) : kNoBound;
  };
  double largest = kNoBound;
  if (!actuator.has_feedback()) {
    double input = bound(actuator.control_limited, actuator.control_lower, actuator.control_upper);
    if (actuator.activation == ActivationType::kIntegrator) input = kNoBound;
    if (actuator.has_activation()) {
      // a filter stays between its start and the control
      input = std::min(std::max(input, std::abs(actuator.activation_start)),
                       bound(actuator.activation_limited, actuator.activation_lower, actuator.activation_upper));
    }
    if (std::isfinite(input)) largest = std::abs(actuator.gain) * input + std::abs(actuator.bias[0]);
  }
  if (actuator.force_limited) {
    largest = std::min(largest, std::max(std::abs(actuator.force_lower), std::abs(actuator.force_upper)));
  }
  return largest;
}

}  // namespace

std::vector<double> effort_limits(const Model& model) {
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  std::vector<double> limits(model.joints.size(), model.actuators.empty() ? kNoLimit : 0.0);
  for (const Actuator& actuator : model.actuators) {
    // A transmission through several joints is no limit of one.
    const double force = actuator.terms.size() == 1 ? largest_force(actuator) : kNoLimit;
    for (const JointTerm& term : actuator.terms) {
      if (term.coefficient != 0 && force > 0)
        limits[static_cast<size_t>(term.joint)] += std::abs(term.coefficient) * force;
    }
  }
  return limits;
}

std::unique_ptr<Control> hold_control(const Model& model, double natural_frequency) {
  return std::make_unique<HoldControl>(model, natural_frequency > 0 ? natural_frequency : kHoldFrequency);
}

std::unique_ptr<Control> random_control(const Model& model, double motion, std::uint64_t seed) {
  return std::make_unique<RandomControl>(model, motion, seed);
}

}  // namespace assay
