// Joint position error, limit violation and penetration: zero for a valid state, known for an invalid one.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "load/mjcf.h"
#include "measures/violation.h"
#include "measures/watch.h"
#include "model/kinematics.h"

namespace assay {
namespace {

constexpr double kRounding = 1e-14;

// A hinged arm with a limit, and a ball, a rod and a second rod that are free, above a floor at 1 m.
Model arm_and_things() {
  return load_model_text(R"(<mujoco model="things"><compiler angle="radian" autolimits="true"/><worldbody>
    <geom name="floor" type="plane" size="0 0 1" pos="0 0 1"/>
    <body name="upper" pos="0 5 3"><joint name="shoulder" axis="0 1 0" range="-0.5 0.5"/>
      <geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.02" contype="0" conaffinity="0" mass="1"/>
      <body name="lower" pos="0.4 0 0"><joint name="elbow" axis="0 0 1"/>
        <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02" contype="0" conaffinity="0" mass="1"/></body></body>
    <body name="ball" pos="0 0 3"><freejoint/><geom type="sphere" size="0.1" mass="1"/></body>
    <body name="rod" pos="2 0 3"><freejoint/><geom type="capsule" fromto="-0.2 0 0 0.2 0 0" size="0.05" mass="1"/></body>
    <body name="other" pos="4 0 3"><freejoint/><geom type="capsule" fromto="0 0 -0.2 0 0 0.2" size="0.03" mass="1"/></body>
  </worldbody></mujoco>)",
                         "things");
}

enum Bodies : std::uint8_t { kUpper, kLower, kBall, kRod, kOther };

void expect_violation(const Violation& found, double dislocation, double misalignment, double limit,
                      double penetration) {
  EXPECT_NEAR(found.dislocation, dislocation, kRounding);
  EXPECT_NEAR(found.misalignment, misalignment, kRounding);
  EXPECT_NEAR(found.limit, limit, kRounding);
  EXPECT_NEAR(found.penetration, penetration, kRounding);
}

TEST(Violation, AMotionThatObeysTheModelHasNone) {
  const Model model = arm_and_things();
  State state = model.initial;
  for (int i = 0; i < 50; ++i) {
    state.position = {0.5 * std::sin(0.3 * i), 2.0 * i};
    bodies_from_joints(model, state);
    expect_violation(violation(model, state), 0, 0, 0, 0);
  }
}

TEST(Violation, AnAnchorMovedByAKnownDistance) {
  const Model model = arm_and_things();
  State state = model.initial;
  state.bodies[kLower].p_WBcm += Vec3(3e-3, 0, 4e-3);
  expect_violation(violation(model, state), 5e-3, 0, 0, 0);
  // Moving both leaves their joint whole and opens the one to the world.
  state = model.initial;
  for (const Bodies body : {kUpper, kLower}) state.bodies[body].p_WBcm += Vec3(0, 0.02, 0);
  expect_violation(violation(model, state), 0.02, 0, 0, 0);
}

TEST(Violation, AnAxisTiltedByAKnownAngle) {
  const Model model = arm_and_things();
  State state = model.initial;
  const double tilt = 1e-6;  // an arc cosine would see nothing of it
  const JointFrames frames = joint_frames(model, state, 1);
  const Quat turn(Eigen::AngleAxisd(tilt, Vec3::UnitX()));
  BodyState& lower = state.bodies[kLower];
  lower.q_WB = turn * lower.q_WB;
  lower.p_WBcm = frames.p_WJ_parent + turn * (lower.p_WBcm - frames.p_WJ_parent);
  expect_violation(violation(model, state), 0, tilt, 0, 0);
  // About the axis itself it is the joint's own motion.
  state = model.initial;
  state.position[1] = 0.7;
  bodies_from_joints(model, state);
  expect_violation(violation(model, state), 0, 0, 0, 0);
}

TEST(Violation, LimitsOnBothSidesAndTurnsBeyond) {
  const Model model = arm_and_things();
  for (const auto& [angle, beyond] : {std::pair{0.5, 0.0}, std::pair{0.6, 0.1}, std::pair{-0.8, 0.3},
                                      std::pair{2 * std::numbers::pi, 2 * std::numbers::pi - 0.5}}) {
    State state = model.initial;
    state.position[0] = angle;
    bodies_from_joints(model, state);
    expect_violation(violation(model, state), 0, 0, beyond, 0);
  }
}

TEST(Violation, PenetrationOfEveryKindOfPair) {
  const Model model = arm_and_things();
  const auto deepest = [&](const auto& place) {
    State state = model.initial;
    place(state.bodies);
    return violation(model, state).penetration;
  };
  using Placed = std::vector<BodyState>;
  // ball and floor
  EXPECT_NEAR(deepest([](Placed& b) { b[kBall].p_WBcm.z() = 1.1; }), 0, kRounding);
  EXPECT_NEAR(deepest([](Placed& b) { b[kBall].p_WBcm.z() = 1.07; }), 0.03, kRounding);
  EXPECT_NEAR(deepest([](Placed& b) { b[kBall].p_WBcm.z() = 0.8; }), 0.3, kRounding) << "its centre below the floor";
  // rod and floor: flat, then on one end at 30 degrees
  EXPECT_NEAR(deepest([](Placed& b) { b[kRod].p_WBcm.z() = 1.04; }), 0.01, kRounding);
  EXPECT_NEAR(deepest([](Placed& b) {
                b[kRod].p_WBcm.z() = 1.14;
                b[kRod].q_WB = Quat(Eigen::AngleAxisd(std::numbers::pi / 6, Vec3::UnitY())) * b[kRod].q_WB;
              }),
              0.2 * 0.5 + 0.05 - 0.14, kRounding);
  // ball beside a rod, then before its end
  EXPECT_NEAR(deepest([](Placed& b) { b[kBall].p_WBcm = b[kRod].p_WBcm + Vec3(0.1, 0.14, 0); }), 0.01, kRounding);
  EXPECT_NEAR(deepest([](Placed& b) { b[kBall].p_WBcm = b[kRod].p_WBcm + Vec3(0.34, 0, 0); }), 0.01, kRounding);
  EXPECT_NEAR(deepest([](Placed& b) { b[kBall].p_WBcm = b[kRod].p_WBcm + Vec3(0.2, 0, 0) + 0.2 * Vec3(0.6, 0.8, 0); }),
              0, kRounding);
  // two rods: crossed, end to side, parallel
  EXPECT_NEAR(deepest([](Placed& b) { b[kOther].p_WBcm = b[kRod].p_WBcm + Vec3(0.05, 0.07, 0.1); }), 0.01, kRounding);
  EXPECT_NEAR(deepest([](Placed& b) { b[kOther].p_WBcm = b[kRod].p_WBcm + Vec3(0.1, 0, 0.26); }), 0.02, kRounding);
  const auto lay = [](Placed& b, const Vec3& p) {
    b[kOther].q_WB = Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitY())) * b[kOther].q_WB;
    b[kOther].p_WBcm = b[kRod].p_WBcm + p;
  };
  EXPECT_NEAR(deepest([&](Placed& b) { lay(b, Vec3(0.1, 0.06, 0)); }), 0.02, kRounding);
  EXPECT_NEAR(deepest([&](Placed& b) { lay(b, Vec3(0.47, 0, 0)); }), 0.01, kRounding) << "on one line";
  // The deepest of several counts, in any order.
  EXPECT_NEAR(deepest([](Placed& b) {
                b[kBall].p_WBcm.z() = 1.07;
                b[kRod].p_WBcm.z() = 1.04;
                b[kOther].p_WBcm.z() = 1.19;
              }),
              0.04, kRounding);
}

