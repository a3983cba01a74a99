#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "conformance/models.h"
#include "engines/registry.h"

namespace assay {
namespace {

using namespace conformance;  // NOLINT(google-build-using-namespace): the suite's small models

std::unique_ptr<Simulation> box3d_simulation(const Model& model, const std::string& contender, const State& state) {
  const ResolvedContender resolved = Registry::instance().resolve(contender);
  return resolved.engine->create(model, state, resolved.settings);
}

double rate_after(const Model& model, const std::string& contender, double angle, double rate, int steps) {
  const auto simulation = box3d_simulation(model, contender, with_joints(model, {angle}, {rate}));
  State state;
  for (int i = 0; i < steps; ++i) simulation->step({});
  simulation->read_state(state);
  return state.velocity[0];
}

// A metre per second for 0.1 s, a thousand kilometres away: there single precision has steps of 6 cm.
TEST(Box3d, DoublePositionsResolveWhatSingleOnesDoNot) {
  Model model;
  add_free_body(model, "far", sphere_solid(1, 0.1), {Vec3(1e6, 0, 0), Quat::Identity()});
  model.gravity = Vec3::Zero();
  model = finished(std::move(model));
  model.initial.bodies[0].v_WBcm = Vec3::UnitX();
  const auto error = [&](const std::string& contender) {
    const auto simulation = box3d_simulation(model, contender, model.initial);
    State state;
    simulation->advance(100);
    simulation->read_state(state);
    return std::abs(state.bodies[0].p_WBcm.x() - (1e6 + 0.1));
  };
  EXPECT_LT(error("box3d"), 1e-6);
  EXPECT_GT(error("box3d-f32"), 0.01);
}

// Box3D takes hertz and a damping ratio of an inertia: these have to become the joint's own stiffness and damping
// again. Its spring is implicit in each of the four sub-steps of 1/4 ms.
TEST(Box3d, NativeSpringsHaveTheJointsStiffnessAndDamping) {
  Flywheel wheel = flywheel();
  Joint& hinge = wheel.model.joints[0];
  hinge.spring_reference = 0.5;
  for (const bool spring : {true, false}) {
    for (const double omega : {20.0, 1e4}) {
      hinge.stiffness = spring ? omega * omega * wheel.axial_inertia : 0;
      hinge.damping = 0.6 * omega * wheel.axial_inertia;
      const Model model = finished(wheel.model);
      double angle = 0.6, rate = 1;
      for (int i = 0; i < 40; ++i) {
        const double h = 1e-3 / 4, k = hinge.stiffness / wheel.axial_inertia, d = hinge.damping / wheel.axial_inertia;
        rate = (rate - h * k * (angle - 0.5)) / (1 + h * d + h * h * k);
        angle += h * rate;
      }
      EXPECT_NEAR(rate_after(model, "box3d-native-pd", 0.6, 1, 10), rate, 2e-4 * std::max(1.0, std::abs(rate)))
          << omega << spring;
    }
  }
  hinge.stiffness = 1e8 * wheel.axial_inertia;
  hinge.damping = 0;
  EXPECT_GT(std::abs(rate_after(finished(wheel.model), "box3d", 0.6, 0, 20)), 2000);  // explicit: flies apart
}

// The effective inertia of a slide on a free parent has both masses and the arm of the force about the parent's centre.
TEST(Box3d, ASlidesNativeSpringActsOnAFreeParentToo) {
  Model model;
  model.gravity = Vec3::Zero();
  add_free_body(model, "base", sphere_solid(2, 0.2));
  Joint& slide =
      add_sliding_body(model, "slider", 0, {Vec3(0, 0.1, 0), Quat::Identity()}, sphere_solid(1, 0.1), Vec3::UnitX());
  slide.stiffness = 50;
  slide.damping = 3;
  model = finished(std::move(model));
  const auto after = [&](const std::string& contender) {
    ResolvedContender resolved = Registry::instance().resolve(contender);
    resolved.settings.timestep = 1e-4;
    const auto simulation = resolved.engine->create(model, with_joints(model, {0.1}, {0}), resolved.settings);
    State state;
    for (int i = 0; i < 2000; ++i) simulation->step({});
    simulation->read_state(state);
    return state.position[0];
  };
  const double reference = after("box3d");
  EXPECT_NEAR(after("box3d-native-pd"), reference, 2e-4);
  EXPECT_LT(reference, 0.06);
}

// Box3D keeps friction of the last sub-step only, and its total of normal impulses counts both sweeps of each.
TEST(Box3d, ContactForcesNeedASingleSubStep) {
  Model model;
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  add_free_body(model, "ball", sphere_solid(2, 0.1), {Vec3(0, 0, 0.1), Quat::Identity()});
  add_contact(model, plane, add_shape(model, ShapeType::kSphere, 0, {}, 0.1), 0.5);
  model = finished(std::move(model));
  EXPECT_FALSE(box3d_simulation(model, "box3d", model.initial)->keep_contacts());
  ResolvedContender single = Registry::instance().resolve("box3d");
  single.settings.values["sub_steps"] = 1LL;
  const auto simulation = single.engine->create(model, model.initial, single.settings);
  ASSERT_TRUE(simulation->keep_contacts());
  simulation->advance(200);
  std::vector<ContactForce> contacts;
  simulation->read_contacts(contacts);
  ASSERT_EQ(contacts.size(), 1U);
  EXPECT_NEAR(contacts[0].impulse_W.z(), 2 * kGravity * 1e-3, 1e-5);
}

// Box3D has one array of 128 worlds in a process.
TEST(Box3d, WorldsAreGivenBackAndTooManyAtOnceAreAnError) {
  const Model model = chain(false);
  for (int i = 0; i < 300; ++i) box3d_simulation(model, "box3d", model.initial);
  std::vector<std::unique_ptr<Simulation>> all;
  EXPECT_THROW(
      {
        for (int i = 0; i < 200; ++i) all.push_back(box3d_simulation(model, "box3d", model.initial));
      },
      EngineError);
  EXPECT_EQ(all.size(), 128U);
}

}  // namespace
}  // namespace assay
