// Initial states of a system, what they give together, and trends.
#include "measures/initial_states.h"

#include <cmath>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "controls/control.h"
#include "load/mjcf.h"
#include "measures/clusters.h"
#include "measures/trend.h"
#include "measures/violation.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Model shipped(const std::string& name) { return load_model(std::string(ASSAY_MODELS "/") + name + ".xml"); }

// How far two states are apart: positions of bodies, angles, rates.
double distance(const State& a, const State& b) {
  double largest = 0;
  for (size_t i = 0; i < a.bodies.size(); ++i) {
    largest = std::max(
        {largest, (a.bodies[i].p_WBcm - b.bodies[i].p_WBcm).norm(), (a.bodies[i].v_WBcm - b.bodies[i].v_WBcm).norm()});
  }
  return largest;
}

TEST(InitialStates, TheFirstIsTheModelsOwnAndTheOthersDifferBySeedAndNumber) {
  const Model model = shipped("capsules-27");
  const InitialStates states{4, 1, {}}, others{4, 2, {}}, more{20, 1, {}};
  EXPECT_EQ(distance(initial_state(model, states, 0), model.initial), 0);
  const State one = initial_state(model, states, 1);
  EXPECT_GT(distance(one, model.initial), 1e-3);
  EXPECT_EQ(distance(one, initial_state(model, states, 1)), 0) << "the same each time";
  EXPECT_EQ(distance(one, initial_state(model, more, 1)), 0) << "however many there are";
  EXPECT_GT(distance(one, initial_state(model, states, 2)), 1e-3);
  EXPECT_GT(distance(one, initial_state(model, others, 1)), 1e-3);
}

TEST(InitialStates, KeepWidthsLimitsJointsAndDepth) {
  for (const char* name : {"capsules-27", "humanoid", "grasp", "planar-chain", "astronaut"}) {
    const Model model = shipped(name);
    ASSERT_THAT(perturbation_obstacle(model), IsEmpty()) << name;
    const Violation start = violation(model, model.initial);
    const InitialStates states{20, 1, {}};
    bool moves = false;
    for (int i = 1; i < states.count; ++i) {
      const State state = initial_state(model, states, i);
      const Violation at = violation(model, state);
      EXPECT_LT(at.dislocation, 1e-9) << name;
      EXPECT_LE(at.penetration, start.penetration + 2e-6) << name;
      EXPECT_LE(at.limit, start.limit + 1e-12) << name;
      for (size_t j = 0; j < model.joints.size(); ++j) {
        EXPECT_LE(std::abs(state.position[j] - model.initial.position[j]), states.around.joint_position) << name;
        EXPECT_LE(std::abs(state.velocity[j] - model.initial.velocity[j]), states.around.joint_rate) << name;
      }
      moves |= distance(state, model.initial) > 1e-4;
    }
    EXPECT_TRUE(moves) << name;
  }
}

TEST(InitialStates, WidthsOfZeroKeepThePose) {
  const Model model = shipped("grasp");
  Perturbation around;
  around.joint_position = around.position = around.rotation = 0;
  const State state = initial_state(model, {2, 1, around}, 1);
  for (size_t j = 0; j < model.joints.size(); ++j) EXPECT_EQ(state.position[j], model.initial.position[j]);
  EXPECT_NE(state.velocity, model.initial.velocity);
}

// ---- statistics over states ---------------------------------------------------------------------------------------------

TEST(Clusters, FigureOfASamplesGroup) {
  const std::vector<double> samples = {1, 2, 3, 4}, group = {0, 1, 0, 1};
  EXPECT_THAT(grouped(samples, group), ElementsAre(ElementsAre(1, 3), ElementsAre(2, 4)));
  EXPECT_EQ(grouped(samples, {}).size(), 4U);
  EXPECT_DOUBLE_EQ(bootstrap_mean_of_groups(grouped(samples, group), 1).value, 2.5);
  EXPECT_NEAR(bootstrap_tail(1000), 0.025, 1e-3);
  EXPECT_LT(bootstrap_tail(5), 0.005) << "few groups: farther out";
}

// 20 motions with 5 dependent pieces each. Their errors are skewed, as those of contacts: some motions have an impact.
TEST(Clusters, AnIntervalOverMotionsCoversWhereOneOverPiecesDoesNot) {
  std::mt19937_64 random(3);  // NOLINT(bugprone-random-generator-seed): the same test each time
  const auto uniform = [&] { return static_cast<double>(random() >> 11U) * 0x1p-53; };
  constexpr int kTrials = 400, kMotions = 20, kPieces = 5;
  int by_motion = 0, by_piece = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<std::vector<double>> groups(kMotions), pieces;
    for (std::vector<double>& group : groups) {
      const double motion = uniform() + uniform() + uniform();
      for (int i = 0; i < kPieces; ++i) {
        group.push_back(motion + 0.2 * uniform());
        pieces.push_back({group.back()});
      }
    }
    constexpr double kMean = 1.6;
    const auto seed = static_cast<std::uint64_t>(trial);
    const Interval motions = bootstrap_mean_of_groups(groups, seed, 500),
                   each = bootstrap_mean_of_groups(pieces, seed, 500);
    if (motions.low <= kMean && kMean <= motions.high) ++by_motion;
    if (each.low <= kMean && kMean <= each.high) ++by_piece;
  }
  EXPECT_GE(by_motion, 0.93 * kTrials);
  EXPECT_LE(by_motion, 0.98 * kTrials);
  EXPECT_LT(by_piece, 0.75 * kTrials) << "pieces of one motion are not independent";
}

