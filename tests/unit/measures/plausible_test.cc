// Soundness of random models: motions that are exact up to a contender's rounding are possible, at any size, at rest
// and without gravity, and planted errors are not.
#include "measures/plausible.h"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "controls/control.h"
#include "controls/work.h"
#include "measures/mechanics.h"
#include "measures/reference/smooth.h"
#include "measures/violation.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using ::testing::HasSubstr;

struct Random {
  std::mt19937_64 bits;
  double within(double most) { return std::uniform_real_distribution<double>(-most, most)(bits); }
  size_t below(size_t count) { return bits() % count; }
  Vec3 vector(double most) { return {within(most), within(most), within(most)}; }
};

enum class Kind { kTree, kTable, kGimbal, kMassless };

struct Case {
  Kind kind = Kind::kTree;
  double length = 1, mass = 1;  // of a link, m, kg
  bool gravity = true, moves = true;
  bool centred = false;  // joints pass through centres of mass
};

Mat3 rod_inertia(const Case& of) {
  const double of_length = of.mass * of.length * of.length / 12;
  return Vec3(of_length, of_length, 0.02 * of_length).asDiagonal();
}

void add_joint(Model& model, int body, JointType type, const Vec3& axis, const Vec3& anchor) {
  Body& own = model.bodies[static_cast<size_t>(body)];
  if (type == JointType::kBall) {
    own.ball = static_cast<int>(model.balls.size());
    BallJoint& ball = model.balls.emplace_back();
    ball.name = own.name;
    ball.body = body;
    ball.p_BJ = anchor;
    return;
  }
  own.joint = static_cast<int>(model.joints.size());
  Joint& joint = model.joints.emplace_back();
  joint.name = own.name;
  joint.body = body;
  joint.type = type;
  joint.axis_B = axis.normalized();
  joint.p_BJ = anchor;
}

Model random_model(const Case& of, Random& random) {
  Model model;
  model.gravity = of.gravity ? Vec3(0, 0, -9.81) : Vec3(0, 0, 0);
  const int count = of.kind == Kind::kTree ? 4 : 3;
  for (int i = 0; i < count; ++i) {
    Body& body = model.bodies.emplace_back();
    body.name = "body " + std::to_string(i);
    const bool tree = of.kind == Kind::kTree;
    body.parent = i == 0 ? kWorld : tree ? static_cast<int>(random.below(static_cast<size_t>(i))) : i - 1;
    body.mass = of.mass;
    body.I_BBcm_B = rod_inertia(of);
    if (of.kind == Kind::kMassless && i + 1 < count) {
      body.mass = 0;
      body.I_BBcm_B.setZero();
    }
    const Vec3 anchor = of.centred || body.mass == 0 ? Vec3(Vec3::Zero()) : random.vector(of.length);
    if (tree) body.X_PB = {random.vector(of.length), Quat(Eigen::AngleAxisd(random.within(3), Vec3::UnitX()))};
    JointType type = JointType::kHinge;
    Vec3 axis = Vec3(random.vector(1)) + 2 * Vec3::Unit(i % 3);
    if (of.kind == Kind::kTable) {
      type = JointType::kSlide;
      axis = Vec3::Unit(i);
    } else if (tree) {
      type = std::array{JointType::kHinge, JointType::kSlide, JointType::kBall}[random.below(3)];
    }
    add_joint(model, i, type, axis, anchor);
  }
  model.initial = reference_state(model);
  if (of.moves) {
    for (double& rate : model.initial.velocity) rate = random.within(1);
    for (size_t j = 0; j < model.joints.size(); ++j) {
      if (model.joints[j].is_slide()) model.initial.velocity[j] *= of.length;
    }
    bodies_from_joints(model, model.initial);
  }
  return model;
}

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const Kind kind : {Kind::kTree, Kind::kTable, Kind::kGimbal, Kind::kMassless}) {
    for (const auto& [length, mass] : {std::pair(1e-3, 1e-3), {0.3, 1.0}, {100.0, 1e3}}) {
      for (const int which : {0, 1, 2, 3}) {
        all.push_back({kind, length, mass, (which & 1) != 0, (which & 2) != 0, true});
        if (kind == Kind::kTree) all.push_back({kind, length, mass, (which & 1) != 0, (which & 2) != 0, false});
      }
    }
  }
  return all;
}

// A state of a contender: each number rounded, and velocities as far as they follow from rounded positions.
State rounded(const Model& model, State state, const Arithmetic& with, Random& random) {
  const double unit = with.single_precision ? std::numeric_limits<float>::epsilon() : 1e-12;
  for (BodyState& body : state.bodies) {
    const double far = body.p_WBcm.norm();
    body.p_WBcm += random.vector(unit * far);
    body.v_WBcm += random.vector(unit * far / with.timestep_s + unit * body.v_WBcm.norm());
    body.w_WB += random.vector(unit / with.timestep_s);
    body.q_WB.coeffs() += unit * Eigen::Vector4d(random.within(1), random.within(1), random.within(1), 0);
    body.q_WB.normalize();
  }
  joints_from_bodies(model, state);
  return state;
}

