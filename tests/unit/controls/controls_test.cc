// The actuators' torques are compared with MuJoCo's in mjcf_against_mujoco_test.cc.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <Eigen/Cholesky>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "controls/control.h"
#include "controls/hold.h"
#include "model/joint_inertia.h"
#include "model/kinematics.h"
#include "temp_folder.h"

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
  model.initial = reference_state(model);
  return model;
}

std::vector<double> torques(const Control& control, const State& state) {
  std::vector<double> result(state.position.size(),
                             std::numeric_limits<double>::quiet_NaN());  // every entry has to be written
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
  const auto force = [](const Actuator& actuator, double control, double length, double speed) {
    return actuator_force(actuator, actuator_input(actuator, control, 0), length, speed);
  };
  EXPECT_EQ(force(motor, 1, 0, 0), 1);
  EXPECT_EQ(force(motor, 9, 0, 0), 2);
  EXPECT_EQ(force(motor, -9, 0, 0), -0.5);
  const Actuator servo{.name = "servo",
                       .terms = {{0, 1}},
                       .gain = 10,
                       .bias = {0, -10, 0},
                       .sine = {},
                       .control_limited = true,
                       .control_upper = 1};
  EXPECT_EQ(force(servo, 5, 0.5, 7), 5);
}

// The closed forms against the differential equation, integrated in small steps by the midpoint rule.
TEST(Controls, ActivationsFollowTheirEquation) {
  for (const ActivationType type : {ActivationType::kFilter, ActivationType::kIntegrator}) {
    for (const double frequency : {0.0, 0.7, 3.0}) {
      Actuator actuator;
      actuator.activation = type;
      actuator.time_constant = 0.2;
      actuator.activation_start = -0.5;
      actuator.sine = {.amplitude = 0.8, .frequency = frequency, .phase = 0.4};
      Actuator plain = actuator;  // its input is the control
      plain.activation = ActivationType::kNone;
      const double control = 1.5, h = 1e-3;
      const auto rate = [&](double activation, double time) {
        const double u = actuator_input(plain, control, time);
        return type == ActivationType::kFilter ? (u - activation) / actuator.time_constant : u;
      };
      double activation = actuator.activation_start;
      for (int i = 0; i < 2000; ++i) {
        EXPECT_NEAR(actuator_input(actuator, control, i * h), activation, 1e-5);
        activation += h * rate(activation + h / 2 * rate(activation, i * h), (i + 0.5) * h);
      }
    }
  }
}

