// What the loader makes of joints, shapes, margins, tendons and actuators beyond the hinge and the sphere, and what
// --drop-unsupported leaves of the rest.
#include <algorithm>
#include <numbers>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "load/mjcf.h"
#include "load/translation.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

Model load_inside(const std::string& inside) { return load_model_text("<mujoco>" + inside + "</mujoco>", "test"); }
Model load_dropped(const std::string& inside) {
  return load_model_text("<mujoco>" + inside + "</mujoco>", "test", {.drop_unsupported = true});
}

std::vector<std::string> names(const auto& elements) {
  std::vector<std::string> result;
  result.reserve(elements.size());
  for (const auto& element : elements) result.push_back(element.name);
  return result;
}

const std::string kTwoHinges =
    "<worldbody><body><joint name='a'/><geom size='0.1'/><body pos='1 0 0'><joint name='b'/><geom size='0.1'/></body>"
    "</body></worldbody>";

// ---- joints ---------------------------------------------------------------------------------------------------------

TEST(MjcfTranslation, SeveralJointsAreAChainOfMasslessBodies) {
  const Model model = load_inside(
      "<worldbody><body name='base'><freejoint/><geom size='1'/>"
      "<body name='hip' pos='1 2 3' euler='0 90 0'><joint name='x' axis='1 0 0' pos='0 0 0.1'/><joint axis='0 1 0'/>"
      "<joint name='z' type='slide' axis='0 0 2'/><geom size='0.1'/></body></body></worldbody>");
  EXPECT_THAT(names(model.bodies), ElementsAre("base", "hip_x", "hip_2", "hip"));
  EXPECT_THAT(names(model.joints), ElementsAre("x", "hip", "z"));
  for (int i = 1; i < 4; ++i) EXPECT_EQ(model.bodies[i].parent, i - 1);
  EXPECT_TRUE(model.bodies[1].is_massless() && model.bodies[2].is_massless());
  EXPECT_EQ(model.bodies[1].I_BBcm_B, Mat3::Zero());
  EXPECT_EQ(model.bodies[1].X_PB.p, Vec3(1, 2, 3));
  EXPECT_EQ(model.bodies[2].X_PB.p, Vec3::Zero());
  EXPECT_EQ(model.bodies[3].X_PB.q.coeffs(), Quat::Identity().coeffs());
  EXPECT_EQ(model.joints[0].p_BJ, Vec3(0, 0, 0.1));
  EXPECT_EQ(model.joints[2].axis_B, Vec3::UnitZ());
  EXPECT_EQ(model.joints[2].type, JointType::kSlide);
  EXPECT_EQ(model.shapes[1].body, 3);
  EXPECT_THAT(model.contacts, IsEmpty());  // base and hip are parent and child, however many joints are between
  EXPECT_EQ(model.dof(), 9);
}

// mjcf_against_mujoco_test.cc compares their motion with MuJoCo's.
TEST(MjcfTranslation, FreeJointWithADamperIsThreeSlidesAndABall) {
  const std::string free =
      "<worldbody><body name='cup' pos='1 2 3' euler='0 0 90'><joint name='j' type='free' damping='0.5' armature='0.1' "
      "frictionloss='0.2'/><geom size='1' pos='0.1 0 0'/></body></worldbody>";
  const Model model = load_inside(free);
  EXPECT_THAT(names(model.bodies), ElementsAre("cup_x", "cup_y", "cup_z", "cup"));
  EXPECT_THAT(names(model.joints), ElementsAre("j_x", "j_y", "j_z"));
  EXPECT_THAT(names(model.balls), ElementsAre("j"));
  EXPECT_EQ(model.dof(), 6);
  for (int k = 0; k < 3; ++k) {
    EXPECT_TRUE(model.bodies[k].is_massless());
    EXPECT_TRUE(model.joints[k].is_slide());
    EXPECT_EQ(model.joints[k].axis_B, Vec3::Unit(k));
    EXPECT_EQ(model.joints[k].damping, 0.5);
    EXPECT_EQ(model.joints[k].armature, 0.1);
    EXPECT_EQ(model.joints[k].dry_friction, 0.2);
    EXPECT_EQ(model.initial.position[k], k + 1);  // where the body is, as in MuJoCo's qpos
  }
  EXPECT_EQ(model.balls[0].damping, 0.5);
  // the body is where the file puts it, also from a keyframe
  const auto expect_cup = [](const Model& loaded, const Vec3& p) {
    const BodyState& cup = loaded.initial.bodies.at(3);
    EXPECT_LT((cup.p_WBcm - (p + Vec3(0, 0.1, 0))).norm(), 1e-12);
    EXPECT_LT(cup.q_WB.angularDistance(Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitZ()))), 1e-7);
  };
  expect_cup(model, {1, 2, 3});
  expect_cup(load_inside(free + "<keyframe><key qpos='4 5 6 1 0 0 1'/></keyframe>"), {4, 5, 6});
  // without values it stays a free body
  EXPECT_TRUE(
      load_inside("<worldbody><body><joint type='free'/><geom size='1'/></body></worldbody>").bodies[0].is_free());
}

