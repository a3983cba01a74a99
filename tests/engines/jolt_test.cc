#include <algorithm>
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "conformance/models.h"
#include "conformance/subject.h"
#include "engines/registry.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using namespace conformance;  // NOLINT(google-build-using-namespace): the suite's small models
using testing::HasSubstr;

bool present(const std::string& contender) {
  return std::ranges::count(Registry::instance().contender_names(), contender) > 0;
}

std::unique_ptr<Simulation> create(const Model& model, const ResolvedContender& contender, const State& state) {
  return contender.engine->create(model, state, contender.settings);
}

State run(const std::string& contender, const Model& model, int steps) {
  const auto simulation = create(model, Registry::instance().resolve(contender), model.initial);
  State state;
  for (int i = 0; i < steps; i += 10) {
    simulation->advance(10);
    simulation->read_state(state);
  }
  return state;
}

// Capsules, balls and a body of two shapes fall onto a tilted plane, with frictions by pair.
Model heap() {
  Model model;
  const Pose tilted{Vec3::Zero(), Quat(Eigen::AngleAxisd(0.1, Vec3(1, 2, 0).normalized()))};
  const int plane = add_shape(model, ShapeType::kPlane, kWorld, tilted);
  std::vector<int> shapes;
  for (int i = 0; i < 6; ++i) {
    const Pose X_WB{Vec3(0.07 * (i % 2), 0.05 * (i % 3), 0.3 + 0.25 * i), Quat(Eigen::AngleAxisd(i, Vec3::UnitX()))};
    add_free_body(model, "body" + std::to_string(i), capsule_solid(1, 0.05, 0.1, Vec3::UnitZ()), X_WB);
    shapes.push_back(add_shape(model, i % 2 == 0 ? ShapeType::kCapsule : ShapeType::kSphere, i, {}, 0.05, 0.1));
    if (i == 3) shapes.push_back(add_shape(model, ShapeType::kSphere, i, {Vec3(0.1, 0, 0), Quat::Identity()}, 0.04));
  }
  for (size_t a = 0; a < shapes.size(); ++a) {
    add_contact(model, plane, shapes[a], 0.3 + 0.1 * static_cast<double>(a));
    for (size_t b = a + 1; b < shapes.size(); ++b) {
      if (model.shapes[shapes[a]].body != model.shapes[shapes[b]].body) add_contact(model, shapes[a], shapes[b], 0.4);
    }
  }
  return finished(std::move(model));
}

// So the ratio of their times is the price of WebAssembly only.
TEST(Jolt, WebAssemblyGivesTheBitsOfTheNativeBuild) {
  if (!present("jolt-f32") || !present("jolt-f32-wasm")) GTEST_SKIP() << "Jolt is not built both ways";
  for (const Model& model : {heap(), chain(true), oblique_trees()}) {
    const State native = run("jolt-f32", model, 1000);
    EXPECT_EQ(differing_bits(native, run("jolt-f32-wasm", model, 1000)), 0) << model.name;
    EXPECT_GT(differing_bits(native, model.initial), 0) << model.name;
  }
}

// A metre per second for 0.1 s, a thousand kilometres away: there single precision has steps of 6 cm.
TEST(Jolt, DoublePositionsResolveWhatSingleOnesDoNot) {
  if (!present("jolt-f64")) GTEST_SKIP() << "Jolt is not built with double positions";
  Model model;
  add_free_body(model, "far", sphere_solid(1, 0.1), {Vec3(1e6, 0, 0), Quat::Identity()});
  model.gravity = Vec3::Zero();
  model = finished(std::move(model));
  model.initial.bodies[0].v_WBcm = Vec3::UnitX();
  EXPECT_NEAR(run("jolt-f64", model, 100).bodies[0].p_WBcm.x(), 1e6 + 0.1, 1e-6);
  EXPECT_GT(std::abs(run("jolt-f32", model, 100).bodies[0].p_WBcm.x() - (1e6 + 0.1)), 0.01);
}