TEST(Clusters, ProbabilityOfHolding) {
  const Interval all = probability(20, 20);
  EXPECT_EQ(all.value, 1);
  EXPECT_EQ(all.high, 1);
  EXPECT_NEAR(all.low, std::pow(0.025, 1.0 / 20), 1e-9) << "closed form of Clopper and Pearson";
  const Interval none = probability(0, 20);
  EXPECT_NEAR(none.high, 1 - all.low, 1e-9);
  EXPECT_EQ(none.low, 0);
  const Interval half = probability(10, 20);
  EXPECT_NEAR(half.low, 1 - half.high, 1e-9);
  EXPECT_NEAR(half.low, 0.2720, 1e-4) << "tables";
}

// ---- trends -------------------------------------------------------------------------------------------------------------

TEST(Trend, AnOscillationAndOutliersAreNoDrift) {
  std::vector<double> time, wave, drift;
  for (int i = 0; i < 400; ++i) {
    time.push_back(0.01 * i);
    wave.push_back(std::sin(20 * time.back()));
    drift.push_back(0.5 * time.back() + 0.1 * wave.back() + (i % 50 == 7 ? 30 : 0));
  }
  const auto slope_of = [&](const std::vector<double>& values) {
    const auto found = robust_slope(time, values, 1);
    EXPECT_TRUE(found);
    return found.value_or(Interval{});
  };
  const Interval of_wave = slope_of(wave), of_drift = slope_of(drift);
  EXPECT_LT(std::abs(of_wave.value), 0.05) << "it swings by 2";
  EXPECT_LE(of_wave.low, 0);
  EXPECT_GE(of_wave.high, 0);
  EXPECT_NEAR(of_drift.value, 0.5, 0.02);
  EXPECT_LT(of_drift.low, 0.5);
  EXPECT_GT(of_drift.high, 0.5);
  EXPECT_FALSE(robust_slope(std::vector<double>(7, 1.0), std::vector<double>(7, 1.0), 1)) << "too few";
  EXPECT_FALSE(robust_slope(std::vector<double>(9, 1.0), std::vector<double>(9, 1.0), 1)) << "no time passes";
}

// ---- torques of a step ----------------------------------------------------------------------------------------------------

// The work on a free particle of midpoint torques is exact to second order; torques of the step's start miss the first.
TEST(StepTorques, OfTimeAloneAreThoseOfTheMiddle) {
  const Model model = shipped("planar-chain");
  const auto sine = make_control(model, {.kind = "sine", .amplitude = 2, .frequency = 1});
  State state = model.initial;
  state.time = 0.25;
  std::vector<double> held(model.joints.size()), middle = held;
  torques_of_step(*sine, state, 0.1, held);
  state.time = 0.3;
  sine->torques(state, middle);
  EXPECT_EQ(held, middle);
  const Model astronaut = shipped("astronaut");  // motors with sines, which read lengths that have no part in the force
  const auto motors = make_control(astronaut, {});
  ASSERT_EQ(motors->input(), ControlInput::kTime);
  std::vector<double> of_step(astronaut.joints.size()), of_middle = of_step;
  State start = astronaut.initial;
  torques_of_step(*motors, start, 0.1, of_step);
  start.time = 0.05;
  motors->torques(start, of_middle);
  EXPECT_EQ(of_step, of_middle);
  state = model.initial;
  const auto hold = make_control(model, {.kind = "hold"});
  torques_of_step(*hold, state, 0.1, held);
  hold->torques(state, middle);
  EXPECT_EQ(held, middle) << "one that reads the state knows only that of the start";
}

TEST(Groups, MedianAndShareOfSamples) {
  const std::vector<std::vector<double>> groups = {{1, 2, 9}, {1, 2, 3}, {2, 2, 8}};
  const Interval median = bootstrap_median_of_groups(groups, 1);
  EXPECT_DOUBLE_EQ(median.value, 2);
  EXPECT_GE(median.low, 1);
  EXPECT_LE(median.high, 9);
  const Interval share = share_within_of_groups(groups, 2, 1);
  EXPECT_DOUBLE_EQ(share.value, 6.0 / 9);
  EXPECT_LE(share.low, share.value);
  EXPECT_GE(share.high, share.value);
  // where all are within, the interval says how many there were
  const Interval all = share_within_of_groups(groups, 10, 1), single = share_within_of_groups({{1, 1, 1, 1}}, 2, 1);
  EXPECT_EQ(all.value, 1);
  EXPECT_NEAR(all.low, std::pow(0.025, 1.0 / 3), 1e-9);
  EXPECT_NEAR(single.low, std::pow(0.025, 1.0 / 4), 1e-9);
  EXPECT_EQ(share_within_of_groups(groups, 0, 1).value, 0);
}

}  // namespace
}  // namespace assay