TEST(MjcfTranslation, BallJointKeepsEverything) {
  const Model model = load_inside(
      "<compiler angle='radian'/><worldbody><body name='arm'><joint name='shoulder' type='ball' pos='0 0 1' range='0 "
      "1.5' "
      "stiffness='2' damping='3' armature='0.5' frictionloss='0.1' margin='0.25'/><geom size='1'/></body></worldbody>");
  ASSERT_THAT(model.balls, SizeIs(1));
  const BallJoint& ball = model.balls[0];
  EXPECT_EQ(ball.name, "shoulder");
  EXPECT_EQ(ball.p_BJ, Vec3(0, 0, 1));
  EXPECT_TRUE(ball.limited);
  EXPECT_EQ(ball.upper, 1.25);
  EXPECT_EQ(ball.stiffness, 2);
  EXPECT_EQ(ball.damping, 3);
  EXPECT_EQ(ball.armature, 0.5);
  EXPECT_EQ(ball.dry_friction, 0.1);
  EXPECT_EQ(ball.spring_reference.coeffs(), Quat::Identity().coeffs());
}

// MuJoCo's margin of a limit keeps the coordinate that much inside of the range: a weight rests there.
TEST(MjcfTranslation, LimitMarginNarrowsTheRange) {
  const Model model = load_inside(
      "<worldbody><body><joint name='j' type='slide' range='-1 2' margin='0.25'/><geom size='1'/></body></worldbody>"
      "<tendon><fixed name='t' range='-3 3' margin='0.5'><joint joint='j' coef='1'/></fixed></tendon>");
  EXPECT_EQ(model.joints[0].lower, -0.75);
  EXPECT_EQ(model.joints[0].upper, 1.75);
  EXPECT_EQ(model.tendons[0].lower, -2.5);
  EXPECT_EQ(model.tendons[0].upper, 2.5);
}

// ---- massless bodies of a file: MuJoCo compiles them with placeholders ----------------------------------------------

LoadReport translate_with_massless(const std::string& xml, std::set<std::string> massless, bool drop = false) {
  const MessageGuard guard;
  std::array<char, 1000> error = {};
  const SpecPtr spec(mj_parseXMLString(xml.c_str(), nullptr, error.data(), static_cast<int>(error.size())));
  if (spec == nullptr) throw InputError(error.data());
  spec->compiler.fusestatic = false;
  const CompiledPtr compiled(mj_compile(spec.get(), nullptr));
  if (compiled == nullptr) throw InputError(mjs_getError(spec.get()));
  TranslationInput input;
  input.spec = spec.get();
  input.compiled = compiled.get();
  input.load.drop_unsupported = drop;
  input.massless = std::move(massless);
  return translate(input);
}

const std::string kChain =
    "<mujoco><worldbody><geom name='floor' type='plane' size='1 1 1'/>"
    "<body name='a'><joint axis='1 0 0'/><geom name='skin' size='0.1'/>"
    "<body name='b'><joint axis='0 1 0'/><geom size='0.1' mass='2'/>"
    "<body name='tip'><joint axis='0 0 1'/><geom size='0.1'/></body></body></body></worldbody></mujoco>";

std::vector<std::string> texts(const LoadReport& report) {
  std::vector<std::string> result;
  result.reserve(report.problems.size());
  for (const Problem& problem : report.problems) result.push_back(problem_text(problem));
  return result;
}

TEST(MjcfTranslation, MasslessLinkComposesJoints) {
  const std::string xml =
      "<mujoco><worldbody><body name='a'><joint axis='1 0 0'/><geom size='0.1' contype='0' "
      "conaffinity='0'/><body name='b'><joint axis='0 1 0'/><geom size='0.1'/></body></body>"
      "</worldbody></mujoco>";
  const LoadReport report = translate_with_massless(xml, {"a"});
  ASSERT_TRUE(report.model.has_value()) << testing::PrintToString(texts(report));
  const Model model = report.model.value_or(Model{});
  EXPECT_TRUE(model.bodies.at(0).is_massless());
  EXPECT_FALSE(model.bodies.at(1).is_massless());
}

