// What the PhysX adapter promises beyond the conformance suite.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "conformance/models.h"
#include "engines/registry.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using conformance::add_contact;
using conformance::add_free_body;
using conformance::add_hinged_body;
using conformance::add_shape;
using conformance::finished;
using testing::HasSubstr;

constexpr double kRadius = 0.1, kTimestep = 1e-3;

using Overrides = std::map<std::string, std::string>;

std::unique_ptr<Simulation> create(const std::string& contender, const Model& model, const State& start,
                                   const Overrides& overrides = {}, double timestep = kTimestep) {
  ResolvedContender resolved = Registry::instance().resolve(contender, overrides);
  resolved.settings.timestep = timestep;
  return resolved.engine->create(model, start, resolved.settings);
}

State run(const std::string& contender, const Model& model, const State& start, int steps,
          const Overrides& overrides = {}, double timestep = kTimestep) {
  const auto simulation = create(contender, model, start, overrides, timestep);
  State state;
  for (int i = 0; i < steps; ++i) {
    if (model.has_springs()) simulation->set_torques({});
    simulation->advance(1);
    if (i % 10 == 0) simulation->read_state(state);
  }
  simulation->read_state(state);
  return state;
}

std::string refusal(const std::string& contender, const Model& model, const Overrides& overrides = {}) {
  try {
    create(contender, model, model.initial, overrides);
  } catch (const UnsupportedError& error) {
    return error.what();
  }
  return "";
}

// A wheel on a hinge through its centre of mass along y, without gravity.
Model wheel(double inertia) {
  Model model;
  model.gravity.setZero();
  add_hinged_body(model, "wheel", kWorld, {},
                  conformance::principal_solid(1, Vec3::Zero(), Vec3::Constant(inertia), Quat::Identity()),
                  Vec3::UnitY());
  return finished(std::move(model));
}

class PhysxTest : public testing::TestWithParam<const char*> {};

