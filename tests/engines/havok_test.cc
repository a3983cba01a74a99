// What Havok's adapter promises beyond the conformance suite.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <string>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "conformance/models.h"
#include "engines/registry.h"
#include "isolate/processes.h"
#include "model/kinematics.h"
#include "simulated.h"

namespace assay {
namespace {

using conformance::add_contact;
using conformance::add_free_body;
using conformance::add_shape;
using conformance::finished;
using testing::ExitedWithCode;
using testing::HasSubstr;

ResolvedContender resolve(const std::string& name, const std::map<std::string, std::string>& overrides = {}) {
  return Registry::instance().resolve(name, overrides);
}

std::vector<double> numbers(const State& state) {
  std::vector<double> all = {state.time};
  for (const BodyState& b : state.bodies) {
    for (const Vec3& v : {b.p_WBcm, b.v_WBcm, b.w_WB}) all.insert(all.end(), v.data(), v.data() + 3);
    all.insert(all.end(), b.q_WB.coeffs().data(), b.q_WB.coeffs().data() + 4);
  }
  all.insert(all.end(), state.position.begin(), state.position.end());
  all.insert(all.end(), state.velocity.begin(), state.velocity.end());
  return all;
}

// Capsules in a loose heap over a plane; all may touch each other.
Model heap() {
  Model model;
  add_shape(model, ShapeType::kPlane, kWorld);
  for (int i = 0; i < 6; ++i) {
    const Quat turned(Eigen::AngleAxisd(0.7 * i, Vec3(1, i, 0).normalized()));
    add_free_body(model, "capsule " + std::to_string(i), conformance::sphere_solid(0.7 + 0.1 * i, 0.1),
                  {Vec3(0.05 * (i % 2), 0.04 * (i % 3), 0.2 + 0.15 * i), turned});
    const int shape = add_shape(model, ShapeType::kCapsule, i, {}, 0.05, 0.1);
    for (int other = 0; other < shape; ++other) add_contact(model, other, shape, 0.6);
  }
  return finished(std::move(model));
}

// One body of two balls, of which only the upper one may touch the plane.
Model two_balls() {
  Model model;
  add_shape(model, ShapeType::kPlane, kWorld);
  add_free_body(model, "balls", conformance::sphere_solid(1, 0.1), {Vec3(0, 0, 0.11), Quat::Identity()});
  add_contact(model, 0, add_shape(model, ShapeType::kSphere, 0, {}, 0.1), 0.5);
  const int lower = add_shape(model, ShapeType::kSphere, 0, {Vec3(0, 0, -0.3), Quat::Identity()}, 0.1);
  // what keeps the lower ball from being left out: it may touch a post far away
  const int post = add_shape(model, ShapeType::kSphere, kWorld, {Vec3(50, 0, 0), Quat::Identity()}, 0.1);
  add_contact(model, lower, post, 0.5);
  return finished(std::move(model));
}

// `count` balls, each over a post of its own: none may touch another's.
Model balls_over_posts(int count) {
  Model model;
  for (int i = 0; i < count; ++i) {
    add_free_body(model, "ball", conformance::sphere_solid(1, 0.1), {Vec3(i, 0, 0.3), Quat::Identity()});
    const int ball = add_shape(model, ShapeType::kSphere, i, {}, 0.1);
    const int post = add_shape(model, ShapeType::kSphere, kWorld, {Vec3(i, 0, 0), Quat::Identity()}, 0.1);
    add_contact(model, ball, post, 0.5);
  }
  return finished(std::move(model));
}

// Two balls and two posts with a coefficient for each ball on each post.
Model four_pairs(double aa, double ab, double ba, double bb) {
  Model model;
  for (int i = 0; i < 2; ++i) {
    add_free_body(model, "ball", conformance::sphere_solid(1, 0.1), {Vec3(i, 0, 1), Quat::Identity()});
    add_shape(model, ShapeType::kSphere, i, {}, 0.1);
  }
  for (int i = 0; i < 2; ++i) add_shape(model, ShapeType::kSphere, kWorld, {Vec3(i, 0, 0), Quat::Identity()}, 0.1);
  add_contact(model, 0, 2, aa);
  add_contact(model, 0, 3, ab);
  add_contact(model, 1, 2, ba);
  add_contact(model, 1, 3, bb);
  return finished(std::move(model));
}

std::string refusals(const Model& model, const ResolvedContender& contender) {
  std::string text;
  for (const Limitation& finding : contender.engine->check(model, contender.settings)) {
    if (finding.fidelity == Fidelity::kRefused) text += finding.element + ": " + finding.how + "\n";
  }
  return text;
}

TEST(Havok, AStepIsFourSubsteps) {
  Model model;
  add_free_body(model, "body", conformance::sphere_solid(1, 0.1));
  model = finished(std::move(model));
  model.initial.bodies[0].v_WBcm.z() = -1;  // faster than what Havok brakes
  ResolvedContender havok = resolve("havok");
  havok.settings.timestep = 0.1;
  const auto simulation = create(model, havok);
  simulation->advance(1);
  // n substeps of semi-implicit Euler fall g h^2 (n + 1) / (2 n)
  EXPECT_NEAR(state_of(*simulation).bodies[0].p_WBcm.z(), -0.1 - (9.81 * 0.01 * 5 / 8), 1e-6);
}

TEST(Havok, AnImpulseIsNotSeenBeforeItsStep) {
  const conformance::Flywheel wheel = conformance::flywheel();
  const auto simulation = create(wheel.model, resolve("havok"));
  const State before = state_of(*simulation);
  simulation->set_torques(std::vector<double>{2});
  EXPECT_EQ(numbers(state_of(*simulation)), numbers(before));
  simulation->advance(1);
  // its initial motion is braked, because its centre of mass is slow
  EXPECT_NEAR((state_of(*simulation).velocity[0] - before.velocity[0]) * wheel.axial_inertia / 2e-3, 1, 0.05);
}

TEST(Havok, ShapesOfOneBodyHaveFiltersOfTheirOwn) {
  const Model model = two_balls();
  const auto simulation = create(model, resolve("havok"));
  simulation->advance(1000);
  EXPECT_NEAR(state_of(*simulation).bodies[0].p_WBcm.z(), 0.1, 2e-3);
}

TEST(Havok, RefusesWhatItsFiltersCannotSay) {
  const ResolvedContender havok = resolve("havok");
  const auto simulation = create(balls_over_posts(32), havok);
  simulation->advance(300);
  for (const BodyState& ball : state_of(*simulation).bodies) EXPECT_NEAR(ball.p_WBcm.z(), 0.2, 2e-3);

  EXPECT_THAT(refusals(balls_over_posts(33), havok), HasSubstr("these pairs need more"));
  EXPECT_THROW(create(balls_over_posts(33), havok), UnsupportedError);
}

TEST(Havok, FindsCoefficientsByMaximumMinimumOrProduct) {
  const ResolvedContender havok = resolve("havok");
  EXPECT_EQ(refusals(four_pairs(0.2, 0.4, 0.5, 0.5), havok), "");  // maxima of 0.2, 0.5 and 0.2, 0.4
  EXPECT_EQ(refusals(four_pairs(0.2, 0.4, 0.2, 0.2), havok), "");  // minima of 0.4, 0.2 and 0.2, 0.4
  EXPECT_EQ(refusals(four_pairs(0.2, 0.4, 0.3, 0.6), havok), "");  // products
  EXPECT_THAT(refusals(four_pairs(0.2, 0.4, 0.3, 0.9), havok), HasSubstr("friction of contact pairs"));
}

TEST(Havok, ItsOwnSpringIsTheModels) {
  conformance::Flywheel wheel = conformance::flywheel();
  Joint& hinge = wheel.model.joints[0];
  hinge.stiffness = 100 * wheel.axial_inertia;  // 10 rad/s
  hinge.spring_reference = hinge.reference + 0.4;
  const State start = conformance::with_joints(wheel.model, {hinge.spring_reference + 0.5}, {0});
  ResolvedContender havok = resolve("havok", {{"pd", "native"}});
  havok.settings.timestep = 0.25e-3;
  const auto simulation = havok.engine->create(wheel.model, start, havok.settings);
  const double half_a_swing = std::numbers::pi / 10;
  simulation->advance(static_cast<int>(std::lround(half_a_swing / havok.settings.timestep)));
  EXPECT_NEAR(state_of(*simulation).position[0], hinge.spring_reference - 0.5, 0.01);

  hinge.limited = true;
  hinge.lower = hinge.spring_reference - 1;
  hinge.upper = hinge.spring_reference + 3.5;
  EXPECT_THAT(refusals(wheel.model, havok), HasSubstr("use pd=explicit"));
  EXPECT_EQ(refusals(wheel.model, resolve("havok")), "");
  hinge.upper = hinge.lower + 7;
  EXPECT_EQ(refusals(wheel.model, resolve("havok")), "") << "the adapter holds it";
}

// End positions for h -> 0: the error of first order is taken away.
std::vector<Vec3> limit(const Model& model, ResolvedContender contender, double duration, double h) {
  const auto run = [&](double timestep) {
    contender.settings.timestep = timestep;
    const auto simulation = create(model, contender);
    simulation->advance(static_cast<int>(std::lround(duration / timestep)));
    return state_of(*simulation);
  };
  const State coarse = run(h), fine = run(h / 2);
  std::vector<Vec3> end;
  end.reserve(fine.bodies.size());
  for (size_t i = 0; i < fine.bodies.size(); ++i) {
    end.emplace_back(2 * fine.bodies[i].p_WBcm - coarse.bodies[i].p_WBcm);
  }
  return end;
}

double distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double largest = 0;
  for (size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).norm());
  return largest;
}