TEST(Controls, ActivationsAreLimited) {
  Actuator actuator;
  actuator.terms = {{0, 1}};
  actuator.gain = 2;
  actuator.activation = ActivationType::kIntegrator;
  actuator.control_limited = actuator.activation_limited = true;
  actuator.control_lower = -1;
  actuator.control_upper = 1;
  actuator.activation_lower = -3;
  actuator.activation_upper = 0.5;
  EXPECT_EQ(actuator_input(actuator, 10, 0.25), 0.25);
  EXPECT_EQ(actuator_input(actuator, 10, 7), 0.5);
  EXPECT_EQ(actuator_input(actuator, -10, 7), -3);
  Model model = two_hinges();
  model.actuators = {actuator};
  model.control0 = {0};
  EXPECT_TRUE(actuator_control(model)->is_zero());
  EXPECT_FALSE(actuator_control(model, {1})->is_zero());
  EXPECT_EQ(actuator_control(model, {1})->input(), ControlInput::kTime);
  EXPECT_EQ(effort_limits(model).at(0), 6);
  model.actuators[0].activation_limited = false;
  EXPECT_EQ(effort_limits(model).at(0), std::numeric_limits<double>::infinity());
  model.actuators[0].activation = ActivationType::kFilter;
  EXPECT_EQ(effort_limits(model).at(0), 2);
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
  for (const std::string& kind : control_kinds()) {
    if (kind == "file" || kind == "policy") continue;
    EXPECT_NE(make_control(model, {.kind = kind}), nullptr) << kind;
  }
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
  EXPECT_EQ(control_text(parse_control("random,seed=3")), "random,motion=0.3,seed=3");
  EXPECT_EQ(parse_control("hold,natural_frequency=2").natural_frequency, 2);
  const ControlSpec file = parse_control("file,path=a,b=1.csv");
  EXPECT_EQ(file.file, "a,b=1.csv") << "the rest of the text";
  EXPECT_EQ(control_text(file), "file,path=a,b=1.csv");
  EXPECT_EQ(control_text(parse_control("push.csv")), "file,path=push.csv");
  for (const char* wrong :
       {"sine,amplitude", "sine,amplitude=", "sine,amplitude=x", "sine,", "sine,ampltude=1", "passive,amplitude=1",
        "sine,amplitude=1,,frequency=2", "random,amplitude=1", "file,seed=1"}) {
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
  EXPECT_EQ(
      refusal({.kind = "quadratic"}),
      "there is no control 'quadratic'; use one of passive, sine, actuators, hold, random, file, policy, the last "
      "two with their files: file,path=torques.csv, policy,config=policy.toml, in a campaign {kind = \"file\", "
      "path = \"torques.csv\"}");
  EXPECT_THAT(refusal({.kind = "sine", .frequency = std::nan("")}),
              HasSubstr("frequency of the control 'sine' is nan"));
  EXPECT_THAT(refusal({.kind = "sine", .amplitude = HUGE_VAL}), HasSubstr("amplitude of the control 'sine' is inf"));
  EXPECT_THAT(refusal({.kind = "hold", .natural_frequency = -1}), HasSubstr("natural_frequency of the control 'hold'"));
  EXPECT_THAT(refusal({.kind = "random", .seed = 0.5}), HasSubstr("seed of the control 'random' is 0.5"));
  EXPECT_THAT(refusal({.kind = "file"}), HasSubstr("has no path"));
  // which is the syntax that is understood
  EXPECT_EQ(parse_control("file,path=torques.csv").file, "torques.csv");
  EXPECT_EQ(parse_control("policy,config=policy.toml").policy, "policy.toml");
  EXPECT_THAT(refusal({.kind = "file", .file = "/nowhere.csv"}), HasSubstr("'/nowhere.csv' cannot be read"));
}

// A pendulum has one inertia, so the gains and the free motion have closed forms.
Model pendulum() {
  Model model;
  Body& body = model.bodies.emplace_back();
  body.joint = 0;
  body.mass = 2;
  body.p_BBcm = {0, 0, -0.5};
  body.I_BBcm_B = 0.1 * Mat3::Identity();
  Joint& joint = model.joints.emplace_back();
  joint.axis_B = Vec3::UnitY();
  joint.armature = 0.4;
  model.initial = reference_state(model);
  return model;
}

TEST(Hold, GainsFollowFromTheInertia) {
  Model model = pendulum();
  const double inertia = 0.1 + 2 * 0.5 * 0.5 + 0.4, w = 2 * std::numbers::pi * 3;
  EXPECT_NEAR(joint_inertia(model, model.initial)(0, 0), inertia, 1e-14);
  State state = model.initial;
  const auto hold = hold_control(model, 3);
  state.position[0] = 0.01;
  EXPECT_THAT(torques(*hold, state), ElementsAre(DoubleNear(-0.01 * inertia * w * w, 1e-12)));
  state.position[0] = 0;
  state.velocity[0] = 0.1;
  EXPECT_THAT(torques(*hold, state), ElementsAre(DoubleNear(-0.1 * 2 * inertia * w, 1e-12)));
  Actuator motor;
  motor.terms = {{0, -2.0}};
  motor.control_limited = true;
  motor.control_lower = -3;
  motor.control_upper = 1;
  model.actuators = {motor};
  EXPECT_THAT(effort_limits(model), ElementsAre(6)) << "gear times the larger control";
  state.position[0] = 1;
  EXPECT_THAT(torques(*hold_control(model, 3), state), ElementsAre(-6));
}

TEST(Hold, EveryModeIsAsStiff) {
  // Two links in a row: the elbow's torque pushes the shoulder back. Without gravity both return like one joint alone.
  Model model = pendulum();
  model.joints[0].armature = 0;
  Body tip = model.bodies[0];
  tip.parent = 0;
  tip.joint = 1;
  tip.X_PB.p = {0, 0, -1};
  tip.I_BBcm_B = 1e-3 * Mat3::Identity();
  model.bodies.push_back(tip);
  model.joints.push_back(model.joints[0]);
  model.joints[1].body = 1;
  model.initial = reference_state(model);
  const Eigen::MatrixXd A = joint_inertia(model, model.initial);
  ASSERT_GT(std::abs(A(0, 1)), 0.1 * A(1, 1));
  const double w = 2 * std::numbers::pi * 10;
  State state = model.initial;
  state.position = {0.01, -0.02};
  const std::vector<double> at = torques(*hold_control(model), state);
  const Eigen::Vector2d acceleration = A.ldlt().solve(Eigen::Vector2d(at[0], at[1]));
  EXPECT_NEAR(acceleration[0], -w * w * 0.01, 1e-9);
  EXPECT_NEAR(acceleration[1], w * w * 0.02, 1e-9);
  state.position = {0, 0};
  state.velocity = {0.3, 0};
  const std::vector<double> damped = torques(*hold_control(model), state);
  const Eigen::Vector2d braking = A.ldlt().solve(Eigen::Vector2d(damped[0], damped[1]));
  EXPECT_NEAR(braking[0], -2 * w * 0.3, 1e-9);
  EXPECT_NEAR(braking[1], 0, 1e-9);
}

TEST(Hold, LeavesWhatNoActuatorDrives) {
  // A cart on a slide that nothing drives, with a driven pendulum: it feels the inertia of both.
  Model model;
  Body& cart = model.bodies.emplace_back();
  cart.joint = 0;
  cart.mass = 2;
  Body& pole = model.bodies.emplace_back();
  pole.parent = 0;
  pole.joint = 1;
  pole.mass = 1;
  pole.p_BBcm = {0, 0, -1};
  pole.I_BBcm_B = 1e-9 * Mat3::Identity();
  model.joints.resize(2);
  model.joints[0].type = JointType::kSlide;
  model.joints[0].axis_B = Vec3::UnitX();
  model.joints[1].body = 1;
  model.joints[1].axis_B = Vec3::UnitY();
  Actuator motor;
  motor.terms = {{1, 1.0}};
  model.actuators = {motor};
  model.initial = reference_state(model);
  State state = model.initial;
  state.position = {1, 0.01};
  const double w = 2 * std::numbers::pi * 2, reduced = 1.0 * 2 / (1 + 2);
  EXPECT_THAT(torques(*hold_control(model, 2), state), ElementsAre(0, DoubleNear(-0.01 * reduced * w * w, 1e-7)));
  state.time = 0.3;
  EXPECT_EQ(torques(*random_control(model, 0.3, 1), state)[0], 0);
}

TEST(Hold, AFreeBodyFollows) {
  // A hinge between two equal free spheres' centres line moves both: half of the inertia that one side has when held.
  Model model;
  for (int i = 0; i < 2; ++i) {
    Body& body = model.bodies.emplace_back();
    body.mass = 1;
    body.I_BBcm_B = 0.2 * Mat3::Identity();
    body.parent = i - 1;
  }
  model.bodies[1].joint = 0;
  Joint& joint = model.joints.emplace_back();
  joint.body = 1;
  model.initial = reference_state(model);
  EXPECT_NEAR(joint_inertia(model, model.initial)(0, 0), 0.1, 1e-14);
}

TEST(Random, SeedsDecide) {
  const Model model = pendulum();
  State state = model.initial;
  state.time = 0.3;
  const auto at = [&](double seed) {
    return torques(*make_control(model, {.kind = "random", .seed = seed}), state)[0];
  };
  EXPECT_EQ(at(1), at(1));
  EXPECT_NE(at(1), at(2));
  EXPECT_NE(at(0), 0);
  double largest = 0;
  for (int i = 0; i < 4000; ++i) {
    state.time = i * 0.01;
    largest = std::max(largest, std::abs(at(7)));
  }
  const double w = 2 * std::numbers::pi * 3, inertia = 1.0;
  EXPECT_LE(largest, inertia * w * w * 0.3) << "three sines of a third each";
  EXPECT_GT(largest, inertia * w * w * 0.3 / 100);
}

class TorqueFile : public TempFolderTest {
 protected:
  std::string file(const std::string& text) const {
    std::filesystem::create_directories(dir_);
    const std::string path = dir_ / "torques.csv";
    std::ofstream(path) << text;
    return path;
  }
  std::string refused(const std::string& text) const { return refusal({.kind = "file", .file = file(text)}); }
};

TEST_F(TorqueFile, IsInterpolated) {
  const Model model = two_hinges();
  const std::string& name = model.joints[1].name;
  const auto control =
      make_control(model, {.kind = "file", .file = file("time," + name + "\n0,1\n\n0.5, 3\r\n1,-1\n")});
  State state = reference_state(model);
  for (const auto& [time, torque] : {std::pair(0.0, 1.0), {0.25, 2.0}, {0.5, 3.0}, {0.75, 1.0}, {9.0, -1.0}}) {
    state.time = time;
    EXPECT_THAT(torques(*control, state), ElementsAre(0, DoubleNear(torque, 1e-15))) << time;
  }
  EXPECT_EQ(control->input(), ControlInput::kTime);
  EXPECT_TRUE(make_control(model, {.kind = "file", .file = file("time," + name + "\n0,0\n")})->is_zero());
}

TEST_F(TorqueFile, ErrorsNameTheirLine) {
  const std::string header = "time," + two_hinges().joints[0].name + "\n";
  EXPECT_THAT(refused(header + "0,1\n1,2,3\n"), HasSubstr("torques.csv:3: there are 3 columns, but the header has 2"));
  EXPECT_THAT(refused(header + "0,nan\n"), HasSubstr("torques.csv:2: column 2 is 'nan'"));
  EXPECT_THAT(refused(header + "0,1\n0.5,2\n0.5,3\n"),
              HasSubstr("torques.csv:4: the time 0.5 does not come after 0.5"));
  EXPECT_THAT(refused("time,knee\n0,1\n"), HasSubstr("torques.csv:1: 'knee' is no hinge or slide"));
  EXPECT_THAT(refused("t,knee\n"), HasSubstr("torques.csv:1: the header begins with 't'"));
  EXPECT_THAT(refused("time\n0\n"), HasSubstr("the header names no joint"));
  EXPECT_THAT(refused(header), HasSubstr("has only a header"));
  EXPECT_THAT(refused(""), HasSubstr("is empty"));
}

}  // namespace
}  // namespace assay
