// Damping, grasp, agreement, Pareto fronts and scaling compared with values computed by hand.
#include <cmath>
#include <numbers>
#include <optional>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "measures/agreement.h"
#include "measures/damping.h"
#include "measures/grasp.h"
#include "measures/mechanics.h"
#include "measures/plausible.h"
#include "measures/scaling.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// What has to be there.
Interval there(const std::optional<Interval>& found) {
  EXPECT_TRUE(found);
  return found.value_or(Interval{});
}

// `count` free bodies of 1 kg in a row along x, 1 m apart, without gravity.
Model free_bodies(int count) {
  Model model;
  model.gravity.setZero();
  for (int i = 0; i < count; ++i) {
    Body body;
    body.name = i == 0 ? "hand" : "object";
    body.X_PB.p = Vec3(i, 0, 0);
    body.mass = 1;
    model.bodies.push_back(body);
  }
  model.initial = reference_state(model);
  return model;
}

// ---- what is conserved under a control ----------------------------------------------------------------------------------

TEST(Driven, InnerTorquesLeaveMomentaAlone) {
  Model model = free_bodies(2);
  Joint hinge;
  hinge.body = 1;
  model.joints = {hinge};
  model.bodies[1].parent = 0;
  model.bodies[1].joint = 0;
  EXPECT_TRUE(conserved_quantities(model).energy);
  const Conserved driven = conserved_quantities(model, true);
  EXPECT_FALSE(driven.energy);
  EXPECT_TRUE(driven.linear_momentum);
  EXPECT_TRUE(driven.angular_momentum);
  // On a hinge to the world the control acts from outside.
  model.bodies.erase(model.bodies.begin());
  model.bodies[0].parent = kWorld;
  model.joints[0].body = 0;
  EXPECT_TRUE(conserved_quantities(model).angular_momentum_axis);
  EXPECT_FALSE(conserved_quantities(model, true).any());
}

TEST(Driven, WorkOfAControlIsToBeHad) {
  const Model model = free_bodies(1);
  State fast = model.initial;
  fast.bodies[0].v_WBcm = Vec3(3, 0, 0);  // 4.5 J
  EXPECT_THAT(Plausibility(model, model.initial, 1).impossibility(fast), HasSubstr("kinetic energy"));
  EXPECT_THAT(Plausibility(model, model.initial, 1, 2).impossibility(fast), IsEmpty());
  EXPECT_THAT(Plausibility(model, model.initial, 1, 1).impossibility(fast), HasSubstr("kinetic energy"));
}

TEST(Driven, LinearMomentumDrift) {
  const Model model = free_bodies(2);
  State state = model.initial;
  state.bodies[0].v_WBcm = Vec3(2, 0, 0);
  state.bodies[1].v_WBcm = Vec3(-2, 0, 0);
  std::vector<State> states(5, state);
  const Conserved conserved = conserved_quantities(model, true);
  for (const Drift::Quantity& quantity : drift(model, conserved, states).quantities) EXPECT_EQ(quantity.absolute, 0);
  states[3].bodies[1].v_WBcm = Vec3(-2, 0.3, 0.4);
  const Drift::Quantity momentum = drift(model, conserved, states).quantities.front();
  EXPECT_EQ(momentum.name, "linear_momentum");
  EXPECT_NEAR(momentum.absolute, 0.5, 1e-15);
  EXPECT_NEAR(momentum.relative.value_or(0), 0.5 / 4, 1e-15) << "of what moves, although it cancels";
}

// ---- hidden damping -------------------------------------------------------------------------------------------------------

std::vector<double> times(int count, double step) {
  std::vector<double> found(static_cast<size_t>(count));
  for (size_t i = 0; i < found.size(); ++i) found[i] = step * static_cast<double>(i);
  return found;
}

