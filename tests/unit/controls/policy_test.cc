// Observations and torques are compared with values that were computed by hand; networks are run by ONNX Runtime.
#include "controls/policy.h"

#include <cmath>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "controls/control.h"
#include "controls/onnx_network.h"
#include "controls/recorded_actions.h"
#include "controls/work.h"
#include "model/kinematics.h"
#include "policy_files.h"

namespace assay {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::Pointwise;

constexpr double kInf = std::numeric_limits<double>::infinity();

std::vector<double> observed(const PolicyConfig& config, const State& state, std::vector<double> last = {0, 0},
                             double time = 0) {
  std::vector<double> observation(config.observations(), std::numeric_limits<double>::quiet_NaN());
  observe(config, walker(), state, last, time, observation);
  return observation;
}

Quat turned(const Vec3& axis, double angle) { return Quat(Eigen::AngleAxisd(angle, axis)); }

auto near(const std::vector<double>& values) { return Pointwise(testing::DoubleNear(1e-12), values); }

TEST(PolicyObservation, BaseVelocitiesAreInTheBasesAxesAndOfItsOrigin) {
  const PolicyConfig config = parsed(config_text(term("base_lin_vel") + term("base_ang_vel")));
  State state = walker().initial;
  // turned by 90 degrees about z: the base's x axis is the world's y axis
  state.bodies[0].q_WB = turned(Vec3::UnitZ(), std::numbers::pi / 2);
  state.bodies[0].w_WB = {1, 0, 2};
  state.bodies[0].v_WBcm = {0, 3, 0};
  // The origin lies 0.1 m behind the centre of mass, at -0.1 y of the world: w x r = (0.2, 0, -0.1). In the base's axes
  // world x is -y, world y is x.
  EXPECT_THAT(observed(config, state), near({3, -0.2, -0.1, 0, -1, 2}));
}

TEST(PolicyObservation, GravityAndOrientation) {
  const PolicyConfig config =
      parsed(config_text(term("projected_gravity") + term("base_quat_wxyz") + term("base_height")));
  State state = walker().initial;
  state.bodies[0].q_WB = turned(Vec3::UnitX(), std::numbers::pi / 2);
  state.bodies[0].p_WBcm = {0.1, 0, 0.3};
  const double half = std::numbers::sqrt2 / 2;
  // rolled to the right by 90 degrees: the base's y axis points up
  EXPECT_THAT(observed(config, state), near({0, -1, 0, half, half, 0, 0, 0.3}));
  // the same orientation by the opposite quaternion
  state.bodies[0].q_WB.coeffs() *= -1;
  EXPECT_THAT(observed(config, state), near({0, -1, 0, half, half, 0, 0, 0.3}));
  // pitched so that the nose points down: gravity is along x, and the centre of mass lies 0.1 m below the origin
  state.bodies[0].q_WB = turned(Vec3::UnitY(), std::numbers::pi / 2);
  EXPECT_THAT(observed(config, state), near({1, 0, 0, half, 0, half, 0, 0.4}));
}

TEST(PolicyObservation, JointsInThePolicysOrderRelativeToItsDefault) {
  const PolicyConfig config = parsed(config_text(
      term("joint_pos_rel") + term("joint_vel_rel", "scale = 0.05\n") + term("joint_pos", "joints = [\"hip\"]\n"),
      "joints = [\"knee\", \"hip\"]\ndefault_joint_pos = {knee = -1.5, \"h*\" = 0.75}\n"));
  State state = walker().initial;
  state.position = {1, -2};
  state.velocity = {10, 20};
  EXPECT_THAT(observed(config, state), near({-0.5, 0.25, 1, 0.5, 1}));
}

TEST(PolicyObservation, ScaleBehindTheTermsClipAndBeforeTheCommonOne) {
  const PolicyConfig config =
      parsed(config_text(term("joint_vel_rel", "clip = 4\nscale = [0.5, 10]\n") + term("last_action") +
                             term("velocity_commands", "scale = [2, 2, 0.25]\n") + term("phase", "period_s = 0.8\n") +
                             term("constant", "values = [3, -7]\n"),
                         "", kActions, kPd, "clip = [-30, 5]\n", kControl, "[command]\nvelocity = [0.5, 0, 1]\n"));
  State state = walker().initial;
  state.velocity = {8, -8};
  EXPECT_THAT(observed(config, state, {1, -2}, 0.2), near({2, -30, 1, -2, 1, 0, 0.25, 1, 0, 3, -7}));
}

// ---- a run ----------------------------------------------------------------------------------------------------------

// Gives what `answer` says, and keeps what it was asked.
class FakeNetwork final : public ActionSource {
 public:
  using Answer = std::function<std::vector<double>(size_t step)>;
  FakeNetwork(std::vector<std::vector<double>>& asked, Answer answer) : asked_(asked), answer_(std::move(answer)) {}
  void act(std::span<const double> observation, std::span<double> actions) override {
    const std::vector<double> answer = answer_(asked_.size());
    std::ranges::copy(answer, actions.begin());
    asked_.emplace_back(observation.begin(), observation.end());
  }