std::string identifier(const testing::TestParamInfo<const char*>& param) {
  std::string name = param.param;
  std::ranges::replace(name, '-', '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Contenders, PhysxTest,
                         testing::Values("physx-d6-pgs", "physx-d6-tgs", "physx-art-pgs", "physx-art-tgs"), identifier);
#ifdef ASSAY_HAS_PHYSX56
INSTANTIATE_TEST_SUITE_P(Version56, PhysxTest,
                         testing::Values("physx56-d6-pgs", "physx56-d6-tgs", "physx56-art-pgs", "physx56-art-tgs"),
                         identifier);
#endif

// The drives' torque after one small step from rest, 2 rad from the spring's rest: linear for an articulation, by the
// half angle's sine for a D6 joint.
TEST_P(PhysxTest, NativeDriveHasTheDeclaredLaw) {
  constexpr double kStiffness = 3, kInertia = 0.02, kDeflection = 2;
  Model model = wheel(kInertia);
  model.joints[0].reference = 0.4;
  model.joints[0].spring_reference = -0.3;
  model.joints[0].stiffness = kStiffness;
  model = finished(std::move(model));
  const State start = conformance::with_joints(model, {-0.3 + kDeflection}, {0});
  const bool articulation = std::string(GetParam()).find("art") != std::string::npos;
  const double arm = articulation ? kDeflection : 2 * std::sin(kDeflection / 2);
  const State end = run(GetParam(), model, start, 1, {{"pd", "native"}, {"velocity_iterations", "0"}}, 1e-4);
  EXPECT_NEAR(end.velocity[0] / (-1e-4 * kStiffness * arm / kInertia), 1, 2e-3);
  // against the other law, so that the test can tell them apart
  EXPECT_GT(std::abs(2 * std::sin(kDeflection / 2) / kDeflection - 1), 0.1);
}

// The drive is implicit: a spring that an explicit torque would blow up at this timestep comes to rest.
TEST_P(PhysxTest, NativeDriveIsStableWhereExplicitTorqueIsNot) {
  Model model = wheel(1e-3);
  model.joints[0].stiffness = 1000;
  model.joints[0].damping = 2;
  model = finished(std::move(model));
  const State start = conformance::with_joints(model, {0.5}, {0});
  EXPECT_LT(std::abs(run(GetParam(), model, start, 500, {{"pd", "native"}}).position[0]), 1e-3);
  const double explicitly = std::abs(run(GetParam(), model, start, 20).velocity[0]);
  EXPECT_TRUE(!(explicitly < 1e3));
}

// A ball hits the end of a floating two-link chain in free space: free bodies and trees meet in one scene.
TEST_P(PhysxTest, FreeBodyAndTreeKeepTheirMomentum) {
  Model model;
  model.gravity.setZero();
  const conformance::Solid link = conformance::capsule_solid(1, 0.05, 0.15, Vec3::UnitZ());
  add_free_body(model, "trunk", link);
  add_hinged_body(model, "arm", 0, {Vec3(0, 0, 0.4), Quat::Identity()}, link, Vec3::UnitY(), {0, 0, -0.2});
  add_free_body(model, "ball", conformance::sphere_solid(0.5, kRadius), {Vec3(-0.5, 0.01, 0.5), Quat::Identity()});
  const int arm = add_shape(model, ShapeType::kCapsule, 1, {}, 0.05, 0.15);
  add_contact(model, arm, add_shape(model, ShapeType::kSphere, 2, {}, kRadius), 0.4);
  model = finished(std::move(model));
  State start = model.initial;
  start.bodies[2].v_WBcm = {2, 0, 0};
  const State end = run(GetParam(), model, start, 400);
  Vec3 momentum = Vec3::Zero();
  for (size_t b = 0; b < model.bodies.size(); ++b) momentum += model.bodies[b].mass * end.bodies[b].v_WBcm;
  EXPECT_GT(end.bodies[1].v_WBcm.x(), 0.3);
  EXPECT_LT(end.bodies[2].v_WBcm.x(), 1.5);
  EXPECT_LT((momentum - Vec3(1, 0, 0)).norm(), 2e-3);
}

// Ranges that lie beyond half a turn from the joint's zero.
TEST_P(PhysxTest, LimitsBeyondHalfATurnHold) {
  Model model;
  conformance::Solid bar = conformance::capsule_solid(1, 0.05, 0.15, Vec3::UnitX());
  bar.p_BBcm = {0.2, 0, 0};
  add_hinged_body(model, "bar", kWorld, {}, bar, Vec3::UnitY());
  model.joints[0].limited = true;
  model.joints[0].lower = 6.5;
  model.joints[0].upper = 7;  // a turn and 41 degrees: the bar falls onto it
  model = finished(std::move(model));
  const State start = conformance::with_joints(model, {6.6}, {0});
  EXPECT_NEAR(run(GetParam(), model, start, 1500).position[0], 7, 0.01);
}

// More than two turns from zero, where PhysX's plain revolute joint of articulations begins again.
TEST_P(PhysxTest, TurnsAreCountedAndLimitsBeyondThemHold) {
  constexpr double kStart = 14, kRate = 30;
  Model model = wheel(0.01);
  const State start = conformance::with_joints(model, {kStart}, {kRate});
  EXPECT_NEAR(run(GetParam(), model, start, 1000).position[0], kStart + kRate, 0.01);
  model.joints[0].limited = true;
  model.joints[0].lower = 13.5;
  model.joints[0].upper = 18;
  model = finished(std::move(model));
  EXPECT_NEAR(run(GetParam(), model, start, 1000).position[0], 18, 0.01);
}

TEST_P(PhysxTest, RefusesWhatPhysxCannotDo) {
  const bool articulation = std::string(GetParam()).find("art") != std::string::npos;
  Model model = wheel(0.01);
  model.joints[0].armature = 0.01;
  EXPECT_THAT(refusal(GetParam(), model), articulation ? HasSubstr("") : HasSubstr("armature"));
  EXPECT_EQ(refusal(GetParam(), model).empty(), articulation);

  model = wheel(0.01);
  model.joints[0].limited = true;
  model.joints[0].lower = -4;
  model.joints[0].upper = 4;
  EXPECT_EQ(refusal(GetParam(), model), "") << "a range beyond a turn, which the adapter holds";

  // a link and its parent
  model = wheel(0.01);
  add_hinged_body(model, "second", 0, {}, conformance::sphere_solid(1, kRadius), Vec3::UnitY());
  const int first = add_shape(model, ShapeType::kSphere, 0, {}, kRadius);
  add_contact(model, first, add_shape(model, ShapeType::kSphere, 1, {Vec3(1, 0, 0), Quat::Identity()}, kRadius), 1);
  model = finished(std::move(model));
  EXPECT_EQ(refusal(GetParam(), model).empty(), !articulation);
}

// A sled slides beside two that touch each other with less friction than any of them has with the ground, so that no
// two materials give every pair its own.
TEST_P(PhysxTest, FrictionThatNoMaterialsGiveIsThePairsOwn) {
  constexpr double kFriction = 0.4, kSpeed = 3;
  Model model;
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  const Vec3 half(2 * kRadius, 2 * kRadius, kRadius);
  const Vec3 squares = half.cwiseProduct(half);
  const conformance::Solid box =
      conformance::principal_solid(1, Vec3::Zero(), Vec3::Constant(squares.sum() / 3) - squares / 3, Quat::Identity());
  for (const char* name : {"first", "second"}) {
    const int body = static_cast<int>(model.bodies.size());
    add_free_body(model, name, box, {Vec3(0, body, kRadius), Quat::Identity()});
    const int shape = add_shape(model, ShapeType::kBox, body);
    model.shapes[shape].half_size = half;
    add_contact(model, plane, shape, body == 0 ? kFriction : 2 * kFriction);
  }
  add_contact(model, 1, 2, 0.1);
  model = finished(std::move(model));
  State start = model.initial;
  for (BodyState& body : start.bodies) body.v_WBcm = {kSpeed, 0, 0};
  constexpr int kSteps = 200;
  const State end = run(GetParam(), model, start, kSteps);
  for (int body = 0; body < 2; ++body) {
    const double lost = kSpeed - end.bodies[body].v_WBcm.x();
    EXPECT_NEAR(lost / (kSteps * kTimestep * conformance::kGravity), (body + 1) * kFriction, 0.01) << body;
  }
}

// Deceleration of a sliding capsule over mu g.
double friction_ratio(const std::string& contender, const std::string& friction) {
  Model model;
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  add_free_body(model, "capsule", conformance::capsule_solid(1, kRadius, 0.3, Vec3::UnitZ()),
                {Vec3(0, 0, kRadius), Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitY()))});
  add_contact(model, plane, add_shape(model, ShapeType::kCapsule, 0, {}, kRadius, 0.3), 0.2);
  model = finished(std::move(model));
  State start = model.initial;
  start.bodies[0].v_WBcm = {3, 0, 0};
  const auto simulation = create(contender, model, start, {{"friction", friction}});
  State from, to;
  simulation->advance(100);
  simulation->read_state(from);
  simulation->advance(200);
  simulation->read_state(to);
  return (from.bodies[0].v_WBcm.x() - to.bodies[0].v_WBcm.x()) / (0.2 * 0.2 * conformance::kGravity);
}

