#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "conformance/models.h"
#include "engines/registry.h"
#include "model/kinematics.h"
#include "reference/smooth.h"

namespace assay {
namespace {

using testing::HasSubstr;

State run(const Model& model, const std::map<std::string, std::string>& overrides, double timestep, double duration) {
  ResolvedContender resolved = Registry::instance().resolve("simbody-euler", overrides);
  resolved.settings.timestep = timestep;
  const auto simulation = resolved.engine->create(model, model.initial, resolved.settings);
  const auto steps = static_cast<int>(std::llround(duration / timestep));
  if (overrides.contains("pd")) {
    for (int i = 0; i < steps; ++i) simulation->step({});
  } else {
    simulation->advance(steps);
  }
  State state;
  simulation->read_state(state);
  return state;
}

// The order that the errors at 8 and 4 ms show.
double observed_order(const Model& model, const std::map<std::string, std::string>& overrides) {
  const State truth = smooth_solution(model, model.initial, 0.4);
  const auto error = [&](double timestep) {
    const State end = run(model, overrides, timestep, 0.4);
    double sum = 0;
    for (size_t i = 0; i < end.bodies.size(); ++i) sum += (end.bodies[i].p_WBcm - truth.bodies[i].p_WBcm).norm();
    return sum;
  };
  return std::log2(error(8e-3) / error(4e-3));
}

// Every choice of `integrator`, of which the gate sees three.
TEST(Simbody, IntegratorsHaveTheDeclaredOrder) {
  const Model model = conformance::chain(true);
  for (const char* integrator : {"euler", "verlet", "rk2", "rk3", "rkm", "rkf"}) {
    const std::map<std::string, std::string> overrides = {{"integrator", integrator}};
    const ResolvedContender resolved = Registry::instance().resolve("simbody-euler", overrides);
    const int order = resolved.engine->capabilities(resolved.settings).order;
    EXPECT_NEAR(observed_order(model, overrides), order, 0.35) << integrator;
  }
}

TEST(Simbody, OwnSpringsKeepTheIntegratorsOrder) {
  Model model = conformance::pendulum().model;
  model.joints[0].stiffness = 3;
  model.joints[0].spring_reference = 0.4;
  model.joints[0].damping = 0.2;
  model = conformance::finished(std::move(model));
  model.initial = conformance::with_joints(model, {1.5}, {2});
  EXPECT_NEAR(observed_order(model, {{"integrator", "rkm"}, {"pd", "native"}}), 4, 0.35);
  EXPECT_NEAR(observed_order(model, {{"integrator", "rkm"}, {"pd", "explicit"}}), 1, 0.35);
}

TEST(Simbody, RefusesContact) {
  Model model;
  conformance::add_free_body(model, "ball", conformance::sphere_solid(1, 0.1), {Vec3(0, 0, 1), Quat::Identity()});
  const int plane = conformance::add_shape(model, ShapeType::kPlane, kWorld);
  conformance::add_contact(model, plane, conformance::add_shape(model, ShapeType::kSphere, 0, {}, 0.1), 1);
  model = conformance::finished(std::move(model));
  EXPECT_THROW(run(model, {}, 1e-3, 0.01), UnsupportedError);
  EXPECT_NO_THROW(run(without_contacts(model), {}, 1e-3, 0.01));
}

// With a fixed step Simbody goes on after an exception inside a step and only counts it.
TEST(Simbody, ReportsAStepThatFailedInside) {
  Model model = conformance::chain(true);
  model.initial.velocity[0] = std::numeric_limits<double>::max();
  for (const char* integrator : {"euler", "rkm", "verlet"}) {
    try {
      run(model, {{"integrator", integrator}}, 1e-3, 0.01);
      FAIL() << integrator << ": no exception";
    } catch (const EngineError& error) {
      EXPECT_THAT(error.what(), HasSubstr("Simbody"));
      EXPECT_THAT(error.what(), testing::Not(HasSubstr("\n")));
    }
  }
}

// The spring that stands for a limit follows the timestep, so it neither blows up nor lets the joint through.
TEST(Simbody, LimitsHoldAtEveryTimestep) {
  Model model = conformance::pendulum().model;
  model.joints[0].limited = true;
  model.joints[0].lower = -0.5;
  model.joints[0].upper = 0.5;
  model = conformance::finished(std::move(model));
  model.initial = conformance::with_joints(model, {0}, {6});
  for (const double timestep : {0.25e-3, 1e-3, 8e-3}) {
    for (const double duration : {0.1, 0.4, 2.0}) {
      const State end = run(model, {}, timestep, duration);
      // the speed of arrival times half a swing of the spring, 1/0.2 of a step, and something for the first step
      EXPECT_LT(std::abs(end.position[0]), 0.5 + (7 * 6 * timestep)) << timestep << " s, after " << duration << " s";
      EXPECT_LT(std::abs(end.velocity[0]), 6.5) << timestep << " s, after " << duration << " s";
    }
  }
}

}  // namespace
}  // namespace assay
