// How joints' springs and dampers act: what the setting pd says, one step at a time.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engines/registry.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using testing::HasSubstr;

// The finger joint of the paper's grasps.
constexpr double kStiffness = 0.4;  // Nm/rad
constexpr double kDamping = 0.005;  // Nms/rad
constexpr double kRest = -0.3;      // rad
constexpr double kInertia = 2e-5;   // kg m^2, about a finger link's

// A wheel on a hinge through its centre, without gravity: nothing but its spring acts.
Model sprung_wheel() {
  Model model;
  model.gravity.setZero();
  Body body;
  body.name = "wheel";
  body.joint = 0;
  body.mass = 0.05;
  body.I_BBcm_B = kInertia * Mat3::Identity();
  model.bodies.push_back(body);
  Joint hinge;
  hinge.name = "hinge";
  hinge.axis_B = Vec3::UnitY();
  hinge.reference = 0.2;
  hinge.stiffness = kStiffness;
  hinge.spring_reference = kRest;
  hinge.damping = kDamping;
  model.joints.push_back(hinge);
  model.initial = reference_state(model);
  model.initial.position = {0.7};
  model.initial.velocity = {-2};
  bodies_from_joints(model, model.initial);
  return model;
}

State after(const ResolvedContender& contender, const Model& model, int steps) {
  const auto simulation = contender.engine->create(model, model.initial, contender.settings);
  for (int i = 0; i < steps; ++i) simulation->step({});
  State state;
  simulation->read_state(state);
  return state;
}

struct Law {
  const char* contender;
  SpringKind kind;
  // Rate after a step of h from the deflection x and the rate v.
  double (*rate)(double h, double x, double v);
};

double explicit_law(double h, double x, double v) { return v - (h * (kStiffness * x + kDamping * v) / kInertia); }
double damping_implicit(double h, double x, double v) {
  return (kInertia * v - h * kStiffness * x) / (kInertia + h * kDamping);
}
double implicit_law(double h, double x, double v) {
  return (kInertia * v - h * kStiffness * x) / (kInertia + h * kDamping + h * h * kStiffness);
}

class PdTest : public testing::TestWithParam<Law> {
 protected:
  void SetUp() override {
    const auto names = Registry::instance().contender_names();
    if (std::ranges::find(names, GetParam().contender) == names.end()) GTEST_SKIP() << "its engine is absent";
    contender_ = Registry::instance().resolve(GetParam().contender);
  }
  ResolvedContender contender_;
};

TEST_P(PdTest, OneStepFollowsTheLaw) {
  const Model model = sprung_wheel();
  const double x = model.initial.position[0] - kRest, v = model.initial.velocity[0];
  EXPECT_EQ(contender_.engine->capabilities(contender_.settings).springs, GetParam().kind);
  for (const double h : {1e-4, 1e-3, 8e-3}) {
    contender_.settings.timestep = h;
    const double law = GetParam().rate(h, x, v);
    EXPECT_NEAR(after(contender_, model, 1).velocity[0], law, 1e-7 * std::abs(law)) << h;
    // the laws differ by more than the tolerance: a setting that is ignored shows
    for (const auto other : {explicit_law, damping_implicit, implicit_law}) {
      if (other != GetParam().rate) {
        EXPECT_GT(std::abs(other(h, x, v) - law), 1e-4 * std::abs(law)) << h;
      }
    }
  }
}

// An explicit damper gives a link more than its momentum back when b h > 2 I; an implicit one cannot.
TEST_P(PdTest, LongStepsBlowUpAnExplicitSpringAlone) {
  const Model model = sprung_wheel();
  contender_.settings.timestep = 16e-3;
  // of the energy that the spring and the link start with
  const double x = model.initial.position[0] - kRest, v = model.initial.velocity[0];
  const double most = std::sqrt((kStiffness * x * x / kInertia) + (v * v));
  const double rate = std::abs(after(contender_, model, 4).velocity[0]);
  if (GetParam().rate == implicit_law) {
    EXPECT_LT(rate, most);
  } else if (GetParam().rate == explicit_law) {
    EXPECT_GT(rate, 10 * most);
  }
}