 private:
  std::vector<std::vector<double>>& asked_;
  Answer answer_;
};

struct Driven {
  Model model = walker();
  PolicyConfig config;
  std::vector<std::vector<double>> asked;
  std::unique_ptr<ControlRun> run;
  State state = model.initial;

  Driven(const std::string& text, const FakeNetwork::Answer& answer, double timestep_s = 0.005)
      : config(parsed(text)),
        run(policy_run(config, model, std::make_unique<FakeNetwork>(asked, answer), timestep_s)) {}

  std::vector<double> step() const {
    std::vector<double> torques(2, std::numeric_limits<double>::quiet_NaN());
    run->torques(state, torques);
    return torques;
  }
};

TEST(PolicyRun, HoldsTargetsForThePeriodAndComputesThePdAtEachStep) {
  Driven driven(config_text(), [](size_t step) { return std::vector{1.0 + static_cast<double>(step), -2.0}; });
  // the targets are the default plus 0.25 times the action: 0.75 and -1.5
  driven.state.velocity = {2, 0};
  EXPECT_THAT(driven.step(), near({20 * 0.25 - 0.5 * 2, 20 * -0.5}));
  driven.state.position = {0.7, -1.6};
  EXPECT_THAT(driven.step(), near({20 * 0.05 - 1, 20 * 0.1}));
  driven.step();
  driven.step();
  EXPECT_EQ(driven.asked.size(), 1);
  // the second control step: the target of the hip is 1
  EXPECT_THAT(driven.step(), near({20 * 0.3 - 1, 20 * 0.1}));
  ASSERT_EQ(driven.asked.size(), 2);
  EXPECT_THAT(driven.asked[1], near({0.2, -0.6}));
  EXPECT_EQ(driven.run->account().policy_steps, 2);
  EXPECT_GE(driven.run->account().policy_s, 0);
}

TEST(PolicyRun, CountsTheWorkOfItsTorques) {
  Driven driven(config_text(), [](size_t) { return std::vector{1.0, 0.0}; });
  driven.state.velocity = {-2, 0};
  const double torque = driven.step().front();
  EXPECT_NEAR(driven.run->account().work, std::abs(torque * 2) * 0.005, 1e-15);
}

TEST(PolicyRun, AnotherTimestepHasThePeriodOfTraining) {
  Driven driven(config_text(), [](size_t) { return std::vector{0.0, 0.0}; }, 0.002);
  for (int i = 0; i < 11; ++i) driven.step();
  EXPECT_EQ(driven.asked.size(), 2);
}

TEST(PolicyRun, APeriodThatIsNoWholeNumberOfTimestepsIsRefused) {
  try {
    Driven driven(config_text(), [](size_t) { return std::vector{0.0, 0.0}; }, 0.003);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("20 ms"), HasSubstr("timesteps of 3 ms"), HasSubstr("policy.toml")));
  }
}

TEST(PolicyRun, ClampsTorquesToTheRobotsLimitsOrThePolicys) {
  const auto far = [](size_t) { return std::vector{100.0, -100.0}; };
  EXPECT_THAT(Driven(config_text(), far).step(), ElementsAre(20, -20));
  EXPECT_THAT(
      Driven(config_text(kTerms, "", kActions, std::string(kPd) + "effort_limit = {hip = 5, knee = 7}\n"), far).step(),
      ElementsAre(5, -7));
}

