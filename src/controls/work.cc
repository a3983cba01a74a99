#include "controls/work.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Cholesky>

#include "model/joint_inertia.h"

namespace assay {
namespace {

// Of each joint without limits, under torques that do not depend on its motion: the energy of its own inertia under the
// largest impulse since the start. A constant force drives a light slide on and on, however far that is.
std::vector<double> open_loop_energy(const Model& model, const Control& control, double duration_s) {
  std::vector<double> energy(model.joints.size(), 0);
  const bool unlimited = std::ranges::any_of(model.joints, [](const Joint& joint) { return !joint.limited; });
  if (control.input() == ControlInput::kState || control.has_memory() || !unlimited) return energy;
  constexpr int kTimes = 256;
  const double step_s = duration_s / kTimes;
  std::vector<double> torques(energy.size()), impulse(energy.size(), 0), largest(energy.size(), 0);
  State state = model.initial;
  for (int i = 0; i < kTimes; ++i) {
    state.time = (i + 0.5) * step_s;
    control.torques(state, torques);
    for (size_t j = 0; j < impulse.size(); ++j) {
      impulse[j] += step_s * torques[j];
      largest[j] = std::max(largest[j], std::abs(impulse[j]));
    }
  }
  const Eigen::MatrixXd inertia = joint_inertia(model, model.initial);
  const Eigen::LLT<Eigen::MatrixXd> factor(inertia);
  if (factor.info() != Eigen::Success) return energy;
  const Eigen::MatrixXd mobility = factor.solve(Eigen::MatrixXd::Identity(inertia.rows(), inertia.cols()));
  for (size_t j = 0; j < energy.size(); ++j) {
    const auto row = static_cast<Eigen::Index>(j);
    if (!model.joints[j].limited) energy[j] = 0.5 * largest[j] * largest[j] * mobility(row, row);
  }
  return energy;
}

}  // namespace

double largest_work(const Model& model, const Control& control, double duration_s) {
  if (control.is_zero()) return 0;
  constexpr int kTimes = 64;
  constexpr double kSwingsPerSecond = 4;  // to one side
  std::vector<double> torques(model.joints.size()), largest(model.joints.size(), 0), range(model.joints.size());
  std::array<State, 3> ends = {model.initial, model.initial, model.initial};
  for (size_t j = 0; j < range.size(); ++j) {
    const Joint& hinge = model.joints[j];
    ends[1].position[j] = hinge.limited ? hinge.lower : model.initial.position[j] - std::numbers::pi;
    ends[2].position[j] = hinge.limited ? hinge.upper : model.initial.position[j] + std::numbers::pi;
    range[j] = ends[2].position[j] - ends[1].position[j];
  }
  const auto known = control.largest_torques();
  if (known) largest = *known;
  for (State& state : ends) {
    for (int i = 0; i < kTimes && !known; ++i) {
      state.time = duration_s * i / kTimes;
      control.torques(state, torques);
      for (size_t j = 0; j < torques.size(); ++j) largest[j] = std::max(largest[j], std::abs(torques[j]));
    }
  }
  const std::vector<double> open = open_loop_energy(model, control, duration_s);
  double work = 0;
  for (size_t j = 0; j < range.size(); ++j) {
    if (!(largest[j] > 0)) continue;
    const double swings = range[j] > 0 ? largest[j] * range[j] * (1 + kSwingsPerSecond * duration_s) : 0;
    work += std::max(swings, open[j]);
  }
  return work;
}

}  // namespace assay