TEST(Damping, OfAnExactDecayIsItsRate) {
  for (const double rate : {0.0, 0.04, 1e-9, -0.002}) {
    const std::vector<double> time = times(200, 0.05);
    std::vector<double> energy;
    energy.reserve(time.size());
    for (const double t : time) energy.push_back(7 * std::exp(-2 * rate * t));
    const Interval found = there(damping_rate(time, energy, 1));
    EXPECT_NEAR(found.value, rate, 1e-15);
    EXPECT_NEAR(found.low, rate, 1e-14);
    EXPECT_NEAR(found.high, rate, 1e-14);
  }
}

TEST(Damping, AnOscillationWidensTheIntervalAroundTheTruth) {
  const std::vector<double> time = times(400, 0.025);
  std::vector<double> energy;
  energy.reserve(time.size());
  for (const double t : time) energy.push_back(3 * std::exp(-2 * 0.01 * t) * (1 + 0.02 * std::sin(9 * t)));
  const Interval found = there(damping_rate(time, energy, 1));
  EXPECT_LT(found.low, 0.01);
  EXPECT_GT(found.high, 0.01);
  EXPECT_LT(found.high - found.low, 0.005);
  EXPECT_GT(found.low, 0) << "it is not taken for none";
}

TEST(Damping, NeedsEnergiesAndTimes) {
  const std::vector<double> time = times(20, 0.1);
  std::vector<double> energy(20, 1);
  EXPECT_TRUE(damping_rate(time, energy, 1));
  energy[5] = 0;
  EXPECT_FALSE(damping_rate(time, energy, 1)) << "at rest";
  EXPECT_FALSE(damping_rate(std::vector<double>(20, 1.0), std::vector<double>(20, 1.0), 1));
  EXPECT_FALSE(damping_rate(std::vector{0.0, 1.0}, std::vector{1.0, 1.0}, 1)) << "too few";
}

// ---- grasp ------------------------------------------------------------------------------------------------------------------

TEST(Grasp, AnObjectThatMovesWithTheHandDoesNotSlip) {
  const Model model = free_bodies(2);
  const auto grasp = [](const std::vector<State>& seen, const GraspBodies& bodies) {
    Grasp result;
    for (const State& state : seen) add_to_grasp(result, seen.front(), state, bodies);
    return result;
  };
  std::vector<State> states;
  for (int i = 0; i < 20; ++i) {
    State state = model.initial;
    state.time = 0.1 * i;
    const Quat turn(Eigen::AngleAxisd(0.4 * i, Vec3(1, 2, 2) / 3));
    state.bodies[0].q_WB = turn;
    state.bodies[0].p_WBcm = Vec3(0.3 * i, 0, 1);
    state.bodies[1].p_WBcm = state.bodies[0].p_WBcm + turn * Vec3(0, 0.1, 0.05);
    states.push_back(state);
  }
  Grasp held = grasp(states, {1, 0, 0.05});
  EXPECT_NEAR(held.slip, 0, 1e-14);
  EXPECT_TRUE(held.held());
  // Within the limit it still lies in the hand; beyond it has been dropped, though it may come back.
  states[7].bodies[1].p_WBcm += Vec3(0, 0, 0.04);
  held = grasp(states, {1, 0, 0.05});
  EXPECT_NEAR(held.slip, 0.04, 1e-14);
  EXPECT_TRUE(held.held());
  states[9].bodies[1].p_WBcm += Vec3(0.3, 0, 0.4);
  states[12].bodies[1].p_WBcm += Vec3(0, 2, 0);
  held = grasp(states, {1, 0, 0.05});
  EXPECT_NEAR(held.slip, 2, 1e-14);
  EXPECT_FALSE(held.held());
  EXPECT_DOUBLE_EQ(held.dropped_at.value_or(-1), 0.9);
}

TEST(Grasp, LargestTimestepAndHolesInTheRange) {
  EXPECT_FALSE(largest_held({}).any);
  EXPECT_FALSE(largest_held({{1, false}, {2, false}}).any);
  const LargestHeld all = largest_held({{1, true}, {2, true}, {4, false}});
  EXPECT_EQ(all.any, 2);
  EXPECT_EQ(all.without_hole, 2);
  const LargestHeld holed = largest_held({{1, true}, {2, false}, {4, true}, {8, false}});
  EXPECT_EQ(holed.any, 4);
  EXPECT_EQ(holed.without_hole, 1);
  const LargestHeld late = largest_held({{1, false}, {2, true}});
  EXPECT_EQ(late.any, 2);
  EXPECT_FALSE(late.without_hole);
}

