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

std::string state_value_fault(const State& state) {
  bool finite = std::isfinite(state.time);
  for (const double number : state.position) finite = finite && std::isfinite(number);
  for (const double number : state.velocity) finite = finite && std::isfinite(number);
  for (const BodyState& body : state.bodies) {
    finite = finite && body.p_WBcm.allFinite() && body.q_WB.coeffs().allFinite() && body.v_WBcm.allFinite() &&
             body.w_WB.allFinite();
  }
  if (!finite) return "a non-finite number";
  for (const BodyState& body : state.bodies) {
    constexpr double kLengthTolerance = 1e-2;  // far above what single precision loses
    const double length = body.q_WB.norm();
    if (std::abs(length - 1) > kLengthTolerance) return fmt::format("an orientation of length {:.3g}", length);
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
