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

// One sub-step of Box3D's spring, of stiffness `k` and damping `d` for an inertia of 1, `turn` from its rest. Each of
// its two sweeps ends with the whole impulse of an implicit spring, -h (k (turn + h rate) + d rate): the one before the
// motion at the old turn, the one after it at the new turn. So it damps by 2 h k more than the spring. Returns the rate
// of the motion.
double spring_sub_step(double h, double k, double d, double& turn, double& rate) {
  const double before = rate, scale = 1 + h * d + h * h * k;
  const double moving = (before - h * k * turn) / scale;
  turn += h * moving;
  rate = (before - h * k * turn) / scale;
  return moving;
}

// Rate at `time` of a weakly damped oscillator (0.3 of the critical damping).
double oscillator_rate(double omega, double turn, double rate, double time) {
  const double decay = 0.3 * omega, damped = omega * std::sqrt(1 - 0.3 * 0.3);
  return std::exp(-decay * time) *
         (rate * std::cos(damped * time) - (omega * omega * turn + decay * rate) / damped * std::sin(damped * time));
}

Model with_spring(Model model, double stiffness, double damping) {
  Joint& hinge = model.joints[0];
  hinge.spring_reference = 0.5;
  hinge.stiffness = stiffness;
  hinge.damping = damping;
  return finished(std::move(model));
}

// Box3D takes hertz and a damping ratio of an inertia: these have to become the joint's own stiffness and damping
// again. About the centre of mass the spring is alone, and its steps are known.
TEST(Box3d, NativeSpringsStepAsBox3dsFormulaSays) {
  constexpr double kInertia = 0.025, kSubStep = 1e-3 / 4;
  Model wheel;
  wheel.gravity = Vec3::Zero();
  const Quat turned(Eigen::AngleAxisd(0.7, Vec3(1, 2, 2).normalized()));
  const Vec3 com(0.05, -0.02, 0.03);
  add_hinged_body(wheel, "wheel", kWorld, {}, principal_solid(2, com, {0.02, 0.03, kInertia}, turned),
                  turned * Vec3::UnitZ(), com);
  for (const double omega : {20.0, 1e4}) {
    for (const bool spring : {true, false}) {
      const double k = spring ? omega * omega : 0, d = 0.6 * omega;
      const Model model = with_spring(wheel, kInertia * k, kInertia * d);
      double turn = 0.1, rate = 1, fastest = 1;
      for (int step = 1; step <= 10; ++step) {
        for (int i = 0; i < 4; ++i) {
          fastest = std::max(fastest, std::abs(spring_sub_step(kSubStep, k, d, turn, rate)));
        }
        // single precision, and an arc tangent that is right to 3e-6 of such turns
        EXPECT_NEAR(rate_after(model, "box3d-native-pd", 0.6, 1, step), rate, 5e-6 * fastest)
            << omega << spring << step;
      }
    }
  }
}

// About another point than the centre of mass, sweeps have to bring the spring and the hinge together.
TEST(Box3d, NativeSpringsHaveTheJointsStiffnessAndDampingInFirstOrder) {
  const Flywheel wheel = flywheel();
  constexpr double kOmega = 20, kTime = 0.064;
  const Model model =
      with_spring(wheel.model, kOmega * kOmega * wheel.axial_inertia, 0.6 * kOmega * wheel.axial_inertia);
  const double exact = oscillator_rate(kOmega, 0.1, 1, kTime);
  ASSERT_LT(exact, -0.5);
  double before = 0;
  for (const double h : {4e-3, 2e-3, 1e-3}) {
    ResolvedContender native = Registry::instance().resolve("box3d-native-pd");
    native.settings.timestep = h;
    const auto simulation = native.engine->create(model, with_joints(model, {0.6}, {1}), native.settings);
    State state;
    simulation->advance(static_cast<int>(std::lround(kTime / h)));
    simulation->read_state(state);
    const double error = std::abs(state.velocity[0] - exact);
    if (before > 0) {
      EXPECT_NEAR(before / error, 2, 0.2) << h;
    }
    before = error;
  }
  EXPECT_LT(before, 0.01);
  EXPECT_GT(std::abs(rate_after(with_spring(wheel.model, 1e8 * wheel.axial_inertia, 0), "box3d", 0.6, 0, 20)),
            2000);  // explicit: flies apart
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