// Jolt's own angle has a zero of its own in the middle of a range; the model's is found behind it.
TEST(Jolt, RangesThatDoNotHoldZeroWork) {
  Flywheel wheel = flywheel();
  Joint& hinge = wheel.model.joints[0];
  hinge.limited = true;
  hinge.lower = 2.5;
  hinge.upper = 4.5;
  hinge.reference = 3;
  wheel.model = finished(std::move(wheel.model));
  for (const double rate : {2.0, -2.0}) {
    const auto simulation =
        create(wheel.model, Registry::instance().resolve("jolt-f32"), with_joints(wheel.model, {3.5}, {rate}));
    State state;
    double furthest = 3.5;
    for (int i = 0; i < 1000; ++i) {
      simulation->advance(1);
      simulation->read_state(state);
      furthest = rate > 0 ? std::max(furthest, state.position[0]) : std::min(furthest, state.position[0]);
    }
    EXPECT_NEAR(furthest, rate > 0 ? 4.5 : 2.5, 5e-3);
  }
}

// The motor is an implicit spring: a stiffness at which an explicit one flies apart leaves it calm.
TEST(Jolt, NativeSpringsAreImplicitAndExplicitOnesAreNot) {
  Flywheel wheel = flywheel();
  Joint& hinge = wheel.model.joints[0];
  hinge.spring_reference = 0.5;
  hinge.stiffness = 1e8 * wheel.axial_inertia;  // 10000 rad/s: 10 rad a step of 1 ms
  wheel.model = finished(std::move(wheel.model));
  const auto largest_rate = [&](const std::string& contender) {
    const auto simulation =
        create(wheel.model, Registry::instance().resolve(contender), with_joints(wheel.model, {0.6}, {0}));
    State state;
    double largest = 0;
    for (int i = 0; i < 20; ++i) {
      simulation->step({});
      simulation->read_state(state);
      largest = std::max(largest, std::isfinite(state.velocity[0]) ? std::abs(state.velocity[0]) : 1e30);
    }
    return largest;
  };
  EXPECT_LT(largest_rate("jolt-f32-native-pd"), 1000);  // of the exact oscillator: 0.1 rad times 10000 rad/s
  EXPECT_GT(largest_rate("jolt-f32"), 2000);
}

TEST(Jolt, SaysThatKeptContactPointsLetRoundBodiesRollAway) {
  const auto said = [](const std::string& contender, ShapeType type) {
    Model model;
    const int plane = add_shape(model, ShapeType::kPlane, kWorld, Pose());
    add_free_body(model, "body", capsule_solid(1, 0.1, 0.1, Vec3::UnitZ()), {Vec3(0, 0, 0.2), Quat::Identity()});
    const int shape = add_shape(model, type, 0, {}, 0.1, 0.1);
    if (type == ShapeType::kBox) model.shapes[static_cast<size_t>(shape)].half_size = Vec3(0.1, 0.1, 0.1);
    add_contact(model, plane, shape, 1);
    model = finished(std::move(model));
    const ResolvedContender jolt = Registry::instance().resolve(contender);
    std::string text;
    for (const Limitation& each : jolt.engine->check(model, jolt.settings)) text += each.how + "\n";
    return text;
  };
  for (const ShapeType round : {ShapeType::kSphere, ShapeType::kCapsule, ShapeType::kCylinder}) {
    EXPECT_THAT(said("jolt-default", round), HasSubstr("rolls away"));
    EXPECT_EQ(said("jolt-f32", round), "");
  }
  EXPECT_EQ(said("jolt-default", ShapeType::kBox), "");
}

TEST(Jolt, RefusesWhatItCannotHold) {
  const ResolvedContender native = Registry::instance().resolve("jolt-f32-native-pd");
  const auto refusal = [&](const auto& change) {
    Flywheel wheel = flywheel();
    change(wheel.model.joints[0]);
    wheel.model = finished(std::move(wheel.model));
    try {
      create(wheel.model, native, wheel.model.initial);
    } catch (const UnsupportedError& error) {
      return std::string(error.what());
    }
    return std::string("taken");
  };
  EXPECT_EQ(refusal([](Joint& hinge) { hinge.armature = 0.1; }), "taken");
  EXPECT_EQ(refusal([](Joint& hinge) {
              hinge.limited = true;
              hinge.lower = -std::numbers::pi;
              hinge.upper = std::numbers::pi;
            }),
            "taken");
  EXPECT_THAT(refusal([](Joint& hinge) {
                hinge.limited = true;
                hinge.lower = -1;
                hinge.upper = 1;
                hinge.stiffness = 1;
                hinge.spring_reference = 2;
              }),
              HasSubstr("spring"));
  EXPECT_EQ(refusal([](Joint& /*hinge*/) {}), "taken");
}

}  // namespace
}  // namespace assay
