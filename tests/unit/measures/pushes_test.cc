#include "measures/pushes.h"

#include <cmath>

#include <gtest/gtest.h>

#include "model/kinematics.h"

namespace assay {
namespace {

// A free trunk with a leg on a hinge, beside a door on a hinge of its own.
Model robot() {
  Model model;
  model.bodies.push_back({.name = "trunk", .X_PB = {{0, 0, 1}, Quat::Identity()}, .mass = 2});
  model.bodies.push_back({.name = "leg", .parent = 0, .joint = 0, .X_PB = {}, .mass = 1, .p_BBcm = {0, 0, -0.5}});
  model.bodies.push_back(
      {.name = "door", .joint = 1, .X_PB = {{5, 0, 0}, Quat::Identity()}, .mass = 1, .p_BBcm = {1, 0, 0}});
  model.joints.push_back({.name = "hip", .body = 1, .axis_B = Vec3::UnitY()});
  model.joints.push_back({.name = "frame", .body = 2});
  model.initial = reference_state(model);
  return model;
}

TEST(Pushes, OneInEachIntervalTheSameForTheSameSeedAndState) {
  const Pushes pushes = {0.5, 2, "", 7};
  const auto drawn = draw_pushes(pushes, 3, 20, 0.02);
  ASSERT_GE(drawn.size(), 8U);
  ASSERT_LE(drawn.size(), 10U);
  for (size_t i = 0; i < drawn.size(); ++i) {
    EXPECT_NEAR(drawn[i].velocity.norm(), 0.5, 1e-12);
    EXPECT_EQ(drawn[i].velocity.z(), 0);
    EXPECT_EQ(std::abs(drawn[i].rate), 0.5);
    EXPECT_NEAR(drawn[i].time_s / 0.02, std::round(drawn[i].time_s / 0.02), 1e-9);
    EXPECT_GT(drawn[i].time_s, 0);
    EXPECT_LT(drawn[i].time_s, 20);
    EXPECT_GT(drawn[i].time_s, i > 0 ? drawn[i - 1].time_s : 0);
  }
  const auto again = draw_pushes(pushes, 3, 20, 0.02), other = draw_pushes(pushes, 4, 20, 0.02);
  ASSERT_EQ(again.size(), drawn.size());
  EXPECT_EQ(again.front().time_s, drawn.front().time_s);
  EXPECT_EQ(again.front().velocity, drawn.front().velocity);
  EXPECT_NE(other.front().velocity, drawn.front().velocity);
  // a longer run begins with the same pushes
  EXPECT_EQ(draw_pushes(pushes, 3, 40, 0.02).front().velocity, drawn.front().velocity);
  EXPECT_TRUE(draw_pushes({}, 3, 20, 0.02).empty());
}

TEST(Pushes, TheBaseTakesWhatItCarriesWithIt) {
  const Model model = robot();
  const Push push = {1, {0.3, 0.4, 0}, 0.5};
  const State after = pushed(model, model.initial, {0.5, 3, "", 1}, push);
  EXPECT_EQ(after.bodies[0].v_WBcm, push.velocity);
  EXPECT_EQ(after.bodies[1].v_WBcm, push.velocity);
  EXPECT_EQ(after.bodies[2].v_WBcm, Vec3::Zero());
  EXPECT_EQ(after.velocity, model.initial.velocity);
  EXPECT_EQ(after.bodies[0].p_WBcm, model.initial.bodies[0].p_WBcm);
}

TEST(Pushes, AJointGainsItsRateAndMovesWhatItCarries) {
  const Model model = robot();
  const State after = pushed(model, model.initial, {2, 3, "frame", 1}, {1, Vec3::Zero(), -2});
  EXPECT_EQ(after.velocity[1], -2);
  EXPECT_EQ(after.velocity[0], 0);
  EXPECT_NEAR((after.bodies[2].w_WB - Vec3(0, 0, -2)).norm(), 0, 1e-12);
  EXPECT_NEAR((after.bodies[2].v_WBcm - Vec3(0, -2, 0)).norm(), 0, 1e-12);
  EXPECT_EQ(after.bodies[0].v_WBcm, Vec3::Zero());
}

TEST(Pushes, WhatCannotBePushed) {
  Model model = robot();
  EXPECT_EQ(push_obstacle(model, {0.5, 3, "", 1}), "");
  EXPECT_NE(push_obstacle(model, {0.5, 3, "hop", 1}).find("'hip'"), std::string::npos);
  model.couplings.push_back({.name = "mimic", .joint = 0, .terms = {{1, 1}}});
  EXPECT_NE(push_obstacle(model, {0.5, 3, "hip", 1}).find("follow"), std::string::npos);
  Model fixed;
  fixed.bodies.push_back({.name = "cart", .joint = 0, .X_PB = {}, .mass = 1});
  fixed.joints.push_back({.name = "slider", .type = JointType::kSlide});
  EXPECT_NE(push_obstacle(fixed, {0.5, 3, "", 1}).find("no free body"), std::string::npos);
  EXPECT_EQ(push_obstacle(fixed, {0.5, 3, "slider", 1}), "");
}

}  // namespace
}  // namespace assay