constexpr std::array kArithmetics = {Arithmetic{true, 1e-3}, Arithmetic{true, 1.0 / 16000}, Arithmetic{false, 1e-3},
                                     Arithmetic{false, 1.0 / 64000}};

std::string text_of(const Case& of) {
  return "kind " + std::to_string(static_cast<int>(of.kind)) + ", " + std::to_string(of.length) + " m, gravity " +
         std::to_string(of.gravity) + ", moves " + std::to_string(of.moves) + ", centred " + std::to_string(of.centred);
}

TEST(PlausibleModels, ExactMotionsUpToRoundingArePossible) {
  Random random{std::mt19937_64(3)};  // NOLINT(bugprone-random-generator-seed): the same test each time
  for (const Case& of : cases()) {
    SCOPED_TRACE(text_of(of));
    const Model model = random_model(of, random);
    const double duration = 0.2 * std::sqrt(of.length);
    const std::vector<State> run = smooth_solution(model, model.initial, {0, 0.5 * duration, duration}, {1e-9, {}});
    for (const Arithmetic& with : kArithmetics) {
      const Plausibility plausibility(model, run.front(), duration, 0, with);
      EXPECT_GT(plausibility.size(), 0);
      EXPECT_GT(plausibility.rest_energy(), 0);
      for (const State& state : run) {
        const State seen = rounded(model, state, with, random);
        EXPECT_EQ(plausibility.impossibility(seen), "");
        EXPECT_EQ(plausibility.divergence(seen), "");
      }
    }
  }
}

TEST(PlausibleModels, PlantedErrorsAreFound) {
  Random random{std::mt19937_64(4)};  // NOLINT(bugprone-random-generator-seed): the same test each time
  for (const Case& of : cases()) {
    SCOPED_TRACE(text_of(of));
    Model model = random_model(of, random);
    for (const Arithmetic& with : kArithmetics) {
      const Plausibility plausibility(model, model.initial, 0.1, 0, with);
      const size_t last = model.bodies.size() - 1;
      // across the axes of all slides
      Vec3 across = Vec3(0.3, 0.5, 0.8);
      if (of.kind == Kind::kTable) across = Vec3::UnitX();

      State torn = model.initial;
      torn.bodies[last].p_WBcm += 0.01 * of.length * across;
      EXPECT_GT(violation(model, torn).dislocation, 1e-3 * of.length) << "a figure";
      EXPECT_EQ(plausibility.impossibility(torn), "") << "an error, which has a measure";
      torn.bodies[last].p_WBcm += 10 * plausibility.size() * across;
      EXPECT_THAT(plausibility.impossibility(torn), HasSubstr("apart"));

      State fast = model.initial;  // ten times as fast as all its energy allows
      const double energy = plausibility.available_energy() + plausibility.rest_energy();
      fast.bodies[last].v_WBcm = std::sqrt(2 * 100 * energy / of.mass) * Vec3::UnitX();
      EXPECT_THAT(plausibility.impossibility(fast), HasSubstr("kinetic energy"));
      if (!of.gravity && !of.moves) {
        fast.bodies[last].v_WBcm = of.length * Vec3::UnitX();  // a link a second, out of nothing
        EXPECT_THAT(plausibility.impossibility(fast), HasSubstr("kinetic energy"));
      }
      State lost = model.initial;
      lost.bodies[last].p_WBcm.x() = std::numeric_limits<double>::quiet_NaN();
      EXPECT_THAT(plausibility.divergence(lost), HasSubstr("non-finite"));
    }
    for (size_t j = 0; j < model.joints.size(); ++j) {
      if (model.joints[j].is_slide()) continue;
      model.joints[j].limited = true;
      model.joints[j].lower = -0.5;
      model.joints[j].upper = 0.5;
      State beyond = model.initial;
      beyond.position[j] = 0.5 + 2 * std::numbers::pi + 0.1;
      EXPECT_THAT(Plausibility(model, model.initial, 0.1).impossibility(beyond), HasSubstr("beyond its limit"));
    }
  }
}

