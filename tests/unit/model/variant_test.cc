#include "model/variant.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "load/mjcf.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using testing::DoubleNear;

// A tilted capsule with a leg of a sphere, beside a thrown ball, above a plane that leans.
Model robot() {
  return load_model_text(R"(<mujoco>
      <worldbody>
        <geom type="plane" size="0 0 1" euler="10 0 0"/>
        <body name="torso" pos="0 0 2" euler="0 60 0">
          <freejoint/>
          <geom type="capsule" size="0.1" fromto="-0.3 0 0 0.3 0 0" mass="3"/>
          <body name="leg" pos="0.3 0 0">
            <joint name="hip" axis="0 1 0" range="-10 40" limited="true" damping="1"/>
            <geom type="sphere" size="0.05" pos="0 0 -0.4" mass="1"/>
          </body>
        </body>
        <body name="ball" pos="0 3 1"><freejoint/><geom type="sphere" size="0.2" mass="1"/></body>
      </worldbody>
    </mujoco>)",
                         "robot");
}

TEST(Variant, ExcludesPairsOfBodies) {
  const Model model = robot();
  const Model apart = variant_of(model, {.exclude = {{"leg", "ball"}, {"torso", "world"}}});
  const auto touch = [](const Model& of, const std::string& a, const std::string& b) {
    const auto name = [&](int shape) {
      const int body = of.shapes[static_cast<size_t>(shape)].body;
      return body == kWorld ? "world" : of.bodies[static_cast<size_t>(body)].name;
    };
    return std::ranges::any_of(of.contacts, [&](const ContactPair& pair) {
      const std::string first = name(pair.shape_a), second = name(pair.shape_b);
      return (first == a && second == b) || (first == b && second == a);
    });
  };
  for (const auto& [a, b] : {std::pair("leg", "ball"), std::pair("torso", "world")}) {
    EXPECT_TRUE(touch(model, a, b));
    EXPECT_FALSE(touch(apart, a, b));
  }
  EXPECT_EQ(apart.contacts.size(), model.contacts.size() - 2);
  EXPECT_NE(apart.hash, model.hash);
  try {
    variant_of(model, {.exclude = {{"leg", "bal"}}});
    FAIL() << "an unknown body was taken";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("'bal'"));
    EXPECT_THAT(error.what(), testing::HasSubstr("did you mean 'ball'"));
  }
}

TEST(Variant, StandsAtTheHeight) {
  const Model model = robot();
  // the ball, above a plane that is turned by 10 degrees about x
  const double tilt = 10 * std::numbers::pi / 180;
  EXPECT_NEAR(height_above_ground(model), std::cos(tilt) - 3 * std::sin(tilt) - 0.2, 1e-12);
  for (const double height : {0.0, 0.05, 4.0}) {
    const Model moved = variant_of(model, {.above_ground_m = height});
    EXPECT_NEAR(height_above_ground(moved), height, 1e-12);
    EXPECT_NE(moved.hash, model.hash);
    // all bodies move alike
    const Vec3 shift = moved.initial.bodies[0].p_WBcm - model.initial.bodies[0].p_WBcm;
    EXPECT_NEAR((moved.initial.bodies[1].p_WBcm - model.initial.bodies[1].p_WBcm - shift).norm(), 0, 1e-12);
    EXPECT_THAT(shift.x(), DoubleNear(0, 1e-12));
  }
  EXPECT_TRUE(std::isinf(height_above_ground(without_contacts(model))));
}

TEST(Variant, ReachOfEveryShape) {
  for (const auto& [shape, reach] :
       {std::pair("type='sphere' size='0.1'", 0.1),
        {"type='capsule' size='0.1 0.2' euler='60 0 0'", 0.1 + 0.2 * std::cos(M_PI / 3)}}) {
    const Model model = load_model_text(
        std::string(
            "<mujoco><worldbody><geom type='plane' size='0 0 1'/><body pos='0 0 1'><freejoint/><geom mass='1' ") +
            shape + "/></body></worldbody></mujoco>",
        "shape");
    EXPECT_NEAR(height_above_ground(model), 1 - reach, 1e-12) << shape;
  }
}

TEST(Variant, SmoothPartHasNoContactsAndLimits) {
  const Model smooth = variant_of(robot(), {.smooth = true});
  EXPECT_TRUE(smooth.contacts.empty());
  EXPECT_FALSE(smooth.has_limits());
  EXPECT_EQ(smooth.joints[0].damping, 1) << "a damper is smooth";
}

TEST(Variant, RatesFitTheJoints) {
  const Model model = robot(), moving = variant_of(model, {.start_rates = 2});
  EXPECT_NE(moving.initial.velocity[0], 0);
  EXPECT_LE(std::abs(moving.initial.velocity[0]), 2);
  State from_bodies = moving.initial;
  from_bodies.velocity.clear();
  joints_from_bodies(moving, from_bodies);
  EXPECT_NEAR(from_bodies.velocity[0], moving.initial.velocity[0], 1e-12);
  EXPECT_EQ(variant_of(model, {.start_rates = 2}).hash, moving.hash) << "the same on every call";
}

TEST(Variant, NothingAskedNothingChanged) { EXPECT_EQ(variant_of(robot(), {}).hash, robot().hash); }

}  // namespace
}  // namespace assay
