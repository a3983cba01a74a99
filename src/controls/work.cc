#include "controls/work.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace assay {

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
  double work = 0;
  for (size_t j = 0; j < range.size(); ++j) {
    if (largest[j] > 0 && range[j] > 0) work += largest[j] * range[j] * (1 + kSwingsPerSecond * duration_s);
  }
  return work;
}

}  // namespace assay
