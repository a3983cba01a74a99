// The loader's result for MJCF and URDF files, compared with values computed by hand. mjcf_against_mujoco_test.cc
// compares with MuJoCo itself, mjcf_refusal_test.cc tests refusals.
#include "load/mjcf.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <set>
#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include "base/errors.h"
#include "controls/control.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using testing::Contains;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

Model load(const std::string& inside) { return load_model_text("<mujoco>" + inside + "</mujoco>", "test"); }

const std::string kBall = "<body name='ball'><freejoint/><geom size='0.1' mass='1'/></body>";

std::string hinge_body(const std::string& joint, const std::string& more = "") {
  return "<worldbody><body name='arm'><joint name='elbow' type='hinge' " + joint +
         "/><geom size='0.1' mass='1'/></body></worldbody>" + more;
}

TEST(Mjcf, CapsuleHasTheExactInertia) {
  const Model model = load(
      "<worldbody><body><freejoint/><geom type='capsule' size='0.05 0.15' mass='1'/></body>"
      "<body><freejoint/><geom type='capsule' fromto='0 0 0 0.3 0 0' size='0.05' mass='1'/></body></worldbody>");
  const Vec3 exact = capsule_inertia(1, 0.05, 0.15);
  ASSERT_EQ(model.bodies.size(), 2U);
  EXPECT_LT((model.bodies[0].I_BBcm_B - Mat3(exact.asDiagonal())).norm(), 1e-16);
  // along x: the axial moment comes first
  EXPECT_LT((model.bodies[1].I_BBcm_B - Mat3(Vec3(exact.z(), exact.x(), exact.x()).asDiagonal())).norm(), 1e-16);
  EXPECT_LT((model.bodies[1].p_BBcm - Vec3(0.15, 0, 0)).norm(), 1e-16);
}

TEST(Mjcf, InertialIsTakenAsGiven) {
  const Model model = load(
      "<worldbody><body><freejoint/><inertial pos='1 2 3' mass='4' fullinertia='0.5 0.6 0.7 0.01 0.02 0.03'/></body>"
      "</worldbody>");
  Mat3 I;
  I << 0.5, 0.01, 0.02, 0.01, 0.6, 0.03, 0.02, 0.03, 0.7;
  EXPECT_LT((model.bodies[0].I_BBcm_B - I).norm(), 1e-14);
  EXPECT_EQ(model.bodies[0].mass, 4);
  EXPECT_EQ(model.bodies[0].p_BBcm, Vec3(1, 2, 3));
}

TEST(Mjcf, JointlessBodiesAreFusedExactly) {
  // a dumbbell of two balls of 1 kg, the second a jointless child 1 m along x, turned by 90 degrees about z
  const Model model = load(
      "<compiler angle='degree'/><worldbody><body name='base' pos='0 0 5'><geom name='block' size='0.2' mass='9'/>"
      "<body name='left' pos='0 0 1'><joint name='hinge' axis='0 1 0'/><geom size='0.1' mass='1'/>"
      "<body name='right' pos='1 0 0' euler='0 0 90'><geom name='far' type='capsule' size='0.1 0.2' pos='0.5 0 0' "
      "mass='1'/>"
      "<body name='last' pos='0 0 2'><joint name='end'/><geom size='0.1'/></body></body></body></body></worldbody>");
  ASSERT_EQ(model.bodies.size(), 2U);
  const Body& left = model.bodies[0];
  EXPECT_EQ(left.name, "left");
  EXPECT_EQ(left.parent, kWorld);
  EXPECT_LT((left.X_PB.p - Vec3(0, 0, 6)).norm(), 1e-15);
  // the capsule's centre lies at (1, 0.5, 0) in left's frame
  EXPECT_DOUBLE_EQ(left.mass, 2);
  EXPECT_LT((left.p_BBcm - Vec3(0.5, 0.25, 0)).norm(), 1e-15);
  const Vec3 capsule = capsule_inertia(1, 0.1, 0.2);
  const double ball = 0.4 * 0.01;
  const Vec3 d(0.5, 0.25, 0);
  const Mat3 exact = Mat3(Vec3(ball + capsule.x(), ball + capsule.x(), ball + capsule.z()).asDiagonal()) +
                     2 * (d.squaredNorm() * Mat3::Identity() - d * d.transpose());
  EXPECT_LT((left.I_BBcm_B - exact).norm(), 1e-14);
  // the grandchild hangs on left, in left's frame
  EXPECT_EQ(model.bodies[1].parent, 0);
  EXPECT_LT((model.bodies[1].X_PB.p - Vec3(1, 0, 2)).norm(), 1e-15);
  EXPECT_NEAR(model.bodies[1].X_PB.q.angularDistance(Quat(std::sqrt(0.5), 0, 0, std::sqrt(0.5))), 0, 1e-7);
  // shapes follow, the base's into the world
  EXPECT_EQ(model.shapes[0].name, "block");
  EXPECT_EQ(model.shapes[0].body, kWorld);
  EXPECT_LT((model.shapes[0].X_BS.p - Vec3(0, 0, 5)).norm(), 1e-15);
  EXPECT_EQ(model.shapes[2].name, "far");
  EXPECT_EQ(model.shapes[2].body, 0);
  EXPECT_LT((model.shapes[2].X_BS.p - Vec3(1, 0.5, 0)).norm(), 1e-15);
  EXPECT_THAT(model.notes,
              Contains("bodies without a joint are fused, exactly: body 'base' into the world, body 'right' "
                       "into 'left'"));
  EXPECT_DOUBLE_EQ(model.total_mass(), 2 + model.bodies[1].mass);
}

