// MuJoCo's own actuators in its adapter, against MuJoCo itself on the same file, and in a run that is continued.
#include <cmath>
#include <string>

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include "controls/engine_actuators.h"
#include "engines/registry.h"
#include "engines/springs.h"
#include "load/mjcf.h"

namespace assay {
namespace {

constexpr const char* kArm =
    R"(<mujoco><compiler angle="radian" autolimits="true"/><option timestep="0.002"/><worldbody>
  <body><joint name="a" axis="0 1 0" ref="0.1" damping="0.05"/>
    <geom type="capsule" fromto="0 0 0 .3 0 0" size=".02" mass=".4" contype="0" conaffinity="0"/>
    <body pos=".3 0 0"><joint name="b" axis="0 1 0"/><joint name="c" type="slide" axis="1 0 0"/>
      <geom type="capsule" fromto="0 0 0 .2 0 0" size=".02" mass=".1" contype="0" conaffinity="0"/></body></body>
  </worldbody>
  <tendon><fixed name="t"><joint joint="a" coef="1"/><joint joint="b" coef="-0.5"/></fixed></tendon>
  <actuator>ACTUATORS</actuator></mujoco>)";
constexpr const char* kLaws = R"(
    <position name="stiff" joint="b" kp="80" kv="20" ctrlrange="-1 0.3" forcerange="-40 3"/>
    <velocity name="speed" joint="c" kv="50" gear="2"/>
    <motor name="motor" joint="a" gear="-3" ctrlrange="-.2 .2"/>
    <general name="pull" tendon="t" gainprm="4" biastype="affine" biasprm="0.1 -4 -3" gear="1.5"/>)";
constexpr const char* kActivations = R"(
    <general name="filter" joint="a" dyntype="filterexact" dynprm="0.05" gainprm="2" actlimited="true" actrange="0 .4"/>
    <general name="ramp" joint="b" dyntype="integrator" gainprm="0.5"/>
    <position name="lag" joint="c" kp="30" kv="40" timeconst="0.1"/>)";

std::string arm(const std::string& actuators) {
  std::string text = kArm;
  return text.replace(text.find("ACTUATORS"), 9, actuators);
}

constexpr const char* kControls = R"(<keyframe><key ctrl="0.8 0.3 0.5 -0.2"/></keyframe></mujoco>)";

std::string with_controls(std::string text) {
  return text.replace(text.find("</mujoco>"), std::string::npos, kControls);
}

ResolvedContender contender_of(const std::string& name) {
  ResolvedContender contender = Registry::instance().resolve(name);
  contender.settings.timestep = 2e-3;
  return contender;
}

// The model as a caller that leaves the actuators to the engine creates it.
Model equipped(Model model) {
  EXPECT_TRUE(equip_for(/*engine_actuators=*/true, *actuator_control(model), model));
  return model;
}

struct Case {
  const char* contender;
  int integrator;
  double timestep;  // s; explicit methods need short ones for such gains
};

class MujocoActuators : public testing::TestWithParam<Case> {};

TEST_P(MujocoActuators, PullAsMuJoCosOwn) {
  const std::string text = with_controls(arm(kLaws));
  const Model model = equipped(load_model_text(text, "arm"));
  ResolvedContender contender = contender_of(GetParam().contender);
  contender.settings.timestep = GetParam().timestep;
  ASSERT_TRUE(contender.engine->capabilities(contender.settings).actuators);
  EXPECT_FALSE(adapter_adds_torques(model, contender.engine->capabilities(contender.settings)));
  const auto simulation = contender.engine->create(model, model.initial, contender.settings);
  char error[1000] = "";
  mjSpec* spec = mj_parseXMLString(text.c_str(), nullptr, error, sizeof(error));
  ASSERT_NE(spec, nullptr) << error;
  mjModel* m = mj_compile(spec, nullptr);
  mj_deleteSpec(spec);
  ASSERT_NE(m, nullptr);
  m->opt.integrator = GetParam().integrator;
  m->opt.timestep = GetParam().timestep;
  mjData* d = mj_makeData(m);
  mj_resetDataKeyframe(m, d, 0);
  State state;
  for (int i = 0; i < 100; ++i) {
    mj_step(m, d);
    simulation->advance(1);
    simulation->read_state(state);
    for (int j = 0; j < 3; ++j) ASSERT_NEAR(state.position[j], d->qpos[j], 1e-10 * (1 + std::abs(d->qpos[j]))) << i;
  }
  mj_deleteData(d);
  mj_deleteModel(m);
}

