// The certified solutions of the models that come with assay, against formulas of their own and against the laws that
// they have to satisfy.
#include "measures/reference/certified.h"

#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "load/mjcf.h"
#include "measures/reference/closed_form.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using testing::HasSubstr;

constexpr double kG = 9.81;

Model certified_model(const std::string& name) { return load_model(std::string(ASSAY_MODELS) + "/" + name + ".xml"); }

CertifiedMotion solved(const Model& model, const std::string& solution, const std::vector<double>& times) {
  const CertifiedSolution* found = find_certified_solution(solution);
  EXPECT_NE(found, nullptr);
  return found->solve(model, times);
}

std::string refusal_by(const Model& model, const std::string& solution, double time) {
  try {
    solved(model, solution, {time});
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

// Velocities are the rates of positions, between events.
void expect_rates(const Model& model, const std::string& solution, const std::vector<double>& times) {
  constexpr double kStep = 1e-5;
  for (const double time : times) {
    const auto states = solved(model, solution, {time - kStep, time, time + kStep}).states;
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      const Vec3 rate = (states[2].bodies[i].p_WBcm - states[0].bodies[i].p_WBcm) / (2 * kStep);
      EXPECT_LT((rate - states[1].bodies[i].v_WBcm).norm(), 1e-8) << solution << ", body " << i << " at " << time;
      const Vec3 turn = rotation_vector(states[2].bodies[i].q_WB * states[0].bodies[i].q_WB.conjugate()) / (2 * kStep);
      EXPECT_LT((turn - states[1].bodies[i].w_WB).norm(), 1e-7) << solution << ", body " << i << " at " << time;
    }
  }
}

TEST(Certified, ABoxSlidesItsDistanceAndStops) {
  const Model model = certified_model("sliding-box");
  const double speed = model.initial.bodies[0].v_WBcm.norm();
  const auto motion = solved(model, "slide-and-roll", {0.1, 1});
  const Vec3 way = motion.states[1].bodies[0].p_WBcm - model.initial.bodies[0].p_WBcm;
  EXPECT_NEAR(way.norm(), sliding_distance(speed, 0.5, kG), 1e-12);
  EXPECT_LT(way.cross(model.initial.bodies[0].v_WBcm).norm(), 1e-12);
  EXPECT_EQ(motion.states[1].bodies[0].v_WBcm.norm(), 0);
  ASSERT_EQ(motion.events.size(), 1U);
  EXPECT_NEAR(motion.events[0].time, sliding_time(speed, 0.5, kG), 1e-12);
  expect_rates(model, "slide-and-roll", {0.05, 0.2, 0.5});
}

TEST(Certified, ABallRollsAfterItsTime) {
  const Model model = certified_model("sphere-to-rolling");
  const double speed = model.initial.bodies[0].v_WBcm.norm();
  const auto motion = solved(model, "slide-and-roll", {1});
  EXPECT_NEAR(motion.states[0].bodies[0].v_WBcm.norm(), rolling_speed(speed), 1e-12);
  EXPECT_NEAR(motion.states[0].bodies[0].w_WB.norm(), rolling_speed(speed) / 0.1, 1e-11);
  ASSERT_EQ(motion.events.size(), 1U);
  EXPECT_NEAR(motion.events[0].time, rolling_time(speed, 0.3, kG), 1e-12);
  expect_rates(model, "slide-and-roll", {0.05, 0.15, 0.5});
}

TEST(Certified, BodiesRollDownASlopeWithTheirShareOfGravity) {
  const Model model = certified_model("rolling");
  const auto state = solved(model, "slide-and-roll", {0.5}).states[0];
  const double pull = model.gravity.x();
  const double shares[] = {5.0 / 7, 2.0 / 3};
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(state.bodies[i].p_WBcm.x(), shares[i] * pull * 0.125, 1e-7) << "body " << i;
    EXPECT_NEAR(state.bodies[i].w_WB.y(), state.bodies[i].v_WBcm.x() / 0.1, 1e-9);
  }
  EXPECT_LT(state.bodies[2].p_WBcm.x(), shares[0] * pull * 0.125);
  EXPECT_GT(state.bodies[2].p_WBcm.x(), shares[1] * pull * 0.125);
  expect_rates(model, "slide-and-roll", {0.1, 0.4});
}