TEST(Violation, SeparationIsSigned) {
  const Model model = arm_and_things();
  int found = 0;
  const Separations separations(model);
  for (size_t i = 0; i < model.contacts.size(); ++i) {
    const ContactPair& pair = model.contacts[i];
    const int a = model.shapes[static_cast<size_t>(pair.shape_a)].body;
    const int b = model.shapes[static_cast<size_t>(pair.shape_b)].body;
    const double apart = separations.of(static_cast<int>(i), model.initial);
    if (a == kBall && b == kRod) {
      ++found;
      EXPECT_NEAR(apart, 2 - 0.2 - 0.15, kRounding);
    }
    if (a == kWorld && b == kOther) {
      ++found;
      EXPECT_NEAR(apart, 1.77, kRounding);
    }
  }
  EXPECT_EQ(found, 2);
}

TEST(Violation, LargestAndRootMeanSquareOverARun) {
  const Model model = arm_and_things();
  const auto violation_summary = [](const Model& of, const std::vector<State>& seen) {
    ViolationSeries series(of, of.initial);
    for (const State& state : seen) series.add(state);
    return series.summary(1);
  };
  std::vector<State> states(4, model.initial);
  states[1].bodies[kLower].p_WBcm.x() += 0.3;
  states[2].bodies[kLower].p_WBcm.x() += 0.4;
  states[3].bodies[kBall].p_WBcm.z() = 1.0;
  const ViolationSummary summary = violation_summary(model, states);
  expect_violation(summary.largest, 0.4, 0, 0, 0.1);
  expect_violation(summary.rms, 0.25, 0, 0, 0.05);
  EXPECT_TRUE(std::isnan(summary.rms_low.dislocation)) << "four samples give no interval";
  // one deep moment in a long run: the root mean square is uncertain, and where nothing is violated it is not
  states.assign(100, model.initial);
  states[50].bodies[kBall].p_WBcm.z() = 1.0;
  const ViolationSummary longer = violation_summary(model, states);
  expect_violation(longer.rms, 0, 0, 0, 0.01);
  EXPECT_EQ(longer.rms_low.penetration, 0) << "most resamples miss the moment";
  EXPECT_GT(longer.rms_high.penetration, 0.012);
  EXPECT_LT(longer.rms_high.penetration, 0.03);
  EXPECT_EQ(longer.rms_high.dislocation, 0);
}

