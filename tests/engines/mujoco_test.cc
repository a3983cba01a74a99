#include <cmath>
#include <new>
#include <numbers>
#include <sys/resource.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include "engines/registry.h"
#include "isolate/activity.h"
#include "model/kinematics.h"
#include "simulated.h"

namespace assay {
namespace {

using testing::HasSubstr;

ResolvedContender mujoco(const std::map<std::string, std::string>& overrides = {}) {
  return Registry::instance().resolve("mujoco-euler", overrides);
}

State run(const Model& model, const ResolvedContender& contender, int steps) {
  const auto simulation = create(model, contender);
  simulation->advance(steps);
  return state_of(*simulation);
}

Body make_body(double mass, const Mat3& I_BBcm_B) {
  Body body;
  body.name = "body";
  body.mass = mass;
  body.I_BBcm_B = I_BBcm_B;
  return body;
}

Shape make_sphere(int body, double radius, double friction) {
  Shape shape;
  shape.body = body;
  shape.radius = radius;
  shape.friction = friction;
  return shape;
}

// Balls in a loose heap over a plane, all of them collide with all.
Model heap() {
  Model model;
  for (int i = 0; i < 8; ++i) {
    model.bodies.push_back(make_body(1, 0.004 * Mat3::Identity()));
    model.bodies.back().X_PB.p = Vec3(0.05 * (i % 2), 0.07 * (i / 2 % 2), 0.15 + 0.22 * i);
    model.shapes.push_back(make_sphere(i, 0.1, 0.2 + 0.1 * i));
  }
  model.shapes.push_back(make_sphere(kWorld, 0, 0.5));
  model.shapes.back().type = ShapeType::kPlane;
  for (int a = 0; a < 9; ++a) {
    for (int b = a + 1; b < 9; ++b) {
      model.contacts.push_back({a, b, std::max(model.shapes[a].friction, model.shapes[b].friction)});
    }
  }
  model.initial = reference_state(model);
  return model;
}

// A hinged pendulum of two links, the second of which would swing through the first's ball.
Model pendulum() {
  Model model;
  for (int i = 0; i < 2; ++i) {
    model.bodies.push_back(make_body(1, 0.01 * Mat3::Identity()));
    Body& body = model.bodies.back();
    body.parent = i - 1;
    body.joint = i;
    body.X_PB.p = {0.4 * i, 0, 0};
    body.p_BBcm = {0.3, 0, 0};
    model.joints.push_back(make_hinge(i));
    model.shapes.push_back(make_sphere(i, 0.05, 1));
    model.shapes.back().X_BS.p = {i == 0 ? 0.3 : 0.1, 0, 0};
  }
  model.initial = reference_state(model);
  model.initial.position[1] = 2.5;
  model.initial.velocity[1] = 4;
  bodies_from_joints(model, model.initial);
  return model;
}

double distance(const State& a, const State& b) {
  double sum = 0;
  for (size_t i = 0; i < a.bodies.size(); ++i) sum += (a.bodies[i].p_WBcm - b.bodies[i].p_WBcm).norm();
  return sum;
}

class MujocoPairs : public testing::TestWithParam<const char*> {};

// For any pairs, MuJoCo's filter has to leave exactly those of the model.
TEST_P(MujocoPairs, AreTheSameFromTheFilterAndFromTheList) {
  Model model = heap();
  const std::string change = GetParam();
  if (change == "some pairs excluded") {
    std::erase_if(model.contacts, [](const ContactPair& pair) { return pair.shape_b < 8 && pair.shape_a % 2 == 0; });
  } else if (change == "friction of its own") {
    model.contacts[5].friction = 0.01;
  } else if (change == "no friction") {
    for (Shape& shape : model.shapes) shape.friction = 0;
    for (ContactPair& pair : model.contacts) pair.friction = 0;
  } else if (change == "two shapes on a body, one of them apart") {
    model.shapes.push_back(model.shapes[3]);
    model.shapes.back().X_BS.p = {0.1, 0, 0};
    model.contacts.push_back({8, 9, 0.5});
  } else if (change == "parent and child touch") {
    model = pendulum();
    model.contacts.push_back({0, 1, 1.0});
  }
  const State by_filter = run(model, mujoco(), 1500);
  const State by_list = run(model, mujoco({{"contact_pairs", "explicit"}}), 1500);
  EXPECT_EQ(distance(by_filter, by_list), 0);

  Model apart = model;
  apart.contacts.clear();
  EXPECT_GT(distance(by_filter, run(apart, mujoco(), 1500)), 0.1) << "nothing touched: the test shows nothing";
}

INSTANTIATE_TEST_SUITE_P(All, MujocoPairs,
                         testing::Values("all with all", "some pairs excluded", "friction of its own", "no friction",
                                         "two shapes on a body, one of them apart", "parent and child touch"));

// MuJoCo would start again from the reference state.
TEST(Mujoco, ReportsABlowUp) {
  Model model = pendulum();
  model.initial.velocity[0] = 1e9;
  const auto simulation = create(model, mujoco());
  try {
    simulation->advance(100);
    FAIL() << "no exception";
  } catch (const EngineError& error) {
    EXPECT_THAT(error.what(), HasSubstr("above 1e10"));
    EXPECT_THAT(error.what(), HasSubstr("0.1 s"));
  }
}

void ask_for_too_much(const mjModel* /*model*/, mjData* data) { mj_stackAllocByte(data, size_t{1} << 50, 8); }

// MuJoCo would end the process.
TEST(Mujoco, TurnsItsErrorsIntoExceptions) {
  const Model model = pendulum();
  const auto simulation = create(model, mujoco());
  mjcb_passive = ask_for_too_much;
  EXPECT_THROW(simulation->advance(1), EngineError);
  mjcb_passive = nullptr;
  EXPECT_NO_THROW(run(model, mujoco(), 10));
}

// Principal moments of a plate turned at random violate A + B >= C in the last digit.
TEST(Mujoco, TakesFlatBodies) {
  for (int i = 1; i < 50; ++i) {
    const Mat3 R = Eigen::AngleAxisd(0.1 * i, Vec3(1, i, -2).normalized()).toRotationMatrix();
    Model model;
    model.bodies.push_back(make_body(1, R * Vec3(0.1, 0.2, 0.3).asDiagonal() * R.transpose()));
    model.initial = reference_state(model);
    const Mat3 I_held = create(model, mujoco())->view().bodies[0].I_BBcm_W;
    EXPECT_LT((I_held - model.bodies[0].I_BBcm_B).norm(), 1e-15);
  }
}

TEST(Mujoco, RefusesImpossibleInertiaInOneLine) {
  Model model = pendulum();
  model.bodies[0].I_BBcm_B = Vec3(1, 1, 3).asDiagonal();
  try {
    create(model, mujoco());
    FAIL() << "no exception";
  } catch (const EngineError& error) {
    EXPECT_THAT(error.what(), HasSubstr("A + B >= C"));
    EXPECT_THAT(error.what(), testing::Not(HasSubstr("\n")));
  }
}

// The compiled model is kept for the next create(): another model or setting must not get it.
TEST(Mujoco, KeepsModelsApart) {
  const Model two = pendulum();
  Model heavy = two;
  heavy.bodies[1].mass = 3;
  const State first = run(two, mujoco(), 50);
  const State other = run(heavy, mujoco(), 50);
  EXPECT_GT(distance(first, other), 1e-6);
  EXPECT_EQ(distance(first, run(two, mujoco(), 50)), 0);
  EXPECT_GT(distance(first, run(two, mujoco({{"integrator", "rk4"}}), 50)), 1e-9);
}

// What spring_note says of each integrator, at a step far beyond the explicit limit.
TEST(Mujoco, TakesDampingImplicitlyAsDeclared) {
  Model model;
  model.gravity.setZero();
  model.bodies.push_back(make_body(1, Mat3::Identity()));
  model.bodies[0].joint = 0;
  model.joints.push_back(make_hinge(0));
  model.joints[0].damping = 5;
  model.initial = reference_state(model);
  model.initial.velocity[0] = 1;
  bodies_from_joints(model, model.initial);

  const auto final_rate = [&](const std::map<std::string, std::string>& overrides) {
    ResolvedContender contender = mujoco(overrides);
    contender.settings.timestep = 1;
    return std::abs(run(model, contender, 8).velocity[0]);
  };
  EXPECT_LT(final_rate({}), 1e-5);
  EXPECT_LT(final_rate({{"integrator", "implicit"}}), 1e-5);
  EXPECT_LT(final_rate({{"integrator", "implicitfast"}}), 1e-5);
  EXPECT_GT(final_rate({{"euler_damping", "off"}}), 1e4);
  EXPECT_GT(final_rate({{"integrator", "rk4"}}), 1e4);
}

#ifndef __SANITIZE_ADDRESS__  // memory has no limit there
// MuJoCo reports it as any other error, and it is no outcome of the model.
TEST(MujocoDeathTest, LackOfMemoryIsNoErrorOfTheEngine) {
  const auto hoard = [] {
    constexpr rlim_t kMore = rlim_t{64} << 20;
    rlimit limit{};
    ::getrlimit(RLIMIT_DATA, &limit);
    limit.rlim_cur = data_bytes() + kMore;
    ::setrlimit(RLIMIT_DATA, &limit);
    const Model model = heap();
    std::vector<std::unique_ptr<Simulation>> simulations;
    try {
      for (;;) simulations.push_back(create(model, mujoco()));
    } catch (const std::bad_alloc&) {
      ::_exit(0);
    } catch (...) {
      ::_exit(1);
    }
  };
  EXPECT_EXIT(hoard(), testing::ExitedWithCode(0), "");
}
#endif

}  // namespace
}  // namespace assay
