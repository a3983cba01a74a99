// Statistics, mechanics, errors and plausibility compared with values computed by hand.
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "measures/accuracy.h"
#include "measures/mechanics.h"
#include "measures/plausible.h"
#include "measures/statistics.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// ---- statistics -----------------------------------------------------------------------------------------------------

// For white noise blocks are as good as samples, and the interval covers the noise's root mean square. A slowly
// changing series has fewer independent samples, so its interval is wider.
TEST(Statistics, IntervalOfARootMeanSquareKnowsThatNeighboursAreAlike) {
  std::mt19937_64 random(7);  // NOLINT(bugprone-random-generator-seed): the same test each time
  const auto uniform = [&] { return static_cast<double>(random() >> 11) / 9007199254740992.0; };
  const double truth = std::sqrt(1.0 / 3);
  int covered = 0;
  double width_noise = 0, width_slow = 0;
  constexpr int kTrials = 100;
  constexpr size_t kCount = 400, kHold = 10;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<double> noise(kCount), slow(kCount);
    for (double& each : noise) each = uniform();
    for (size_t i = 0; i < kCount; ++i) slow[i] = noise[i - i % kHold];
    const auto seed = static_cast<std::uint64_t>(trial);
    const Interval of_noise = bootstrap_rms_of_series(noise, seed, 400);
    const Interval of_slow = bootstrap_rms_of_series(slow, seed, 400);
    if (of_noise.low <= truth && truth <= of_noise.high) ++covered;
    width_noise += of_noise.high - of_noise.low;
    width_slow += of_slow.high - of_slow.low;
  }
  EXPECT_GE(covered, 85) << "of 100 intervals of 95 %";
  EXPECT_LE(covered, 100);
  EXPECT_GT(width_slow / width_noise, 2) << "a tenth of the independent samples: about the root of ten";
  EXPECT_LT(width_slow / width_noise, 4);
  const std::vector<double> same(100, -2.0);
  const Interval of_same = bootstrap_rms_of_series(same, 1);
  EXPECT_DOUBLE_EQ(of_same.value, 2);
  EXPECT_NEAR(of_same.low, 2, 1e-12);
  EXPECT_NEAR(of_same.high, 2, 1e-12);
  EXPECT_TRUE(std::isnan(bootstrap_rms_of_series(std::vector<double>(7, 1.0), 1).low)) << "too few";
}

TEST(Statistics, MedianAndQuantilesOfSmallSamples) {
  EXPECT_EQ(median(std::vector{3.0}), 3);
  EXPECT_EQ(median(std::vector{3.0, 1.0, 2.0}), 2);
  EXPECT_EQ(median(std::vector{4.0, 1.0, 2.0, 3.0}), 2.5);
  EXPECT_EQ(mean(std::vector{1.0, 2.0, 6.0}), 3);
  EXPECT_EQ(quantile(std::vector{1.0, 2.0, 3.0, 4.0, 5.0}, 0.25), 2);
  EXPECT_EQ(quantile(std::vector{1.0, 2.0}, 0.75), 1.75);
}

TEST(Statistics, BootstrapIsReproducibleAndSharpensWithSamples) {
  std::mt19937_64 random(7);  // NOLINT(bugprone-random-generator-seed): the same test each time
  std::normal_distribution<double> normal(10, 1);
  std::vector<double> few(10), many(1000);
  for (double& x : few) x = normal(random);
  for (double& x : many) x = normal(random);
  const Interval a = bootstrap_median(many, 3), b = bootstrap_median(many, 3), c = bootstrap_median(many, 4);
  EXPECT_EQ(a.low, b.low);
  EXPECT_EQ(a.high, b.high);
  EXPECT_TRUE(a.low != c.low || a.high != c.high);
  EXPECT_LT(a.low, a.value);
  EXPECT_GT(a.high, a.value);
  const Interval wide = bootstrap_median(few, 3);
  EXPECT_GT(wide.high - wide.low, 3 * (a.high - a.low));
}