TEST(Mjcf, HingeKeepsEverything) {
  const Model model = load("<compiler angle='radian'/>" +
                           hinge_body("pos='0.1 0.2 0.3' axis='0 3 4' ref='0.5' range='-1 2' stiffness='7' "
                                      "springref='0.25' damping='0.125' armature='0.0625'"));
  ASSERT_EQ(model.joints.size(), 1U);
  const Joint& h = model.joints[0];
  EXPECT_EQ(h.name, "elbow");
  EXPECT_EQ(h.body, 0);
  EXPECT_EQ(h.p_BJ, Vec3(0.1, 0.2, 0.3));
  EXPECT_LT((h.axis_B - Vec3(0, 0.6, 0.8)).norm(), 1e-15);
  EXPECT_EQ(h.reference, 0.5);
  EXPECT_TRUE(h.limited);
  EXPECT_EQ(h.lower, -1);
  EXPECT_EQ(h.upper, 2);
  EXPECT_EQ(h.stiffness, 7);
  EXPECT_EQ(h.spring_reference, 0.25);
  EXPECT_EQ(h.damping, 0.125);
  EXPECT_EQ(h.armature, 0.0625);
  EXPECT_EQ(model.dof(), 1);
  EXPECT_TRUE(model.has_springs() && model.has_armature() && model.has_limits());
  EXPECT_EQ(model.initial.position, std::vector<double>{0.5});
}

