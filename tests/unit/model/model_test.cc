#include "model/model.h"

#include <functional>

#include <gtest/gtest.h>

#include "model/kinematics.h"

namespace assay {
namespace {

// One of everything.
Model sample() {
  Model model;
  model.name = "sample";
  model.bodies.push_back({.name = "base", .X_PB = {}, .mass = 2});
  model.bodies.push_back({.name = "arm", .parent = 0, .joint = 0, .X_PB = {}, .mass = 1});
  model.joints.push_back({.name = "elbow", .body = 1});
  model.shapes.push_back({.name = "ball", .body = 0, .X_BS = {}, .radius = 0.1});
  model.shapes.push_back({.name = "floor", .type = ShapeType::kPlane, .X_BS = {}});
  model.contacts.push_back({0, 1, 0.5});
  model.actuators.push_back({.name = "motor", .terms = {{0, 1}}, .sine = {}});
  model.initial = reference_state(model);
  model.control0 = {0};
  model.hash = model_hash(model);
  return model;
}

TEST(Model, Sums) {
  Model model = sample();
  EXPECT_EQ(model.dof(), 7);
  EXPECT_EQ(model.total_mass(), 3);
  EXPECT_FALSE(model.has_springs());
  model.joints[0].damping = 1;
  EXPECT_TRUE(model.has_springs());
  EXPECT_FALSE(model.has_armature());
  model.joints[0].armature = 1;
  EXPECT_TRUE(model.has_armature());
  EXPECT_FALSE(model.has_limits());
  model.joints[0].limited = true;
  EXPECT_TRUE(model.has_limits());
  EXPECT_TRUE(model.bodies[0].is_free());
  EXPECT_FALSE(model.bodies[1].is_free());
}

// fields_test.cc has the members of bodies, joints, shapes and contact pairs.
TEST(Model, EveryPieceOfPhysicsIsInTheHash) {
  const std::vector<std::function<void(Model&)>> changes = {
      [](Model& m) { m.gravity.z() = -9.80665; },
      [](Model& m) { m.bodies.pop_back(); },
      [](Model& m) { m.contacts.clear(); },
      [](Model& m) { m.actuators[0].gain = 3; },
      [](Model& m) { m.actuators[0].terms[0].coefficient = 2; },
      [](Model& m) { m.actuators[0].terms.push_back({0, 1}); },
      [](Model& m) { m.actuators[0].sine.amplitude = 2; },
      [](Model& m) { m.actuators[0].control_lower = -1; },
      [](Model& m) { m.actuators[0].control_upper = 1; },
      [](Model& m) { m.actuators[0].force_lower = -1; },
      [](Model& m) { m.actuators[0].bias[1] = -2; },
      [](Model& m) { m.actuators[0].bias[2] = -2; },
      [](Model& m) { m.actuators[0].control_limited = true; },
      [](Model& m) { m.actuators[0].force_limited = true; },
      [](Model& m) { m.actuators[0].force_upper = 2; },
      [](Model& m) { m.initial.position[0] = 1; },
      [](Model& m) { m.initial.velocity[0] = 1; },
      [](Model& m) { m.initial.bodies[0].v_WBcm.x() = 1; },
      [](Model& m) { m.control0[0] = 1; },
  };
  const Model original = sample();
  for (size_t i = 0; i < changes.size(); ++i) {
    Model changed = original;
    changes[i](changed);
    EXPECT_NE(model_hash(changed), original.hash) << "change number " << i;
  }
}

TEST(Model, WhatIsNotPhysicsIsNotInTheHash) {
  Model model = sample();
  model.name = "other";
  model.source = "/elsewhere";
  model.notes = {"a note"};
  model.gravity.x() = -0.0;
  EXPECT_EQ(model_hash(model), sample().hash);
}

TEST(Model, CopiesDifferInOneRespect) {
  const Model model = sample();
  const Model bare = without_contacts(model);
  EXPECT_TRUE(bare.contacts.empty());
  EXPECT_EQ(bare.gravity, model.gravity);
  EXPECT_NE(bare.hash, model.hash);
  const Model floating = without_gravity(model);
  EXPECT_EQ(floating.gravity, Vec3::Zero());
  EXPECT_EQ(floating.contacts.size(), 1U);
  EXPECT_NE(floating.hash, model.hash);
  EXPECT_NE(floating.hash, bare.hash);
  EXPECT_EQ(without_gravity(floating).hash, floating.hash);
}

}  // namespace
}  // namespace assay
