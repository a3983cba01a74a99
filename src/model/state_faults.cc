#include "model/state_faults.h"

#include <cmath>

#include <fmt/format.h>

namespace assay {

std::string state_shape_fault(const State& state, size_t bodies, size_t joints) {
  const auto counts = [](size_t found, size_t wanted, const char* what) {
    return fmt::format("{} {} where the model has {}", found, what, wanted);
  };
  if (state.bodies.size() != bodies) return counts(state.bodies.size(), bodies, "bodies");
  if (state.position.size() != joints) return counts(state.position.size(), joints, "joint positions");
  if (state.velocity.size() != joints) return counts(state.velocity.size(), joints, "joint velocities");
  return "";
}

std::string state_value_fault(const State& state, const Model* model) {
  const auto at = [&](const std::string& what, const char* respect, const char* kind, const auto& named) {
    if (model == nullptr) return what;
    return fmt::format("{}{} {} '{}'{}", what, respect, kind, named.name,
                       std::isfinite(state.time) ? fmt::format(" at {:.6g} s", state.time) : "");
  };
  const std::string number = "a non-finite number";
  const auto joint = [&](size_t j) { return model == nullptr ? Joint{} : model->joints[j]; };
  const auto body = [&](size_t b) { return model == nullptr ? Body{} : model->bodies[b]; };
  for (size_t j = 0; j < state.position.size(); ++j) {
    if (!std::isfinite(state.position[j])) return at(number, " as the position of", "joint", joint(j));
    if (!std::isfinite(state.velocity[j])) return at(number, " as the velocity of", "joint", joint(j));
  }
  for (size_t b = 0; b < state.bodies.size(); ++b) {
    const BodyState& each = state.bodies[b];
    if (!each.p_WBcm.allFinite()) return at(number, " as the position of", "body", body(b));
    if (!each.q_WB.coeffs().allFinite()) return at(number, " in the orientation of", "body", body(b));
    if (!each.v_WBcm.allFinite()) return at(number, " as the velocity of", "body", body(b));
    if (!each.w_WB.allFinite()) return at(number, " as the angular velocity of", "body", body(b));
  }
  if (!std::isfinite(state.time)) return model == nullptr ? number : number + " as the time";
  for (size_t b = 0; b < state.bodies.size(); ++b) {
    constexpr double kLengthTolerance = 1e-2;  // far above what single precision loses
    const double length = state.bodies[b].q_WB.norm();
    if (std::abs(length - 1) <= kLengthTolerance) continue;
    return at(fmt::format("an orientation of length {:.3g}", length), " for", "body", body(b));
  }
  return "";
}

std::string state_time_fault(const State& state, double start_s, double timestep_s, long long steps) {
  constexpr double kRounding = 1e-3;
  const double elapsed = timestep_s * static_cast<double>(steps), asked = start_s + elapsed;
  if (std::abs(state.time - asked) <= 0.5 * timestep_s + kRounding * elapsed) return "";
  return fmt::format("the time {:.6g} s where {:.6g} s was asked for", state.time, asked);
}

}  // namespace assay