TEST(Mjcf, AnglesAreInDegreesUnlessTheFileSaysOtherwise) {
  const Model model = load(hinge_body("range='-90 180'"));
  EXPECT_DOUBLE_EQ(model.joints[0].lower, -std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(model.joints[0].upper, std::numbers::pi);
}

TEST(Mjcf, SpringdamperBecomesStiffnessAndDamping) {
  // MuJoCo: natural frequency and damping ratio of the joint's inertia at the reference, 1 kg ball of radius 0.1
  const Model model = load(hinge_body("springdamper='0.1 0.5'"));
  const double inertia = 0.4 * 0.01;
  EXPECT_NEAR(model.joints[0].stiffness, inertia / (0.1 * 0.1 * 0.5 * 0.5), 1e-12);
  EXPECT_NEAR(model.joints[0].damping, 2 * inertia / 0.1, 1e-12);
}

TEST(Mjcf, Shapes) {
  const Model model = load(
      "<asset><material name='red' rgba='1 0 0 1'/></asset><worldbody>"
      "<geom name='floor' type='plane' size='0 0 1' pos='0 0 -1' friction='0.3'/>"
      "<body name='b'><freejoint/><geom name='s' size='0.5' material='red'/>"
      "<geom name='c' type='capsule' size='0.1 0.2' rgba='0 1 0 0.5'/>"
      "<geom name='drawn' size='2' contype='0' conaffinity='0'/></body></worldbody>");
  ASSERT_EQ(model.shapes.size(), 4U);
  EXPECT_EQ(model.shapes[0].type, ShapeType::kPlane);
  EXPECT_EQ(model.shapes[0].body, kWorld);
  EXPECT_EQ(model.shapes[0].X_BS.p, Vec3(0, 0, -1));
  EXPECT_EQ(model.shapes[0].friction, 0.3);
  EXPECT_TRUE(model.shapes[0].collides);
  EXPECT_EQ(model.shapes[1].type, ShapeType::kSphere);
  EXPECT_EQ(model.shapes[1].radius, 0.5);
  EXPECT_THAT(model.shapes[1].rgba, ElementsAre(1, 0, 0, 1));
  EXPECT_EQ(model.shapes[2].type, ShapeType::kCapsule);
  EXPECT_EQ(model.shapes[2].radius, 0.1);
  EXPECT_EQ(model.shapes[2].half_length, 0.2);
  EXPECT_THAT(model.shapes[2].rgba, ElementsAre(0, 1, 0, 0.5f));
  EXPECT_FALSE(model.shapes[3].collides);
  // ball and capsule of one body never touch each other
  ASSERT_EQ(model.contacts.size(), 2U);
  for (const ContactPair& pair : model.contacts) {
    EXPECT_EQ(pair.shape_a, 0);
    EXPECT_EQ(pair.friction, 1);  // MuJoCo's default of the other is larger than 0.3
  }
}

// Friction of the only pair between two free balls.
double pair_friction(const std::string& first, const std::string& second, const std::string& contact = "") {
  const Model model = load("<worldbody><body name='a'><freejoint/><geom name='g' size='1' " + first +
                           "/></body><body name='b'><freejoint/><geom name='h' size='1' " + second +
                           "/></body></worldbody><contact>" + contact + "</contact>");
  return model.contacts.size() == 1 ? model.contacts[0].friction : -1.0 - static_cast<double>(model.contacts.size());
}

TEST(Mjcf, FrictionRules) {
  EXPECT_EQ(pair_friction("friction='0.4'", "friction='0.6'"), 0.6);
  EXPECT_EQ(pair_friction("friction='0.4' priority='1'", "friction='0.6'"), 0.4);
  EXPECT_EQ(pair_friction("friction='0.4' priority='1'", "friction='0.6' priority='2'"), 0.6);
  EXPECT_EQ(pair_friction("friction='0.4'", "friction='0.6'", "<pair geom1='g' geom2='h' friction='0.1 0.1'/>"), 0.1);
  // condim 1 is frictionless, and the larger condim wins unless one geom has priority
  EXPECT_EQ(pair_friction("condim='1'", "condim='1'"), 0);
  EXPECT_EQ(pair_friction("condim='1' friction='0.4'", "condim='3' friction='0.2'"), 0.4);
  EXPECT_EQ(pair_friction("condim='1' priority='1'", "condim='3'"), 0);
  EXPECT_EQ(pair_friction("", "", "<pair geom1='g' geom2='h' condim='1'/>"), 0);
}

TEST(Mjcf, CollisionFilter) {
  const double none = -1;
  EXPECT_EQ(pair_friction("contype='1' conaffinity='2'", "contype='1' conaffinity='2'"), none);
  EXPECT_EQ(pair_friction("contype='1' conaffinity='0'", "contype='0' conaffinity='1'"), 1);
  EXPECT_EQ(pair_friction("contype='4' conaffinity='0'", "contype='4' conaffinity='0'"), none);
  EXPECT_EQ(pair_friction("", "", "<exclude body1='b' body2='a'/>"), none);
  EXPECT_EQ(pair_friction("contype='0' conaffinity='0'", "contype='0' conaffinity='0'",
                          "<pair geom1='g' geom2='h' friction='0.1 0.1'/>"),
            0.1);
  EXPECT_EQ(pair_friction("", "", "<exclude body1='b' body2='a'/><pair geom1='g' geom2='h' friction='0.1 0.1'/>"), 0.1);
}

// Names of the shapes that may touch, as "a-b".
std::vector<std::string> touching(const Model& model) {
  std::vector<std::string> names;
  names.reserve(model.contacts.size());
  for (const ContactPair& pair : model.contacts) {
    names.push_back(model.shapes[pair.shape_a].name + "-" + model.shapes[pair.shape_b].name);
  }
  return names;
}

TEST(Mjcf, ParentAndChildDoNotCollideUnlessTheParentIsFixed) {
  const std::string chain =
      "<worldbody><geom name='floor' type='plane' size='1 1 1'/><body><geom name='base' size='1'/><body>"
      "<joint/><geom name='upper' size='1'/><body><joint/><geom name='lower' size='1'/><body><joint/>"
      "<geom name='end' size='1'/></body></body></body></body></worldbody>";
  EXPECT_THAT(touching(load(chain)), ElementsAre("floor-upper", "floor-lower", "floor-end", "base-upper", "base-lower",
                                                 "base-end", "upper-end"));
  EXPECT_THAT(touching(load("<option><flag filterparent='disable'/></option>" + chain)),
              ElementsAre("floor-upper", "floor-lower", "floor-end", "base-upper", "base-lower", "base-end",
                          "upper-lower", "upper-end", "lower-end"));
  const Model without = load("<option><flag contact='disable'/></option>" + chain);
  EXPECT_THAT(without.contacts, IsEmpty());
  EXPECT_FALSE(without.shapes[0].collides);
  EXPECT_THAT(without.notes, Contains("contacts are off: the file disables them"));
}

TEST(Mjcf, Actuators) {
  const Model model = load("<compiler angle='radian'/>" +
                           hinge_body("",
                                      "<actuator><motor name='m' joint='elbow' gear='3' ctrlrange='-1 2'/>"
                                      "<position joint='elbow' kp='5' kv='0.5' forcerange='-4 6' gear='2'/>"
                                      "<general name='g' joint='elbow' gainprm='-2' forcerange='-4 6'/></actuator>"
                                      "<keyframe><key ctrl='0.5 0.6 0.7'/></keyframe>"));
  ASSERT_EQ(model.actuators.size(), 3U);
  const Actuator& motor = model.actuators[0];
  EXPECT_EQ(motor.name, "m");
  EXPECT_EQ(motor.gain, 1);
  EXPECT_FALSE(motor.has_feedback());
  ASSERT_EQ(motor.terms.size(), 1U);
  EXPECT_EQ(motor.terms[0].joint, 0);
  EXPECT_EQ(motor.terms[0].coefficient, 3);
  EXPECT_TRUE(motor.control_limited);
  EXPECT_FALSE(motor.force_limited);
  EXPECT_EQ(motor.control_lower, -1);
  EXPECT_EQ(motor.control_upper, 2);
  const Actuator& position = model.actuators[1];
  EXPECT_EQ(position.gain, 5);
  EXPECT_THAT(position.bias, ElementsAre(0, -5, -0.5));
  EXPECT_EQ(position.terms.at(0).coefficient, 2);
  EXPECT_TRUE(position.force_limited);
  EXPECT_EQ(position.force_lower, -4);
  EXPECT_EQ(position.force_upper, 6);
  EXPECT_EQ(model.actuators[2].gain, -2);
  EXPECT_EQ(model.actuators[2].terms.at(0).coefficient, 1);
  EXPECT_EQ(model.actuators[2].force_lower, -4);
  EXPECT_EQ(model.actuators[2].force_upper, 6);
  EXPECT_THAT(model.control0, ElementsAre(0.5, 0.6, 0.7));
}

// A joint's own limit of actuator forces, against MuJoCo's torque for many controls.
TEST(Mjcf, JointForceLimitIsTheActuators) {
  for (const char* actuator :
       {"<motor joint='elbow' gear='2'/>", "<motor joint='elbow' gear='-2' forcerange='-1 0.2'/>",
        "<motor joint='elbow' forcerange='2 3'/>", "<motor joint='elbow' forcerange='-3 -2'/>",
        "<position joint='elbow' kp='3' gear='0.5' forcerange='-1 9'/>"}) {
    const std::string xml =
        "<mujoco>" + hinge_body("actuatorfrcrange='-0.5 1.5'") + "<actuator>" + actuator + "</actuator></mujoco>";
    SCOPED_TRACE(actuator);
    const Model model = load_model_text(xml, "test");
    mjSpec* spec = mj_parseXMLString(xml.c_str(), nullptr, nullptr, 0);
    mjModel* m = mj_compile(spec, nullptr);
    ASSERT_NE(m, nullptr);
    mjData* d = mj_makeData(m);
    for (int i = -16; i <= 16; ++i) {
      const double u = 0.25 * i;
      d->ctrl[0] = u;
      mj_forward(m, d);
      const Actuator& a = model.actuators[0];
      EXPECT_NEAR(a.terms[0].coefficient * actuator_force(a, actuator_input(a, u, 0), 0, 0), d->qfrc_actuator[0], 1e-15)
          << u;
    }
    mj_deleteData(d);
    mj_deleteModel(m);
    mj_deleteSpec(spec);
  }
  // without an actuator it has no effect
  EXPECT_THAT(load(hinge_body("actuatorfrcrange='-0.5 1.5'")).actuators, IsEmpty());
}

TEST(Mjcf, StartWithinLimits) {
  // 0.2: 'below' leads; 2: it follows, and its limit asks for 1.1 of the other
  for (const auto& [slope, follows] : {std::pair(0.2, 0.2), std::pair(2.0, 1.1)}) {
    const std::string text = fmt::format(
        "<mujoco><compiler angle='radian'/><worldbody><body name='a'><joint name='below' range='0.5 2'/>"
        "<geom size='0.1' pos='1 0 0'/><body name='b' pos='1 0 0'><joint name='follows' range='-1 3'/>"
        "<geom size='0.1' pos='1 0 0'/></body></body><body name='c'><joint name='within' type='slide' range='-1 1'/>"
        "<geom size='0.1'/></body></worldbody>"
        "<equality><joint joint1='follows' joint2='below' polycoef='0.1 {} 0 0 0'/></equality>"
        "<keyframe><key qpos='-0.25 0 0.5' qvel='0 0 3'/></keyframe></mujoco>",
        slope);
    const Model as_written = load_model_text(text, "test");
    const Model model = load_model_text(text, "test", {.within_limits = true});
    EXPECT_THAT(as_written.initial.position, ElementsAre(-0.25, 0, 0.5));
    EXPECT_THAT(model.initial.position, ElementsAre(DoubleNear(0.5, 1e-12), DoubleNear(follows, 1e-12), 0.5));
    EXPECT_THAT(model.initial.velocity, ElementsAre(0, 0, 3));
    EXPECT_LT((model.initial.bodies[0].p_WBcm - Vec3(std::cos(0.5), std::sin(0.5), 0)).norm(), 1e-12);
    EXPECT_NE(model.hash, as_written.hash);
  }
}

TEST(Mjcf, KeyframesAndInitialState) {
  // a ball off its body's origin, turned 90 degrees about z: velocities are the centre's, angular ones in world axes
  const Model model = load(
      "<worldbody><body name='b'><freejoint/><geom size='0.1' pos='1 0 0'/></body>"
      "<body name='c'><joint ref='30'/><geom size='0.1' pos='0 1 0'/></body></worldbody>"
      "<keyframe><key name='first' time='3' qpos='1 2 3 0.7071067811865476 0 0 0.7071067811865476 0.25' "
      "qvel='1 0 0 1 0 2 0.5'/><key/></keyframe>");
  ASSERT_EQ(model.keyframes.size(), 2U);
  EXPECT_EQ(model.keyframes[0].name, "first");
  EXPECT_EQ(model.keyframes[1].name, "key2");
  const State& state = model.keyframes[0].state;
  EXPECT_EQ(state.time, 3);
  EXPECT_LT((state.bodies[0].p_WBcm - Vec3(1, 3, 3)).norm(), 1e-15);
  EXPECT_LT((state.bodies[0].w_WB - Vec3(0, 1, 2)).norm(), 1e-15);
  // origin moves with (1, 0, 0), and (0, 1, 2) x (0, 1, 0) = (-2, 0, 0)
  EXPECT_LT((state.bodies[0].v_WBcm - Vec3(-1, 0, 0)).norm(), 1e-15);
  EXPECT_THAT(state.position, ElementsAre(0.25));
  EXPECT_THAT(state.velocity, ElementsAre(0.5));
  // the run starts from the first, at time 0
  EXPECT_EQ(model.initial.time, 0);
  EXPECT_EQ(model.initial.position, state.position);
  EXPECT_EQ(model.initial.bodies[0].v_WBcm, state.bodies[0].v_WBcm);
  // an empty key is the reference
  EXPECT_NEAR(model.keyframes[1].state.position[0], std::numbers::pi / 6, 1e-15);
}

TEST(Mjcf, WithoutKeyframesTheReferenceAtRest) {
  const Model model =
      load("<worldbody><body pos='1 2 3'><freejoint/><geom size='0.1' pos='1 0 0'/></body></worldbody>");
  EXPECT_EQ(model.initial.bodies[0].p_WBcm, Vec3(2, 2, 3));
  EXPECT_EQ(model.initial.bodies[0].v_WBcm, Vec3::Zero());
  EXPECT_THAT(model.keyframes, IsEmpty());
}

TEST(Mjcf, NamesAreMadeUpAndUnique) {
  const Model model = load(
      "<worldbody><body><freejoint/><geom size='0.1'/><geom size='0.1'/></body>"
      "<body name='body1'><joint/><geom name='body1_shape' size='0.1'/></body></worldbody>");
  EXPECT_EQ(model.name, "test");
  EXPECT_EQ(model.bodies[0].name, "body1_2");
  EXPECT_EQ(model.bodies[1].name, "body1");  // the file's own names stay
  EXPECT_EQ(model.joints[0].name, "body1");
  std::set<std::string> shapes;
  for (const Shape& shape : model.shapes) shapes.insert(shape.name);
  EXPECT_EQ(shapes.size(), 3U);
}

TEST(Mjcf, ContenderMattersBecomeNotes) {
  const Model model = load(
      "<option timestep='0.004' integrator='RK4' cone='elliptic'><flag warmstart='disable'/></option>"
      "<worldbody><geom name='floor' type='plane' size='1 1 1' solref='0.01 1'/>" +
      kBall + "</worldbody><sensor><accelerometer site='s'/></sensor>" + "<worldbody><site name='s'/></worldbody>");
  EXPECT_THAT(model.notes,
              Contains("the file's MuJoCo options are ignored, because the contender decides them: timestep, "
                       "integrator, cone, flag Warmstart"));
  EXPECT_THAT(model.notes,
              Contains(HasSubstr("(solref, solimp, solmix, gap) is ignored, because the contender decides it: "
                                 "geom 'floor'")));
  EXPECT_THAT(model.notes, Contains(HasSubstr("1 sensors are left out")));
  EXPECT_THAT(load("<worldbody>" + kBall + "</worldbody>").notes, IsEmpty());
  EXPECT_THAT(load(hinge_body("frictionloss='1' solreffriction='0.01 1'")).notes,
              Contains(HasSubstr("because the contender decides it: joint 'elbow'")));
  EXPECT_THAT(load(hinge_body("solreffriction='0.01 1'")).notes, IsEmpty());
}

TEST(Mjcf, DisabledPhysicsIsNotThere) {
  const std::string body = hinge_body("range='-10 10' stiffness='3' damping='2' frictionloss='1'",
                                      "<actuator><motor joint='elbow' ctrlrange='-1 1'/></actuator>");
  const Model model = load(
      "<option><flag gravity='disable' limit='disable' spring='disable' damper='disable' frictionloss='disable' "
      "clampctrl='disable'/></option>" +
      body);
  EXPECT_EQ(model.gravity, Vec3::Zero());
  EXPECT_FALSE(model.has_limits());
  EXPECT_FALSE(model.has_springs());
  EXPECT_FALSE(model.actuators[0].control_limited);
  EXPECT_THAT(load("<option actuatorgroupdisable='0'><flag frictionloss='disable'/></option>" + body).actuators,
              IsEmpty());
  EXPECT_THAT(load("<option><flag actuation='disable' frictionloss='disable'/></option>" + body).actuators, IsEmpty());
}

TEST(Mjcf, VisualShapesAreDrawnOnly) {
  const Model model = load(
      "<asset><mesh name='m' vertex='0 0 0 1 0 0 0 1 0 0 0 1'/></asset>"
      "<worldbody><body name='b'><freejoint/><geom size='0.1'/>"
      "<geom name='cover' type='box' size='1 1 1' contype='0' conaffinity='0'/>"
      "<geom name='hull' type='mesh' mesh='m' contype='0' conaffinity='0'/></body></worldbody>");
  ASSERT_EQ(model.shapes.size(), 2U);
  EXPECT_EQ(model.shapes[1].type, ShapeType::kBox);
  EXPECT_FALSE(model.shapes[1].collides);
  EXPECT_THAT(model.notes, Contains("visual shapes are left out: geom 'hull' (mesh)"));
  EXPECT_GT(model.total_mass(), 8000);  // their mass stays
}

TEST(Mjcf, HashIsOfThePhysics) {
  const std::string plain = "<worldbody>" + kBall + "</worldbody>";
  const Model model = load(plain);
  EXPECT_EQ(model.hash.size(), 32U);
  EXPECT_EQ(model.hash, load_model_text("<mujoco model='other'>" + plain + "</mujoco>", "x").hash);
  EXPECT_EQ(model.hash, load("<option timestep='0.1'/>" + plain).hash);
  EXPECT_NE(model.hash, load("<option gravity='0 0 -9.8'/>" + plain).hash);
  EXPECT_NE(model.hash, load(plain + "<keyframe><key qpos='0 0 1 1 0 0 0'/></keyframe>").hash);
}

// ---- files ----------------------------------------------------------------------------------------------------------

class MjcfFile : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& text) const {
    const std::string path = folder_ / name;
    std::ofstream(path) << text;
    return path;
  }

  std::filesystem::path folder_ = std::filesystem::path(testing::TempDir()) / fmt::format("assay_mjcf_{}", ::getpid());
};

