#include "model/joint_rows.h"

#include <numbers>

#include <gtest/gtest.h>

#include "model/kinematics.h"

namespace assay {
namespace {

constexpr double kTimestep = 1e-3, kInertia = 0.02;

// Balanced wheels on hinges to the world: the joint-space inertia is the constant kInertia on the diagonal.
Model wheels(int count) {
  Model model;
  for (int i = 0; i < count; ++i) {
    Body& body = model.bodies.emplace_back();
    body.joint = i;
    body.mass = 1;
    body.I_BBcm_B = kInertia * Mat3::Identity();
    Joint& joint = model.joints.emplace_back();
    joint.body = i;
  }
  model.initial = reference_state(model);
  return model;
}

// Semi-implicit Euler of wheels whose inertia is `scale` times what the rows believe.
void step(const Model& model, JointRows& rows, const std::vector<double>& torques, State& state, double scale = 1) {
  std::vector<double> all = torques;
  rows.add(model, state, all);
  for (size_t j = 0; j < all.size(); ++j) {
    state.velocity[j] += all[j] / (scale * kInertia) * kTimestep;
    state.position[j] += state.velocity[j] * kTimestep;
  }
  bodies_from_joints(model, state);
}

TEST(JointRows, ACouplingGivesWayByItsLoad) {
  Model model = wheels(2);
  model.couplings = {{.name = "gears", .joint = 1, .terms = {{0, -2.0}}, .offset = 0.1}};
  State state = model.initial;
  state.position[1] = 0.1;
  bodies_from_joints(model, state);
  JointRows rows(model, kTimestep, {});
  ASSERT_TRUE(rows.any());
  for (int i = 0; i < 400; ++i) step(model, rows, {0.3, 0.3}, state);
  // free, the wheels would part by (1 + 2) times 0.3 / I
  const double load = 3 * 0.3 / kInertia;
  EXPECT_NEAR(state.position[1] - 0.1 + 2 * state.position[0], 5 * kTimestep * kTimestep * load, 1e-9);
  // together: torque 0.3 (1 - 2) on I (1 + 4)
  EXPECT_NEAR(state.velocity[0], -0.3 / (5 * kInertia) * 0.4, 1e-3);
}

TEST(JointRows, AreStableForInertiasBetweenHalfAndManyTimesTheirOwn) {
  Model model = wheels(3);
  model.couplings = {{.name = "a", .joint = 1, .terms = {{0, 1.0}}, .offset = 0},
                     {.name = "b", .joint = 2, .terms = {{0, 1.0}}, .offset = 0}};
  for (const double scale : {0.5, 1.0, 10.0, 100.0}) {
    State state = model.initial;
    state.velocity = {1, -1, 0.5};
    JointRows rows(model, kTimestep, {});
    for (int i = 0; i < 4000; ++i) step(model, rows, {0, 0, 0}, state, scale);
    EXPECT_NEAR(state.velocity[1], state.velocity[0], 1e-6) << scale;
    EXPECT_NEAR(state.position[2], state.position[0], 1e-6) << scale;
    EXPECT_NEAR(state.velocity[0], 0.5 / 3, 1e-6) << "momentum " << scale;
  }
}

TEST(JointRows, LimitsPushAndNeverPull) {
  Model model = wheels(2);
  model.tendons = {{.name = "tendon", .terms = {{0, 1.0}, {1, 1.0}}, .limited = true, .lower = -1, .upper = 1}};
  model.joints[1].limited = true;
  model.joints[1].lower = -7;
  model.joints[1].upper = 0.2;
  EXPECT_TRUE(is_wide(model.joints[1]));
  EXPECT_FALSE(without_wide_ranges(model).joints[1].limited);
  JointRows rows(model, kTimestep, {});
  State state = model.initial;
  std::vector<double> torques(2, 0.0);
  state.velocity = {-5, 0};
  rows.add(model, state, torques);
  EXPECT_EQ(torques, std::vector<double>({0, 0})) << "far from every limit";
  state.position = {2, 0.19};  // beyond the tendon's, which comes back fast enough by itself
  state.velocity = {-1000, 0};
  rows.add(model, state, torques);
  EXPECT_EQ(torques, std::vector<double>({0, 0})) << "on its way back";
  // the tendon's push on the second wheel would pull it off its own limit
  state.position = {2, 0.3};
  state.velocity = {0, 0};
  rows.add(model, state, torques);
  EXPECT_LT(torques[0], 0);
  EXPECT_LT(torques[1], 0);
  for (int i = 0; i < 500; ++i) step(model, rows, {0.1, 0.1}, state);
  EXPECT_NEAR(state.position[0] + state.position[1], 1, 1e-3);
  EXPECT_LT(state.position[1], 0.201);
}

TEST(JointRows, PartsAreChosen) {
  Model model = wheels(1);
  model.joints[0].limited = true;
  model.joints[0].upper = 2 * std::numbers::pi;
  EXPECT_TRUE(has_joint_rows(model));
  EXPECT_TRUE(JointRows(model, kTimestep, {}).any());
  EXPECT_FALSE(JointRows(model, kTimestep, {.wide_ranges = false}).any());
  model.joints[0].upper = 6;
  EXPECT_FALSE(has_joint_rows(model));
}

}  // namespace
}  // namespace assay