TEST(Certified, AThrownBoxBendsDownTheSlopeAsCoulombsLawSays) {
  const Model model = certified_model("incline-boxes");
  const auto motion = solved(model, "slide-and-roll", {0.1, 0.25, 2});
  for (const size_t held : {0U, 1U}) {
    EXPECT_EQ((motion.states[2].bodies[held].p_WBcm - model.initial.bodies[held].p_WBcm).norm(), 0);
  }
  const double down = model.gravity.x(), press = -model.gravity.z();
  EXPECT_NEAR(motion.states[1].bodies[2].p_WBcm.x(), (down - 0.4 * press) * 0.25 * 0.25 / 2, 1e-12);
  // The same motion in short steps of the law itself.
  constexpr int kSteps = 200000;
  const double h = 0.1 / kSteps;
  Vec3 p = model.initial.bodies[3].p_WBcm, v = model.initial.bodies[3].v_WBcm;
  const auto law = [&](const Vec3& u) { return Vec3(Vec3(down, 0, 0) - 0.6 * press * u.normalized()); };
  for (int i = 0; i < kSteps; ++i) {
    const Vec3 middle = v + h / 2 * law(v);
    p += h * middle;
    v += h * law(middle);
  }
  EXPECT_LT((p - motion.states[0].bodies[3].p_WBcm).norm(), 1e-9);
  EXPECT_LT((v - motion.states[0].bodies[3].v_WBcm).norm(), 1e-9);
  ASSERT_EQ(motion.events.size(), 2U);
  EXPECT_EQ(motion.events[0].what, "body 'off' begins to slip");
  EXPECT_EQ(motion.events[0].time, 0);
  EXPECT_EQ(motion.events[1].what, "body 'thrown' stops slipping");
  EXPECT_EQ(motion.states[2].bodies[3].v_WBcm.norm(), 0);
  expect_rates(model, "slide-and-roll", {0.05, 0.2, motion.events[1].time - 1e-3, motion.events[1].time + 0.1});
}

TEST(Certified, BallsThatMeetMoveOnTogether) {
  const Model model = certified_model("ball-row");
  const auto motion = solved(model, "ball-row", {0.01, 1});
  ASSERT_EQ(motion.events.size(), 4U);
  double time = 0;
  for (int i = 0; i < 4; ++i) {
    time += 0.02 * (i + 1);  // the gap at 1 / (i + 1) m/s
    EXPECT_NEAR(motion.events[static_cast<size_t>(i)].time, time, 1e-12);
  }
  for (const BodyState& body : motion.states[1].bodies) EXPECT_NEAR(body.v_WBcm.x(), 0.2, 1e-12);
  EXPECT_NEAR(motion.states[1].bodies[4].p_WBcm.x(), 0.48 + 0.2 * (1 - time), 1e-12);
  EXPECT_NEAR(motion.states[1].bodies[0].p_WBcm.x(), 0.08 + 0.2 * (1 - time), 1e-12);
}

