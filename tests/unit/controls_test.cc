// The actuators' torques are compared with MuJoCo's in mjcf_against_mujoco_test.cc.
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "controls/control.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;

// Two hinges in a row.
Model two_hinges() {
  Model model;
  model.bodies.push_back({.name = "upper", .joint = 0, .X_PB = {}, .mass = 1});
  model.bodies.push_back({.name = "lower", .parent = 0, .joint = 1, .X_PB = {}, .mass = 1});
  model.joints.push_back({.name = "shoulder", .body = 0});
  model.joints.push_back({.name = "elbow", .body = 1});
  return model;
}

std::vector<double> torques(const Control& control, const State& state) {
  std::vector<double> result(2, std::numeric_limits<double>::quiet_NaN());  // every entry has to be written
  control.torques(state, result);
  return result;
}

TEST(Controls, Passive) {
  const auto control = passive_control();
  EXPECT_THAT(torques(*control, reference_state(two_hinges())), ElementsAre(0, 0));
  EXPECT_TRUE(control->is_zero());
  EXPECT_EQ(control->input(), ControlInput::kNothing);
}

TEST(Controls, SineFollowsTime) {
  const Model model = two_hinges();
  const auto control = sine_control(model, {{2, 0.5, 0}, {3, 1, std::numbers::pi / 2}});
  State state = reference_state(model);
  EXPECT_THAT(torques(*control, state), ElementsAre(0, 3));
  state.time = 0.5;  // a quarter and a half of a period
  EXPECT_THAT(torques(*control, state), ElementsAre(DoubleNear(2, 1e-15), DoubleNear(-3, 1e-15)));
  EXPECT_EQ(control->input(), ControlInput::kTime);
  EXPECT_FALSE(control->is_zero());
  EXPECT_THROW(sine_control(model, {{1, 1, 0}}), std::invalid_argument);
  EXPECT_TRUE(sine_control(model, {{0, 1, 0}, {0, 1, 0}})->is_zero());
}

TEST(Controls, MotorsAndServosAdd) {
  Model model = two_hinges();
  model.actuators.push_back({.name = "motor", .terms = {{1, 3}}, .sine = {}});
  model.actuators.push_back({.name = "servo", .terms = {{1, 2}}, .gain = 5, .bias = {0, -5, -0.5}, .sine = {}});
  model.control0 = {0.25, 1};
  State state = reference_state(model);
  state.position = {9, 0.1};
  state.velocity = {9, 0.2};
  const double servo = 2 * (5 * (1 - 2 * 0.1) - 0.5 * 2 * 0.2);
  EXPECT_THAT(torques(*actuator_control(model), state), ElementsAre(0, DoubleNear(0.75 + servo, 1e-15)));
  EXPECT_THAT(torques(*actuator_control(model, {0, 0.2}), state),
              ElementsAre(0, DoubleNear(-2 * 0.5 * 2 * 0.2, 1e-15)));
  EXPECT_EQ(actuator_control(model)->input(), ControlInput::kState);
  EXPECT_FALSE(actuator_control(model, {0, 0})->is_zero());
  EXPECT_THROW(actuator_control(model, {1}), std::invalid_argument);
}

TEST(Controls, MotorsAloneNeedNoState) {
  Model model = two_hinges();
  EXPECT_TRUE(actuator_control(model)->is_zero());
  model.actuators.push_back({.name = "motor", .terms = {{0, 3}}, .sine = {}});
  model.control0 = {0};
  EXPECT_EQ(actuator_control(model)->input(), ControlInput::kNothing);
  EXPECT_TRUE(actuator_control(model)->is_zero());
  EXPECT_FALSE(actuator_control(model, {1})->is_zero());
}

TEST(Controls, Clamps) {
  const Actuator motor{.name = "motor",
                       .terms = {{0, -2}},
                       .sine = {},
                       .control_limited = true,
                       .force_limited = true,
                       .control_lower = -1,
                       .control_upper = 3,
                       .force_lower = -0.5,
                       .force_upper = 2};
  EXPECT_EQ(actuator_force(motor, 1, 0, 0), 1);
  EXPECT_EQ(actuator_force(motor, 9, 0, 0), 2);
  EXPECT_EQ(actuator_force(motor, -9, 0, 0), -0.5);
  const Actuator servo{.name = "servo",
                       .terms = {{0, 1}},
                       .gain = 10,
                       .bias = {0, -10, 0},
                       .sine = {},
                       .control_limited = true,
                       .control_upper = 1};
  EXPECT_EQ(actuator_force(servo, 5, 0.5, 7), 5);
}

TEST(Controls, MadeByName) {
  const Model model = two_hinges();
  State state = reference_state(model);
  state.time = 0.125;
  const auto sine =
      make_control(model, {.kind = "sine", .amplitude = 4, .frequency = 2, .phase_step = std::numbers::pi});
  EXPECT_THAT(torques(*sine, state), ElementsAre(DoubleNear(4, 1e-14), DoubleNear(-4, 1e-14)));
  EXPECT_EQ(sine->description(), "sine, 4 Nm, 2 Hz");
  EXPECT_TRUE(make_control(model, {.kind = "passive"})->is_zero());
  EXPECT_TRUE(make_control(model, {.kind = "actuators"})->is_zero());
  for (const std::string& kind : control_kinds()) EXPECT_NE(make_control(model, {.kind = kind}), nullptr);
}

TEST(Controls, ATextIsReadBack) {
  EXPECT_EQ(control_text({.kind = "passive", .amplitude = 7}), "passive");
  EXPECT_EQ(control_text({.kind = "sine", .amplitude = 2, .frequency = 0.1, .phase_step = -1e-3}),
            "sine,amplitude=2,frequency=0.1,phase_step=-0.001");
  const ControlSpec third{.kind = "sine", .amplitude = 1 / 3.0, .frequency = 2 / 3.0};
  const ControlSpec read = parse_control(control_text(third));
  EXPECT_EQ(read.kind, "sine");
  EXPECT_EQ(read.amplitude, third.amplitude);
  EXPECT_EQ(read.frequency, third.frequency);
  EXPECT_EQ(read.phase_step, third.phase_step);
  EXPECT_EQ(parse_control("sine,frequency=3").amplitude, ControlSpec{}.amplitude) << "the rest as in a campaign";
  EXPECT_EQ(parse_control("actuators").kind, "actuators");
  for (const char* wrong : {"sine,amplitude", "sine,amplitude=", "sine,amplitude=x", "sine,", "sine,ampltude=1",
                            "passive,amplitude=1", "sine,amplitude=1,,frequency=2"}) {
    EXPECT_THROW(parse_control(wrong), InputError) << wrong;
  }
}

std::string refusal(const ControlSpec& spec) {
  try {
    make_control(two_hinges(), spec);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Controls, UnknownNamesAndValuesAreRefused) {
  EXPECT_THAT(refusal({.kind = "sinus"}), HasSubstr("'sinus' (did you mean 'sine'?)"));
  EXPECT_EQ(refusal({.kind = "quadratic"}), "there is no control 'quadratic'; use one of passive, sine, actuators");
  EXPECT_THAT(refusal({.kind = "sine", .frequency = std::nan("")}), HasSubstr("frequency is nan"));
  EXPECT_THAT(refusal({.kind = "sine", .amplitude = HUGE_VAL}), HasSubstr("amplitude is inf"));
}

}  // namespace
}  // namespace assay