// ---- agreement --------------------------------------------------------------------------------------------------------------

TEST(Agreement, EqualRunsNeverPart) {
  const Model model = free_bodies(3);
  const std::vector<State> states(10, model.initial);
  const std::vector<double> apart = distances(states, states);
  EXPECT_EQ(apart, std::vector<double>(10, 0.0));
  EXPECT_FALSE(parting_time(times(10, 0.1), apart));
}

TEST(Agreement, DistanceIsTheMeanOverBodiesAndTheShorterRunCounts) {
  const Model model = free_bodies(2);
  std::vector<State> a(4, model.initial), b(3, model.initial);
  b[1].bodies[0].p_WBcm += Vec3(0, 3, 4);
  b[2].bodies[1].p_WBcm += Vec3(1, 0, 0);
  EXPECT_THAT(distances(a, b), ElementsAre(0, 2.5, 0.5));
}

// Errors of chaotic motions grow by the same factor in equal times.
TEST(Agreement, PartingTimeOfExponentialGrowth) {
  const std::vector<double> time = times(50, 0.1);
  std::vector<double> apart;
  apart.reserve(time.size());
  for (const double t : time) apart.push_back(1e-9 * std::exp(4 * t));
  EXPECT_NEAR(parting_time(time, apart, 1e-3).value_or(0), std::log(1e6) / 4, 1e-12);
  EXPECT_FALSE(parting_time(time, apart, 1e3));
  EXPECT_EQ(parting_time(time, apart, 1e-10), 0) << "from the start";
  EXPECT_DOUBLE_EQ(parting_time({5.0, 5.5, 6.0}, {0, 0, 1}, 1e-3).value_or(0), 1.0) << "counted from the start";
}

// ---- scaling ----------------------------------------------------------------------------------------------------------------

TEST(Scaling, ExponentOfAPowerLaw) {
  for (const double exponent : {1.0, 2.0, 2.7}) {
    std::vector<TimeAtSize> points;
    for (int n = 25; n <= 250; n += 25) points.push_back({static_cast<double>(n), {3e-4 * std::pow(n, exponent)}});
    const Interval found = there(scaling_exponent(points, 1));
    EXPECT_NEAR(found.value, exponent, 1e-12);
    EXPECT_NEAR(found.low, exponent, 1e-10);
    EXPECT_NEAR(found.high, exponent, 1e-10);
  }
}

TEST(Scaling, NoiseWidensTheIntervalAroundTheTruth) {
  std::mt19937_64 random(3);  // NOLINT(bugprone-random-generator-seed): the same test each time
  std::normal_distribution<double> noise(0, 0.1);
  std::vector<TimeAtSize> points;
  for (int n = 25; n <= 250; n += 25) {
    TimeAtSize at{static_cast<double>(n), {}};
    for (int run = 0; run < 5; ++run) at.seconds.push_back(1e-3 * n * n * std::exp(noise(random)));
    points.push_back(at);
  }
  const Interval found = there(scaling_exponent(points, 1));
  EXPECT_LT(found.low, 2);
  EXPECT_GT(found.high, 2);
  EXPECT_LT(found.high - found.low, 0.5);
  EXPECT_GT(found.high - found.low, 0.02);
}

TEST(Scaling, NeedsThreeSizesAndPositiveTimes) {
  EXPECT_FALSE(scaling_exponent({{10, {1}}, {20, {2}}}, 1));
  EXPECT_FALSE(scaling_exponent({{10, {1}}, {20, {2}}, {30, {0}}}, 1));
  EXPECT_FALSE(scaling_exponent({{10, {1}}, {20, {}}, {30, {1}}}, 1));
  EXPECT_FALSE(scaling_exponent({{10, {1}}, {10, {2}}, {10, {3}}}, 1));
}

}  // namespace
}  // namespace assay