TEST(PolicyRun, VelocityAndEffortActions) {
  const auto ones = [](size_t) { return std::vector{1.0, -1.0}; };
  Driven velocity(config_text(kTerms, "", "[actions]\ntype = \"joint_velocity\"\nscale = 3\n", "[pd]\ndamping = 2\n"),
                  ones);
  velocity.state.velocity = {1, 1};
  EXPECT_THAT(velocity.step(), near({2 * (3 - 1), 2 * (-3 - 1)}));
  Driven effort(config_text(kTerms, "", "[actions]\ntype = \"joint_effort\"\nscale = 4\noffset = [1, 0]\n", ""), ones);
  EXPECT_THAT(effort.step(), near({5, -4}));
}

TEST(PolicyRun, JointsWithoutAnActionGetNoTorque) {
  Driven driven(config_text(kTerms, "", "[actions]\ntype = \"joint_effort\"\njoints = [\"knee\"]\n", ""),
                [](size_t) { return std::vector{3.0}; });
  EXPECT_THAT(driven.step(), ElementsAre(0, 3));
}

TEST(PolicyRun, DelaysActionsByControlSteps) {
  Driven driven(config_text(term("last_action"), "", "[actions]\ntype = \"joint_effort\"\noffset = 1\n", "", "",
                            "[control]\nperiod_ms = 5\ndelay = 2\n"),
                [](size_t step) { return std::vector{5.0 + static_cast<double>(step), 0.0}; });
  // before the first action arrives, that of zero acts
  EXPECT_THAT(driven.step(), ElementsAre(1, 1));
  EXPECT_THAT(driven.step(), ElementsAre(1, 1));
  EXPECT_THAT(driven.step(), ElementsAre(6, 1));
  EXPECT_THAT(driven.step(), ElementsAre(7, 1));
  // what the network is told is its newest action, not the one that acts
  EXPECT_THAT(driven.asked[0], ElementsAre(0, 0));
  EXPECT_THAT(driven.asked[1], ElementsAre(5, 0));
  EXPECT_THAT(driven.asked[3], ElementsAre(7, 0));
}

TEST(PolicyRun, ClipsActionsBeforeScaleAndMemory) {
  Driven driven(config_text(term("last_action"), "", "[actions]\ntype = \"joint_effort\"\nscale = 2\nclip = 3\n", "",
                            "", "[control]\nperiod_ms = 5\n"),
                [](size_t) { return std::vector{9.0, -9.0}; });
  EXPECT_THAT(driven.step(), ElementsAre(6, -6));
  driven.step();
  EXPECT_THAT(driven.asked[1], ElementsAre(3, -3));
}

// What the network is told in its first three control steps, in which the hip is at 1, 2, 3 and the knee at 10, 20, 30.
std::vector<std::vector<double>> told(const std::string& observations) {
  Driven driven(config_text(term("joint_pos", "joints = [\"hip\"]\n") + term("joint_pos", "joints = [\"knee\"]\n"), "",
                            kActions, kPd, observations, "[control]\nperiod_ms = 5\n"),
                [](size_t) { return std::vector{0.0, 0.0}; });
  for (const double x : {1.0, 2.0, 3.0}) {
    driven.state.position = {x, 10 * x};
    driven.step();
  }
  return driven.asked;
}

TEST(PolicyRun, HistoryInEachLayout) {
  EXPECT_THAT(told("history = 2\n"),
              ElementsAre(ElementsAre(1, 1, 10, 10), ElementsAre(1, 2, 10, 20), ElementsAre(2, 3, 20, 30)));
  EXPECT_THAT(told("history = 2\nhistory_order = \"newest_first\"\n")[2], ElementsAre(3, 2, 30, 20));
  EXPECT_THAT(told("history = 2\nhistory_layout = \"step\"\n")[2], ElementsAre(2, 20, 3, 30));
  EXPECT_THAT(told("history = 3\nhistory_layout = \"step\"\nhistory_start = \"zero\"\n")[1],
              ElementsAre(0, 0, 1, 10, 2, 20));
}

