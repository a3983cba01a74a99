#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "conformance/models.h"
#include "engines/registry.h"
#include "measures/reference/smooth.h"
#include "model/kinematics.h"

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

Body link(int parent, const Vec3& p_PB) {
  Body body;
  body.parent = parent;
  body.X_PB = {p_PB, Quat(Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()))};
  body.mass = 1;
  body.p_BBcm = {0.05, -0.02, -0.1};
  body.I_BBcm_B = Vec3(0.02, 0.03, 0.025).asDiagonal();
  return body;
}

void add_ball(Model& model, int body) {
  model.bodies[body].ball = static_cast<int>(model.balls.size());
  model.balls.push_back({.name = "ball", .body = body, .p_BJ = {0, 0, 0.2}});
}

Joint& add_joint(Model& model, int body, JointType type) {
  model.bodies[body].joint = static_cast<int>(model.joints.size());
  Joint& joint = model.joints.emplace_back();
  joint.body = body;
  joint.type = type;
  joint.axis_B = Vec3(1, -1, 2).normalized();
  joint.reference = 0.1;
  return joint;
}

// A ball joint, then a slide and a hinge in one body, with springs in all and a tendon between the last two.
Model all_joints() {
  Model model;
  model.bodies = {link(kWorld, {0, 0, 1}), link(0, {0, 0, -0.3}), link(1, Vec3::Zero())};
  Body& between = model.bodies[1];
  between.mass = 0;
  between.p_BBcm.setZero();
  between.I_BBcm_B.setZero();
  model.bodies[2].X_PB = {};
  add_ball(model, 0);
  model.balls[0].stiffness = 5;
  model.balls[0].damping = 0.1;
  model.balls[0].spring_reference = Quat(Eigen::AngleAxisd(0.3, Vec3::UnitY()));
  Joint& slide = add_joint(model, 1, JointType::kSlide);
  slide.stiffness = 200;
  slide.damping = 1;
  Joint& hinge = add_joint(model, 2, JointType::kHinge);
  hinge.axis_B = Vec3::UnitX();
  hinge.p_BJ = {0, 0, 0.1};
  model.tendons = {{.name = "tendon", .terms = {{0, 2}, {1, 0.5}}, .stiffness = 20, .damping = 0.2}};
  model = conformance::finished(std::move(model));
  model.initial = reference_state(model);
  model.initial.velocity = {0.3, 2};
  bodies_from_joints(model, {{Quat(Eigen::AngleAxisd(0.5, Vec3(1, 1, 0).normalized())), Vec3(1, 2, -1)}},
                     model.initial);
  return model;
}

TEST(Simbody, BallsSlidesMasslessBodiesAndTheirSpringsKeepTheIntegratorsOrder) {
  const Model model = all_joints();
  EXPECT_NEAR(observed_order(model, {{"integrator", "euler"}}), 1, 0.35);
  EXPECT_THROW(run(model, {{"integrator", "verlet"}}, 1e-3, 0.01), UnsupportedError);  // ball joints
  EXPECT_NEAR(observed_order(model, {{"integrator", "rkm"}}), 4, 0.6);
  EXPECT_NEAR(observed_order(model, {{"integrator", "rkm"}, {"pd", "explicit"}}), 1, 0.35);
}

// A closed chain of two ball joints, a body welded to it, and a hinge that turns with a slide.
Model constrained() {
  Model model;
  model.bodies = {link(kWorld, {0, 0, 1}), link(0, {0, 0, -0.3}),     link(kWorld, {0, 0, 0}),
                  link(kWorld, {1, 0, 0}), link(kWorld, {1, 0, 0.3}), link(kWorld, {1, 0.5, 0})};
  add_ball(model, 0);
  add_ball(model, 1);
  for (const auto& [body, type] : {std::pair{3, JointType::kSlide}, {4, JointType::kHinge}, {5, JointType::kHinge}}) {
    add_joint(model, body, type);
  }
  model.joints[2].reference = 0.4;  // as the coupling of many has it
  model.couplings = {{.name = "two", .joint = 1, .terms = {{0, 2}}, .offset = -0.1},
                     {.name = "many", .joint = 2, .terms = {{0, 1}, {1, -1}}, .offset = 0.4}};
  model = conformance::finished(std::move(model));
  model.initial = reference_state(model);
  model.initial.velocity = {0.2, 0.4, -0.2};
  bodies_from_joints(model, std::vector<BallCoordinates>(2), model.initial);
  const auto pose = [&](int body) { return body_pose(model.bodies[body], model.initial.bodies[body]); };
  const Vec3 p_B(0.1, 0, -0.3);
  model.connects = {{.name = "end", .body_a = kWorld, .body_b = 1, .p_A = pose(1) * p_B, .p_B = p_B}};
  model.welds = {{.name = "weld", .body_a = 1, .body_b = 2, .X_AB = pose(1).inverse() * pose(2)}};
  return model;
}

TEST(Simbody, HoldsCouplingsConnectsAndWelds) {
  const Model model = constrained();
  EXPECT_NEAR(observed_order(model, {{"integrator", "euler"}}), 1, 0.35);
  EXPECT_NEAR(observed_order(model, {{"integrator", "rkm"}}), 4, 0.6);
  const State end = run(model, {}, 1e-3, 0.5);
  EXPECT_NEAR(end.position[1], -0.1 + 2 * end.position[0], 1e-10);
  EXPECT_NEAR(end.position[2], 0.4 + end.position[0] - end.position[1], 1e-10);
  EXPECT_GT(std::abs(end.position[0] - 0.1), 0.01) << "it did not move";
  const auto pose = [&](int body) { return body_pose(model.bodies[body], end.bodies[body]); };
  EXPECT_LT((pose(1) * model.connects[0].p_B - model.connects[0].p_A).norm(), 1e-10);
  const Pose X_AB = pose(1).inverse() * pose(2);
  EXPECT_LT((X_AB.p - model.welds[0].X_AB.p).norm(), 1e-10);
  EXPECT_LT(X_AB.q.angularDistance(model.welds[0].X_AB.q), 1e-9);
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

// With a fixed step Simbody goes on after a step that failed inside, here because its constraints could not be met, and
// only counts it. Its release build checks no state: what is left of one is not finite, which its caller sees.
TEST(Simbody, ReportsAStepThatFailedInside) {
  Model model = constrained();
  std::ranges::fill(model.initial.velocity, 1e4);
  try {
    run(model, {{"integrator", "euler"}}, 1, 10);
    FAIL() << "no exception";
  } catch (const EngineError& error) {
    EXPECT_THAT(error.what(), HasSubstr("Simbody"));
    EXPECT_THAT(error.what(), testing::Not(HasSubstr("\n")));
  }
  EXPECT_FALSE(std::isfinite(run(model, {{"integrator", "rkm"}}, 1, 10).position[0]));
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
