#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "conformance/models.h"
#include "engines/registry.h"
#include "model/kinematics.h"
#include "simulated.h"

namespace assay {
namespace {

using conformance::add_contact;
using conformance::add_free_body;
using conformance::add_hinged_body;
using conformance::add_shape;
using conformance::capsule_solid;
using conformance::sphere_solid;

const Quat kAlongX(std::sqrt(0.5), 0, std::sqrt(0.5), 0), kAlongY(std::sqrt(0.5), -std::sqrt(0.5), 0, 0);

std::unique_ptr<Simulation> create(const Model& model, const std::string& contender,
                                   const std::map<std::string, std::string>& overrides = {}, double timestep = 1e-3) {
  ResolvedContender resolved = Registry::instance().resolve(contender, overrides);
  resolved.settings.timestep = timestep;
  return resolved.engine->create(model, model.initial, resolved.settings);
}

// A bar slides across two rails. The rails' and the bar's other pairs have larger coefficients, so that no coefficient
// a shape gives every pair its own under DART's rule, the smaller of two: the shapes have to be there more than once.
TEST(Dart, CarriesCoefficientsThatItsRuleCannot) {
  Model model;
  const int plane = add_shape(model, ShapeType::kPlane, kWorld, {Vec3(0, 0, -5), Quat::Identity()});
  add_free_body(model, "bar", capsule_solid(1, 0.1, 0.3, Vec3::UnitZ()), {Vec3(0, 0, 0.2), kAlongY});
  const int bar = add_shape(model, ShapeType::kCapsule, 0, {}, 0.1, 0.3);
  add_free_body(model, "ball", sphere_solid(1, 0.1), {Vec3(0, 0, 3), Quat::Identity()});
  const int ball = add_shape(model, ShapeType::kSphere, 1, {}, 0.1);
  for (const double side : {-0.2, 0.2}) {
    const int rail = add_shape(model, ShapeType::kCapsule, kWorld, {Vec3(0, side, 0), kAlongX}, 0.1, 2);
    add_contact(model, rail, bar, 0.1);
    add_contact(model, rail, ball, 0.6);
  }
  add_contact(model, plane, bar, 0.5);
  model = conformance::finished(std::move(model));
  model.initial.bodies[0].v_WBcm = {1, 0, 0};
  const auto simulation = create(model, "dart");
  simulation->advance(200);
  const State end = state_of(*simulation);
  EXPECT_NEAR(end.bodies[0].v_WBcm.x(), 1 - (0.1 * 9.81 * 0.2), 0.002);
  EXPECT_NEAR(end.bodies[0].p_WBcm.z(), 0.2, 1e-3);
}

// Each plugin has a copy of ODE; DART starts and closes its own with every detector.
TEST(Dart, LivesBesideOde) {
  Model model;
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  for (int i = 0; i < 5; ++i) {
    const Quat q(Eigen::AngleAxisd(0.4 * i, Vec3(1, 2, 2) / 3));
    add_free_body(model, "capsule", capsule_solid(1, 0.08, 0.1, Vec3::UnitZ()), {Vec3(0.03 * i, 0, 0.2 + 0.2 * i), q});
    const int shape = add_shape(model, ShapeType::kCapsule, i, {}, 0.08, 0.1);
    for (int other = plane; other < shape; ++other) add_contact(model, other, shape, 0.5);
  }
  model = conformance::finished(std::move(model));
  const std::vector<std::string> names = Registry::instance().contender_names();
  const bool has_ode = std::ranges::find(names, "ode-quick") != names.end();
  const auto run = [&](const std::string& contender, const std::string& guest) {
    const auto simulation = create(model, contender);
    for (int i = 0; i < 20; ++i) {
      simulation->advance(20);
      if (!guest.empty()) create(model, guest)->advance(5);
    }
    return state_of(*simulation).bodies.back().p_WBcm;
  };
  if (!has_ode) GTEST_SKIP() << "needs ODE";
  EXPECT_EQ(run("dart", "").eval(), run("dart", "ode-quick"));
  EXPECT_EQ(run("ode-quick", "").eval(), run("ode-quick", "dart"));
}

// What spring_note says, at a step far beyond the explicit limit.
TEST(Dart, TakesDampingImplicitlyAsDeclared) {
  Model model;
  model.gravity.setZero();
  add_hinged_body(model, "wheel", kWorld, {}, {1, Vec3::Zero(), Mat3::Identity()}, Vec3::UnitY()).damping = 5;
  model = conformance::finished(std::move(model));
  model.initial = conformance::with_joints(model, {0}, {1});
  const auto final_rate = [&](const std::string& pd) {
    const auto simulation = create(model, "dart", {{"pd", pd}}, 1);
    for (int i = 0; i < 8; ++i) simulation->step({});
    return std::abs(state_of(*simulation).velocity[0]);
  };
  EXPECT_LT(final_rate("native"), 1e-5);
  EXPECT_GT(final_rate("explicit"), 1e4);
}

// DART would correct the whole excess in one step and leave the joint that speed.
TEST(Dart, MovesJointsBackAtTheDeclaredSpeed) {
  Model model;
  model.gravity.setZero();
  Joint& joint = add_hinged_body(model, "wheel", kWorld, {}, {1, Vec3::Zero(), Mat3::Identity()}, Vec3::UnitY());
  joint.limited = true;
  joint.lower = -0.6;
  joint.upper = 0.6;
  model = conformance::finished(std::move(model));
  model.initial = conformance::with_joints(model, {-0.68}, {0});
  const auto rate_after = [&](const std::string& cap, int steps) {
    const auto simulation = create(model, "dart", {{"limit_max_correcting_velocity", cap}});
    simulation->advance(steps);
    return state_of(*simulation).velocity[0];
  };
  EXPECT_NEAR(rate_after("0.1", 1), 0.1, 1e-6);
  EXPECT_NEAR(rate_after("0.1", 1000), 0.1, 1e-6);  // within its range by then
  EXPECT_NEAR(rate_after("0", 1), 80, 1e-3);
}

// The solver's numbers are the process's in DART, not the world's.
TEST(Dart, KeepsSettingsOfInstancesApart) {
  Model model;
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  add_free_body(model, "ball", sphere_solid(1, 0.1), {Vec3(0, 0, 0.09), Quat::Identity()});
  add_contact(model, plane, add_shape(model, ShapeType::kSphere, 0, {}, 0.1), 1);
  model = conformance::finished(std::move(model));
  const auto stiff = create(model, "dart", {{"contact_max_correcting_velocity", "0"}});
  const auto lazy = create(model, "dart", {{"contact_max_correcting_velocity", "0.001"}});
  stiff->advance(10);
  lazy->advance(10);
  EXPECT_GT(state_of(*stiff).bodies[0].p_WBcm.z(), 0.098);
  EXPECT_NEAR(state_of(*lazy).bodies[0].p_WBcm.z(), 0.09 + 1e-5, 1e-6);
}

}  // namespace
}  // namespace assay