TEST(PolicyRun, AnActionThatIsNoNumberEndsTheRun) {
  for (const double bad : {std::nan(""), kInf}) {
    Driven driven(config_text(), [&](size_t step) { return std::vector{0.0, step == 1 ? bad : 0.0}; });
    for (int i = 0; i < 4; ++i) driven.step();
    try {
      driven.step();
      FAIL();
    } catch (const PolicyError& error) {
      EXPECT_THAT(error.what(), AllOf(HasSubstr("action 2 of 2 ('knee')"), HasSubstr("control step 2")));
    }
  }
}

// ---- drives of the engine -------------------------------------------------------------------------------------------

TEST_F(PolicyFile, DrivesOfTheEngineAreItsSpringsAndTheTargetsTorque) {
  Model model = walker();
  model.joints[0].stiffness = 3;
  model.joints[0].spring_reference = 0.1;
  const std::string actions = write("actions.csv", "hip,knee\n1,2\n");
  const std::string pd = std::string(kPd) + "law = \"engine\"\n";
  const auto control = policy_control(model, write("policy.toml", config_text(kTerms, "", kActions, pd)), actions);
  Model driven = model;
  control->equip(driven);
  EXPECT_EQ(driven.joints[0].stiffness, 23);
  EXPECT_EQ(driven.joints[1].damping, 0.5);
  EXPECT_NE(driven.hash, model.hash);
  std::vector<double> torques(2);
  control->start(0.005)->torques(model.initial, torques);
  // With the springs, whose reference is 0.1 and 0, they pull towards 0.75 and -0.5.
  EXPECT_THAT(torques, near({20 * (0.75 - 0.1), 20 * -0.5}));
  EXPECT_THAT(control->description(), HasSubstr("without torque limits"));
  EXPECT_EQ(largest_work(model, *control, 1), kInf);
}

TEST_F(PolicyFile, RecordedActionsAreGivenStepByStepAndHeld) {
  const std::string config = write("policy.toml", config_text(kTerms, "network = \"actions.csv\"\n"));
  write("actions.csv", "knee, hip\n0, 1\n\n2, 3\n");
  const auto control = policy_control(walker(), config, "");
  const auto run = control->start(0.02);
  std::vector<double> torques(2);
  const State state = walker().initial;
  for (const double hip : {1.0, 3.0, 3.0}) {
    run->torques(state, torques);
    EXPECT_THAT(torques, near({20 * 0.25 * hip, hip == 1 ? 0 : 20 * 0.25 * 2}));
  }
  EXPECT_THAT(control->description(), HasSubstr("record of 2 actions every 20 ms"));
  EXPECT_TRUE(control->has_memory());
  EXPECT_THROW(control->check_timestep(0.003), InputError);
  // the content decides, not the name
  write("actions.csv", "knee, hip\n0, 1\n\n2, 4\n");
  EXPECT_NE(policy_control(walker(), config, "")->description(), control->description());
}

