// SDF files: frames, joints, masses and shapes by the rules of the format; each right value is a closed form or that of
// the same robot written another way.
#include "load/sdf.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "load/mjcf.h"
#include "temp_folder.h"

namespace assay::sdf_files {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

constexpr double kExact = 1e-12;
constexpr const char* kMass =
    "<inertial><mass>2</mass><inertia><ixx>0.2</ixx><iyy>0.3</iyy><izz>0.4</izz></inertia></inertial>";

std::string document(const std::string& model, const std::string& version = "1.9") {
  return fmt::format("<sdf version='{}'>\n<model name='m'>\n{}\n</model></sdf>", version, model);
}

// A base on the world and an arm at (0, 0, 1) on it.
std::string arm(const std::string& joint, const std::string& inside = "", const std::string& version = "1.9") {
  return document(fmt::format("<link name='base'>{0}</link>\n<link name='arm'><pose>0 0 1 0 0 0.5</pose>{0}{1}</link>\n"
                              "<joint name='w' type='fixed'><parent>world</parent><child>base</child></joint>\n{2}",
                              kMass, inside, joint),
                  version);
}

std::string joint(const std::string& type, const std::string& inside) {
  return fmt::format("<joint name='j' type='{}'><parent>base</parent><child>arm</child>{}</joint>", type, inside);
}

Model loaded(const std::string& text, const LoadOptions& options = {}) { return load_model_text(text, "m", options); }

std::string refusal_of(const std::string& text, const LoadOptions& options = {}) {
  const LoadReport report = inspect_model_text(text, "m", options);
  return report.model || report.problems.empty() ? "" : problem_text(report.problems.front());
}

int index_of(const Model& model, const std::string& body) {
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    if (model.bodies[i].name == body) return static_cast<int>(i);
  }
  return -1;
}

// Of a body's centre of mass at the start.
Vec3 place(const Model& model, const std::string& body) {
  const int i = index_of(model, body);
  return i < 0 ? Vec3(NAN, NAN, NAN) : model.initial.bodies[static_cast<size_t>(i)].p_WBcm;
}

Vec3 axis_W(const Model& model, size_t number) {
  const Joint& j = model.joints.at(number);
  return model.initial.bodies[static_cast<size_t>(j.body)].q_WB * j.axis_B;
}

// How a coupling's follower depends on its leader, whichever of the two it is solved for.
struct Line {
  double slope = 0, offset = 0;
};
Line line_of(const Model& model, const Coupling& coupling, const std::string& follower) {
  const double c = coupling.terms.at(0).coefficient;
  const bool solved = model.joints[static_cast<size_t>(coupling.joint)].name == follower;
  return solved ? Line{c, coupling.offset} : Line{1 / c, -coupling.offset / c};
}

TEST(Sdf, PosesFollowTheirFrames) {
  const Model model = loaded(document(
      fmt::format("<pose>1 0 0 0 0 0</pose><link name='a'><pose degrees='true'>0 0 1 0 0 90</pose>{0}</link>"
                  "<frame name='f' attached_to='a'><pose>2 0 0 0 0 0</pose></frame>"
                  "<link name='b'><pose relative_to='f' rotation_format='quat_xyzw'>3 0 0 0 0 0 1</pose>{0}</link>",
                  kMass)));
  EXPECT_NEAR((place(model, "a") - Vec3(1, 0, 1)).norm(), 0, kExact);
  EXPECT_NEAR((place(model, "b") - Vec3(1, 5, 1)).norm(), 0, kExact);  // along a's x, which is the model's y
  EXPECT_TRUE(model.bodies.at(0).is_free() && model.bodies.at(1).is_free());
}

TEST(Sdf, PlacementFrameStandsAtThePose) {
  const Model model = loaded(fmt::format(
      "<sdf version='1.9'><model name='m' placement_frame='b'><pose>0 0 5 0 0 0</pose><link name='a'>{0}</link><link "
      "name='b'><pose>0 0 2 0 0 0</pose>{0}</link></model></sdf>",
      kMass));
  EXPECT_NEAR((place(model, "b") - Vec3(0, 0, 5)).norm(), 0, kExact);
  EXPECT_NEAR((place(model, "a") - Vec3(0, 0, 3)).norm(), 0, kExact);
}