INSTANTIATE_TEST_SUITE_P(Integrators, MujocoActuators,
                         testing::Values(Case{"mujoco-implicitfast", mjINT_IMPLICITFAST, 2e-3},
                                         Case{"mujoco-implicit", mjINT_IMPLICIT, 2e-3},
                                         Case{"mujoco-euler", mjINT_EULER, 1e-5}, Case{"mujoco-rk4", mjINT_RK4, 1e-5}));

TEST(MujocoActuatorsOwn, TorquesAddToThem) {
  const Model model = equipped(load_model_text(with_controls(arm(kLaws)), "arm"));
  const ResolvedContender contender = contender_of("mujoco-implicitfast");
  const auto alone = contender.engine->create(model, model.initial, contender.settings);
  const auto pushed = contender.engine->create(model, model.initial, contender.settings);
  const std::vector<double> torques = {0, 0, 5};
  alone->advance(1);
  pushed->step(torques);
  State a, b;
  alone->read_state(a);
  pushed->read_state(b);
  EXPECT_GT(b.velocity[2] - a.velocity[2], 1e-3);
}

// With activations and sines a run that is continued from its state is the run.
TEST(MujocoActuatorsOwn, ContinueFromAnyState) {
  const std::string sine = R"(<custom><numeric name="assay:sine:ramp" data="0.4 1.5 0.2"/></custom></mujoco>)";
  std::string text = arm(kActivations);
  text.replace(text.find("</mujoco>"), std::string::npos, R"(<keyframe><key ctrl="0.8 0.3 0.5"/></keyframe>)" + sine);
  const Model model = equipped(load_model_text(text, "arm"));
  const ResolvedContender contender = contender_of("mujoco-implicitfast");
  EXPECT_TRUE(adapter_adds_torques(model, contender.engine->capabilities(contender.settings)));
  const std::vector<double> none(3, 0.0);
  const auto whole = contender.engine->create(model, model.initial, contender.settings);
  State state, end, again;
  for (int i = 0; i < 200; ++i) {
    if (i == 80) whole->read_state(state);
    whole->step(none);
  }
  whole->read_state(end);
  const auto rest = contender.engine->create(model, state, contender.settings);
  for (int i = 80; i < 200; ++i) rest->step(none);
  rest->read_state(again);
  for (int j = 0; j < 3; ++j) EXPECT_NEAR(again.position[j], end.position[j], 1e-9);
}

// Where the caller computes them, the same law as torques tends to the same motion.
TEST(MujocoActuatorsOwn, AreTheLawThatOtherEnginesGet) {
  const std::string soft = R"(<position name="p" joint="a" kp="3" kv="0.2" forcerange="-1 1"/>
    <motor name="m" joint="b" gear="0.1"/><velocity name="v" joint="c" kv="0.4"/>)";
  std::string text = arm(soft);
  text.replace(text.find("</mujoco>"), std::string::npos, R"(<keyframe><key ctrl="0.5 0.2 0.1"/></keyframe></mujoco>)");
  const Model model = load_model_text(text, "arm");
  Model own = model, others = model;
  const auto control = actuator_control(model);
  EXPECT_TRUE(equip_for(true, *control, own));
  EXPECT_FALSE(equip_for(false, *control, others));
  EXPECT_TRUE(others.actuators.empty());
  ResolvedContender contender = Registry::instance().resolve("mujoco-implicitfast");
  contender.settings.timestep = 1e-5;
  const auto native = contender.engine->create(own, own.initial, contender.settings);
  const auto given = contender.engine->create(others, others.initial, contender.settings);
  const auto run = control->start(1e-5);
  std::vector<double> torques(3);
  State a, b;
  given->read_state(b);
  for (int i = 0; i < 20000; ++i) {
    run->torques(b, torques);
    given->step(torques);
    given->read_state(b);
  }
  native->advance(20000);
  native->read_state(a);
  for (int j = 0; j < 3; ++j) EXPECT_NEAR(a.position[j], b.position[j], 2e-5);
}

TEST(MujocoActuatorsOwn, ExplicitOnesAreLeftToTheCaller) {
  const ResolvedContender contender = contender_of("mujoco-rk4-explicit-pd");
  EXPECT_FALSE(contender.engine->capabilities(contender.settings).actuators);
  const Model model = load_model_text(with_controls(arm(kLaws)), "arm");  // with its actuators, which may not act
  Model none = model;
  none.actuators.clear();
  none.control0.clear();
  State a, b;
  for (auto [with, state] : {std::pair{&model, &a}, std::pair{static_cast<const Model*>(&none), &b}}) {
    const auto simulation = contender.engine->create(*with, with->initial, contender.settings);
    const std::vector<double> zero(3, 0.0);
    for (int i = 0; i < 10; ++i) simulation->step(zero);
    simulation->read_state(*state);
  }
  EXPECT_EQ(a.position, b.position);
}

}  // namespace
}  // namespace assay