// A 95 % interval covers the true value about 95 times in 100.
TEST(Statistics, BootstrapIntervalCoversTheTruth) {
  std::mt19937_64 random(11);  // NOLINT(bugprone-random-generator-seed): the same test each time
  std::normal_distribution<double> normal(5, 2);
  int covered = 0;
  constexpr int kTrials = 300;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<double> samples(40);
    for (double& x : samples) x = normal(random);
    const Interval interval = bootstrap_mean(samples, static_cast<std::uint64_t>(trial), 400);
    if (interval.low <= 5 && 5 <= interval.high) ++covered;
  }
  EXPECT_GT(covered, kTrials * 0.88);
  EXPECT_LT(covered, kTrials * 0.99);
}

TEST(Statistics, OneSampleHasNoWidth) {
  const Interval interval = bootstrap_median(std::vector{2.5}, 1);
  EXPECT_EQ(interval.low, 2.5);
  EXPECT_EQ(interval.high, 2.5);
}

TEST(Statistics, SpreadAndOutliers) {
  const std::vector<double> steady = {10, 10.1, 9.9, 10, 10.05, 9.95, 30, 10};
  EXPECT_NEAR(relative_spread(steady), 0.01, 0.01);
  EXPECT_THAT(outliers(steady), ElementsAre(6));
  EXPECT_THAT(outliers(std::vector{1.0, 1.0, 1.0}), IsEmpty());
}

// ---- models for the mechanics ---------------------------------------------------------------------------------------

// One free body with a diagonal inertia.
Model free_body() {
  Model model;
  model.gravity = Vec3(0, 0, -10);
  Body body;
  body.name = "body";
  body.mass = 2;
  body.I_BBcm_B = Vec3(1, 2, 3).asDiagonal();
  model.bodies = {body};
  model.initial = reference_state(model);
  return model;
}

// Two links of 1 m and 1 kg on hinges about y; the first is pinned to (1, 0, 2).
Model double_pendulum() {
  Model model;
  for (int i = 0; i < 2; ++i) {
    Body body;
    body.name = i == 0 ? "upper" : "lower";
    body.parent = i - 1;
    body.joint = i;
    body.X_PB.p = i == 0 ? Vec3(1, 0, 2) : Vec3(1, 0.2, 0);
    body.mass = 1;
    body.p_BBcm = Vec3(0.5, 0, 0);
    body.I_BBcm_B = Vec3(0.01, 0.1, 0.1).asDiagonal();
    model.bodies.push_back(body);
    Joint hinge;
    hinge.name = i == 0 ? "shoulder" : "elbow";
    hinge.body = i;
    hinge.axis_B = Vec3::UnitY();
    model.joints.push_back(hinge);
  }
  model.initial = reference_state(model);
  return model;
}

// ---- mechanics ------------------------------------------------------------------------------------------------------

TEST(Mechanics, EnergyAndMomentaOfATurnedFreeBody) {
  const Model model = free_body();
  State state = model.initial;
  // Turned by 90 degrees about z: the body's x axis is the world's y axis.
  state.bodies[0].q_WB = Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitZ()));
  state.bodies[0].p_WBcm = Vec3(0, 3, 4);
  state.bodies[0].v_WBcm = Vec3(1, 0, 2);
  state.bodies[0].w_WB = Vec3(0, 5, 0);  // about the body's x axis, where the inertia is 1
  EXPECT_NEAR(kinetic_energy(model, state), 0.5 * 2 * 5 + 0.5 * 1 * 25, 1e-12);
  EXPECT_NEAR(potential_energy(model, state), 2 * 10 * 4, 1e-12);
  EXPECT_TRUE(linear_momentum(model, state).isApprox(Vec3(2, 0, 4), 1e-12));
  // x cross m v = (0, 3, 4) x (2, 0, 4) = (12, 8, -6), and the spin (0, 5, 0)
  EXPECT_TRUE(angular_momentum(model, state, Vec3::Zero()).isApprox(Vec3(12, 13, -6), 1e-12));
  EXPECT_TRUE(angular_momentum(model, state, Vec3(0, 3, 4)).isApprox(Vec3(0, 5, 0), 1e-12));
}

TEST(Mechanics, SpringsStoreEnergy) {
  Model model = double_pendulum();
  model.gravity.setZero();
  model.joints[1].stiffness = 4;
  model.joints[1].spring_reference = 0.5;
  State state = model.initial;
  state.position = {0.3, 1.0};
  bodies_from_joints(model, state);
  EXPECT_NEAR(potential_energy(model, state), 0.5 * 4 * 0.25, 1e-12);
}

