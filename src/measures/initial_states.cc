#include "measures/initial_states.h"

#include <algorithm>
#include <cassert>
#include <random>
#include <vector>

#include "measures/violation.h"
#include "model/couplings.h"
#include "model/kinematics.h"

namespace assay {
namespace {

// Uniform draws, the same everywhere, unlike the standard's distributions.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  double within(double width) { return width * (2 * static_cast<double>(random_() >> 11U) * 0x1p-53 - 1); }
  Vec3 vector(double width) {
    const double x = within(width), y = within(width), z = within(width);
    return {x, y, z};
  }
  // About an axis that points anywhere.
  Quat turn(double width) {
    Vec3 axis = vector(1);
    while (axis.norm() > 1 || axis.norm() < 1e-3) axis = vector(1);
    return Quat(Eigen::AngleAxisd(within(width), axis.normalized()));
  }

 private:
  std::mt19937_64 random_;
};

// Moved from its start, but not across a limit; a start beyond a limit stays.
double moved(double start, double change, bool limited, double lower, double upper) {
  if (!limited) return start + change;
  return start < lower || start > upper ? start : std::clamp(start + change, lower, upper);
}

// Around `base`; `scale` is that of the widths of positions.
State drawn(const Model& model, const State& base, const Perturbation& around, double scale, Draw& draw) {
  State state = base;
  for (size_t j = 0; j < model.joints.size(); ++j) {
    const Joint& joint = model.joints[j];
    const double change = draw.within(scale * (joint.is_slide() ? around.slide_position : around.joint_position));
    state.position[j] = moved(state.position[j], change, joint.limited, joint.lower, joint.upper);
    state.velocity[j] += draw.within(joint.is_slide() ? around.slide_rate : around.joint_rate);
  }
  follow_leaders(model, state.position);
  velocities_follow_leaders(model, state.velocity);
  std::vector<BallCoordinates> balls;
  for (size_t b = 0; b < model.balls.size(); ++b) {
    const auto index = static_cast<int>(b);
    const Quat start = ball_rotation(model, base, index);
    const Quat turned = start * draw.turn(scale * around.joint_position);
    const BallJoint& ball = model.balls[b];
    const bool stays = ball.limited && rotation_vector(turned).norm() > ball.upper;
    balls.push_back({stays ? start : turned, Vec3(ball_velocity(model, base, index) + draw.vector(around.joint_rate))});
  }
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    if (!model.bodies[i].is_free()) continue;
    BodyState& body = state.bodies[i];
    body.p_WBcm += draw.vector(scale * around.position);
    body.q_WB = (draw.turn(scale * around.rotation) * body.q_WB).normalized();
    body.v_WBcm += draw.vector(around.velocity);
    body.w_WB += draw.vector(around.spin);
  }
  bodies_from_joints(model, balls, state);
  return state;
}

// States of one seed are independent of how many there are.
Draw draw_of(const InitialStates& states, int index) {
  return Draw(states.seed + 0x9E3779B97F4A7C15U * static_cast<std::uint64_t>(index));
}

}  // namespace

std::string perturbation_obstacle(const Model& model) {
  if (model.connects.empty() && model.welds.empty()) return "";
  return "has closed loops, which other positions of its joints would tear";
}

State initial_state(const Model& model, const InitialStates& states, int index) {
  assert(index >= 0);
  if (index == 0) return model.initial;
  constexpr double kNear = 1e-6;  // m: rounding of a keyframe's numbers
  constexpr int kAttempts = 8;    // with the same widths
  const Separations separations(model);
  const int pairs = static_cast<int>(model.contacts.size());
  std::vector<double> least;
  least.reserve(model.contacts.size());
  for (int i = 0; i < pairs; ++i) least.push_back(std::min(0.0, separations.of(i, model.initial)) - kNear);
  const auto overlaps = [&](const State& state) {
    for (int i = 0; i < pairs; ++i) {
      if (separations.of(i, state) < least[static_cast<size_t>(i)]) return true;
    }
    return false;
  };
  Draw draw = draw_of(states, index);
  double scale = 1;
  for (int attempt = 1;; ++attempt) {
    State state = drawn(model, model.initial, states.around, scale, draw);
    if (scale == 0 || !overlaps(state)) return state;
    if (attempt % kAttempts == 0) scale *= 0.5;
    if (scale < 1e-3) scale = 0;  // rates alone
  }
}

State with_other_rates(const Model& model, const State& base, const InitialStates& states, int index) {
  Draw draw = draw_of(states, index);
  return drawn(model, base, states.around, 0, draw);
}

}  // namespace assay