TEST(MjcfTranslation, MasslessBodiesThatEnginesCannotBeGiven) {
  // a shape that touches others, and a leaf
  const LoadReport refused = translate_with_massless(kChain, {"a", "tip"});
  EXPECT_FALSE(refused.model.has_value());
  EXPECT_THAT(texts(refused), Contains(AllOf(HasSubstr("geom 'skin'"), HasSubstr("its body 'a' has no mass"))));
  EXPECT_THAT(texts(refused), Contains(AllOf(HasSubstr("body 'tip'"), HasSubstr("moves and has no mass"))));
  const LoadReport dropped = translate_with_massless(kChain, {"a", "tip"}, true);
  const Model left = dropped.model.value_or(Model{});
  EXPECT_THAT(names(left.bodies), ElementsAre("a", "b"));
  EXPECT_EQ(left.bodies.at(1).mass, 2);
  for (const ContactPair& pair : left.contacts) {
    EXPECT_NE(left.shapes[pair.shape_a].name, "skin");
    EXPECT_NE(left.shapes[pair.shape_b].name, "skin");
  }
  // a fork, and a free root
  const std::string fork =
      "<mujoco><worldbody><body name='root'>{}<geom size='0.1' contype='0' conaffinity='0'/>"
      "<body name='l'><joint axis='0 1 0'/><geom size='0.1'/></body>{}</body></worldbody></mujoco>";
  const std::string right = "<body name='r'><joint axis='0 1 0'/><geom size='0.1'/></body>";
  EXPECT_THAT(texts(translate_with_massless(fmt::format(fmt::runtime(fork), "<joint axis='1 0 0'/>", right), {"root"})),
              Contains(AllOf(HasSubstr("body 'root'"), HasSubstr("carries 2 bodies"))));
  EXPECT_THAT(texts(translate_with_massless(fmt::format(fmt::runtime(fork), "<freejoint/>", ""), {"root"})),
              Contains(AllOf(HasSubstr("body 'root'"), HasSubstr("is free and has no mass"))));
}

// ---- shapes and contacts --------------------------------------------------------------------------------------------

TEST(MjcfTranslation, AllShapesCollide) {
  const Model model = load_inside(
      "<asset><hfield name='h' nrow='2' ncol='3' size='2 1 0.5 0.1' elevation='0 1 2 3 4 5'/>"
      "<mesh name='m' vertex='0 0 0 1 0 0 0 1 0 0 0 1'/></asset><worldbody>"
      "<geom name='hills' type='hfield' hfield='h' pos='1 0 0'/>"
      "<body><freejoint/><geom name='box' type='box' size='1 2 3'/></body>"
      "<body><freejoint/><geom name='can' type='cylinder' size='1 2'/></body>"
      "<body><freejoint/><geom name='egg' type='ellipsoid' size='1 2 3'/></body>"
      "<body><freejoint/><geom name='rock' type='mesh' mesh='m'/></body></worldbody>");
  ASSERT_THAT(model.shapes, SizeIs(5));
  EXPECT_THAT(model.contacts, SizeIs(10));
  EXPECT_EQ(model.shapes[1].half_size, Vec3(1, 2, 3));
  EXPECT_EQ(model.shapes[2].radius, 1);
  EXPECT_EQ(model.shapes[2].half_length, 2);
  EXPECT_EQ(model.shapes[3].type, ShapeType::kEllipsoid);
  EXPECT_EQ(model.shapes[4].type, ShapeType::kHull);
  EXPECT_EQ(model.hulls.at(model.shapes[4].data).faces.size(), 4U);
  const HeightField& field = model.height_fields.at(model.shapes[0].data);
  EXPECT_EQ(field.rows, 2);
  EXPECT_EQ(field.columns, 3);
  EXPECT_EQ(field.half_x, 2);
  EXPECT_EQ(field.half_y, 1);
  EXPECT_EQ(field.base, 0.1);
  // MJCF lists the row of the largest y first
  ASSERT_THAT(field.heights, SizeIs(6));
  EXPECT_NEAR(field.heights[0], 0.3, 1e-7);
  EXPECT_NEAR(field.heights[5], 0.2, 1e-7);
}

