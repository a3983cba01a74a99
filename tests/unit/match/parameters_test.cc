#include "match/parameters.h"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "load/mjcf.h"
#include "load/model_mjcf.h"

namespace assay::match {
namespace {

constexpr const char* kRobot = R"(<mujoco model="robot">
  <compiler angle="radian" autolimits="true"/>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 0.1" friction="0.4 0 0"/>
    <body name="upper" pos="0 0 1">
      <joint name="yaw" axis="0 0 1"/>
      <joint name="pitch" axis="0 1 0" pos="0.1 0 0" damping="0.2" frictionloss="0.1" armature="0.01" range="-1 2" ref="0.3"/>
      <geom type="capsule" fromto="0 0 0 0.3 0 -0.3" size="0.03" mass="1.5" friction="0.4 0 0"/>
      <body name="lower" pos="0.3 0 -0.3" quat="0.9 0.1 0.3 -0.2">
        <joint name="slide" type="slide" axis="1 1 0"/>
        <geom type="box" size="0.05 0.1 0.15" pos="0.02 0 0" quat="1 0.4 0 0" mass="0.7" friction="0.4 0 0"/>
      </body>
    </body>
  </worldbody>
  <actuator><position name="servo" joint="pitch" kp="30" ctrlrange="-1 1"/></actuator>
</mujoco>)";

Parameter named(const std::string& name, ChangeKind kind, const std::string& element, int component, double nominal) {
  Parameter p;
  p.name = name, p.kind = kind, p.element = element, p.component = component, p.nominal = nominal;
  p.lower = -1e9, p.upper = 1e9;
  return p;
}

TEST(Parameters, InertiaOfAnyCoordinatesIsABodys) {
  Body body;
  body.mass = 2;
  body.I_BBcm_B << 0.02, 0.001, 0, 0.001, 0.03, -0.002, 0, -0.002, 0.045;
  EXPECT_LT((inertia_of(body, 1, {}) - body.I_BBcm_B).norm(), 1e-15);
  EXPECT_LT((inertia_of(body, 3, {}) - 3 * body.I_BBcm_B).norm(), 1e-15);
  for (int seed = 0; seed < 50; ++seed) {
    std::srand(static_cast<unsigned>(seed));
    const Eigen::Matrix<double, 6, 1> drawn = Eigen::Matrix<double, 6, 1>::Random();
    const Mat3 I = inertia_of(body, 1, {drawn[0], drawn[1], drawn[2], drawn[3], drawn[4], drawn[5]});
    const Vec3 moments = Eigen::SelfAdjointEigenSolver<Mat3>(I).eigenvalues();
    EXPECT_GT(moments[0], 0);
    EXPECT_LT(moments[2], moments[0] + moments[1]);
  }
}

TEST(Parameters, BecomeChangesOfTheModel) {
  const Model model = load_model_text(kRobot, "robot");
  const std::vector<Parameter> parameters = {named("damping:pitch", ChangeKind::kDamping, "pitch", 0, 0.2),
                                             named("mass:lower", ChangeKind::kMass, "lower", 0, 0.7),
                                             named("centre.y:lower", ChangeKind::kCentre, "lower", 1, 0),
                                             named("gravity.x", ChangeKind::kGravity, "", 0, 0),
                                             named("ground", ChangeKind::kGround, "", 0, 0),
                                             named("encoder:pitch", ChangeKind::kEncoder, "pitch", 0, 0),
                                             named("delay", ChangeKind::kDelay, "", 0, 0),
                                             named("friction", ChangeKind::kFriction, "", 0, 0.4)};
  const std::vector<double> values = {0.05, 1.4, 0.01, 0.3, -0.002, -0.1, 0.004, 0.2};
  const Candidate candidate = candidate_of(model, parameters, values);
  const Model changed = changed_model(model, parse_changes(change_texts(candidate.changes)));
  const auto body = [](const Model& m, const char* name) { return *std::ranges::find(m.bodies, name, &Body::name); };
  const auto joint = [](const Model& m, const char* name) { return *std::ranges::find(m.joints, name, &Joint::name); };
  EXPECT_DOUBLE_EQ(joint(changed, "pitch").damping, 0.05);
  EXPECT_DOUBLE_EQ(joint(changed, "yaw").damping, 0);
  EXPECT_DOUBLE_EQ(body(changed, "lower").mass, 1.4);
  EXPECT_LT((body(changed, "lower").I_BBcm_B - 2 * body(model, "lower").I_BBcm_B).norm(), 1e-12);
  EXPECT_NEAR(body(changed, "lower").p_BBcm.y() - body(model, "lower").p_BBcm.y(), 0.01, 1e-15);
  EXPECT_DOUBLE_EQ(changed.gravity.x(), 0.3);
  EXPECT_DOUBLE_EQ(changed.gravity.z(), -9.81);
  EXPECT_DOUBLE_EQ(changed.shapes[0].X_BS.p.z(), -0.002);
  EXPECT_NEAR(joint(changed, "pitch").reference, 0.2, 1e-15);
  EXPECT_NEAR(joint(changed, "pitch").upper, 1.9, 1e-15);
  EXPECT_NEAR(changed.contacts.at(0).friction, 0.5 * model.contacts.at(0).friction, 1e-15);
  EXPECT_NEAR(delay_s_of(candidate.changes), 0.004, 1e-15);
}

TEST(Parameters, CoordinatesAreInverse) {
  Parameter p;
  p.nominal = 0.5, p.lower = 0.1, p.upper = 3, p.step = 0.2;
  for (const bool log : {false, true}) {
    p.log = log;
    EXPECT_DOUBLE_EQ(p.coordinate(p.nominal), 0);
    for (const double value : {0.1, 0.4, 2.9}) EXPECT_NEAR(p.value(p.coordinate(value)), value, 1e-14);
  }
}

// What is written is read as the same robot, with a body of two joints, and joints, shapes and actuators.
TEST(ModelMjcf, IsReadBackAsTheSameRobot) {
  const Model model = load_model_text(kRobot, "robot");
  const Model again = load_model_text(model_mjcf(model), "again");
  ASSERT_EQ(again.bodies.size(), model.bodies.size());
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    EXPECT_EQ(again.bodies[b].parent, model.bodies[b].parent);
    EXPECT_NEAR(again.bodies[b].mass, model.bodies[b].mass, 1e-12);
    EXPECT_LT((again.bodies[b].p_BBcm - model.bodies[b].p_BBcm).norm(), 1e-12);
    EXPECT_LT((again.bodies[b].I_BBcm_B - model.bodies[b].I_BBcm_B).norm(), 1e-12);
    EXPECT_LT((again.bodies[b].X_PB.p - model.bodies[b].X_PB.p).norm(), 1e-12);
    EXPECT_LT(again.bodies[b].X_PB.q.angularDistance(model.bodies[b].X_PB.q), 1e-7);
  }
  ASSERT_EQ(again.joints.size(), model.joints.size());
  for (size_t j = 0; j < model.joints.size(); ++j) {
    const Joint &was = model.joints[j], &is = again.joints[j];
    EXPECT_EQ(is.name, was.name);
    EXPECT_LT((is.p_BJ - was.p_BJ).norm(), 1e-12);
    EXPECT_LT((is.axis_B - was.axis_B).norm(), 1e-12);
    EXPECT_DOUBLE_EQ(is.reference, was.reference);
    EXPECT_EQ(is.limited, was.limited);
    EXPECT_DOUBLE_EQ(is.upper, was.upper);
    EXPECT_DOUBLE_EQ(is.damping, was.damping);
    EXPECT_DOUBLE_EQ(is.dry_friction, was.dry_friction);
    EXPECT_DOUBLE_EQ(is.armature, was.armature);
  }
  ASSERT_EQ(again.contacts.size(), model.contacts.size());
  for (size_t c = 0; c < model.contacts.size(); ++c)
    EXPECT_DOUBLE_EQ(again.contacts[c].friction, model.contacts[c].friction);
  ASSERT_EQ(again.actuators.size(), 1u);
  EXPECT_DOUBLE_EQ(again.actuators[0].gain, 30);
  EXPECT_EQ(again.actuators[0].bias, model.actuators[0].bias);
}

}  // namespace
}  // namespace assay::match
