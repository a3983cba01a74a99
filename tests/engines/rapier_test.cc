#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <assay_rapier.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engines/registry.h"
#include "model/kinematics.h"
#include "simulated.h"

namespace assay {
namespace {

using testing::HasSubstr;

const std::vector<std::string> kJoints = {"impulse", "multibody"};

ResolvedContender rapier(const std::string& joints, const std::map<std::string, std::string>& overrides = {}) {
  ResolvedContender contender = Registry::instance().resolve("rapier-" + joints + "-f64", overrides);
  contender.settings.timestep = 1e-3;
  return contender;
}

Body make_body(int hinge, double mass, double inertia) {
  Body body;
  body.name = "body";
  body.joint = hinge;
  body.mass = mass;
  body.I_BBcm_B = inertia * Mat3::Identity();
  return body;
}

constexpr double kInertia = 2e-5;  // kg m^2

// A wheel on a hinge through its centre, without gravity.
Model wheel() {
  Model model;
  model.gravity.setZero();
  model.bodies.push_back(make_body(0, 0.05, kInertia));
  model.joints.push_back(make_hinge(0));
  model.joints[0].reference = 0.2;
  model.initial = reference_state(model);
  return model;
}

// ---- springs --------------------------------------------------------------------------------------------------------

// Rapier's own springs are implicit in angle and rate, in each of the four substeps.
TEST(Rapier, NativeSpringIsImplicit) {
  constexpr double kStiffness = 0.4, kDamping = 0.005, kRest = -0.3, kSubstep = 1e-3 / 4;
  Model model = wheel();
  model.joints[0].stiffness = kStiffness;
  model.joints[0].damping = kDamping;
  model.joints[0].spring_reference = kRest;
  model.initial.position = {0.7};
  model.initial.velocity = {-2};
  bodies_from_joints(model, model.initial);
  double angle = 0.7, rate = -2;
  for (int i = 0; i < 4; ++i) {
    rate = (kInertia * rate - kSubstep * kStiffness * (angle - kRest)) /
           (kInertia + kSubstep * kDamping + kSubstep * kSubstep * kStiffness);
    angle += kSubstep * rate;
  }
  for (const std::string& joints : kJoints) {
    const auto simulation = create(model, rapier(joints, {{"pd", "native"}}));
    simulation->step({});
    const State end = state_of(*simulation);
    // an impulse joint turns its bodies by a normalised first-order update of the quaternion
    const double tolerance = joints == "impulse" ? 1e-3 : 1e-12;
    EXPECT_NEAR(end.velocity[0], rate, std::abs(rate) * tolerance) << joints;
    EXPECT_NEAR(end.position[0], angle, std::abs(rate) * 1e-3 * tolerance) << joints;
  }
}

TEST(Rapier, NativeSpringOfAnImpulseJointIsDeclaredWithinHalfATurn) {
  Model model = wheel();
  model.joints[0].stiffness = 1;
  const auto findings = [&](const std::string& joints, const std::string& pd) {
    const ResolvedContender contender = rapier(joints, {{"pd", pd}});
    return contender.engine->check(model, contender.settings);
  };
  ASSERT_EQ(findings("impulse", "native").size(), 1U);
  EXPECT_EQ(findings("impulse", "native")[0].fidelity, Fidelity::kApproximated);
  EXPECT_THAT(findings("impulse", "native")[0].how, HasSubstr("half a turn"));
  EXPECT_TRUE(findings("multibody", "native").empty());
  EXPECT_TRUE(findings("impulse", "explicit").empty());
}

// ---- what may touch -------------------------------------------------------------------------------------------------

// More different sets of partners than Rapier has bits of groups: the pairs are looked up by a hook.
TEST(Rapier, PairsBeyondTheGroupsBits) {
  constexpr int kBalls = 100;
  constexpr double kRadius = 0.1;
  Model model;
  model.gravity.setZero();
  for (int i = 0; i < kBalls; ++i) {
    model.bodies.push_back(make_body(-1, 1, 0.004));
    model.bodies.back().X_PB.p.x() = 1.5 * kRadius * i;  // each overlaps the one before and the one after
    Shape shape;
    shape.body = i;
    shape.radius = kRadius;
    model.shapes.push_back(shape);
    if (i % 2 == 1) model.contacts.push_back({i - 1, i, 0.5});
  }
  model.initial = reference_state(model);
  const auto simulation = create(model, rapier("impulse"));
  simulation->advance(500);
  const State end = state_of(*simulation);
  for (int i = 1; i < kBalls; i += 2) {
    const Vec3 left = end.bodies[i - 1].p_WBcm, right = end.bodies[i].p_WBcm;
    EXPECT_GT((right - left).norm(), 1.9 * kRadius) << "pair " << i << " was not pushed apart";
    const Vec3 middle_before = (model.initial.bodies[i - 1].p_WBcm + model.initial.bodies[i].p_WBcm) / 2;
    EXPECT_LT(((left + right) / 2 - middle_before).norm(), 1e-9) << "a stranger pushed pair " << i;
  }
}

// Two links on a free one fall on a plane, and lie on it as they do with impulse joints.
TEST(Rapier, FloatingTreeLandsOnThePlane) {
  constexpr double kRadius = 0.05, kHalf = 0.1;
  Model model;
  for (int i = 0; i < 3; ++i) {
    model.bodies.push_back(make_body(i - 1, 1, 0.005));
    Body& body = model.bodies.back();
    body.parent = i - 1;
    body.X_PB.p = i == 0 ? Vec3(0, 0, 0.3) : Vec3(2 * (kHalf + kRadius), 0, 0);
    if (i > 0) {
      model.joints.push_back(make_hinge(i));
      model.joints.back().p_BJ = Vec3(-kHalf - kRadius, 0, 0);
    }
    Shape shape;
    shape.type = ShapeType::kCapsule;
    shape.body = i;
    shape.X_BS.q = Quat::FromTwoVectors(Vec3::UnitZ(), Vec3::UnitX());
    shape.radius = kRadius;
    shape.half_length = kHalf;
    model.shapes.push_back(shape);
  }
  Shape floor;
  floor.type = ShapeType::kPlane;
  model.shapes.push_back(floor);
  for (int i = 0; i < 3; ++i) model.contacts.push_back({i, 3, 0.7});
  model.initial = reference_state(model);
  model.initial.position = {0.4, -0.9};
  model.initial.bodies[0].w_WB = Vec3(0.3, 0.5, 0);
  bodies_from_joints(model, model.initial);
  for (const std::string& joints : kJoints) {
    const auto simulation = create(model, rapier(joints));
    simulation->advance(3000);
    for (const BodyState& body : state_of(*simulation).bodies) {
      EXPECT_NEAR(body.p_WBcm.z(), kRadius, 2e-3) << joints;
      EXPECT_LT(std::abs(body.v_WBcm.z()), 0.01) << joints;
    }
  }
}

// ---- refused and failed ---------------------------------------------------------------------------------------------

TEST(Rapier, RefusesWhatImpulseJointsCannot) {
  Model model = wheel();
  model.joints[0].armature = 0.01;
  EXPECT_THROW(create(model, rapier("impulse")), UnsupportedError);
  EXPECT_NO_THROW(create(model, rapier("multibody")));
  model = wheel();
  model.joints[0].limited = true;
  model.joints[0].lower = -4;
  model.joints[0].upper = 4;
  EXPECT_NO_THROW(create(model, rapier("impulse"))) << "a range beyond a turn, which the adapter holds";
  EXPECT_NO_THROW(create(model, rapier("multibody")));
}

// Rapier itself disables such a body and goes on.
TEST(Rapier, StateThatIsNotFiniteFailsTheRun) {
  for (const std::string& joints : kJoints) {
    const auto simulation = create(wheel(), rapier(joints));
    simulation->set_torques(std::vector<double>{1e308});
    try {
      simulation->advance(10);
      FAIL() << joints << ": no error";
    } catch (const EngineError& error) {
      EXPECT_THAT(error.what(), HasSubstr("no longer finite"));
    }
  }
}

TEST(Rapier, PanicEndsAtTheInterface) {
  for (const RapierApi* api : {&assay_rapier_f32, &assay_rapier_f64}) {
    RapierOptions options{};
    options.timestep = 1e-3;
    RapierWorld* world = api->create(&options);
    ASSERT_NE(world, nullptr);
    RapierShape shape{};
    shape.body = 7;
    EXPECT_EQ(api->add_shape(world, &shape), 1);
    EXPECT_THAT(api->error(), HasSubstr("index out of bounds"));
    EXPECT_THAT(api->error(), HasSubstr("world.rs"));
    api->destroy(world);
  }
}

}  // namespace
}  // namespace assay
