#include "measures/transfer.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "model/kinematics.h"

namespace assay {
namespace {

// A ball of radius 0.1 m over a plane, with its centre of mass 0.02 m in front of its frame, and a hinge on it.
Model ball() {
  Model model;
  model.bodies.push_back({.name = "ball", .X_PB = {{0, 0, 0.1}, Quat::Identity()}, .mass = 1, .p_BBcm = {0.02, 0, 0}});
  model.bodies.push_back({.name = "flag", .parent = 0, .joint = 0, .X_PB = {}, .mass = 0.1});
  model.joints.push_back({.name = "hinge", .body = 1});
  Shape plane;
  plane.type = ShapeType::kPlane;
  Shape sphere;
  sphere.body = 0;
  sphere.radius = 0.1;
  model.shapes = {plane, sphere};
  model.contacts = {{0, 1}};
  model.initial = reference_state(model);
  return model;
}

// `count` samples 0.1 s apart, the first of which is the model's own; `change` gets each with its time.
template <typename Change>
std::vector<State> run(const Model& model, int count, const Change& change) {
  std::vector<State> states(static_cast<size_t>(count), model.initial);
  for (size_t i = 0; i < states.size(); ++i) {
    states[i].time = 0.1 * static_cast<double>(i);
    change(states[i], states[i].time);
  }
  return states;
}

TransferTask task() {
  TransferTask task;
  task.base = 0;
  return task;
}

TEST(Transfer, FallsByHeightOfTheBasesFrame) {
  const Model model = ball();
  const auto states = run(model, 11, [](State& state, double t) { state.bodies[0].p_WBcm.z() = 0.1 - 0.1 * t; });
  TransferTask low = task();
  low.fallen_height = 0.055;
  const Transfer found = transfer(model, states, low, false);
  EXPECT_NEAR(found.fell_at.value_or(-1), 0.5, 1e-12);
  EXPECT_NEAR(found.up_s, 0.5, 1e-12);
  EXPECT_FALSE(transfer(model, states, task(), false).fell_at);
}

TEST(Transfer, FallsByTiltFromTheStartWhateverTheHeading) {
  const Model model = ball();
  TransferTask tilted = task();
  tilted.fallen_tilt = 0.35;
  const auto turn = [&](const Vec3& axis) {
    return run(model, 11, [&](State& state, double t) { state.bodies[0].q_WB = Quat(Eigen::AngleAxisd(t, axis)); });
  };
  EXPECT_NEAR(transfer(model, turn(Vec3::UnitY()), tilted, false).fell_at.value_or(-1), 0.4, 1e-12);
  EXPECT_FALSE(transfer(model, turn(Vec3::UnitZ()), tilted, false).fell_at);
}

TEST(Transfer, FallsByAJointOutsideItsRange) {
  const Model model = ball();
  TransferTask outside;
  outside.joints = {{0, -0.25, 1}};
  const auto states = run(model, 11, [](State& state, double t) { state.position[0] = -t; });
  EXPECT_NEAR(transfer(model, states, outside, false).fell_at.value_or(-1), 0.3, 1e-12);
}

TEST(Transfer, ARunThatFailsHasFallenAtItsEnd) {
  const Model model = ball();
  const auto states = run(model, 5, [](State& /*state*/, double /*t*/) {});
  EXPECT_NEAR(transfer(model, states, task(), true).fell_at.value_or(-1), 0.4, 1e-12);
  EXPECT_NEAR(transfer(model, states, task(), false).up_s, 0.4, 1e-12);
}

TEST(Transfer, VelocityErrorsAreInTheBasesHeading) {
  const Model model = ball();
  TransferTask walks = task();
  walks.command = {1, 0, 0.5};
  // It walks along the world's y, where its x axis points, and turns: the frame's origin moves 0.02 m x 2/s to its
  // right of the centre of mass.
  const auto states = run(model, 3, [](State& state, double /*t*/) {
    state.bodies[0].q_WB = Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitZ()));
    state.bodies[0].v_WBcm = {0, 1.03, 0};
    state.bodies[0].w_WB = {0, 0, 2};
  });
  const Transfer found = transfer(model, states, walks, false);
  EXPECT_NEAR(found.velocity_error.value_or(-1), std::hypot(0.03, 0.04), 1e-12);
  EXPECT_NEAR(found.turning_error.value_or(-1), 1.5, 1e-12);
  EXPECT_FALSE(transfer(model, states, task(), false).velocity_error);
}

TEST(Transfer, SlipIsTheSpeedOfTheLowestPointOnTheGround) {
  const Model model = ball();
  const auto slip = [&](const Vec3& velocity, const Vec3& spin, double height) {
    const auto states = run(model, 3, [&](State& state, double /*t*/) {
      BodyState& body = state.bodies[0];
      body.p_WBcm = {0.02, 0, height};
      body.w_WB = spin;
      // of the ball's centre, which is the frame's origin
      body.v_WBcm = velocity + spin.cross(Vec3(0.02, 0, 0));
    });
    return transfer(model, states, task(), false).foot_slip;
  };
  EXPECT_NEAR(slip({0.3, 0.4, 0}, Vec3::Zero(), 0.1).value_or(-1), 0.5, 1e-12);
  // rolling: 1 m/s with 10 rad/s at 0.1 m
  EXPECT_NEAR(slip({1, 0, 0}, {0, 10, 0}, 0.1).value_or(-1), 0, 1e-12);
  EXPECT_NEAR(slip({1, 0, 0}, {0, -10, 0}, 0.1).value_or(-1), 2, 1e-12);
  EXPECT_FALSE(slip({1, 0, 0}, Vec3::Zero(), 0.103));
}