TEST(Mechanics, ArmatureTurnsWithItsJoint) {
  Model model = double_pendulum();
  model.joints[0].armature = 0.2;
  State state = model.initial;
  state.velocity = {3, 0};
  bodies_from_joints(model, state);
  Model without = model;
  without.joints[0].armature = 0;
  EXPECT_NEAR(kinetic_energy(model, state) - kinetic_energy(without, state), 0.5 * 0.2 * 9, 1e-12);
}

TEST(Mechanics, WhatAModelConserves) {
  Model chain = double_pendulum();
  EXPECT_TRUE(conserved_quantities(chain).energy);
  EXPECT_FALSE(conserved_quantities(chain).angular_momentum_axis) << "gravity turns it about y";
  chain.gravity = Vec3(0, -9.81, 0);
  EXPECT_TRUE(conserved_quantities(chain).angular_momentum_axis) << "gravity along the axis has no moment about it";
  chain.gravity.setZero();
  const Conserved conserved = conserved_quantities(chain);
  ASSERT_TRUE(conserved.angular_momentum_axis);
  const Conserved::Axis axis = conserved.angular_momentum_axis.value_or(Conserved::Axis{});
  EXPECT_TRUE(axis.p_Wo.isApprox(Vec3(1, 0, 2), 1e-12));
  EXPECT_TRUE(axis.axis_W.isApprox(Vec3::UnitY(), 1e-12));
  EXPECT_FALSE(conserved.linear_momentum);
  Model damped = chain;
  damped.joints[1].damping = 0.1;
  EXPECT_FALSE(conserved_quantities(damped).energy);
  EXPECT_TRUE(conserved_quantities(damped).angular_momentum_axis) << "the elbow's damper is an inner one";
  damped.joints[0].damping = 0.1;
  EXPECT_FALSE(conserved_quantities(damped).angular_momentum_axis);

  Model body = free_body();
  EXPECT_TRUE(conserved_quantities(body).energy);
  EXPECT_FALSE(conserved_quantities(body).linear_momentum);
  body.gravity.setZero();
  EXPECT_TRUE(conserved_quantities(body).linear_momentum);
  EXPECT_TRUE(conserved_quantities(body).angular_momentum);
  Shape ball, floor;
  ball.body = 0;
  floor.type = ShapeType::kPlane;
  body.shapes = {ball, floor};
  body.contacts = {{0, 1, 1.0}};
  EXPECT_FALSE(conserved_quantities(body).any());
}

TEST(Mechanics, DriftOfAnIdealRunIsZeroAndOfADisturbedOneKnown) {
  Model model = free_body();
  model.gravity.setZero();
  State state = model.initial;
  state.bodies[0].v_WBcm = Vec3(3, 0, 0);
  state.bodies[0].w_WB = Vec3(0, 0, 2);
  std::vector<State> states;
  for (int i = 0; i < 5; ++i) {
    states.push_back(state);
    state.bodies[0].p_WBcm += 0.1 * state.bodies[0].v_WBcm;
    state.bodies[0].q_WB = Quat(Eigen::AngleAxisd(0.2, Vec3::UnitZ())) * state.bodies[0].q_WB;
  }
  const Conserved conserved = conserved_quantities(model);
  for (const Drift::Quantity& quantity : drift(model, conserved, states).quantities) {
    EXPECT_LT(quantity.absolute, 1e-12) << quantity.name;
  }
  // 3 m/s become 4 m/s in the middle of the run: the largest deviation counts, not the last.
  states[2].bodies[0].v_WBcm = Vec3(4, 0, 0);
  const Drift drifted = drift(model, conserved, states);
  ASSERT_EQ(drifted.quantities.size(), 3U);
  const double kinetic = 0.5 * 2 * 9 + 0.5 * 3 * 4;
  EXPECT_EQ(drifted.quantities[0].name, "energy");
  EXPECT_NEAR(drifted.quantities[0].absolute, 0.5 * 2 * (16 - 9), 1e-12);
  EXPECT_NEAR(drifted.quantities[0].relative.value_or(-1), 7 / kinetic, 1e-12);
  EXPECT_EQ(drifted.quantities[1].name, "linear_momentum");
  EXPECT_NEAR(drifted.quantities[1].absolute, 2, 1e-12);
  EXPECT_NEAR(drifted.quantities[1].relative.value_or(-1), 2.0 / 6, 1e-12);
}