TEST(MjcfTranslation, ContactMarginInflates) {
  const std::string bodies =
      "<worldbody><geom name='floor' type='plane' size='1 1 1' pos='0 0 1' margin='0.02'/>"
      "<body><freejoint/><geom name='ball' size='0.1' margin='0.03'/></body>"
      "<body><freejoint/><geom name='rod' type='capsule' size='0.1 0.2' margin='0.01'/></body>"
      "<body><freejoint/><geom name='crate' type='box' size='0.1 0.2 0.3' margin='0.01'/></body>"
      "<body><freejoint/><geom name='lone' size='0.1' margin='0.03' contype='0' conaffinity='0'/></body></worldbody>";
  const Model model = load_inside(bodies);
  EXPECT_DOUBLE_EQ(model.shapes[0].X_BS.p.z(), 1.02);
  EXPECT_DOUBLE_EQ(model.shapes[1].radius, 0.13);
  EXPECT_DOUBLE_EQ(model.shapes[2].radius, 0.11);
  EXPECT_DOUBLE_EQ(model.shapes[2].half_length, 0.2);
  EXPECT_NEAR((model.shapes[3].half_size - Vec3(0.11, 0.21, 0.31)).norm(), 0, 1e-15);
  EXPECT_EQ(model.shapes[4].radius, 0.1);
  EXPECT_THAT(model.notes, Contains(AllOf(HasSubstr("contact margins inflate"), HasSubstr("geom 'ball' (0.03 m)"),
                                          Not(HasSubstr("lone")))));
  EXPECT_NEAR(model.bodies[0].mass, 4.0 / 3 * 3.14159265 * 1, 1e-6);  // the mass is that of the geom
}

TEST(MjcfTranslation, EqualPairsAreOne) {
  const Model model = load_inside(
      "<worldbody><geom name='floor' type='plane' size='1 1 1'/><body><freejoint/><geom name='foot' size='1'/></body>"
      "</worldbody><contact><pair geom1='foot' geom2='floor' condim='6' friction='0.5 0.5 0.1 0.01 0.01'/>"
      "<pair geom1='floor' geom2='foot' condim='6' friction='0.5 0.5 0.1 0.01 0.01'/></contact>");
  ASSERT_THAT(model.contacts, SizeIs(1));
  EXPECT_EQ(model.contacts[0].friction, 0.5);
  EXPECT_EQ(model.contacts[0].torsional, 0.1);
  EXPECT_EQ(model.contacts[0].rolling, 0.01);
}

// ---- tendons and actuators ------------------------------------------------------------------------------------------

TEST(MjcfTranslation, FixedTendonKeepsEverything) {
  const Model model =
      load_inside(kTwoHinges +
                  "<tendon><fixed name='t' stiffness='2' damping='3' springlength='0.1 0.4' range='-1 1' "
                  "frictionloss='0.2'><joint joint='a' coef='2'/><joint joint='b' coef='-1'/></fixed>"
                  "<fixed name='idle'><joint joint='a' coef='1'/></fixed></tendon>");
  ASSERT_THAT(names(model.tendons), ElementsAre("t"));
  const Tendon& tendon = model.tendons[0];
  ASSERT_THAT(tendon.terms, SizeIs(2));
  EXPECT_EQ(tendon.terms[1].joint, 1);
  EXPECT_EQ(tendon.terms[1].coefficient, -1);
  EXPECT_EQ(tendon.stiffness, 2);
  EXPECT_EQ(tendon.damping, 3);
  EXPECT_EQ(tendon.rest_lower, 0.1);
  EXPECT_EQ(tendon.rest_upper, 0.4);
  EXPECT_TRUE(tendon.limited);
  EXPECT_EQ(tendon.dry_friction, 0.2);
  const Model off = load_inside(
      "<option><flag spring='disable' damper='disable' limit='disable' frictionloss='disable'/>"
      "</option>" +
      kTwoHinges +
      "<tendon><fixed name='t' stiffness='2' damping='3' range='-1 1' frictionloss='0.2'>"
      "<joint joint='a' coef='2'/></fixed></tendon>");
  EXPECT_THAT(off.tendons, IsEmpty());
}