TEST(Sdf, NestedModelsHaveScopes) {
  const Model model = loaded(document(
      fmt::format("<link name='a'>{0}</link><model name='n'><pose>0 1 0 0 0 0</pose><link name='a'>{0}</link></model>"
                  "<joint name='j' type='ball'><parent>a</parent><child>n::a</child></joint>",
                  kMass)));
  EXPECT_NEAR((place(model, "n::a") - Vec3(0, 1, 0)).norm(), 0, kExact);
  ASSERT_EQ(model.balls.size(), 1U);
}

TEST(Sdf, AxesAreExpressedInTheirFrames) {
  const std::string axis = "<axis><xyz>1 0 0</xyz></axis>";
  const Vec3 turned(std::cos(0.5), std::sin(0.5), 0);
  EXPECT_NEAR((axis_W(loaded(arm(joint("revolute", axis))), 0) - turned).norm(), 0, 1e-9);
  const std::string in_model = "<axis><xyz expressed_in='__model__'>1 0 0</xyz></axis>";
  EXPECT_NEAR((axis_W(loaded(arm(joint("revolute", in_model))), 0) - Vec3::UnitX()).norm(), 0, 1e-9);
  // 1.4 means the model's frame, 1.5 the joint's
  EXPECT_NEAR((axis_W(loaded(arm(joint("revolute", axis), "", "1.4")), 0) - Vec3::UnitX()).norm(), 0, 1e-9);
  EXPECT_NEAR((axis_W(loaded(arm(joint("revolute", axis), "", "1.5")), 0) - turned).norm(), 0, 1e-9);
}

TEST(Sdf, JointsKeepLimitsSpringsAndMotors) {
  const Model model = loaded(
      arm(joint("prismatic",
                "<axis><xyz>0 0 1</xyz><limit><lower>-0.1</lower><upper>0.2</upper><effort>7</effort></limit><dynamics>"
                "<damping>3</damping><friction>0.5</friction><spring_stiffness>11</spring_stiffness><spring_reference>"
                "0.05</spring_reference></dynamics></axis>")));
  const Joint& j = model.joints.at(0);
  EXPECT_EQ(j.type, JointType::kSlide);
  EXPECT_TRUE(j.limited);
  EXPECT_EQ(j.lower, -0.1);
  EXPECT_EQ(j.upper, 0.2);
  EXPECT_EQ(j.damping, 3);
  EXPECT_EQ(j.dry_friction, 0.5);
  EXPECT_EQ(j.stiffness, 11);
  EXPECT_EQ(j.spring_reference, 0.05);
  ASSERT_EQ(model.actuators.size(), 1U);
  EXPECT_EQ(model.actuators[0].force_upper, 7);
  const std::string passive = "<axis><xyz>0 0 1</xyz><limit><effort>0</effort></limit></axis>";
  EXPECT_TRUE(loaded(arm(joint("revolute", passive))).actuators.empty());
}

TEST(Sdf, EqualLimitsHoldAJointThere) {
  const Model model = loaded(document(fmt::format(
      "<link name='base'>{0}</link><link name='arm'><pose>1 0 0 0 0 0</pose><inertial><pose>1 0 0 0 0 0</pose><mass>2"
      "</mass></inertial></link><joint name='j' type='revolute'><parent>base</parent><child>arm</child><axis><xyz>0 0 1"
      "</xyz><limit><lower>{1}</lower><upper>{1}</upper></limit></axis></joint>",
      kMass, std::numbers::pi / 2)));
  ASSERT_EQ(model.bodies.size(), 1U);
  // the arm's centre, 1 m along its x, has turned about its origin
  EXPECT_NEAR((model.bodies[0].p_BBcm - Vec3(0.5, 0.5, 0)).norm(), 0, 1e-9);
}

TEST(Sdf, ScrewsCoupleTheirSlide) {
  const Model model =
      loaded(arm(joint("screw", "<screw_thread_pitch>0.01</screw_thread_pitch><axis><xyz>0 0 1</xyz></axis>")));
  ASSERT_EQ(model.couplings.size(), 1U);
  EXPECT_NEAR(line_of(model, model.couplings[0], "j_slide").slope, 0.01 / (2 * std::numbers::pi), 1e-15);
  const Model old = loaded(arm(joint("screw", "<thread_pitch>-100</thread_pitch><axis><xyz>0 0 1</xyz></axis>")));
  EXPECT_NEAR(line_of(old, old.couplings.at(0), "j_slide").slope, 0.01, 1e-15);  // rad/m, left-handed
}