// The declared deviations are of the size that the missing gyroscopic torque makes, and not more.
TEST(Havok, ItsChainsLimitIsThatWithoutGyroscopicTorque) {
  const auto names = Registry::instance().contender_names();
  if (std::ranges::find(names, "ode-step") == names.end()) GTEST_SKIP() << "ODE is not there";
  const Model chain = conformance::chain(true);
  const std::vector<Vec3> havok = limit(chain, resolve("havok"), 1, 1e-3);
  EXPECT_LT(distance(havok, limit(chain, resolve("ode-step", {{"gyroscopic", "off"}}), 1, 0.5e-3)), 1e-3);
  EXPECT_GT(distance(havok, limit(chain, resolve("ode-step"), 1, 0.5e-3)), 5e-3);
}

// Seen from a train, a body that is let go falls with g; at rest Havok brakes it.
TEST(Havok, ADriftingBodyIsNotBraked) {
  Model model;
  add_free_body(model, "at rest", conformance::sphere_solid(1, 0.1));
  add_free_body(model, "drifting", conformance::sphere_solid(1, 0.1), {Vec3(0, 1, 0), Quat::Identity()});
  model = finished(std::move(model));
  model.initial.bodies[1].v_WBcm.x() = 1;
  const auto simulation = create(model, resolve("havok"));
  simulation->advance(8);
  const State state = state_of(*simulation);
  EXPECT_NEAR(state.bodies[0].v_WBcm.z(), -0.97 * 9.81 * 8e-3, 2e-4);
  EXPECT_NEAR(state.bodies[1].v_WBcm.z(), -9.81 * 8e-3, 2e-6);
}