TEST(Mjcf, RoomForASimulationOfItsOwnIsNotTaken) {
  for (const char* const size : {"memory='1000T'", "njmax='100000000' nconmax='100000000'", "nstack='100000000'"}) {
    EXPECT_EQ(load(fmt::format("<size {}/><worldbody>{}</worldbody>", size, kBall)).bodies.size(), 1U) << size;
  }
}

TEST_F(MjcfFile, IncludesAndDefaultsAreMujocos) {
  write("ball.xml", "<mujoco>" + kBall + "</mujoco>");
  const std::string path =
      write("scene.xml",
            "<mujoco><default><geom friction='0.25'/></default><worldbody><include file='ball.xml'/>"
            "</worldbody></mujoco>");
  const Model model = load_model(path);
  EXPECT_EQ(model.name, "scene");
  EXPECT_EQ(model.source, path);
  EXPECT_EQ(model.bodies.at(0).name, "ball");
  EXPECT_EQ(model.shapes.at(0).friction, 0.25);
}

constexpr const char* kUrdf = R"(<robot name="arm">
  <link name="base"/>
  <link name="upper">
    <inertial><origin xyz="0 0 0.1"/><mass value="2"/>
      <inertia ixx="0.1" ixy="0.01" ixz="0" iyy="0.2" iyz="0" izz="0.15"/></inertial>
    <collision><geometry><sphere radius="0.05"/></geometry></collision>
  </link>
  <link name="lower"><inertial><mass value="1"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <link name="tool"><inertial><mass value="1"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.2"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="2" effort="10" velocity="3"/><dynamics damping="0.5"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="lower"/><origin xyz="0 0 0.3"/>
    <axis xyz="1 0 0"/></joint>
  <joint name="wrist" type="fixed"><parent link="lower"/><child link="tool"/><origin xyz="0 0 0.4"/></joint>