TEST(Sdf, UniversalJointsTurnAboutBothAxes) {
  const Model model = loaded(arm(joint("universal", "<axis><xyz>1 0 0</xyz></axis><axis2><xyz>0 1 0</xyz></axis2>")));
  ASSERT_EQ(model.joints.size(), 2U);
  EXPECT_EQ(model.joints[0].name, "j");
  EXPECT_EQ(model.joints[1].name, "j_2");
  EXPECT_NEAR(axis_W(model, 0).dot(axis_W(model, 1)), 0, 1e-9);
}

TEST(Sdf, MimicsAndGearboxesCouple) {
  const std::string two = fmt::format(
      "<link name='tip'>{}</link><joint name='k' type='revolute'><parent>base</parent><child>tip</child><axis><xyz>0 0 "
      "1</xyz>{{}}</axis></joint>",
      kMass);
  const std::string axis = "<axis><xyz>0 0 1</xyz></axis>";
  const std::string mimic =
      "<mimic joint='j'><multiplier>2</multiplier><offset>0.3</offset><reference>0.1</reference></mimic>";
  const Model model = loaded(arm(joint("revolute", axis) + fmt::format(fmt::runtime(two), mimic)));
  ASSERT_EQ(model.couplings.size(), 1U);
  EXPECT_NEAR(line_of(model, model.couplings[0], "k").offset, 0.3 - 2 * 0.1, kExact);
  EXPECT_NEAR(line_of(model, model.couplings[0], "k").slope, 2, kExact);
  EXPECT_EQ(model.actuators.size(), 1U);
  const Model geared =
      loaded(arm(joint("revolute", axis) + fmt::format(fmt::runtime(two), "") +
                 "<joint name='g' type='gearbox'><parent>arm</parent><child>tip</child><gearbox_ratio>3</gearbox_ratio>"
                 "<gearbox_reference_body>base</gearbox_reference_body><axis><xyz>0 0 1</xyz></axis><axis2><xyz "
                 "expressed_in='base'>0 0 1</xyz></axis2></joint>"));
  ASSERT_EQ(geared.couplings.size(), 1U);
  EXPECT_NEAR(line_of(geared, geared.couplings[0], "k").slope, -3, kExact);
}

TEST(Sdf, ASecondParentClosesALoop) {
  const std::string links =
      fmt::format("<link name='a'>{0}</link><link name='b'>{0}</link><link name='c'>{0}</link>", kMass);
  const auto hinge = [](const char* name, const char* type, const char* parent, const char* child) {
    return fmt::format("<joint name='{}' type='{}'><parent>{}</parent><child>{}</child>{}</joint>", name, type, parent,
                       child, std::string(type) == "ball" ? "" : "<axis><xyz>0 1 0</xyz></axis>");
  };
  const std::string tree = links + hinge("1", "revolute", "a", "b") + hinge("2", "revolute", "b", "c");
  EXPECT_EQ(loaded(document(tree + hinge("3", "ball", "a", "c"))).connects.size(), 1U);
  EXPECT_EQ(loaded(document(tree + hinge("3", "revolute", "a", "c"))).connects.size(), 2U);  // two points are a hinge
  EXPECT_EQ(
      loaded(document(tree + "<joint name='3' type='fixed'><parent>a</parent><child>c</child></joint>")).welds.size(),
      1U);
  EXPECT_THAT(refusal_of(document(tree + hinge("3", "prismatic", "a", "c"))), HasSubstr("closes a loop"));
  // no loop: the tree of the second parent is turned over
  const Model turned = loaded(document(links + hinge("1", "revolute", "a", "c") + hinge("2", "revolute", "b", "c")));
  EXPECT_EQ(turned.joints.size(), 2U);
  EXPECT_TRUE(turned.connects.empty());
  EXPECT_EQ(turned.bodies[static_cast<size_t>(index_of(turned, "b"))].parent, index_of(turned, "c"));
  EXPECT_NEAR((axis_W(turned, 1) + Vec3::UnitY()).norm(), 0, 1e-9);  // its coordinate keeps its sign
}