TEST(Mechanics, DriftAlongAnAxisIgnoresOtherComponents) {
  Model model = double_pendulum();
  model.gravity.setZero();
  State state = model.initial;
  state.velocity = {1, 1};
  bodies_from_joints(model, state);
  State tilted = state;
  tilted.bodies[1].w_WB += Vec3(7, 0, 0);
  const Drift along = drift(model, conserved_quantities(model), {state, tilted});
  EXPECT_EQ(along.quantities.back().name, "angular_momentum");
  EXPECT_LT(along.quantities.back().absolute, 1e-12);
  tilted.bodies[1].w_WB += Vec3(0, 2, 0);
  const Drift about = drift(model, conserved_quantities(model), {state, tilted});
  EXPECT_NEAR(about.quantities.back().absolute, 0.1 * 2, 1e-12);
}

// ---- errors ---------------------------------------------------------------------------------------------------------

TEST(Accuracy, PositionErrorIsTheMeanDistance) {
  const Model model = double_pendulum();
  State moved = model.initial;
  EXPECT_EQ(position_error(model.initial, moved), 0);
  moved.bodies[0].p_WBcm += Vec3(3, 4, 0);
  moved.bodies[1].p_WBcm += Vec3(0, 0, 1);
  EXPECT_NEAR(position_error(model.initial, moved), 3, 1e-12);
}

TEST(Accuracy, ObservedOrder) {
  EXPECT_THAT(observed_order(1, 0.5, 2, 1).value_or(-1), DoubleNear(1, 1e-12));
  EXPECT_THAT(observed_order(0.25, 1e-8, 1, 256e-8).value_or(-1), DoubleNear(4, 1e-12));
  EXPECT_FALSE(observed_order(1, 0, 2, 1));
  EXPECT_FALSE(observed_order(1, 1, 2, std::numeric_limits<double>::infinity()));
}

std::vector<ErrorAt> curve(const std::vector<double>& errors, double rounding) {
  std::vector<ErrorAt> points;
  double timestep = 1.0 / 64;
  for (const double error : errors) {
    points.push_back({timestep, error, rounding});
    timestep *= 2;
  }
  return points;
}

TEST(Accuracy, FloorIsFlaggedOnlyWhereTheErrorStopsShrinking) {
  EXPECT_FALSE(error_floor(curve({1e-4, 2e-4, 4e-4, 8e-4}, 1e-12))) << "first order all the way";
  EXPECT_FALSE(error_floor(curve({1e-3, 1.2e-3, 2e-3, 4e-3}, 1e-12))) << "over a factor of two it may be chance";
  const auto floor = error_floor(curve({0.29, 0.29, 0.291, 0.30}, 1e-12));
  ASSERT_TRUE(floor) << "a hidden damping";
  EXPECT_EQ(floor, 0.29);
  EXPECT_FALSE(error_floor(curve({5e-14, 5e-14, 5e-14, 6e-14}, 1e-13))) << "that is rounding";
  EXPECT_FALSE(error_floor(curve({0.29, 0.29}, 1e-12))) << "two points say nothing";
  EXPECT_FALSE(error_floor({}));
}

TEST(Accuracy, APlateauIsWhereACurveStopsFallingWhateverTheReason) {
  EXPECT_FALSE(plateau(curve({1e-4, 2e-4, 4e-4, 8e-4}, 0)));
  EXPECT_EQ(plateau(curve({2.4e-4, 2.6e-4, 2.5e-4, 7e-4, 2e-3}, 0)), 2.6e-4) << "the largest of the flat part";
  EXPECT_EQ(plateau(curve({2.4e-4, 2.6e-4, 2.5e-4}, 1)), 2.6e-4) << "rounding explains it: a plateau nevertheless";
  EXPECT_FALSE(plateau(curve({2.4e-4, 2.6e-4, 7e-4, 2e-3}, 0))) << "over a factor of two it may be chance";
}