</robot>)";

// As MJCF has it between moving links; planes are no link.
TEST_F(MjcfFile, WhatIsAttachedIsInItsOwnFile) {
  const auto robot = [&](const char* spring) {
    write("part.xml", fmt::format("<mujoco>\n<worldbody>\n<body name='hand'>\n<joint name='j' {}/><geom name='g' "
                                  "size='0.1'/></body></worldbody></mujoco>",
                                  spring));
    return write("robot.xml",
                 "<mujoco><asset><model name='part' file='part.xml'/></asset><worldbody>\n<body name='arm'><joint "
                 "name='k'/><geom size='0.1'/><frame><attach model='part' body='hand' prefix='l_'/></frame></body>"
                 "</worldbody></mujoco>");
  };
  const LoadReport refused = inspect_model(robot("stiffness='1 2'"));
  ASSERT_EQ(refused.problems.size(), 1U);
  EXPECT_THAT(problem_text(refused.problems[0]), HasSubstr("joint 'l_j' (part.xml, line 4) has a nonlinear spring"));
  FileFacts facts;
  ASSERT_FALSE(inspect_model(robot(""), {}, &facts).refused());
  EXPECT_EQ(facts.line_of("joint 'l_j'"), 4);
  EXPECT_EQ(facts.file_of("joint 'l_j'"), "part.xml");
  EXPECT_EQ(facts.line_of("joint 'k'"), 2);
  EXPECT_EQ(facts.file_of("joint 'k'"), "");
}

