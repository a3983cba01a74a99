// The largest timestep that `assay check` prints for explicit springs and dampers, against engines that have them: they
// hold just below and grow just above.
#include "check/step_bounds.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "engines/registry.h"
#include "load/mjcf.h"
#include "model/kinematics.h"

namespace assay {
namespace {

// Rest at the start pose, with nothing but springs and dampers, so that only their own growth is seen.
Model at_rest(Model model) {
  model.gravity.setZero();
  model.contacts.clear();
  for (Shape& shape : model.shapes) shape.collides = false;
  for (size_t j = 0; j < model.joints.size(); ++j) {
    model.joints[j].limited = false;
    model.joints[j].spring_reference = model.initial.position[j];
  }
  return model;
}

// How far joints' rates have grown after 400 steps from random rates of a microradian a second.
double growth(const std::string& name, Model model, double timestep) {
  ResolvedContender contender = Registry::instance().resolve(name);
  contender.settings.timestep = timestep;
  std::mt19937 random(7);  // NOLINT(bugprone-random-generator-seed): the same every time
  std::uniform_real_distribution<double> rate(-1e-6, 1e-6);
  model.initial.velocity.assign(model.joints.size(), 0);
  for (double& v : model.initial.velocity) v = rate(random);
  for (BodyState& body : model.initial.bodies) body.v_WBcm = body.w_WB = Vec3::Zero();
  bodies_from_joints(model, model.initial);
  const auto simulation = contender.engine->create(model, model.initial, contender.settings);
  State state;
  double largest = 0;
  for (int i = 0; i < 400 && largest < 1; ++i) {
    simulation->step({});
    simulation->read_state(state);
    for (const double v : state.velocity) largest = std::max(largest, std::isfinite(v) ? std::abs(v) : 1.0);
  }
  return largest / 1e-6;
}

bool there(const std::string& name) {
  const auto names = Registry::instance().contender_names();
  return std::ranges::find(names, name) != names.end();
}

void expect_edge(const std::string& name, const Model& model) {
  SCOPED_TRACE(name);
  if (!there(name)) GTEST_SKIP() << "no " << name;
  const double bound = step_bounds(model, model.initial).joints.largest;
  EXPECT_LT(growth(name, model, 0.97 * bound), 20);
  EXPECT_GT(growth(name, model, 1.03 * bound), 1000);
}

constexpr const char* kFinger =
    R"(<mujoco><compiler angle="radian"/><default><geom type="capsule" size=".008"/></default>
  <worldbody><body name="base"><joint name="spread" axis="1 0 0" damping="0.01" stiffness="2"/>
    <geom fromto="0 0 0 0 0 .05" mass=".03"/>
    <body pos="0 0 .05" euler="0 .4 0"><joint name="middle" axis="0 1 0" damping="0.004" stiffness="0.4"/>
      <geom fromto="0 0 0 0 0 .03" mass=".01"/>
      <body pos="0 0 .03" euler="0 .7 .3"><joint name="tip" axis="0 1 0" damping="0.002" stiffness="0.8"/>
        <geom fromto="0 0 0 0 0 .02" mass=".005"/></body></body></body></worldbody></mujoco>)";

class StepBounds : public testing::TestWithParam<const char*> {};

TEST_P(StepBounds, FingerHoldsBelowAndGrowsAbove) {
  expect_edge(GetParam(), at_rest(load_model_text(kFinger, "finger")));
}

INSTANTIATE_TEST_SUITE_P(Explicit, StepBounds,
                         testing::Values("mujoco-euler-explicit-pd", "ode-step", "dart-explicit-pd"),
                         [](const auto& each) {
                           std::string name = each.param;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

TEST(GraspBound, PaperGraspHoldsBelowAndGrowsAbove) {
  expect_edge("mujoco-euler-explicit-pd", at_rest(load_model(ASSAY_MODELS "/grasp.xml")));
}

}  // namespace
}  // namespace assay