TEST(Sdf, MassComesFromInertialOrShapes) {
  EXPECT_EQ(loaded(document("<link name='a'/>")).bodies.at(0).mass, 1);
  const auto computed = [](const std::string& shape, const std::string& inertial = "<inertial auto='true'/>") {
    return loaded(document(fmt::format("<link name='a'>{}<collision name='c'><pose>1 0 0 0 0 0</pose><density>500"
                                       "</density><geometry>{}</geometry></collision></link>",
                                       inertial, shape)))
        .bodies.at(0);
  };
  const Body box = computed("<box><size>1 2 3</size></box>");
  EXPECT_NEAR(box.mass, 3000, 1e-9);
  EXPECT_NEAR(box.p_BBcm.x(), 1, kExact);
  EXPECT_NEAR(box.I_BBcm_B(0, 0), 3000.0 / 12 * (4 + 9), 1e-6);
  const Body ball =
      computed("<sphere><radius>0.5</radius></sphere>", "<inertial auto='true'><mass>3</mass></inertial>");
  EXPECT_NEAR(ball.mass, 3, kExact);
  EXPECT_NEAR(ball.I_BBcm_B(1, 1), 0.4 * 3 * 0.25, kExact);
  const Body prism = computed(
      "<polyline><point>0 0</point><point>1 0</point><point>1 1</point><point>0 "
      "1</point><height>2</height></polyline>");
  EXPECT_NEAR(prism.mass, 1000, 1e-9);
  EXPECT_NEAR((prism.p_BBcm - Vec3(1.5, 0.5, 1)).norm(), 0, 1e-9);
  EXPECT_NEAR(prism.I_BBcm_B(2, 2), 1000.0 / 12 * 2, 1e-6);
}

TEST(Sdf, LinksOfAModelTouchWhereItSaysSo) {
  const auto pair = [](const std::string& before, const std::string& in_b) {
    const char* ball = "<collision name='c'><geometry><sphere><radius>0.1</radius></sphere></geometry>{}</collision>";
    return document(before + fmt::format("<link name='a'>{0}{1}</link><link name='b'>{0}{2}</link>", kMass,
                                         fmt::format(fmt::runtime(ball), ""), fmt::format(fmt::runtime(ball), in_b)));
  };
  EXPECT_TRUE(loaded(pair("", "")).contacts.empty());
  const std::string low = "<surface><friction><ode><mu>0.3</mu><mu2>0.3</mu2></ode></friction></surface>";
  const Model model = loaded(pair("<self_collide>1</self_collide>", low));
  ASSERT_EQ(model.contacts.size(), 1U);
  EXPECT_EQ(model.contacts[0].friction, 0.3);  // the smaller one
  EXPECT_TRUE(loaded(pair("<self_collide>1</self_collide>",
                          "<surface><contact><collide_bitmask>0x0</collide_bitmask></contact></surface>"))
                  .contacts.empty());
}

TEST(Sdf, AWorldGivesItsModelsAndGravity) {
  const std::string world = fmt::format(
      "<sdf version='1.9'><world name='w'>{{}}<model name='ground'><static>true</static><link name='l'><collision "
      "name='c'><geometry><plane><normal>0 0 1</normal></plane></geometry></collision></link></model><model "
      "name='a'><link name='l'>{0}</link></model>{{}}</world></sdf>",
      kMass);
  const Model one = loaded(fmt::format(fmt::runtime(world), "", ""));
  EXPECT_EQ(one.gravity.z(), -9.8);
  EXPECT_EQ(one.bodies.at(0).name, "l");
  EXPECT_EQ(loaded(fmt::format(fmt::runtime(world), "<gravity>0 0 -1.6</gravity>", "")).gravity.z(), -1.6);
  const std::string two =
      fmt::format(fmt::runtime(world), "", fmt::format("<model name='b'><link name='l'>{}</link></model>", kMass));
  EXPECT_THAT(refusal_of(two), AllOf(HasSubstr("2 models that move: 'a', 'b'"), HasSubstr("--sdf-model")));
  EXPECT_EQ(loaded(two, {.sdf_model = "b"}).bodies.size(), 1U);
  EXPECT_EQ(loaded(two, {.sdf_model = "*"}).bodies.size(), 2U);
  EXPECT_THAT(refusal_of(two, {.sdf_model = "c"}), HasSubstr("no model 'c'"));
}

TEST(Sdf, WhatIsNotReadIsNamed) {
  const Model model = loaded(document(
      fmt::format("<link name='a'>{}<kinematic>1</kinematic></link>\n<plugin name='drive' filename='x'/>", kMass)));
  EXPECT_THAT(model.notes, Contains(HasSubstr("<kinematic> of link 'a' (line 3) is not read")));
  EXPECT_THAT(model.notes, Contains(AllOf(HasSubstr("plugins are left out"), HasSubstr("'drive' (line 4)"))));
}

