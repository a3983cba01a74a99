#include "load/model_mjcf.h"

#include <gtest/gtest.h>

#include "load/mjcf.h"

namespace assay {
namespace {

// Constraints, tendons, their springs, and actuators with activations come back as they were.
TEST(ModelMjcf, WritesConstraintsAndTendons) {
  const Model model = load_model_text(R"(<mujoco model="hand">
    <compiler angle="radian" autolimits="true"/>
    <worldbody>
      <body name="a" pos="0 0 1"><joint name="ja" axis="0 1 0" ref="0.2"/><geom size="0.1" mass="1"/></body>
      <body name="b" pos="1 0 1"><joint name="jb" axis="0 1 0"/><geom size="0.1" mass="1"/></body>
      <body name="c" pos="2 0 1"><joint name="jc" axis="0 1 0" ref="-0.1"/><geom size="0.1" mass="1"/>
        <body name="d" pos="0 0 0.4"><joint name="jd" axis="1 0 0"/><geom size="0.1" mass="1"/></body></body>
      <body name="e" pos="0 2 0"><freejoint/><geom size="0.1" mass="1"/></body>
    </worldbody>
    <tendon>
      <fixed name="pull" stiffness="3" springlength="0.1 0.4" damping="0.2" frictionloss="0.05" range="-1 2"><joint joint="ja" coef="0.5"/><joint joint="jc" coef="-2"/></fixed>
      <fixed name="sum"><joint joint="ja" coef="1"/><joint joint="jb" coef="-0.5"/><joint joint="jd" coef="-0.25"/></fixed>
    </tendon>
    <equality>
      <joint name="two" joint1="jb" joint2="jc" polycoef="0.1 0.7 0 0 0"/>
      <tendon name="three" tendon1="sum" polycoef="0.05 0 0 0 0"/>
      <connect name="tie" body1="d" body2="b" anchor="0.1 0 0"/>
      <weld name="glue" body1="e" body2="a" relpose="0.1 0.2 0.3 0.9 0.1 0.2 0.3"/>
    </equality>
    <actuator>
      <general name="muscle" tendon="pull" dyntype="filter" dynprm="0.05" gainprm="4" ctrlrange="-1 1"/>
      <motor name="m" joint="jd" gear="2"/>
    </actuator>
  </mujoco>)",
                                      "hand");
  const Model again = load_model_text(model_mjcf(model), "again");

  ASSERT_EQ(again.couplings.size(), model.couplings.size());
  for (size_t i = 0; i < model.couplings.size(); ++i) {
    const Coupling &was = model.couplings[i], &is = again.couplings[i];
    ASSERT_EQ(is.terms.size(), was.terms.size());
    EXPECT_EQ(is.joint, was.joint);
    EXPECT_NEAR(is.offset, was.offset, 1e-12);
    for (size_t k = 0; k < was.terms.size(); ++k) {
      EXPECT_EQ(is.terms[k].joint, was.terms[k].joint);
      EXPECT_NEAR(is.terms[k].coefficient, was.terms[k].coefficient, 1e-12);
    }
  }
  ASSERT_EQ(again.connects.size(), 1U);
  EXPECT_EQ(again.connects[0].body_a, model.connects[0].body_a);
  EXPECT_LT((again.connects[0].p_A - model.connects[0].p_A).norm(), 1e-12);
  EXPECT_LT((again.connects[0].p_B - model.connects[0].p_B).norm(), 1e-12);
  ASSERT_EQ(again.welds.size(), 1U);
  EXPECT_LT((again.welds[0].X_AB.p - model.welds[0].X_AB.p).norm(), 1e-12);
  EXPECT_LT(again.welds[0].X_AB.q.angularDistance(model.welds[0].X_AB.q), 1e-7);
  ASSERT_GE(again.tendons.size(), 1U);
  const Tendon &was = model.tendons[0], &is = again.tendons[0];
  EXPECT_EQ(is.name, was.name);
  EXPECT_NEAR(is.stiffness, was.stiffness, 1e-12);
  EXPECT_NEAR(is.rest_lower, was.rest_lower, 1e-12);
  EXPECT_NEAR(is.rest_upper, was.rest_upper, 1e-12);
  EXPECT_NEAR(is.damping, was.damping, 1e-12);
  EXPECT_NEAR(is.dry_friction, was.dry_friction, 1e-12);
  EXPECT_NEAR(is.upper, was.upper, 1e-12);
  ASSERT_EQ(again.actuators.size(), 2U);
  EXPECT_EQ(again.actuators[0].activation, ActivationType::kFilter);
  EXPECT_NEAR(again.actuators[0].time_constant, 0.05, 1e-12);
  EXPECT_NEAR(again.actuators[0].gain, 4, 1e-12);
  ASSERT_EQ(again.actuators[0].terms.size(), 2U);
  EXPECT_NEAR(again.actuators[0].terms[1].coefficient, model.actuators[0].terms[1].coefficient, 1e-12);
}

}  // namespace
}  // namespace assay