TEST(PhysxFriction, IsCoulombsButForThePlainPatch) {
  EXPECT_NEAR(friction_ratio("physx-d6-pgs", "improved_patch"), 1, 0.01);
  EXPECT_NEAR(friction_ratio("physx-d6-tgs", "improved_patch"), 1, 0.01);
  EXPECT_NEAR(friction_ratio("physx-d6-pgs", "two_directional"), 1, 0.01);
  EXPECT_NEAR(friction_ratio("physx-d6-pgs", "patch"), 2, 0.02);
  EXPECT_NEAR(friction_ratio("physx-d6-tgs", "patch"), 2, 0.02);
}

// Deceleration over mu g of a link of an articulation on two capsules, whose pairs' coefficient no coefficients of the
// shapes give when `by_callback`, and of a free box.
std::pair<double, double> ratios_of_link_and_box(const std::string& contender, bool by_callback) {
  constexpr double kFriction = 0.2;
  Model model;
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  const conformance::Solid solid =
      conformance::principal_solid(1, Vec3::Zero(), Vec3::Constant(0.05), Quat::Identity());
  add_free_body(model, "sled", solid, {Vec3(0, 0, kRadius), Quat::Identity()});
  add_hinged_body(model, "wheel", 0, {}, solid, Vec3::UnitZ());
  const Quat along_x(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitY()));
  add_free_body(model, "ball", conformance::sphere_solid(1, kRadius), {Vec3(0, -3, kRadius), Quat::Identity()});
  const int ball = add_shape(model, ShapeType::kSphere, 2, {}, kRadius);
  for (const double side : {-0.3, 0.3}) {
    const int runner = add_shape(model, ShapeType::kCapsule, 0, {Vec3(0, side, 0), along_x}, kRadius, 0.3);
    add_contact(model, plane, runner, kFriction);
    if (by_callback) add_contact(model, ball, runner, kFriction / 2);
  }
  if (by_callback) add_contact(model, plane, ball, kFriction / 2);
  add_free_body(model, "box", solid, {Vec3(0, 3, kRadius), Quat::Identity()});
  const int box = add_shape(model, ShapeType::kBox, 3);
  model.shapes[box].half_size = {0.3, 0.3, kRadius};
  add_contact(model, plane, box, kFriction);
  model = finished(std::move(model));
  State start = model.initial;
  for (BodyState& body : start.bodies) body.v_WBcm = {3, 0, 0};
  const State from = run(contender, model, start, 100), to = run(contender, model, start, 200);
  const auto ratio = [&](int body) {
    return (from.bodies[body].v_WBcm.x() - to.bodies[body].v_WBcm.x()) / (0.1 * kFriction * conformance::kGravity);
  };
  return {ratio(0), ratio(3)};
}