TEST(Sdf, MistakesHaveASentence) {
  const std::string axis = "<axis><xyz>0 0 1</xyz></axis>";
  EXPECT_THAT(refusal_of("<sdf><model name='m'/></sdf>"), HasSubstr("no version"));
  EXPECT_THAT(refusal_of(document("<link name='a'/>", "1.2")), HasSubstr("1.4 to 1.12"));
  EXPECT_THAT(refusal_of(document("<link name='a'><pose>0 0 x 0 0 0</pose></link>")),
              AllOf(HasSubstr("line 3"), HasSubstr("'0 0 x 0 0 0'"), HasSubstr("6 numbers")));
  EXPECT_THAT(refusal_of(document("<link name='a'/><link name='b'><pose relative_to='aa'/></link>")),
              HasSubstr("'aa'"));
  EXPECT_THAT(refusal_of(document("<link name='a'><pose relative_to='b'/></link><link name='b'><pose "
                                  "relative_to='a'/></link>")),
              HasSubstr("relative to itself"));
  EXPECT_THAT(refusal_of(arm(joint("hinge", axis))), HasSubstr("the type 'hinge'"));
  EXPECT_THAT(refusal_of(arm(joint("revolute", ""))), HasSubstr("has no <axis>"));
  EXPECT_THAT(refusal_of(arm(joint("revolute", "<axis><xyz>0 0 0</xyz></axis>"))), HasSubstr("axis 0 0 0"));
  EXPECT_THAT(refusal_of(arm(joint("revolute", "<axis><xyz>0 0 1</xyz><mimic joint='z'/></axis>"))), HasSubstr("'z'"));
  const std::string flat = "<collision name='c'><geometry><heightmap/></geometry></collision>";
  EXPECT_THAT(refusal_of(arm(joint("revolute", axis), flat)),
              AllOf(HasSubstr("heightmap"), HasSubstr("--drop-unsupported")));
  EXPECT_TRUE(loaded(arm(joint("revolute", axis), flat), {.drop_unsupported = true}).shapes.empty());
  EXPECT_THAT(refusal_of(document("<static>1</static><link name='a'/>")), HasSubstr("nothing in it can move"));
  const std::string thin =
      "<link "
      "name='a'><inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>9</izz></inertia></inertial></link>";
  EXPECT_THAT(refusal_of(document(thin)), AllOf(HasSubstr("no body can have"), HasSubstr("--repair")));
  EXPECT_EQ(refusal_of(document(thin), {.repair = true}), "");
}

class SdfIncludes : public TempFolderTest {
 protected:
  std::string write(const std::string& name, const std::string& text) {
    fs::create_directories((dir_ / name).parent_path());
    std::ofstream(dir_ / name) << text;
    return (dir_ / name).string();
  }
  std::string refusal_in(const std::string& file) {
    const LoadReport report = inspect_model(file);
    return report.model ? "" : problem_text(report.problems.front());
  }
};

TEST_F(SdfIncludes, AreReadFromTheModelsFolderAlone) {
  const std::string part = document(fmt::format("<link name='a'>{}</link>", kMass));
  write("walker/part/model.sdf", part);
  write("walker/part/model.config", "<model><sdf version='1.9'>model.sdf</sdf></model>");
  write("other/model.sdf", part);
  const auto with = [](const std::string& uri, const char* merge = "false") {
    return document(fmt::format("<include merge='{}'><uri>{}</uri><pose>0 0 3 0 0 0</pose></include>", merge, uri));
  };
  const Model model = load_model(write("walker/model.sdf", with("model://part")));
  EXPECT_NEAR((place(model, "m::a") - Vec3(0, 0, 3)).norm(), 0, kExact);
  EXPECT_NEAR((place(load_model(write("walker/model.sdf", with("part", "true"))), "a") - Vec3(0, 0, 3)).norm(), 0,
              kExact);
  EXPECT_THAT(refusal_in(write("walker/model.sdf", with("../other/model.sdf"))),
              HasSubstr("outside the model's folder"));
  EXPECT_THAT(refusal_in(write("walker/model.sdf", with("model.sdf"))), HasSubstr("contains itself"));
  EXPECT_THAT(refusal_in(write("walker/model.sdf", with("model://none"))), HasSubstr("--package none=DIR"));
  EXPECT_THAT(refusal_in(write("walker/model.sdf", with("https://x/y"))), HasSubstr("network"));
}

}  // namespace
}  // namespace assay::sdf_files