// An attached file keeps its folder and its compiler, whatever the file says that attaches it.
TEST_F(MjcfFile, WhatIsAttachedKeepsItsOwnFolders) {
  const auto put = [&](const std::string& name, const std::string& text) {
    std::filesystem::create_directories((folder_ / name).parent_path());
    return write(name, text);
  };
  const char* tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  for (const char* name : {"arm/assets/box.obj", "hand/m/box.obj", "leg/meshes/box.obj"}) put(name, tetrahedron);
  const auto robot = [](const std::string& compiler, const std::string& file, const std::string& more = "") {
    return fmt::format(
        "<mujoco>{}<asset><mesh name='box' file='{}'/></asset><worldbody><body name='link'><joint axis='0 1 0'/><geom "
        "type='mesh' mesh='box' density='6'/>{}</body></worldbody></mujoco>",
        compiler, file, more);
  };
  const auto cell = [](const std::string& compiler, const std::string& file) {
    return fmt::format(
        "<mujoco>{}<asset><model name='a' file='{}'/></asset><worldbody><attach model='a' prefix='a_'/></worldbody>"
        "</mujoco>",
        compiler, file);
  };
  put("arm/meshdir.xml", robot("<compiler meshdir='assets'/>", "box.obj"));
  put("arm/assetdir.xml", robot("<compiler assetdir='assets'/>", "box.obj"));
  put("arm/none.xml", robot("", "assets/box.obj"));
  put("hand/hand.xml", robot("<compiler meshdir='m'/>", "box.obj"));
  put("leg/parts/leg.xml",
      "<mujocoinclude><asset><mesh name='box' file='box.obj'/></asset><worldbody><body name='link'><joint/><geom "
      "type='mesh' mesh='box' density='6'/></body></worldbody></mujocoinclude>");
  put("leg/leg.xml", "<mujoco><compiler meshdir='meshes'/><include file='parts/leg.xml'/></mujoco>");
  put("arm/with_hand.xml",
      "<mujoco><compiler meshdir='assets'/><asset><model name='h' file='../hand/hand.xml'/><mesh name='box' "
      "file='box.obj'/></asset><worldbody><body name='link'><joint/><geom type='mesh' mesh='box' density='6'/><attach "
      "model='h' prefix='h_'/></body></worldbody></mujoco>");
  LoadOptions trusting;
  trusting.allow_external_files = true;
  for (const char* compiler : {"", "<compiler meshdir='arm/assets'/>", "<compiler meshdir='elsewhere'/>"}) {
    for (const char* file : {"arm/meshdir.xml", "arm/assetdir.xml", "arm/none.xml", "leg/leg.xml"}) {
      const std::string path = write("cell.xml", cell(compiler, file));
      EXPECT_NEAR(load_model(path).total_mass(), 1, 1e-6) << compiler << file;
      FileFacts facts;
      ASSERT_FALSE(inspect_model(path, {}, &facts).refused());
      ASSERT_EQ(facts.meshes.size(), 1U);
      EXPECT_TRUE(std::filesystem::exists(facts.meshes[0].file)) << facts.meshes[0].file;
    }
  }
  EXPECT_NEAR(load_model(write("cell.xml", cell("", "arm/with_hand.xml"))).total_mass(), 2, 1e-6);

  // what is missing is named as the attached file would find it, and what lies outside is refused as ever
  std::filesystem::remove(folder_ / "hand/m/box.obj");
  const LoadReport missing =
      inspect_model(write("cell.xml", cell("<compiler meshdir='arm/assets'/>", "hand/hand.xml")));
  ASSERT_TRUE(missing.refused());
  EXPECT_THAT(problem_text(missing.problems[0]),
              AllOf(HasSubstr("mesh 'a_box' (hand/hand.xml, line 1)"), HasSubstr("hand/m/box.obj")));
  const std::string inner = put("inner/cell.xml", cell("", "robot.xml"));
  put("inner/robot.xml", robot("<compiler meshdir='../arm/assets'/>", "box.obj"));
  const LoadReport outside = inspect_model(inner);
  ASSERT_TRUE(outside.refused());
  EXPECT_THAT(problem_text(outside.problems[0]),
              AllOf(HasSubstr("(robot.xml, line 1)"), HasSubstr("--allow-external-files")));
  EXPECT_NEAR(load_model(inner, trusting).total_mass(), 1, 1e-6);
}

