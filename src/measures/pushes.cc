#include "measures/pushes.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <random>

#include <fmt/format.h>

#include "base/text.h"
#include "model/joint.h"
#include "model/kinematics.h"

namespace assay {
namespace {

std::vector<int> free_bodies(const Model& model) {
  std::vector<int> found;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    if (model.bodies[i].is_free()) found.push_back(static_cast<int>(i));
  }
  return found;
}

int joint_index(const Model& model, const std::string& name) {
  const auto found = std::ranges::find(model.joints, name, &Joint::name);
  return found == model.joints.end() ? -1 : static_cast<int>(found - model.joints.begin());
}

State with_rate(const Model& model, State state, size_t joint, double rate) {
  const std::vector<BallCoordinates> balls = ball_coordinates(model, state);
  state.velocity[joint] += rate;
  bodies_from_joints(model, balls, state);
  return state;
}

}  // namespace

std::string push_obstacle(const Model& model, const Pushes& pushes) {
  if (pushes.joint.empty()) {
    const size_t count = free_bodies(model).size();
    if (count == 1) return "";
    return count == 0 ? "has no free body to push: name a joint"
                      : fmt::format("has {} free bodies: name a joint to push", count);
  }
  const int joint = joint_index(model, pushes.joint);
  if (joint < 0) {
    std::vector<std::string> names;
    names.reserve(model.joints.size());
    for (const Joint& each : model.joints) names.push_back(each.name);
    return fmt::format("has no hinge or slide '{}' to push{}", pushes.joint, did_you_mean(pushes.joint, names));
  }
  const bool follows = std::ranges::any_of(model.couplings, [&](const Coupling& each) { return each.joint == joint; });
  return follows ? fmt::format("has the joint '{}' follow others: push one of those", pushes.joint) : "";
}

std::vector<Push> draw_pushes(const Pushes& pushes, int state, double duration_s, double sample_s) {
  std::vector<Push> drawn;
  if (!pushes.any()) return drawn;
  // the same on every machine, unlike the standard's distributions
  std::mt19937_64 random(pushes.seed + 0xD1B54A32D192ED03U * static_cast<std::uint64_t>(state + 1));
  const auto uniform = [&random] { return static_cast<double>(random() >> 11U) * 0x1p-53; };
  const auto intervals = static_cast<int>(std::ceil(duration_s / pushes.every_s));
  for (int i = 0; i < intervals; ++i) {
    const double at = pushes.every_s * (i + uniform()), angle = 2 * std::numbers::pi * uniform();
    const double time = sample_s * std::ceil(at / sample_s);
    if (time < 0.5 * sample_s || time > duration_s - 0.5 * sample_s) continue;
    if (!drawn.empty() && time < drawn.back().time_s + 0.5 * sample_s) continue;
    drawn.push_back({time, pushes.velocity * Vec3(std::cos(angle), std::sin(angle), 0),
                     pushes.velocity * (angle < std::numbers::pi ? 1 : -1)});
  }
  return drawn;
}

State pushed(const Model& model, const State& state, const Pushes& pushes, const Push& push) {
  assert(push_obstacle(model, pushes).empty());
  State after = state;
  if (pushes.joint.empty()) {
    std::vector<bool> carried(model.bodies.size(), false);
    for (size_t i = 0; i < model.bodies.size(); ++i) {  // parents come before their children
      const Body& body = model.bodies[i];
      carried[i] = body.is_free() || (body.parent != kWorld && carried[static_cast<size_t>(body.parent)]);
      if (carried[i]) after.bodies[i].v_WBcm += push.velocity;
    }
    return after;
  }
  // what the rate adds, to the bodies as the engine has them
  const auto joint = static_cast<size_t>(joint_index(model, pushes.joint));
  const State still = with_rate(model, state, joint, 0), faster = with_rate(model, state, joint, push.rate);
  after.velocity[joint] += push.rate;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    after.bodies[i].v_WBcm += faster.bodies[i].v_WBcm - still.bodies[i].v_WBcm;
    after.bodies[i].w_WB += faster.bodies[i].w_WB - still.bodies[i].w_WB;
  }
  return after;
}

}  // namespace assay