// x = t, the reference 0: the error is the time.
TEST(Accuracy, ErrorOverARunIsNotThatOfItsEnd) {
  std::vector<State> run(5, free_body().initial), reference = run;
  const std::vector<double> errors = {7, 0.3, 0.4, 0, 0.1};
  for (size_t i = 0; i < run.size(); ++i) run[i].bodies[0].p_WBcm.x() += errors[i];
  const ErrorOverTime error = error_over_time(run, reference);
  EXPECT_NEAR(error.at_end, 0.1, 1e-15);
  EXPECT_NEAR(error.largest, 0.4, 1e-15) << "the common start does not count";
  EXPECT_NEAR(error.rms, std::sqrt((0.09 + 0.16 + 0.01) / 4), 1e-15);
}

TEST(Accuracy, RoundingGrowsWithStepsAndPrecision) {
  EXPECT_NEAR(rounding_error(false, 2, 1000), 2 * 1000 * 2.220446049250313e-16, 1e-25);
  EXPECT_GT(rounding_error(true, 2, 1000), 1e8 * rounding_error(false, 2, 1000));
}

TEST(Accuracy, PiecesSpreadEvenly) {
  EXPECT_THAT(piece_starts(100, 10, 4), ElementsAre(0, 30, 60, 90));
  EXPECT_THAT(piece_starts(100, 10, 1), ElementsAre(0));
  EXPECT_THAT(piece_starts(10, 10, 3), ElementsAre(0, 0, 0));
}

// ---- plausibility -----------------------------------------------------------------------------------------------------

TEST(Plausible, AFallIsPossibleAndMoreSpeedIsNot) {
  Model model = double_pendulum();
  State start = model.initial;
  start.velocity = {1, 1};
  bodies_from_joints(model, start);
  const Plausibility plausibility(model, start, 1);
  EXPECT_EQ(plausibility.impossibility(start), "");
  // Hanging down, all height turned into speed: sqrt(E / E_now) times the rates.
  State fallen = start;
  fallen.position = {std::numbers::pi / 2, 0};
  bodies_from_joints(model, fallen);
  const double energy = kinetic_energy(model, start) + potential_energy(model, start) - potential_energy(model, fallen);
  const double factor = std::sqrt(energy / kinetic_energy(model, fallen));
  for (double& rate : fallen.velocity) rate *= factor;
  bodies_from_joints(model, fallen);
  EXPECT_EQ(plausibility.impossibility(fallen), "");
  for (double& rate : fallen.velocity) rate *= 4;
  bodies_from_joints(model, fallen);
  EXPECT_THAT(plausibility.impossibility(fallen), HasSubstr("kinetic energy"));
  EXPECT_EQ(plausibility.divergence(fallen), "");
}

TEST(Plausible, AHingeTornApart) {
  const Model model = double_pendulum();
  const Plausibility plausibility(model, model.initial, 1);
  State torn = model.initial;
  torn.bodies[1].p_WBcm += Vec3(0, 0, 0.2);
  EXPECT_EQ(plausibility.impossibility(torn), "") << "an error, not an impossibility";
  torn.bodies[1].p_WBcm += Vec3(0, 0, 1);
  EXPECT_THAT(plausibility.impossibility(torn), HasSubstr("'elbow'"));
}

TEST(Plausible, AHingeThatHasPassedItsLimit) {
  Model model = double_pendulum();
  State turned = model.initial;
  turned.position[1] = 100;
  EXPECT_EQ(Plausibility(model, model.initial, 1).impossibility(turned), "") << "it has no limit";
  model.joints[1].limited = true;
  model.joints[1].lower = -1;
  model.joints[1].upper = 1;
  const Plausibility plausibility(model, model.initial, 1);
  EXPECT_EQ(plausibility.impossibility(model.initial), "");
  for (const double side : {-1, 1}) {
    turned.position[1] = side * 7.2;
    EXPECT_EQ(plausibility.impossibility(turned), "") << "a violation, which has a measure";
    turned.position[1] = side * 7.3;
    EXPECT_THAT(plausibility.impossibility(turned), HasSubstr("hinge 'elbow' is 6.3 rad beyond its limit"));
  }
}