TEST_F(MjcfFile, UrdfsBaseDoesNotCollideWithWhatAJointJoinsToIt) {
  const auto link = [](const std::string& name) {
    return "<link name='" + name +
           "'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>"
           "<collision name='" +
           name + "'><geometry><sphere radius='1'/></geometry></collision></link>";
  };
  const auto joint = [](const std::string& type, const std::string& parent, const std::string& child) {
    return "<joint name='to_" + child + "' type='" + type + "'><parent link='" + parent + "'/><child link='" + child +
           "'/><axis xyz='0 1 0'/></joint>";
  };
  const std::string path =
      write("arm.urdf", "<robot name='arm'>" + link("stand") + link("base") + link("upper") + link("lower") +
                            joint("fixed", "stand", "base") + joint("continuous", "base", "upper") +
                            joint("continuous", "upper", "lower") + "</robot>");
  LoadOptions options;
  options.root_joint = RootJoint::kFixed;
  options.ground = Ground::kPlane;
  EXPECT_THAT(touching(load_model(path, options)),
              UnorderedElementsAre("stand-lower", "base-lower", "ground-upper", "ground-lower"));
  options.root_joint = RootJoint::kFloating;
  EXPECT_THAT(touching(load_model(path, options)), UnorderedElementsAre("stand-lower", "base-lower", "ground-stand",
                                                                        "ground-base", "ground-upper", "ground-lower"));
}

TEST_F(MjcfFile, UrdfsFirstElementCounts) {
  const Model model = load_model(write("twice.urdf", R"(<robot name="twice">
  <link name="base"/>
  <link name="arm">
    <inertial><mass value="2"/><mass value="3"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <inertial><mass value="5"/><inertia ixx="4" ixy="0" ixz="0" iyy="4" iyz="0" izz="4"/></inertial>
  </link>
  <joint name="turn" type="continuous">
    <parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
    <axis xyz="0 0 1"/>
  </joint>
</robot>)"));
  ASSERT_EQ(model.bodies.size(), 1U);
  EXPECT_EQ(model.bodies[0].mass, 2);
  EXPECT_TRUE(model.joints[0].axis_B.isApprox(Vec3::UnitY()));
  EXPECT_THAT(model.notes, Contains("link 'arm' has a second <inertial> in line 5: the first one counts, as in ROS"));
  EXPECT_THAT(model.notes, Contains("joint 'turn' has a second <axis> in line 9: the first one counts, as in ROS"));
}

TEST_F(MjcfFile, Urdf) {
  const Model model = load_model(write("arm.urdf", kUrdf));
  EXPECT_EQ(model.name, "arm");
  ASSERT_EQ(model.bodies.size(), 2U);
  EXPECT_EQ(model.bodies[0].name, "upper");
  EXPECT_LT((model.bodies[0].X_PB.p - Vec3(0, 0, 0.2)).norm(), 1e-15);
  EXPECT_EQ(model.bodies[0].mass, 2);
  EXPECT_LT((model.bodies[0].p_BBcm - Vec3(0, 0, 0.1)).norm(), 1e-15);
  Mat3 I;
  I << 0.1, 0.01, 0, 0.01, 0.2, 0, 0, 0, 0.15;
  EXPECT_LT((model.bodies[0].I_BBcm_B - I).norm(), 1e-15);
  EXPECT_EQ(model.joints[0].name, "shoulder");
  EXPECT_EQ(model.joints[0].axis_B, Vec3::UnitY());
  EXPECT_TRUE(model.joints[0].limited);
  EXPECT_EQ(model.joints[0].lower, -1);
  EXPECT_EQ(model.joints[0].upper, 2);
  EXPECT_EQ(model.joints[0].damping, 0.5);
  EXPECT_FALSE(model.joints[1].limited);
  // lower and tool, 1 kg each, 0.4 m apart
  EXPECT_DOUBLE_EQ(model.bodies[1].mass, 2);
  EXPECT_LT((model.bodies[1].p_BBcm - Vec3(0, 0, 0.2)).norm(), 1e-15);
  EXPECT_NEAR(model.bodies[1].I_BBcm_B(0, 0), 0.2 + 2 * 0.04, 1e-15);
  EXPECT_THAT(model.notes, Contains(HasSubstr("velocity limits are not used, because no engine here has them: 1")));
  // a motor for each joint, within the effort limit
  ASSERT_EQ(model.actuators.size(), 2U);
  EXPECT_EQ(model.actuators[0].name, "shoulder");
  EXPECT_EQ(model.actuators[0].gain, 1);
  EXPECT_EQ(model.actuators[0].bias, (std::array<double, 3>{0, 0, 0}));
  EXPECT_TRUE(model.actuators[0].force_limited);
  EXPECT_EQ(model.actuators[0].force_lower, -10);
  EXPECT_EQ(model.actuators[0].force_upper, 10);
  EXPECT_EQ(model.actuators[1].terms.at(0).joint, 1);
  EXPECT_FALSE(model.actuators[1].force_limited);
  EXPECT_EQ(model.control0, (std::vector<double>{0, 0}));
  // from a string it is the same robot
  EXPECT_EQ(load_model_text(kUrdf, "arm").hash, model.hash);
}

// What URDF readers know and what they do not, once for each kind.
TEST_F(MjcfFile, UrdfPartsThatAreNotReadAreNoted) {
  const auto robot = [](const std::string& tip, const std::string& inside, const std::string& more) {
    return fmt::format(R"(<robot name="r" xmlns:drake="x" version="1.0">
<link name="base"/><material name="red"><color rgba="1 0 0 1" shade="2"/></material>
<link name="tip"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<visual name="v"><geometry><mesh filename="m.dae" scale="1 1 1"/></geometry><material name="red"/></visual>{}</link>
<joint name="j" type="revolute"><parent link="base"/><child link="tip"/><axis xyz="0 1 0"/><origin rpy="0 0 0"/>
{}</joint>{}</robot>)",
                       tip, inside, more);
  };
  const auto unread = [](const Model& model) {
    return std::ranges::count_if(model.notes,
                                 [](const std::string& note) { return note.find("not read") != std::string::npos; });
  };
  const std::string limit = R"(<limit lower="-1" upper="1" effort="1"/>)";
  EXPECT_EQ(unread(load_model_text(robot("", limit, ""), "r")), 0);
  const Model model = load_model_text(
      robot(R"(<contact><lateral_friction value="0.1"/></contact><self_collision_checking/>)",
            R"(<limit low="-1" upper="1" effort="1"/><dynamics damping="1" spring_stiffness="3"/><limits lower="0"/>
<drake:rotor_inertia value="1"/><drake:rotor_inertia value="2"/><safety_controller k_velocity="3"/>)",
            R"(<ros2_control name="x" type="system"><joint name="j"/></ros2_control>
<drake:collision_filter_group name="g"/><gazebo/>)"),
      "r");
  for (const char* note :
       {"<contact> of link 'tip' (line 4) is not read", "<self_collision_checking> of link 'tip' (line 4) is not read",
        "attribute 'low' of <limit> of joint 'j' (line 6) is not read (did you mean 'lower'?)",
        "attribute 'spring_stiffness' of <dynamics> of joint 'j' (line 6) is not read",
        "<limits> of joint 'j' (line 6) is not read (did you mean 'limit'?)",
        "<drake:rotor_inertia> of joint 'j' (line 7) and 1 more are not read",
        "<safety_controller> of joint 'j' (line 7) is not read", "<drake:collision_filter_group> (line 8) is not read",
        "ros2_control blocks are not read (1): they are another program's",
        "gazebo extensions are not read (1): they are another program's"}) {
    EXPECT_THAT(model.notes, Contains(note));
  }
  EXPECT_EQ(unread(model), 10);
}