INSTANTIATE_TEST_SUITE_P(Contenders, PdTest,
                         testing::Values(Law{"mujoco-euler", SpringKind::kNative, damping_implicit},
                                         Law{"mujoco-implicit", SpringKind::kNative, damping_implicit},
                                         Law{"mujoco-euler-explicit-pd", SpringKind::kExplicit, explicit_law},
                                         Law{"mujoco-rk4-explicit-pd", SpringKind::kExplicit, explicit_law},
                                         Law{"bullet-si-f64", SpringKind::kExplicit, explicit_law},
                                         Law{"bullet-mb", SpringKind::kExplicit, explicit_law},
                                         Law{"ode-quick", SpringKind::kExplicit, explicit_law},
                                         Law{"ode-step", SpringKind::kExplicit, explicit_law},
                                         Law{"ode-quick-native-pd", SpringKind::kNative, implicit_law},
                                         Law{"ode-step-native-pd", SpringKind::kNative, implicit_law}),
                         [](const auto& param) {
                           std::string name = param.param.contender;
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

// Both ways of an engine that has both are contenders, so that the gate tries both against the damped oscillator. The
// plugins of one engine (its precisions, the ways to it) share their first word and count together.
TEST(Pd, BothWaysAreContenders) {
  const auto family = [](const std::string& name) { return name.substr(0, name.find('-')); };
  std::map<std::string, std::set<std::string>> choices;
  std::map<std::string, std::set<std::string>> tried;
  for (const Engine* engine : Registry::instance().engines()) {
    const std::vector<Setting> settings = engine->settings();
    const auto pd = std::ranges::find(settings, "pd", &Setting::name);
    if (pd == settings.end()) continue;
    choices[family(engine->name())].insert(pd->choices.begin(), pd->choices.end());
    for (const Contender& contender : engine->contenders()) {
      const auto set = contender.set.find("pd");
      tried[family(engine->name())].insert(setting_text(set == contender.set.end() ? pd->default_value : set->second));
    }
  }
  EXPECT_FALSE(choices.empty());
  EXPECT_EQ(tried, choices);
}

TEST(Pd, AWrongValueNamesTheNearest) {
  for (const char* contender : {"mujoco-euler", "ode-quick", "bullet-si-f64"}) {
    const auto names = Registry::instance().contender_names();
    if (std::ranges::find(names, contender) == names.end()) continue;
    try {
      Registry::instance().resolve(contender, {{"pd", "explict"}});
      ADD_FAILURE() << contender;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("setting 'pd' is 'explict' (did you mean 'explicit'?)"));
    }
  }
}

// A joint of ODE has one pair of stops: the spring of a limited hinge is a motor beside it, with the same row.
TEST(Pd, OdesNativeSpringOfALimitedHingeFollowsTheSameLaw) {
  const auto names = Registry::instance().contender_names();
  if (std::ranges::find(names, "ode-step") == names.end()) GTEST_SKIP() << "ODE is absent";
  for (const char* name : {"ode-step-native-pd", "ode-quick-native-pd"}) {
    ResolvedContender native = Registry::instance().resolve(name);
    Model model = sprung_wheel();
    EXPECT_FALSE(native.engine->create(model, model.initial, native.settings)->view().joints[0].limited);
    model.joints[0].limited = true;
    model.joints[0].lower = -1;
    model.joints[0].upper = 2;
    EXPECT_TRUE(native.engine->create(model, model.initial, native.settings)->view().joints[0].limited) << name;
    const double x = model.initial.position[0] - kRest, v = model.initial.velocity[0];
    for (const double h : {1e-4, 1e-3, 16e-3}) {
      native.settings.timestep = h;
      const double law = implicit_law(h, x, v);
      EXPECT_NEAR(after(native, model, 1).velocity[0], law, 1e-7 * std::abs(law)) << name << " at " << h;
    }
    // the stop holds where the spring would pull through it
    model.joints[0].lower = 0.5;
    native.settings.timestep = 1e-3;
    EXPECT_GT(after(native, model, 200).position[0], 0.4) << name;
    EXPECT_LT(after(native, model, 200).position[0], 0.51) << name;
  }
}

TEST(Pd, OdeRefusesANativeSpringOnALimitedSlide) {
  const auto names = Registry::instance().contender_names();
  if (std::ranges::find(names, "ode-step") == names.end()) GTEST_SKIP() << "ODE is absent";
  const ResolvedContender native = Registry::instance().resolve("ode-step-native-pd");
  Model model = sprung_wheel();
  model.joints[0].type = JointType::kSlide;
  model.joints[0].limited = true;
  model.joints[0].lower = -1;
  model.joints[0].upper = 1;
  model.initial = reference_state(model);
  EXPECT_THROW(native.engine->create(model, model.initial, native.settings), UnsupportedError);
  model.joints[0].stiffness = model.joints[0].damping = 0;  // without a spring the stops are free
  EXPECT_TRUE(native.engine->create(model, model.initial, native.settings)->view().joints[0].limited);
}

}  // namespace
}  // namespace assay