TEST(PlausibleModels, AThinPlateMaySinkInByLessThanItIsWideAndNotFallThrough) {
  Model model;
  Body& plate = model.bodies.emplace_back();
  plate.name = "plate";
  plate.mass = 1;
  plate.I_BBcm_B = Vec3(1, 1, 2).asDiagonal() * (0.1 * 0.1 / 12);
  Shape& box = model.shapes.emplace_back();
  box.type = ShapeType::kBox;
  box.body = 0;
  box.half_size = {0.05, 0.05, 1e-6};
  model.shapes.emplace_back().type = ShapeType::kPlane;
  model.contacts = {{0, 1, 1.0}};
  model.initial = reference_state(model);
  const Plausibility plausibility(model, model.initial, 1);
  State state = model.initial;
  state.bodies[0].p_WBcm.z() = -1e-4;
  EXPECT_EQ(plausibility.impossibility(state), "") << "a soft contact under the plate's weight";
  state.bodies[0].p_WBcm.z() = -2e-3;
  EXPECT_THAT(plausibility.impossibility(state), HasSubstr(kBelowGround));
}

// The scale is the robot's: what puts a plate through the ground is a foot of a long leg that is pressed in.
TEST(PlausibleModels, AFootOfALongLegMayLieDeeperThanAPlateByItself) {
  Model model;
  model.bodies.resize(2);
  model.bodies[0].name = "leg";
  model.bodies[1].name = "foot";
  for (Body& body : model.bodies) {
    body.mass = 1;
    body.I_BBcm_B = 1e-3 * Mat3::Identity();
  }
  model.bodies[0].p_BBcm = {0, 0, 0.4};
  model.bodies[1].parent = 0;
  model.bodies[1].joint = 0;
  model.bodies[1].X_PB.p = {0, 0, 0.8};
  Joint& ankle = model.joints.emplace_back();
  ankle.name = "ankle";
  ankle.body = 1;
  Shape& sole = model.shapes.emplace_back();
  sole.type = ShapeType::kBox;
  sole.body = 1;
  sole.half_size = {0.05, 0.05, 1e-6};
  model.shapes.emplace_back().type = ShapeType::kPlane;
  model.contacts = {{0, 1, 1.0}};
  model.initial = reference_state(model);
  const Plausibility plausibility(model, model.initial, 1);
  const auto at = [&](double height) {
    State state = model.initial;
    for (BodyState& body : state.bodies) body.p_WBcm.z() += height - 0.8;
    return plausibility.impossibility(state);
  };
  EXPECT_EQ(at(-2.8e-4), "");
  EXPECT_EQ(at(-0.01), "");
  EXPECT_THAT(at(-0.05), HasSubstr(kBelowGround));
}

// A weld's pose has the digits of its file: engines close the gap in a step.
TEST(PlausibleModels, WhatTheStartViolatesIsCorrected) {
  Model model;
  model.gravity.setZero();
  Body& body = model.bodies.emplace_back();
  body.mass = 1;
  body.I_BBcm_B = 0.01 * Mat3::Identity();
  model.welds.push_back({.name = "held", .body_a = 0, .body_b = kWorld, .X_AB = {Vec3(1e-6, 0, 0), Quat::Identity()}});
  model.initial = reference_state(model);
  const Plausibility plausibility(model, model.initial, 1, 0, {false, 1e-3});
  State state = model.initial;
  state.bodies[0].v_WBcm.x() = 1e-3;
  EXPECT_EQ(plausibility.impossibility(state), "");
  state.bodies[0].v_WBcm.x() = 1;
  EXPECT_THAT(plausibility.impossibility(state), HasSubstr("kinetic energy"));
}

// 1 g on a slide without limits under 1 N for 2 s is 2000 m/s fast and 2 km away.
TEST(PlausibleModels, AForceDrivesALightSlideFar) {
  Model model;
  model.gravity.setZero();
  Body& body = model.bodies.emplace_back();
  body.mass = 1e-3;
  body.I_BBcm_B = 1e-9 * Mat3::Identity();
  add_joint(model, 0, JointType::kSlide, Vec3::UnitX(), Vec3::Zero());
  Actuator& motor = model.actuators.emplace_back();
  motor.terms = {{0, 1.0}};
  model.initial = reference_state(model);
  model.control0 = {1.0};
  const auto control = actuator_control(model, model.control0);
  const double work = largest_work(model, *control, 2);
  EXPECT_NEAR(work, 2000, 1e-6) << "J: (1 N 2 s)^2 / (2 kg / 1000)";
  const Plausibility plausibility(model, model.initial, 2, work);
  State state = model.initial;
  state.position[0] = 2000;
  state.velocity[0] = 2000;
  bodies_from_joints(model, state);
  EXPECT_EQ(plausibility.impossibility(state), "");
  EXPECT_EQ(plausibility.divergence(state), "");
  state.velocity[0] = 5000;
  bodies_from_joints(model, state);
  EXPECT_THAT(plausibility.impossibility(state), HasSubstr("kinetic energy"));
}

}  // namespace
}  // namespace assay