// What a pair overlaps by at the start is the model's; what comes on top is the contact's.
TEST(Violation, PenetrationBeyondTheStarts) {
  Model model = arm_and_things();
  const auto height = [&](double z) {
    State state = model.initial;
    state.bodies[kBall].p_WBcm.z() = z;
    return state;
  };
  const State start = height(1.0);  // 0.1 m deep, as above
  ViolationSeries series(model, start);
  series.add(start);
  EXPECT_NEAR(series.summary(1).largest.penetration, 0.1, kRounding);
  EXPECT_NEAR(series.summary(1).largest.added, 0, kRounding);
  series.add(height(0.97));
  EXPECT_NEAR(series.summary(1).largest.penetration, 0.13, kRounding);
  EXPECT_NEAR(series.summary(1).largest.added, 0.03, kRounding);
}

TEST(Violation, TheUsualLimitFollowsTheThinnestShapeThatTouches) {
  Model model;
  model.bodies.emplace_back().mass = 1;
  model.bodies.front().I_BBcm_B = Mat3::Identity();
  Shape& ball = model.shapes.emplace_back();
  ball.body = 0;
  model.shapes.emplace_back().type = ShapeType::kPlane;
  EXPECT_FALSE(usual_penetration_limit(model)) << "nothing touches";
  model.contacts = {{0, 1, 1.0}};
  for (const auto& [radius, limit] : {std::pair(0.5, 5e-3), std::pair(0.03, 3e-3), std::pair(0.004, 1e-3)}) {
    model.shapes.front().radius = radius;
    EXPECT_NEAR(usual_penetration_limit(model).value_or(0), limit, 1e-12) << radius;
  }
}

TEST(Watch, InstantsAreAMillisecondApartWhateverTheTimestep) {
  EXPECT_EQ(watch_steps(1), 1);
  EXPECT_EQ(watch_steps(4), 1);
  EXPECT_EQ(watch_steps(1.0 / 64), 64);
  EXPECT_EQ(watch_steps(1.0 / 3), 3);
  EXPECT_EQ(watch_steps(0.4), 2);
}

TEST(Watch, NumbersComeBackAsTheyWere) {
  const Model model = arm_and_things();
  State state = model.initial;
  state.bodies[kBall].p_WBcm.z() = 1.2;
  Watch watch(model, state, {kBall, kUpper, 0.05});
  for (int i = 1; i < 12; ++i) {
    state.time = 0.1 * i;
    state.bodies[kBall].p_WBcm.z() -= 0.01 * i;
    watch.look(state);
  }
  const Watched seen = watch.watched(7);
  const auto back = Watched::of(seen.numbers());
  ASSERT_TRUE(back);
  EXPECT_EQ(back->numbers(), seen.numbers());
  EXPECT_GT(back->violation.largest.penetration, 0.1);
  EXPECT_EQ(back->violation.rms_high.penetration, seen.violation.rms_high.penetration);
  EXPECT_EQ(back->grasp.dropped_at, seen.grasp.dropped_at);
  EXPECT_TRUE(back->grasp.dropped_at);
  EXPECT_FALSE(Watched::of({1, 2, 3}));
}

}  // namespace
}  // namespace assay