// What an impact must not change: the angular momentum about the point that strikes, and without friction's work the
// energy falls.
TEST(Certified, ARodsEndStrikesAndSticksOrSlips) {
  for (const std::string name : {"sticks", "slips"}) {
    const Model model = certified_model("rod-strike-" + name);
    const double height = 0.3 - 0.2 * std::cos(M_PI / 6) - 0.02;
    const auto motion = solved(model, "rod-strike", {height - 1e-9, height + 1e-9, height + 0.05});
    ASSERT_GE(motion.events.size(), 1U);
    EXPECT_NEAR(motion.events[0].time, height, 1e-12);
    EXPECT_EQ(motion.events[0].what, "the rod strikes the ground and " + name);
    const BodyState &before = motion.states[0].bodies[0], &after = motion.states[1].bodies[0];
    const Vec3 arm = before.q_WB * Vec3(0, 0, -0.2) - Vec3(0, 0, 0.02);
    const double mass = model.bodies[0].mass, inertia = model.bodies[0].I_BBcm_B(1, 1);
    const auto about = [&](const BodyState& body) { return Vec3(inertia * body.w_WB - mass * arm.cross(body.v_WBcm)); };
    EXPECT_LT((about(before) - about(after)).norm(), 1e-8);
    const Vec3 at_end = after.v_WBcm + after.w_WB.cross(arm);
    EXPECT_NEAR(at_end.z(), 0, 1e-7);
    const Vec3 impulse = mass * (after.v_WBcm - before.v_WBcm);
    if (name == "sticks") {
      EXPECT_NEAR(at_end.x(), 0, 1e-7);
      EXPECT_LE(std::abs(impulse.x()), impulse.z());
    } else {
      EXPECT_GT(at_end.x(), 0);
      EXPECT_NEAR(impulse.x(), -0.1 * impulse.z(), 1e-9);
    }
    const auto energy = [&](const BodyState& body) {
      return mass * body.v_WBcm.squaredNorm() + inertia * body.w_WB.squaredNorm();
    };
    EXPECT_LT(energy(after), energy(before));
    expect_rates(model, "rod-strike", {height / 2, height + 0.03});
  }
}

TEST(Certified, ATippingBoxIsAPendulumAboutItsEdge) {
  const Model model = certified_model("tipping-box");
  const double length = std::hypot(0.1, 0.3), balance = std::atan2(0.1, 0.3);
  const double mass = model.bodies[0].mass, inertia = model.bodies[0].I_BBcm_B(1, 1) + mass * length * length;
  const double angle = M_PI / 6 - balance;
  const Pendulum pendulum(std::sqrt(mass * kG * length / inertia), M_PI - angle);
  const auto motion = solved(model, "tipping-box", {0.1, 0.3});
  for (const State& state : motion.states) {
    const double from_hanging = pendulum.angle(state.time);
    EXPECT_NEAR(state.bodies[0].w_WB.y(), -pendulum.rate(state.time), 1e-10);
    EXPECT_NEAR(state.bodies[0].p_WBcm.z(), -length * std::cos(from_hanging), 1e-10);
  }
  expect_rates(model, "tipping-box", {0.1, 0.3});
  EXPECT_THAT(refusal_by(model, "tipping-box", 2), HasSubstr("let the run end before"));
}

// McGeer's and Coleman's periodic speed of point feet, which feet of a small radius approach.
TEST(Certified, ARimlessWheelComesToItsPeriodicSpeed) {
  const Model model = certified_model("rimless-wheel");
  std::vector<double> times;
  for (int i = 1; i <= 4000; ++i) times.push_back(5e-3 * i);
  const auto motion = solved(model, "rimless-wheel", times);
  ASSERT_GT(motion.events.size(), 20U);
  std::vector<double> rates;
  for (size_t i = motion.events.size() - 3; i < motion.events.size(); ++i) {
    rates.push_back(solved(model, "rimless-wheel", {motion.events[i].time + 1e-9}).states[0].bodies[0].w_WB.y());
  }
  EXPECT_NEAR(rates[0], rates[2], 1e-8) << "it is periodic";
  const double mass = 2, length = 0.305, about_hub = 0.06, about_foot = about_hub + mass * length * length;
  const double spread = M_PI / 4, slope = std::atan2(model.gravity.x(), -model.gravity.z());
  const double kept = (about_hub + mass * length * length * std::cos(spread)) / about_foot;
  const double fall = 2 * mass * kG * length * 2 * std::sin(spread / 2) * std::sin(slope) / about_foot;
  EXPECT_NEAR(rates[2], std::sqrt(kept * kept * fall / (1 - kept * kept)), 0.03 * rates[2]);
  expect_rates(model, "rimless-wheel", {0.1, 1.234});
}