class HavokNode : public testing::Test {
 protected:
  void SetUp() override {
    try {
      create(heap(), resolve("havok-node"));
    } catch (const EngineError& error) {
      if (std::string(error.what()).starts_with("Node is not there")) GTEST_SKIP() << error.what();
      throw;
    }
  }
};

TEST_F(HavokNode, GivesTheNativeBits) {
  for (const Model& model : {conformance::chain(true), conformance::oblique_trees(), heap()}) {
    const auto native = create(model, resolve("havok")), node = create(model, resolve("havok-node"));
    const std::vector<double> torques(model.joints.size(), 0.3);
    for (int batch = 0; batch < 8; ++batch) {
      for (const auto& simulation : {native.get(), node.get()}) {
        simulation->set_torques(torques);
        simulation->advance(40);
      }
      const std::vector<double> expected = numbers(state_of(*native));
      ASSERT_EQ(numbers(state_of(*node)), expected) << model.name << ", batch " << batch;
    }
    EXPECT_NE(numbers(state_of(*native)), numbers(model.initial)) << "nothing moved";
  }
}

// In a child process: its simulations do not use the parent's Node, if there is one by then.
TEST_F(HavokNode, SaysThatNodeIsNotThere) {
  const Model model = heap();
  const ResolvedContender node = resolve("havok-node");
  const auto without = [&] {
    setenv("PATH", "/nonexistent", 1);
    try {
      create(model, node);
    } catch (const EngineError& error) {
      std::fputs(error.what(), stderr);
      std::_Exit(3);
    }
    std::_Exit(0);
  };
  EXPECT_EXIT(without(), ExitedWithCode(3), "Node is not there: install it");
}

TEST_F(HavokNode, ANodeThatDiesIsAnEngineErrorAndTheNextSimulationHasAnother) {
  const Model model = heap();
  const ResolvedContender node = resolve("havok-node");
  const auto killed = [&] {
    const auto simulation = create(model, node);
    std::ifstream children("/proc/self/task/" + std::to_string(getpid()) + "/children");
    for (pid_t child = 0; children >> child;) kill(child, SIGKILL);
    try {
      simulation->advance(1);
    } catch (const EngineError& error) {
      std::fputs(error.what(), stderr);
      create(model, node)->advance(1);
      std::_Exit(3);
    }
    std::_Exit(0);
  };
  EXPECT_EXIT(killed(), ExitedWithCode(3), "Node ended");
}

// As in a worker, whose parent then starts another one.
TEST_F(HavokNode, ANodeThatSomebodyElseEndsTakesAnExpendableProcessAlong) {
  const Model model = heap();
  const ResolvedContender node = resolve("havok-node");
  const auto killed = [&](int signal) {
    be_expendable();
    const auto simulation = create(model, node);
    for (const pid_t child : children_of(getpid())) kill(child, signal);
    try {
      simulation->advance(1);
    } catch (const EngineError& error) {
      std::fputs(error.what(), stderr);
      std::_Exit(3);
    }
    std::_Exit(0);
  };
  EXPECT_EXIT(killed(SIGKILL), testing::KilledBySignal(SIGKILL), "");
  EXPECT_EXIT(killed(SIGUSR2), ExitedWithCode(3), "Node ended") << "as by itself";
}

}  // namespace
}  // namespace assay