// A log of the world along x, its axis in the plane's height, in place of the plane: touched by balls from any side.
TEST(Transfer, SlipOnALogIsAlongItsSurface) {
  Model model = ball();
  Shape& log = model.shapes[0];
  log.type = ShapeType::kCapsule;
  log.radius = 0.3;
  log.half_length = 1;
  log.X_BS.q = Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitY()));
  const Vec3 normal(0, 0.6, 0.8);
  const auto slip = [&](const Vec3& velocity, const Vec3& spin, double gap, double along) {
    const auto states = run(model, 3, [&](State& state, double /*t*/) {
      BodyState& body = state.bodies[0];
      body.p_WBcm = Vec3(along, 0, 0) + (0.4 + gap) * normal + Vec3(0.02, 0, 0);
      body.w_WB = spin;
      body.v_WBcm = velocity + spin.cross(Vec3(0.02, 0, 0));
    });
    return transfer(model, states, task(), false).foot_slip;
  };
  EXPECT_NEAR(slip({0.5, 0, 0}, Vec3::Zero(), 0.001, 0).value_or(-1), 0.5, 1e-12);
  EXPECT_NEAR(slip(2 * normal, Vec3::Zero(), 0, 0.9).value_or(-1), 0, 1e-12);  // away from it, not along it
  // rolling across it: 1 m/s with 10 rad/s at 0.1 m
  EXPECT_NEAR(slip({0, -0.8, 0.6}, {10, 0, 0}, 0, 0).value_or(-1), 0, 1e-12);
  EXPECT_FALSE(slip({1, 0, 0}, Vec3::Zero(), 0.003, 0));
  EXPECT_FALSE(slip({1, 0, 0}, Vec3::Zero(), 0, 1.1));  // beyond the log's cap, whose centre is at 1 m
}

TEST(Transfer, WhatComesAfterTheFallDoesNotCount) {
  const Model model = ball();
  TransferTask low = task();
  low.command = {0, 0, 0};
  low.fallen_height = 0.055;
  const auto states = run(model, 11, [](State& state, double t) {
    state.bodies[0].p_WBcm.z() = t < 0.45 ? 0.1 : 0;
    state.bodies[0].v_WBcm.x() = t < 0.45 ? 1 : 100;
  });
  EXPECT_NEAR(transfer(model, states, low, false).velocity_error.value_or(-1), 1, 1e-12);
}

// The same ball with a flag whose centre of mass is 0.5 m above its hinge.
Model flagged() {
  Model model = ball();
  model.bodies[1].p_BBcm = {0, 0, 0.5};
  model.initial = reference_state(model);
  return model;
}

// What no run gives.
const FirstParting kNone = {.time_s = -1, .body = -2, .joint = -2, .contact = false};

TEST(FirstParting, NamesTheJointThatMovesABodyApart) {
  const Model model = flagged();
  const auto stays = run(model, 11, [](State& /*state*/, double /*t*/) {});
  const auto swings = run(model, 11, [](State& state, double t) {
    if (t < 0.45) return;
    state.position[0] = 0.01;
    state.bodies[1].p_WBcm.x() += 0.005;
  });
  const FirstParting found = first_parting(model, swings, stays).value_or(kNone);
  EXPECT_EQ(found.body, 1);
  EXPECT_EQ(found.joint, 0);
  EXPECT_NEAR(found.time_s, 0.5, 1e-12);
  EXPECT_FALSE(found.contact);
  EXPECT_FALSE(first_parting(model, stays, stays));
}

TEST(FirstParting, AFreeBaseMovesByItself) {
  const Model model = flagged();
  const auto stays = run(model, 11, [](State& /*state*/, double /*t*/) {});
  const auto slides = run(model, 11, [](State& state, double t) {
    for (BodyState& body : state.bodies) body.p_WBcm.x() += 0.01 * t;
    state.position[0] = 1e-4 * t;  // 0.05 mm at most
  });
  const FirstParting found = first_parting(model, slides, stays).value_or(kNone);
  EXPECT_EQ(found.body, 0);
  EXPECT_EQ(found.joint, -1);
  EXPECT_GT(found.time_s, 0.05);
  EXPECT_LE(found.time_s, 0.2);
}

TEST(FirstParting, AContactOfOneRunOnly) {
  const Model model = flagged();
  const auto stays = run(model, 11, [](State& /*state*/, double /*t*/) {});
  const auto hops = run(model, 11, [](State& state, double t) {
    if (t < 0.45) return;
    for (BodyState& body : state.bodies) body.p_WBcm.z() += 0.01;
  });
  EXPECT_TRUE(first_parting(model, hops, stays).value_or(kNone).contact);
  EXPECT_TRUE(first_parting(model, stays, hops).value_or(kNone).contact);
}

}  // namespace
}  // namespace assay
