// Each kind of change is seen in the model or the control that it changes, and swaps are what a pair of contenders has
// a way for.
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "controls/changes/change.h"
#include "controls/changes/swaps.h"
#include "controls/policy_config.h"
#include "model/kinematics.h"
#include "run/coordinator/temporary_folder.h"

namespace assay {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

// A free trunk over a plane with two hinges and a ball joint in a row; the trunk and the shank may touch.
Model leg() {
  Model model;
  model.name = "leg";
  model.bodies.push_back({.name = "trunk", .X_PB = {{0, 0, 1}, Quat::Identity()}, .mass = 5});
  model.bodies.push_back({.name = "thigh", .parent = 0, .joint = 0, .X_PB = {}, .mass = 2});
  model.bodies.push_back({.name = "shank", .parent = 1, .joint = 1, .X_PB = {}, .mass = 1});
  model.bodies.push_back({.name = "foot", .parent = 2, .ball = 0, .X_PB = {}, .mass = 0.5});
  for (const char* name : {"hip", "knee"}) {
    Joint joint;
    joint.name = name;
    joint.body = static_cast<int>(model.joints.size()) + 1;
    joint.limited = true;
    joint.lower = -1;
    joint.upper = 1;
    joint.stiffness = 3;
    joint.spring_reference = 0.1;
    joint.damping = 0.5;
    joint.armature = 0.02;
    joint.dry_friction = 0.3;
    Actuator motor;
    motor.terms = {{static_cast<int>(model.joints.size()), 1}};
    motor.force_limited = true;
    motor.force_lower = -4;
    motor.force_upper = 4;
    model.joints.push_back(joint);
    model.actuators.push_back(motor);
  }
  BallJoint ankle;
  ankle.name = "ankle";
  ankle.body = 3;
  ankle.limited = true;
  ankle.upper = 1;
  ankle.armature = 0.01;
  ankle.damping = 0.2;
  model.balls.push_back(ankle);
  Shape plane, sole, belly;
  plane.type = ShapeType::kPlane;
  sole.body = 3;
  sole.radius = belly.radius = 0.1;
  belly.body = 0;
  model.shapes = {plane, sole, belly};
  model.contacts = {{0, 1, 0.8}, {1, 2, 0.6}};
  model.control0 = {1, 1};
  model.initial = reference_state(model);
  model.hash = model_hash(model);
  return model;
}

Model with(const char* change) { return changed_model(leg(), {parse_change(change)}); }

void expect_refused(const std::function<void()>& work, const std::vector<std::string>& naming) {
  try {
    work();
    FAIL() << "nothing was refused: " << testing::PrintToString(naming);
  } catch (const InputError& error) {
    for (const std::string& each : naming) EXPECT_THAT(error.what(), HasSubstr(each));
  }
}

TEST(Changes, TextsAreReadBack) {
  const std::vector<std::string> texts = {
      "contacts=off",     "self_contacts=off", "friction=0.5",        "limits:knee=off", "armature:hip=+0.1",
      "damping=2",        "stiffness=off",     "dry_friction=off",    "mass:foot=1.5",   "inertia=0.9",
      "gravity=0.5",      "dampers=explicit",  "clamp=off",           "delay=-1",        "law=engine",
      "gear:my:joint=-1", "order=hip,knee",    "contender=ode-quick", "timestep=0.5",    "set:cone=elliptic"};
  EXPECT_EQ(change_texts(parse_changes(texts)), texts);
  EXPECT_EQ(parse_change("gear:my:joint=-1").element, "my:joint");
}

TEST(Changes, RefusalsNameTheValue) {
  for (const auto& [text, naming] : std::vector<std::pair<std::string, std::vector<std::string>>>{
           {"armature", {"'armature'", "no value", "armature=off"}},
           {"armatur=off", {"'armatur'", "'armature'"}},
           {"contacts=2", {"'contacts=2'", "off"}},
           {"mass=off", {"'off'", "positive"}},
           {"mass=0", {"'0'", "positive"}},
           {"delay=0.5", {"'0.5'", "whole number"}},
           {"contacts:hip=off", {"'hip'", "leave the name out"}},
           {"set=3", {"names no setting"}},
           {"law=implicit", {"'implicit'", "explicit or engine"}}}) {
    expect_refused([&] { parse_change(text); }, naming);
  }
  expect_refused([] { with("armature:hipp=off"); }, {"'hipp'", "'leg'", "'hip'"});
  expect_refused([] { with("mass:torso=2"); }, {"'torso'", "body"});
}

TEST(Changes, OfTheModelAreInIt) {
  EXPECT_THAT(with("contacts=off").contacts, IsEmpty());
  EXPECT_THAT(with("self_contacts=off").contacts, ElementsAre(Field(&ContactPair::shape_a, 0)));
  EXPECT_DOUBLE_EQ(with("friction=0.5").contacts[1].friction, 0.3);
  EXPECT_FALSE(with("limits=off").has_limits());
  EXPECT_FALSE(with("limits=off").balls[0].limited);
  EXPECT_TRUE(with("limits:knee=off").joints[0].limited);
  EXPECT_FALSE(with("limits:knee=off").joints[1].limited);
  EXPECT_EQ(with("armature=off").joints[0].armature, 0);
  EXPECT_EQ(with("armature=off").balls[0].armature, 0);
  EXPECT_DOUBLE_EQ(with("armature:hip=+0.1").joints[0].armature, 0.12);
  EXPECT_DOUBLE_EQ(with("armature:hip=+0.1").joints[1].armature, 0.02);
  EXPECT_DOUBLE_EQ(with("damping=2").joints[1].damping, 1);
  EXPECT_DOUBLE_EQ(with("damping:ankle=2").balls[0].damping, 0.4);
  EXPECT_DOUBLE_EQ(with("stiffness=0.5").joints[0].stiffness, 1.5);
  EXPECT_EQ(with("dry_friction=off").joints[0].dry_friction, 0);
  EXPECT_DOUBLE_EQ(with("mass:shank=1.5").total_mass(), leg().total_mass() + 0.5);
  EXPECT_DOUBLE_EQ(with("inertia:shank=2").bodies[2].I_BBcm_B(0, 0), 2 * leg().bodies[2].I_BBcm_B(0, 0));
  EXPECT_DOUBLE_EQ(with("gravity=0.5").gravity.z(), leg().gravity.z() / 2);
  EXPECT_EQ(with("dampers=explicit").joints[0].stiffness, 0);
  for (const char* change : {"contacts=off", "limits=off", "armature=off", "mass:shank=1.5", "gravity=0.5"}) {
    EXPECT_NE(with(change).hash, leg().hash) << change;
  }
  EXPECT_EQ(changed_model(leg(), {}).hash, leg().hash);
}

std::vector<double> torques_of(const ControlSpec& spec, const std::vector<std::string>& changes, const State& state) {
  const auto control = changed_control(leg(), spec, parse_changes(changes));
  std::vector<double> torques(2);
  control->start(1e-3)->torques(state, torques);
  return torques;
}

TEST(Changes, OfTheControlAreInItsTorques) {
  const Model model = leg();
  const ControlSpec actuators;
  EXPECT_THAT(torques_of(actuators, {}, model.initial), ElementsAre(1, 1));
  EXPECT_THAT(torques_of(actuators, {"gear:knee=-1"}, model.initial), ElementsAre(1, -1));
  EXPECT_THAT(torques_of(actuators, {"gear=2", "gear:knee=-1"}, model.initial), ElementsAre(2, -2));
  EXPECT_THAT(torques_of(actuators, {"gear:hip=3", "order=hip,knee"}, model.initial), ElementsAre(3, 1));
  const ControlSpec sine = {.kind = "sine", .amplitude = 1, .frequency = 0, .phase_step = 1};
  const double second = std::sin(1);
  EXPECT_THAT(torques_of(sine, {}, model.initial), ElementsAre(0, second));
  EXPECT_THAT(torques_of(sine, {"order=hip,knee"}, model.initial), ElementsAre(second, 0));
  EXPECT_THAT(torques_of(sine, {"order=reversed"}, model.initial), ElementsAre(second, 0));
  expect_refused([&] { torques_of(sine, {"order=hip"}, model.initial); }, {"'order=hip'", "two"});
  expect_refused([&] { torques_of(sine, {"order=hip,toe"}, model.initial); }, {"'toe'", "no such hinge or slide"});
  expect_refused([&] { torques_of(sine, {"law=engine"}, model.initial); }, {"'law=engine'", "'sine'"});
}

TEST(Changes, ClampOffRaisesTheLimitsOfAHeldPose) {
  State bent = leg().initial;
  bent.position = {0.5, 0.5};
  const ControlSpec hold = {.kind = "hold"};
  EXPECT_THAT(torques_of(hold, {}, bent)[0], -4);
  EXPECT_LT(torques_of(hold, {"clamp=off"}, bent)[0], -4);
}

TEST(Changes, DampersBecomeTorquesOfTheStepsStart) {
  State moving = leg().initial;
  moving.position = {0.3, 0};
  moving.velocity = {0, 2};
  // 3 (0.3 - 0.1), 3 (0 - 0.1) + 2 0.5
  const std::vector<double> torques = torques_of({}, {"dampers=explicit"}, moving);
  EXPECT_DOUBLE_EQ(torques[0], 1 - 0.6);
  EXPECT_DOUBLE_EQ(torques[1], 1 - 0.7);
  // of the changed robot
  EXPECT_DOUBLE_EQ(torques_of({}, {"dampers=explicit", "damping=2"}, moving)[1], 1 - 1.7);
}

TEST(Changes, DelayHoldsTorquesBack) {
  const Model model = leg();
  const ControlSpec sine = {.kind = "sine", .amplitude = 1, .frequency = 10, .phase_step = 0};
  const auto now = changed_control(model, sine, {}), later = changed_control(model, sine, parse_changes({"delay=2"}));
  EXPECT_TRUE(later->has_memory());
  const auto run_now = now->start(1e-3), run_later = later->start(1e-3);
  std::vector<double> given, delayed;
  State state = model.initial;
  for (int step = 0; step < 6; ++step) {
    state.time = 1e-3 * step;
    std::array<double, 2> torques{};
    run_now->torques(state, torques);
    given.push_back(torques[0]);
    run_later->torques(state, torques);
    delayed.push_back(torques[0]);
  }
  EXPECT_EQ(delayed[0], 0);
  EXPECT_EQ(delayed[1], 0);
  for (size_t i = 2; i < delayed.size(); ++i) EXPECT_EQ(delayed[i], given[i - 2]);
  expect_refused([&] { changed_control(model, sine, parse_changes({"delay=-1"})); }, {"-1", "sine"});
}

TEST(Changes, OfAPolicyAreInItsConfiguration) {
  const TemporaryFolder folder;
  const std::string config = folder.path() + "/policy.toml", actions = folder.path() + "/actions.csv";
  std::ofstream(config) << "joints = [\"hip\", \"knee\"]\n[control]\nperiod_ms = 10\n[observations]\n"
                           "[[observations.terms]]\nterm = \"joint_pos\"\n[actions]\ntype = \"joint_position\"\n"
                           "[pd]\nstiffness = 10\ndamping = 1\n";
  std::ofstream(actions) << "hip,knee\n1,1\n";
  const ControlSpec spec = {.kind = "policy", .policy = config, .network = actions};
  const Model model = leg();
  const auto configured = [&](const char* change) {
    const auto control = changed_control(model, spec, parse_changes({change}));
    Model equipped = model;
    control->equip(equipped);
    return std::tuple(control->policy()->delay, control->policy()->effort_limit[0], equipped.joints[0].stiffness);
  };
  constexpr double kNone = std::numeric_limits<double>::infinity();
  EXPECT_EQ(configured("gear=1"), std::tuple(0, 4.0, 3.0));
  EXPECT_EQ(configured("delay=1"), std::tuple(1, 4.0, 3.0));
  EXPECT_EQ(configured("clamp=off"), std::tuple(0, kNone, 3.0));
  EXPECT_EQ(configured("law=engine"), std::tuple(0, kNone, 13.0));
  expect_refused([&] { configured("delay=-1"); }, {"policy.toml", "delay of 0"});
}

// ---- swaps ----------------------------------------------------------------------------------------------------------

std::vector<std::string> causes_of(const Swaps& swaps) {
  std::vector<std::string> causes;
  causes.reserve(swaps.swaps.size());
  for (const Swap& swap : swaps.swaps) causes.push_back(swap.cause);
  return causes;
}

Swaps swaps_of(const Model& model, const ControlSpec& spec, const std::string& a, const std::string& b,
               const std::vector<SeenParameter>& seen = {}) {
  const auto control = make_control(model, spec);
  return swaps_for({&model, spec, control.get(), {.name = "A", .contender = a}, {.name = "B", .contender = b}, 1},
                   seen);
}

TEST(Swaps, AreThoseOfTheRobotAndItsControl) {
  const Swaps all = swaps_of(leg(), {.kind = "hold"}, "mujoco-euler", "ode-quick");
  const std::vector<std::string> causes = causes_of(all);
  for (const char* cause : {"armature", "damping", "stiffness", "dry friction", "limits", "contacts",
                            "contact friction", "damping law", "control delay", "torque clamp", "gear", "joint order",
                            "timestep", "friction model", "contact softness", "solver iterations", "integrator"}) {
    EXPECT_THAT(causes, Contains(cause));
  }
  EXPECT_THAT(all.not_possible, Contains(Field(&NoSwap::cause, "precision")));

  Model bare = leg();
  bare.contacts.clear();
  for (Joint& joint : bare.joints) joint.stiffness = joint.damping = joint.armature = 0;
  for (BallJoint& ball : bare.balls) ball.damping = ball.armature = 0;
  const std::vector<std::string> fewer = causes_of(swaps_of(bare, {.kind = "passive"}, "mujoco-euler", "ode-quick"));
  for (const char* cause : {"armature", "damping", "contacts", "friction model", "gear", "control delay"}) {
    EXPECT_THAT(fewer, Not(Contains(cause)));
  }
}

TEST(Swaps, HaveAdviceUnlessTheyTakeTheSameFromBoth) {
  for (const Swap& swap : swaps_of(leg(), {.kind = "hold"}, "mujoco-euler", "mujoco-euler").swaps) {
    EXPECT_FALSE(swap.a.empty() && swap.b.empty()) << swap.words;
    const bool off = swap.a == swap.b && swap.a.front().value == "off";
    EXPECT_EQ(swap.is_advice(), !off) << swap.words;
  }
}

TEST(Swaps, PutWhatParitySawIntoTheOtherSide) {
  const Swaps found =
      swaps_of(leg(), {.kind = "hold"}, "mujoco-euler", "ode-quick",
               {{true, "armature", "hip", -1}, {true, "armature", "knee", 0.5}, {false, "mass", "foot", 0.1}});
  EXPECT_THAT(change_texts(found.swaps[0].b), ElementsAre("mass:foot=1.1"));
  EXPECT_THAT(found.swaps[0].a, IsEmpty());
  EXPECT_THAT(change_texts(found.swaps[1].a), ElementsAre("armature:hip=off", "armature:knee=1.5"));
  Model bare = leg();
  bare.joints[0].armature = 0;
  const Swaps more = swaps_of(bare, {.kind = "hold"}, "mujoco-euler", "ode-quick", {{true, "armature", "hip", 0.25}});
  EXPECT_THAT(change_texts(more.swaps[0].a), ElementsAre("armature:hip=+0.25"));
}

TEST(Swaps, RecipeWorksChangesOfTheContenderIn) {
  const Side side = {.name = "A",
                     .contender = "mujoco-euler",
                     .changes = parse_changes({"set:cone=elliptic", "timestep=0.5", "timestep=0.5", "armature=off"})};
  const Recipe recipe = recipe_of(side);
  EXPECT_EQ(recipe.contender.settings.get<std::string>("cone"), "elliptic");
  EXPECT_EQ(recipe.timestep_factor, 0.25);
  EXPECT_THAT(change_texts(recipe.changes), ElementsAre("armature=off"));
  EXPECT_EQ(recipe_of(side.with(parse_changes({"contender=mujoco-rk4"}))).contender.base, "mujoco-rk4");
  expect_refused([&] { recipe_of(side.with(parse_changes({"set:con=elliptic"}))); }, {"'con'", "'cone'"});
}

}  // namespace
}  // namespace assay