TEST(Certified, JointsStopAtLimitsAndByDryFriction) {
  const Model model = certified_model("joint-stops");
  const auto motion = solved(model, "dry-joints", {0.1, 5});
  const State &early = motion.states[0], &late = motion.states[1];
  EXPECT_NEAR(early.position[0], -kG * 0.1 * 0.1 / 2, 1e-12);
  EXPECT_EQ(late.position[0], -0.3);
  // Each half swing loses 2 F / k = 40 mm: from 100 mm to -60, to 20 mm, where the spring cannot overcome friction.
  EXPECT_NEAR(late.position[1], 0.02, 1e-12);
  const double inertia = model.bodies[2].I_BBcm_B(1, 1);
  EXPECT_NEAR(late.position[2], 6 * 6 * inertia / (2 * 0.02), 1e-9);
  EXPECT_EQ(late.velocity[2], 0);
  EXPECT_EQ(late.bodies[2].w_WB.norm(), 0);
  int limits = 0;
  for (const SolutionEvent& event : motion.events) limits += event.what.find("meets its limit") != std::string::npos;
  EXPECT_GE(limits, 2);
  expect_rates(model, "dry-joints", {0.05, 0.123});
}

TEST(Certified, WhatIsHeldStaysAndWhatIsNotFalls) {
  EXPECT_EQ(solved(certified_model("box-stack"), "box-stack", {3}).states[0].bodies[4].p_WBcm.z(), 0.9);
  const Model holds = certified_model("grip-holds"), slips = certified_model("grip-slips");
  EXPECT_EQ(solved(holds, "two-finger-grip", {3}).states[0].bodies[0].p_WBcm.z(), 0.5);
  const State state = solved(slips, "two-finger-grip", {0.2}).states[0];
  EXPECT_NEAR(state.bodies[0].v_WBcm.z(), -(kG - 2 * 0.2 * 10 / 0.5) * 0.2, 1e-12);
}

TEST(Certified, ModelsOfAnotherKindAreRefusedWithTheReason) {
  EXPECT_THAT(refusal_by(certified_model("box-stack"), "slide-and-roll", 1), HasSubstr("something else than a plane"));
  EXPECT_THAT(refusal_by(certified_model("sliding-box"), "rod-strike", 1), HasSubstr("it has gravity"));
  EXPECT_THAT(refusal_by(certified_model("humanoid"), "slide-and-roll", 1), HasSubstr("no free joint"));
  Model model = certified_model("sliding-box");
  model.initial.bodies[0].p_WBcm.z() += 1e-3;
  EXPECT_THAT(refusal_by(model, "slide-and-roll", 1), HasSubstr("0.001 m off its plane"));
  model = certified_model("sliding-box");
  model.contacts[0].friction = 3;
  EXPECT_THAT(refusal_by(model, "slide-and-roll", 1), HasSubstr("tips over"));
  model = certified_model("box-stack");
  model.initial.bodies[3].p_WBcm.x() += 0.09;
  model.initial.bodies[4].p_WBcm.x() += 0.12;
  EXPECT_THAT(refusal_by(model, "box-stack", 1), HasSubstr("tips over"));
  model = certified_model("grip-holds");
  model.joints[0].stiffness *= 2;
  EXPECT_THAT(refusal_by(model, "two-finger-grip", 1), HasSubstr("do not press alike"));
  model = certified_model("rod-strike-sticks");
  model.contacts[0].friction = 0.3;
  EXPECT_EQ(find_certified_solution("slide"), nullptr);
}

}  // namespace
}  // namespace assay