TEST_F(PolicyFile, RecordedActionsThatDoNotFitAreRefused) {
  const PolicyConfig config = parsed(config_text());
  const auto refusal = [&](const std::string& text) -> std::string {
    try {
      parse_recorded_actions(text, "actions.csv", config, walker());
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal("hip,knee,ankle\n"), AllOf(HasSubstr("names 3 joints"), HasSubstr("has 2 actions")));
  EXPECT_THAT(refusal("hip,kne\n"), AllOf(HasSubstr("actions.csv:1"), HasSubstr("did you mean 'knee'")));
  EXPECT_THAT(refusal("hip,hip\n"), HasSubstr("two columns"));
  EXPECT_THAT(refusal("hip,knee\n1\n"), HasSubstr("actions.csv:2: there are 1 columns, but the header has 2"));
  EXPECT_THAT(refusal("hip,knee\n1,nan\n"), HasSubstr("column 2 is 'nan'"));
  EXPECT_THAT(refusal("hip,knee\n"), HasSubstr("no line of actions"));
  EXPECT_THAT(refusal(""), HasSubstr("no line of actions"));
}

// ---- configurations that do not fit ---------------------------------------------------------------------------------

std::string refusal_of(const std::string& text, const Model& model = walker()) {
  try {
    parse_policy_config(model, text, "policy.toml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(PolicyConfigRefusals, NameBothSides) {
  const std::string three = "joints = [\"hip\", \"knee\", \"ankle\"]\n";
  EXPECT_THAT(refusal_of(config_text(kTerms, three)),
              AllOf(HasSubstr("policy.toml:1"), HasSubstr("names 3 joints"), HasSubstr("'walker' has 2 joints")));
  EXPECT_THAT(refusal_of(config_text(kTerms, "joints = [\"hip\", \"kne\"]\n")),
              AllOf(HasSubstr("'kne' is no hinge or slide of 'walker'"), HasSubstr("did you mean 'knee'")));
  EXPECT_THAT(refusal_of(config_text(kTerms, "joints = [\"hip\", \"hip\"]\n")), HasSubstr("names 'hip' twice"));
  EXPECT_THAT(refusal_of(config_text(kTerms, "default_joint_pos = [1, 2, 3]\n")),
              HasSubstr("has 3 numbers, but there are 2 joints"));
  EXPECT_THAT(refusal_of(config_text(kTerms, "default_joint_pos = {hip = 1}\n")),
              HasSubstr("has nothing for the joint 'knee'"));
  EXPECT_THAT(refusal_of(config_text(kTerms, "default_joint_pos = {\"*\" = 1, hip = 2}\n")),
              HasSubstr("both match the joint 'hip'"));
  EXPECT_THAT(refusal_of(config_text(kTerms, "default_joint_pos = {\"*\" = 1, ankle = 2}\n")),
              HasSubstr("matches no joint"));
  EXPECT_THAT(refusal_of(config_text(kTerms, "base = \"torso\"\n")), HasSubstr("no moving body of 'walker'"));
  EXPECT_THAT(refusal_of(config_text(kTerms, "bases = 1\n")), HasSubstr("unknown key 'bases'"));
  EXPECT_THAT(refusal_of("[control"), HasSubstr("policy.toml:1"));
}

TEST(PolicyConfigRefusals, Control) {
  const auto with = [](const std::string& control) {
    return refusal_of(config_text(kTerms, "", kActions, kPd, "", control));
  };
  EXPECT_THAT(with("[control]\ntimestep_ms = 5\ndecimation = 4\nperiod_ms = 10\n"),
              AllOf(HasSubstr("period_ms is 10"), HasSubstr("timestep_ms = 5 times decimation = 4 is 20")));
  EXPECT_EQ(with("[control]\ntimestep_ms = 5\ndecimation = 4\nperiod_ms = 20\n"), "");
  EXPECT_THAT(with("[control]\ntimestep_ms = 5\n"), HasSubstr("how long a control step is"));
  EXPECT_THAT(with("[control]\ntimestep_ms = 5\ndecimation = 1.5\n"), HasSubstr("'decimation' is 1.5"));
  EXPECT_THAT(with("[control]\nperiod_ms = -1\n"), HasSubstr("'period_ms' is -1"));
  EXPECT_THAT(with("[control]\nperiod_ms = 20\ndelay = -1\n"), HasSubstr("'delay' is -1"));
  EXPECT_THAT(with(""), HasSubstr("no [control]"));
}

TEST(PolicyConfigRefusals, Observations) {
  const auto with = [](const std::string& terms) { return refusal_of(config_text(terms)); };
  EXPECT_THAT(with(term("joint_pose")), AllOf(HasSubstr("'joint_pose'"), HasSubstr("did you mean 'joint_pos'")));
  EXPECT_THAT(with(term("base_ang_vel", "scale = [1, 2]\n")), HasSubstr("'scale' has 2 numbers, but the term "
                                                                        "'base_ang_vel' has 3"));
  EXPECT_THAT(with(term("base_ang_vel", "clip = 0\n")), HasSubstr("'clip' is 0"));
  EXPECT_THAT(with(term("base_ang_vel", "joints = [\"hip\"]\n")), HasSubstr("unknown key 'joints'"));
  EXPECT_THAT(with(term("velocity_commands")), HasSubstr("there are none: give [command]"));
  EXPECT_THAT(with(term("phase")), HasSubstr("no period_s"));
  EXPECT_THAT(with("terms = 3\n"), HasSubstr("[[observations.terms]]"));
  EXPECT_THAT(with(""), HasSubstr("[[observations.terms]]"));
  EXPECT_THAT(refusal_of(config_text(kTerms, "", kActions, kPd, "history = 0\n")), HasSubstr("'history' is 0"));
  Model fixed = walker();
  fixed.bodies.erase(fixed.bodies.begin());
  for (Body& body : fixed.bodies) --body.parent;
  for (Joint& joint : fixed.joints) --joint.body;
  fixed.initial = reference_state(fixed);
  EXPECT_THAT(refusal_of(config_text(term("base_ang_vel")), fixed),
              AllOf(HasSubstr("base_ang_vel is of a base"), HasSubstr("'walker' has no free body")));
}

TEST(PolicyConfigRefusals, ActionsAndGains) {
  const auto with = [](const std::string& actions, const std::string& pd) {
    return refusal_of(config_text(kTerms, "", actions, pd));
  };
  EXPECT_THAT(with("[actions]\ntype = \"position\"\n", kPd),
              HasSubstr("'type' is 'position': use one of joint_position"));
  EXPECT_THAT(with("[actions]\nscale = 1\n", kPd), HasSubstr("[actions] has no type"));
  EXPECT_THAT(with("[actions]\ntype = \"joint_position\"\nscale = [1, 2, 3]\n", kPd),
              HasSubstr("'scale' has 3 numbers, but there are 2 joints"));
  EXPECT_THAT(with("[actions]\ntype = \"joint_effort\"\noffset = \"default\"\n", ""), HasSubstr("for joint_position"));
  EXPECT_THAT(with("[actions]\ntype = \"joint_effort\"\n", kPd), HasSubstr("the actions are efforts"));
  EXPECT_THAT(with(kActions, ""), HasSubstr("no [pd]"));
  EXPECT_THAT(with(kActions, "[pd]\ndamping = 1\n"), HasSubstr("[pd] has no stiffness"));
  EXPECT_THAT(with(kActions, "[pd]\nstiffness = -1\ndamping = 1\n"), HasSubstr("negative"));
  EXPECT_THAT(with(kActions, std::string(kPd) + "effort_limit = 0\n"), HasSubstr("an effort_limit is 0"));
  EXPECT_THAT(with(kActions, std::string(kPd) + "law = \"engine\"\neffort_limit = 5\n"),
              HasSubstr("drives of the engine have no torque limit"));
  Model loose = walker();
  loose.actuators.pop_back();
  EXPECT_THAT(refusal_of(config_text(), loose), HasSubstr("acts on the joint 'knee', but no actuator of 'walker'"));
  EXPECT_EQ(refusal_of(config_text(kTerms, "", kActions, std::string(kPd) + "effort_limit = inf\n"), loose), "");
}

TEST_F(PolicyFile, FilesThatCannotBeReadAreRefused) {
  const std::string config = write("policy.toml", config_text());
  EXPECT_THROW(policy_control(walker(), (dir_ / "none.toml").string(), ""), InputError);
  EXPECT_THROW(policy_control(walker(), dir_.string(), ""), InputError);
  EXPECT_THROW(policy_control(walker(), config, (dir_ / "none.onnx").string()), InputError);
  try {
    policy_control(walker(), config, "");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("names no network"));
  }
}

TEST(PolicyControl, TextOfItsSpec) {
  for (const char* text : {"policy,config=a,b.toml", "policy,config=a.toml,network=x.onnx"}) {
    EXPECT_EQ(control_text(parse_control(text)), text);
  }
  EXPECT_EQ(parse_control("policy,config=a.toml,network=x.onnx").network, "x.onnx");
  EXPECT_THROW(make_control(walker(), parse_control("policy")), InputError);
}

}  // namespace
}  // namespace assay