// An actuator's own armature and damping act on its joint through the square of the gear.
TEST(MjcfTranslation, ActuatorsArmatureAndDampingAreTheJoints) {
  const Model model =
      load_inside(kTwoHinges + "<actuator><motor joint='b' gear='3' armature='2' damping='0.5'/></actuator>");
  EXPECT_EQ(model.joints[1].armature, 18);
  EXPECT_EQ(model.joints[1].damping, 4.5);
  EXPECT_EQ(model.joints[0].armature, 0);
}

TEST(MjcfTranslation, SumOfForcesWithinItsLimitNeedsNoClamp) {
  const std::string two =
      "<worldbody><body><joint name='j' actuatorfrcrange='-{0} {0}'/><geom size='1'/></body></worldbody>"
      "<actuator><motor joint='j' gear='2' ctrlrange='-1 1'/><position joint='j' kp='9' forcerange='-1 3'/></actuator>";
  const Model model = load_inside(fmt::format(fmt::runtime(two), 5));
  EXPECT_FALSE(model.actuators[0].force_limited);
  EXPECT_THROW(load_inside(fmt::format(fmt::runtime(two), 4)), InputError);
  EXPECT_THAT(load_dropped(fmt::format(fmt::runtime(two), 4)).notes, Contains(HasSubstr("does not limit the sum")));
}

TEST(MjcfTranslation, TendonForceLimitIsItsActuators) {
  const Model model = load_inside(kTwoHinges +
                                  "<tendon><fixed name='t' actuatorfrcrange='-3 1'><joint joint='a' coef='2'/>"
                                  "<joint joint='b' coef='5'/></fixed></tendon>"
                                  "<actuator><motor tendon='t' gear='-2'/></actuator>");
  EXPECT_EQ(model.actuators[0].force_lower, -0.5);
  EXPECT_EQ(model.actuators[0].force_upper, 1.5);
  EXPECT_EQ(model.actuators[0].terms[1].coefficient, -10);
}

// ---- what the switch leaves -----------------------------------------------------------------------------------------

TEST(MjcfTranslation, DroppedActuatorsExertNoForceAndDelayedOnesActAtOnce) {
  const Model model = load_dropped(kTwoHinges +
                                   "<actuator><muscle name='m' joint='a' lengthrange='0 1'/>"
                                   "<position name='p' joint='a' kp='2' delay='0.1' nsample='4'/></actuator>");
  EXPECT_THAT(names(model.actuators), ElementsAre("p"));
  EXPECT_EQ(model.actuators[0].gain, 2);
  EXPECT_THAT(model.notes, Contains(HasSubstr("lets its force follow the control at once")));
}

TEST(MjcfTranslation, ActivationsKeepEverything) {
  const Model model = load_inside(
      kTwoHinges +
      "<actuator><position name='p' joint='a' kp='2' timeconst='0.1'/><intvelocity name='i' joint='b' kp='1' "
      "actrange='0 1'/><motor name='u' joint='b'/><general name='g' joint='b' dyntype='filter' dynprm='0.3'/>"
      "<position name='n' joint='a' timeconst='0'/></actuator>"
      "<keyframe><key act='0.25 0.5 0.75'/></keyframe>");
  ASSERT_THAT(names(model.actuators), ElementsAre("p", "i", "u", "g", "n"));
  EXPECT_EQ(model.actuators[0].activation, ActivationType::kFilter);
  EXPECT_EQ(model.actuators[0].time_constant, 0.1);
  EXPECT_EQ(model.actuators[0].activation_start, 0.25);
  EXPECT_EQ(model.actuators[1].activation, ActivationType::kIntegrator);
  EXPECT_TRUE(model.actuators[1].activation_limited);
  EXPECT_EQ(model.actuators[1].activation_upper, 1);
  EXPECT_EQ(model.actuators[1].activation_start, 0.5);
  EXPECT_FALSE(model.actuators[2].has_activation());
  EXPECT_EQ(model.actuators[3].time_constant, 0.3);
  EXPECT_EQ(model.actuators[3].activation_start, 0.75);
  EXPECT_FALSE(model.actuators[4].has_activation());
}