// A coupling without a name of its own is found in the file.
TEST_F(MjcfFile, UrdfMimicHasItsJointsNameAndLine) {
  const std::string path = write("hand.urdf", R"(<robot name="hand"><link name="base"/>
<link name="a"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<link name="b"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="left" type="continuous"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/></joint>
<joint name="right" type="continuous"><parent link="base"/><child link="b"/><axis xyz="0 1 0"/>
<mimic joint="left" multiplier="2"/></joint></robot>)");
  FileFacts facts;
  const LoadReport report = inspect_model(path, {}, &facts);
  ASSERT_TRUE(report.model.has_value());
  ASSERT_EQ(report.model.value_or(Model{}).couplings.size(), 1U);
  EXPECT_EQ(report.model.value_or(Model{}).couplings[0].name, "right");
  EXPECT_EQ(facts.line_of("coupling 'right'"), 6);
}

// Shapes have no mass in URDF: neither those of a link without <inertial>, nor those of a link whose inertia is joined
// to that of the link that it is fixed to, because a third one there is an empty frame.
TEST_F(MjcfFile, UrdfShapesWeighNothing) {
  const Model model = load_model(write("hand.urdf", R"(<robot name="hand">
    <link name="base"/>
    <link name="palm"><inertial><mass value="1"/>
      <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
    <link name="frame"><inertial><mass value="0"/>
      <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
    <link name="gripper">
      <inertial><mass value="3"/><inertia ixx="0.2" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.2"/></inertial>
      <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
    <link name="cover"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
    <joint name="wrist" type="revolute"><parent link="base"/><child link="palm"/><axis xyz="0 1 0"/>
      <limit lower="-1" upper="1"/></joint>
    <joint name="a" type="fixed"><parent link="palm"/><child link="frame"/></joint>
    <joint name="b" type="fixed"><parent link="frame"/><child link="gripper"/><origin xyz="0 0 0.4"/></joint>
    <joint name="c" type="fixed"><parent link="palm"/><child link="cover"/></joint>
  </robot>)"));
  ASSERT_EQ(model.bodies.size(), 1U);
  EXPECT_DOUBLE_EQ(model.bodies[0].mass, 4);
  EXPECT_LT((model.bodies[0].p_BBcm - Vec3(0, 0, 0.3)).norm(), 1e-15);
  EXPECT_NEAR(model.bodies[0].I_BBcm_B(0, 0), 0.3 + 0.75 * 0.16, 1e-14);  // reduced mass 3/4 kg, 0.4 m apart
  EXPECT_NEAR(model.bodies[0].I_BBcm_B(2, 2), 0.3, 1e-14);
}

}  // namespace
}  // namespace assay