TEST(PhysxFriction, LinksHaveTheirPairsFrictionBesideFreeBodies) {
  for (const char* contender : {"physx-art-pgs", "physx-art-tgs", "physx-art-tgs4"}) {
    for (const bool by_callback : {false, true}) {
      const auto [link, box] = ratios_of_link_and_box(contender, by_callback);
      EXPECT_NEAR(link, 1, 0.02) << contender << (by_callback ? ", by callback" : "");
      EXPECT_NEAR(box, 1, 0.02) << contender << (by_callback ? ", by callback" : "");
    }
  }
}

TEST(PhysxFriction, DirectionalModelsAreRefusedWhereTheyWouldBeIgnored) {
  Model model;
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  add_free_body(model, "ball", conformance::sphere_solid(1, kRadius), {Vec3(0, 0, 1), Quat::Identity()});
  add_contact(model, plane, add_shape(model, ShapeType::kSphere, 0, {}, kRadius), 1);
  model = finished(std::move(model));
  EXPECT_THAT(refusal("physx-d6-tgs", model, {{"friction", "two_directional"}}), HasSubstr("patch"));
  EXPECT_EQ(refusal("physx-d6-pgs", model, {{"friction", "two_directional"}}), "");
}

TEST(PhysxJoints, RevoluteAndD6AreTheSameToTheLastBit) {
  const Model model = conformance::chain(true);
  const State d6 = run("physx-d6-pgs", model, model.initial, 300);
  const State revolute = run("physx-d6-pgs", model, model.initial, 300, {{"joints", "revolute"}});
  EXPECT_EQ(d6.bodies[4].p_WBcm, revolute.bodies[4].p_WBcm);
  EXPECT_NE(d6.bodies[4].p_WBcm, run("physx-art-pgs", model, model.initial, 300).bodies[4].p_WBcm);
}

// The finding's factor in the adapter's own numbers: what the deviation declares is all that is lost.
TEST(PhysxJoints, PgsSlowsARotorByTheFindingsFactor) {
  Model model = wheel(0.012);
  model.joints[0].p_BJ = {0.25, 0, 0};
  model = finished(std::move(model));
  const State start = conformance::with_joints(model, {0}, {8});
  double rate = 8;
  const double swinging = 0.25 * 0.25;
  for (int i = 0; i < 1000; ++i) rate *= (0.012 + swinging * std::cos(rate * kTimestep)) / (0.012 + swinging);
  EXPECT_NEAR(run("physx-d6-pgs", model, start, 1000).velocity[0], rate, 2e-3);
  EXPECT_NEAR(run("physx-art-pgs", model, start, 1000).velocity[0], 8, 2e-3);
}

#ifdef ASSAY_HAS_PHYSX56
// Two versions behind one adapter: what differs is the engine.
TEST(Physx56, IsAnotherEngineWithTheSameSettings) {
  const Registry& registry = Registry::instance();
  const ResolvedContender old = registry.resolve("physx-art-pgs"), current = registry.resolve("physx56-art-pgs");
  EXPECT_EQ(old.engine->build().version, "5.1.3");
  EXPECT_EQ(current.engine->build().version, "5.6.1");
  const Model model = conformance::chain(true);
  const Vec3 a = run("physx-art-pgs", model, model.initial, 300).bodies[4].p_WBcm;
  const Vec3 b = run("physx56-art-pgs", model, model.initial, 300).bodies[4].p_WBcm;
  EXPECT_NE(a, b);
  EXPECT_LT((a - b).norm(), 1e-5);
}

TEST(Physx56, RefusesEllipsoidsByName) {
  Model model;
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  add_free_body(model, "egg", conformance::sphere_solid(1, kRadius), {Vec3(0, 0, 1), Quat::Identity()});
  const int shape = add_shape(model, ShapeType::kEllipsoid, 0);
  model.shapes[shape].half_size = {0.1, 0.2, 0.3};
  add_contact(model, plane, shape, 1);
  model = finished(std::move(model));
  EXPECT_THAT(refusal("physx56-d6-pgs", model), HasSubstr("replace it by a capsule or a mesh"));
}
#endif

}  // namespace
}  // namespace assay