TEST(MjcfTranslation, MocapBodyStandsStillWithItsWeld) {
  const Model model = load_inside(
      "<worldbody><geom name='floor' type='plane' size='1 1 1'/>"
      "<body name='handle' mocap='true' pos='0 0 1'><geom name='grip' size='0.1'/></body>"
      "<body name='hand' pos='0 0 1'><freejoint/><geom name='palm' size='0.1'/></body></worldbody>"
      "<equality><weld name='drag' body1='handle' body2='hand'/></equality>");
  EXPECT_THAT(names(model.bodies), ElementsAre("hand"));
  EXPECT_THAT(names(model.shapes), ElementsAre("floor", "grip", "palm"));
  EXPECT_EQ(model.shapes[1].body, kWorld);
  EXPECT_EQ(model.shapes[1].X_BS.p, Vec3(0, 0, 1));
  EXPECT_EQ(model.contacts.size(), 2U) << "the palm's: the floor and the handle both stand still";
  ASSERT_THAT(names(model.welds), ElementsAre("drag"));
  EXPECT_EQ(model.welds[0].body_a, 0);
  EXPECT_EQ(model.welds[0].body_b, kWorld);
  EXPECT_TRUE(model.welds[0].X_AB.p.isApprox(Vec3(0, 0, -1))) << model.welds[0].X_AB.p;
  EXPECT_THAT(model.notes, Contains(AllOf(HasSubstr("mocap bodies stand still"), HasSubstr("body 'handle'"))));
}

TEST(MjcfTranslation, MocapBodyStandsWhereTheKeyframePutsIt) {
  const std::string text =
      "<worldbody><body name='target' mocap='true' pos='0 0 1'><geom size='0.1'/></body>"
      "<body name='hand'><freejoint/><geom size='0.1'/></body></worldbody>"
      "<keyframe><key name='near' mpos='0 0 2' mquat='0 2 0 0'/><key name='far' mpos='0 0 9'/></keyframe>";
  const Model near = load_inside(text);
  EXPECT_EQ(near.shapes[0].X_BS.p, Vec3(0, 0, 2));
  EXPECT_TRUE(near.shapes[0].X_BS.q.coeffs().isApprox(Quat(0, 1, 0, 0).coeffs()));
  EXPECT_THAT(near.notes, Contains(AllOf(HasSubstr("mocap bodies elsewhere"), HasSubstr("body 'target' in key 'far'"),
                                         Not(HasSubstr("'near'")))));
  for (const std::string keyframe : {"far", "1"}) {
    const Model far = load_model_text("<mujoco>" + text + "</mujoco>", "robot.xml", {.keyframe = keyframe});
    EXPECT_EQ(far.shapes[0].X_BS.p, Vec3(0, 0, 9)) << keyframe;
    EXPECT_EQ(far.shapes[0].X_BS.q.w(), 1) << keyframe;
  }
}

TEST(MjcfTranslation, DroppedFlexIsFixed) {
  const Model model = load_dropped(
      "<worldbody><body name='b'><freejoint/><geom size='1'/></body>"
      "<flexcomp name='cloth' type='grid' count='2 2 1' spacing='1 1 1' radius='0.01' dim='2' mass='1'/></worldbody>");
  EXPECT_THAT(names(model.bodies), ElementsAre("b"));
}

// mjcf_against_mujoco_test.cc compares the points with MuJoCo's.
TEST(MjcfTranslation, WeldWithoutTorqueIsAConnect) {
  const std::string text =
      "<worldbody><body name='a'><freejoint/><geom size='0.1'/></body></worldbody><equality><weld name='w' body1='a' "
      "torquescale='{}'/></equality>";
  const Model connected = load_inside(fmt::format(fmt::runtime(text), 0));
  EXPECT_THAT(connected.welds, IsEmpty());
  EXPECT_THAT(names(connected.connects), ElementsAre("w"));
  EXPECT_THAT(connected.notes, Contains(AllOf(HasSubstr("equality 'w'"), HasSubstr("as a connect"))));
  const Model welded = load_inside(fmt::format(fmt::runtime(text), 1));
  EXPECT_THAT(names(welded.welds), ElementsAre("w"));
  EXPECT_THAT(welded.notes, Not(Contains(HasSubstr("torquescale"))));
  const Model dropped = load_dropped(fmt::format(fmt::runtime(text), 2));
  EXPECT_THAT(names(dropped.welds), ElementsAre("w"));
  EXPECT_THAT(dropped.notes, Contains(HasSubstr("torquescale=\"2\"")));
}

TEST(MjcfTranslation, OpenConstraintsAreNoted) {
  const Model model =
      load_inside(kTwoHinges + "<equality><joint name='gears' joint1='a' joint2='b' polycoef='0.5 1'/></equality>");
  EXPECT_THAT(model.notes,
              Contains(AllOf(HasSubstr("open in the initial state"), HasSubstr("coupling 'gears' by 0.5"))));
}

}  // namespace
}  // namespace assay