TEST(Plausible, BelowTheGround) {
  Model model = free_body();
  Shape ball, floor;
  ball.body = 0;
  ball.radius = 0.1;
  floor.type = ShapeType::kPlane;
  model.shapes = {ball, floor};
  model.contacts = {{0, 1, 1.0}};
  State start = model.initial;
  start.bodies[0].p_WBcm.z() = 1;
  const Plausibility plausibility(model, start, 10);
  State state = start;
  state.bodies[0].p_WBcm.z() = 0.01;
  EXPECT_EQ(plausibility.impossibility(state), "");
  state.bodies[0].p_WBcm.z() = -0.09;
  EXPECT_EQ(plausibility.impossibility(state), "") << "deep, but the ground still holds a part of it: a penetration";
  state.bodies[0].p_WBcm.z() = -0.2;
  EXPECT_THAT(plausibility.impossibility(state), HasSubstr("wholly below the ground, by 0.1 m"));
  EXPECT_NEAR(plausibility.available_energy(), 2 * 10 * 1, 1e-12) << "no deeper than the ground";
}

TEST(Plausible, ACentreOfMassOutsideOfItsShape) {
  Model model = free_body();
  Shape ball, floor;
  ball.body = 0;
  ball.radius = 0.1;
  ball.X_BS.p = {0, 0, 0.3};
  floor.type = ShapeType::kPlane;
  model.shapes = {ball, floor};
  model.contacts = {{0, 1, 1.0}};
  State state = model.initial;
  state.bodies[0].p_WBcm = {0, 0, -0.2};
  const Plausibility plausibility(model, state, 10);
  EXPECT_EQ(plausibility.impossibility(state), "");
  state.bodies[0].p_WBcm.z() = -0.5;
  EXPECT_THAT(plausibility.impossibility(state), HasSubstr("below the ground"));
}

TEST(Plausible, ASlideMayTravelAndFall) {
  // A block on a rail that leads down: no chain holds it, and its anchors part along the rail.
  Model model;
  Body& block = model.bodies.emplace_back();
  block.mass = 2;
  block.joint = 0;
  block.p_BBcm = {0, 0, 0.1};
  Joint& rail = model.joints.emplace_back();
  rail.name = "rail";
  rail.type = JointType::kSlide;
  rail.axis_B = Vec3::UnitZ();
  model.gravity = {0, 0, -10};
  model.initial = reference_state(model);
  const Plausibility plausibility(model, model.initial, 2);
  EXPECT_NEAR(plausibility.available_energy(), 2 * 10 * 20, 1e-9) << "2 s of free fall";
  State state = model.initial;
  state.position[0] = -5;
  bodies_from_joints(model, state);
  EXPECT_EQ(plausibility.impossibility(state), "");
  state.bodies[0].p_WBcm.x() += 1;
  EXPECT_THAT(plausibility.impossibility(state), HasSubstr("slide 'rail' is 1 m apart"));
}

TEST(Plausible, BallJointsAndTendonsHaveSprings) {
  Model model;
  Body& body = model.bodies.emplace_back();
  body.mass = 1;
  body.ball = 0;
  body.p_BBcm = {0, 0, -0.5};
  BallJoint& ball = model.balls.emplace_back();
  ball.stiffness = 8;
  ball.spring_reference = Quat(Eigen::AngleAxisd(0.5, Vec3::UnitX()));
  Body& tip = model.bodies.emplace_back();
  tip.mass = 1;
  tip.parent = 0;
  tip.joint = 0;
  model.joints.emplace_back().body = 1;
  Tendon& tendon = model.tendons.emplace_back();
  tendon.terms = {{0, 2.0}};
  tendon.stiffness = 3;
  tendon.rest_lower = 1;
  tendon.rest_upper = 2;
  model.gravity.setZero();
  model.initial = reference_state(model);
  const Plausibility plausibility(model, model.initial, 1);
  EXPECT_NEAR(plausibility.available_energy(), 0.5 * 8 * 0.5 * 0.5 + 0.5 * 3 * 1 * 1, 1e-12);
}

TEST(Plausible, NonFiniteAndFarAwayAreDivergence) {
  const Model model = free_body();
  const Plausibility plausibility(model, model.initial, 2);
  State state = model.initial;
  EXPECT_EQ(plausibility.divergence(state), "");
  state.bodies[0].w_WB.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(plausibility.divergence(state), HasSubstr("non-finite"));
  state = model.initial;
  state.bodies[0].p_WBcm = Vec3(0, 0, -20);
  EXPECT_EQ(plausibility.divergence(state), "") << "a free fall of 2 s";
  state.bodies[0].p_WBcm = Vec3(1e9, 0, 0);
  EXPECT_THAT(plausibility.divergence(state), HasSubstr("away"));
}

}  // namespace
}  // namespace assay
