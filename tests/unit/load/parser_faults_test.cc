// What MuJoCo's parser and compiler refuse, in words of ours: each of the usual mistakes with its element, its line and
// the way out, and the same file once that way was taken.
#include "load/parser_faults.h"

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "load/mjcf.h"
#include "temp_folder.h"

namespace assay {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

std::string refusal_of(const LoadReport& report) {
  std::string all;
  for (const Problem& problem : report.problems) {
    if (problem.severity == Severity::kRefused) all += (all.empty() ? "" : " / ") + problem_text(problem);
  }
  return all;
}

struct Mistake {
  const char* name;
  const char* wrong;  // inside <mujoco>, from line 2 on
  const char* says;   // how the refusal begins
  const char* advice;
  const char* right;  // what follows the advice
};

// A body that is fine; line 2.
#define ARM "<worldbody><body name='arm'><joint name='elbow'/><geom name='ball' size='0.1'/></body></worldbody>\n"
#define BODY(inside) "<worldbody>\n<body name='arm'>" inside "</body></worldbody>"
#define BALL "<freejoint/><geom name='ball' size='0.1'/>"

const std::vector<Mistake> kMistakes = {
    {"MisspelledAttribute", BODY("<freejoint/><geom name='ball' sise='0.1'/>"),
     "geom 'ball' (line 3) has an attribute 'sise'", "did you mean 'size'?", BODY(BALL)},
    {"UnknownElement",
     "<worldbody>\n<bodi/>\n"
     "<body><freejoint/><geom size='1'/></body></worldbody>",
     "a bodi of the world (line 3) is an element that MJCF does not know there", "remove it",
     "<worldbody><body><freejoint/><geom size='1'/></body></worldbody>"},
    {"NotANumber", BODY("<freejoint/><geom name='ball' size='0.1 x'/>"), "geom 'ball' (line 3) has size=\"0.1 x\"",
     "give numbers", BODY(BALL)},
    {"Commas", BODY("<freejoint/><geom name='ball' size='0.1' pos='0,0,1'/>"), "geom 'ball' (line 3) has pos=\"0,0,1\"",
     "blanks between them", BODY("<freejoint/><geom name='ball' size='0.1' pos='0 0 1'/>")},
    {"TooFewNumbers", "<worldbody>\n<body name='arm' pos='1 2'>" BALL "</body></worldbody>",
     "body 'arm' (line 3) has pos=\"1 2\", which has too few numbers", "all of the numbers",
     "<worldbody>\n<body name='arm' pos='1 2 0'>" BALL "</body></worldbody>"},
    {"TooManyNumbers", "<worldbody>\n<body name='arm' pos='1 2 3 4'>" BALL "</body></worldbody>",
     "body 'arm' (line 3) has pos=\"1 2 3 4\", which has too many numbers", "only the numbers",
     "<worldbody>\n<body name='arm' pos='1 2 3'>" BALL "</body></worldbody>"},
    {"Keyword", BODY("<joint name='j' type='revolute'/><geom size='0.1'/>"), "joint 'j' (line 3) has type=\"revolute\"",
     "free, ball, slide or hinge", BODY("<joint name='j' type='hinge'/><geom size='0.1'/>")},
    {"KeywordOfOption", "<option integrator='rk4'/>\n" ARM, "<option> (line 2) has integrator=\"rk4\"",
     "Euler, RK4, implicit or implicitfast", "<option integrator='RK4'/>\n" ARM},
    {"TooLarge", BODY("<joint name='j' damping='1e999'/><geom size='0.1'/>"),
     "joint 'j' (line 3) has damping=\"1e999\"", "smaller number",
     BODY("<joint name='j' damping='1'/><geom size='0.1'/>")},
    {"ZeroQuaternion", "<worldbody>\n<body name='arm' quat='0 0 0 0'>" BALL "</body></worldbody>",
     "body 'arm' (line 3) has a quaternion of length zero", "1 0 0 0",
     "<worldbody>\n<body name='arm' quat='1 0 0 0'>" BALL "</body></worldbody>"},
    {"TwoOrientations", "<worldbody>\n<body name='arm' quat='1 0 0 0' euler='0 0 0'>" BALL "</body></worldbody>",
     "body 'arm' (line 3) has more than one of quat", "keep one",
     "<worldbody>\n<body name='arm' quat='1 0 0 0'>" BALL "</body></worldbody>"},
    {"JointOfTheWorld", "<worldbody>\n<joint name='j'/></worldbody>", "joint 'j' (line 3) is an element of the world",
     "<body>", BODY("<joint name='j'/><geom size='0.1'/>")},
    {"UnknownClass", BODY("<freejoint/><geom name='ball' class='big' size='0.1'/>"),
     "geom 'ball' (line 3) names the class 'big'", "correct the name", BODY(BALL)},
    {"TwoInertials",
     BODY("<freejoint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>"
          "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>"),
     "body 'arm' (line 3) has 2 elements <inertial>", "keep one",
     BODY("<freejoint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>")},
    {"RepeatedName",
     "<worldbody><body name='a'>" BALL "</body>\n<body name='a'><freejoint/><geom size='1'/></body></worldbody>",
     "body 'a' (line 3) has the name of another body", "rename",
     "<worldbody><body name='a'>" BALL "</body>\n<body name='b'><freejoint/><geom size='1'/></body></worldbody>"},
    {"MissingModel", "<worldbody>\n<attach model='gripper' body='hand' prefix='l_'/></worldbody>",
     "an attach of the world (line 3) names the model 'gripper'", "<model>", ARM},
    // of the compiler
    {"MissingMass", BODY("<joint name='j'/>"), "body 'arm' (line 3) moves, and its mass or inertia is not positive",
     "<inertial>", BODY("<joint name='j'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>")},
    {"NegativeMass", BODY("<freejoint/><inertial pos='0 0 0' mass='-1' diaginertia='1 1 1'/>"),
     "body 'arm' (line 3) moves, and its mass or inertia is not positive", "<inertial>",
     BODY("<freejoint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>")},
    {"NoSize", BODY("<freejoint/><geom name='ball'/>"), "geom 'ball' (line 3) has a size that is not positive",
     "positive", BODY(BALL)},
    {"PlaneWithoutSize", "<worldbody>\n<geom name='floor' type='plane'/><body>" BALL "</body></worldbody>",
     "geom 'floor' (line 3) has a third size", "0 0 1",
     "<worldbody>\n<geom name='floor' type='plane' size='0 0 1'/><body>" BALL "</body></worldbody>"},
    {"PlaneThatMoves", BODY("<freejoint/><geom name='floor' type='plane' size='1 1 1'/>"),
     "geom 'floor' (line 3) is a plane on a body that moves", "thin box",
     BODY("<freejoint/><geom name='floor' type='box' size='1 1 0.01'/>")},
    {"MissingMesh", BODY("<freejoint/><geom name='g' type='mesh' mesh='no'/>"), "geom 'g' (line 3) names the mesh 'no'",
     "correct the name", BODY(BALL)},
    {"MissingMaterial", BODY("<freejoint/><geom name='g' size='1' material='no'/>"),
     "geom 'g' (line 3) names the material 'no'", "remove it", BODY("<freejoint/><geom name='g' size='1'/>")},
    {"LimitedWithoutRange", BODY("<joint name='j' limited='true'/><geom size='0.1'/>"),
     "joint 'j' (line 3) is limited, and its range", "lower bound first",
     BODY("<joint name='j' limited='true' range='-1 1'/><geom size='0.1'/>")},
    {"FreeJointBelow", BODY("<joint/><geom size='0.1'/><body name='in'><freejoint/><geom size='0.1'/></body>"),
     "body 'in' (line 3) has a free joint and lies in another body", "<worldbody>",
     BODY("<joint/><geom size='0.1'/>") "<worldbody><body name='in'><freejoint/><geom size='0.1'/></body></worldbody>"},
    {"FreeJointAndHinge", BODY("<freejoint/><joint/><geom size='0.1'/>"), "body 'arm' (line 3) has a free joint with",
     "alone", BODY("<freejoint/><geom size='0.1'/>")},
    {"ZeroAxis", BODY("<joint name='j' axis='0 0 0'/><geom size='0.1'/>"),
     "joint 'j' (line 3) has an axis of length zero", "0 0 1",
     BODY("<joint name='j' axis='0 0 1'/><geom size='0.1'/>")},
    {"MissingTarget", ARM "<actuator>\n<motor name='m' joint='no'/></actuator>", "motor 'm' (line 4) acts on 'no'",
     "correct the name", ARM "<actuator>\n<motor name='m' joint='elbow'/></actuator>"},
    {"NoTarget", ARM "<actuator>\n<motor name='m'/></actuator>", "motor 'm' (line 4) acts on nothing", "joint=\"NAME\"",
     ARM "<actuator>\n<motor name='m' joint='elbow'/></actuator>"},
    {"MissingBodyOfWeld", ARM "<equality>\n<weld name='w' body1='no'/></equality>", "weld 'w' (line 4) names 'no'",
     "correct the name", ARM "<equality>\n<weld name='w' body1='arm'/></equality>"},
    {"MissingBodyOfExclude", ARM "<contact>\n<exclude name='e' body1='arm' body2='no'/></contact>",
     "exclude 'e' (line 4) names the body 'no'", "remove it", ARM},
    {"MissingJointOfTendon", ARM "<tendon>\n<fixed name='t'><joint joint='no' coef='1'/></fixed></tendon>",
     "fixed 't' (line 4) names the joint 'no'", "correct the name",
     ARM "<tendon>\n<fixed name='t'><joint joint='elbow' coef='1'/></fixed></tendon>"},
    {"SensorOfNothing", ARM "<sensor>\n<jointpos name='s' joint='no'/></sensor>", "jointpos 's' (line 4) names 'no'",
     "remove the sensor", ARM},
    {"KeyframeOfAnotherSize", ARM "<keyframe>\n<key name='home' qpos='1 2'/></keyframe>",
     "key 'home' (line 4) has a number of qpos that is not the model's 1", "give 1 numbers",
     ARM "<keyframe>\n<key name='home' qpos='1'/></keyframe>"},
    {"OnePointTwice", BODY("<freejoint/><geom name='g' type='capsule' size='0.1' fromto='0 0 0 0 0 0'/>"),
     "geom 'g' (line 3) has a fromto with one point twice", "two different points",
     BODY("<freejoint/><geom name='g' type='capsule' size='0.1' fromto='0 0 0 0 0 1'/>")},
    {"FlatMesh",
     "<asset>\n<mesh name='m' vertex='0 0 0 1 0 0 0 1 0 1 1 0'/></asset><worldbody><body><freejoint/><geom type='mesh' "
     "mesh='m'/></body></worldbody>",
     "mesh 'm' (line 3) is flat", "thickness",
     "<asset>\n<mesh name='m' vertex='0 0 0 1 0 0 0 1 0 0 0 1'/></asset><worldbody><body><freejoint/><geom type='mesh' "
     "mesh='m'/></body></worldbody>"},
    {"ThreeVertices",
     "<asset>\n<mesh name='m' vertex='0 0 0 1 0 0 0 1 0'/></asset><worldbody><body><freejoint/><geom type='mesh' "
     "mesh='m'/></body></worldbody>",
     "mesh 'm' (line 3) has fewer than four vertices", "give it four",
     "<asset>\n<mesh name='m' vertex='0 0 0 1 0 0 0 1 0 0 0 1'/></asset><worldbody><body><freejoint/><geom type='mesh' "
     "mesh='m'/></body></worldbody>"},
    {"HeightFieldOfNoSize", "<asset>\n<hfield name='h' nrow='2' ncol='2' size='1 1 0 1'/></asset>" ARM,
     "hfield 'h' (line 3) has a size that is not positive", "four positive",
     "<asset>\n<hfield name='h' nrow='2' ncol='2' size='1 1 1 1'/></asset>" ARM},
    {"DeformableOfNothing", "<worldbody>\n<flexcomp name='f' type='grid' count='0 0 0' dim='2'/></worldbody>",
     "flexcomp 'f' (line 3) is a deformable body", "remove it", ARM},
    {"DeformableOfNoFile", BODY(BALL "<flexcomp name='f' type='mesh' dim='2' file='no.obj'/>"),
     "flexcomp 'f' (line 3) names the file", "put it there", BODY(BALL)},
    {"UserData", "<size nuser_geom='1'/>\n" BODY("<freejoint/><geom name='g' size='1' user='1 2 3'/>"),
     "geom 'g' (line 4) has more user values", "enlarge nuser_geom",
     "<size nuser_geom='3'/>\n" BODY("<freejoint/><geom name='g' size='1' user='1 2 3'/>")},
    // no XML
    {"NotClosed", "<worldbody>\n<body name='arm'>" BALL "</worldbody>", "(line 3) it is not XML: the element <body>",
     "</body>", BODY(BALL)},
    {"Unquoted", "<worldbody>\n<body name=arm>" BALL "</body></worldbody>",
     "(line 3) it is not XML: the element <body>", "in quotes", BODY(BALL)},
    {"CommentThatDoesNotEnd", "<!-- here\n" ARM, "(line 2) it is not XML: a comment", "-->", "<!-- here -->\n" ARM},
};

class Mistakes : public testing::TestWithParam<Mistake> {};

std::string document_with(const std::string& inside) { return "<mujoco>\n" + inside + "\n</mujoco>\n"; }

TEST_P(Mistakes, HaveElementLineAndAWayOutThatWorks) {
  const std::string words = refusal_of(inspect_model_text(document_with(GetParam().wrong), "robot.xml"));
  EXPECT_THAT(words, AllOf(StartsWith(GetParam().says), HasSubstr(GetParam().advice)));
  EXPECT_EQ(refusal_of(inspect_model_text(document_with(GetParam().right), "robot.xml")), "");
}

INSTANTIATE_TEST_SUITE_P(Mjcf, Mistakes, testing::ValuesIn(kMistakes),
                         [](const testing::TestParamInfo<Mistake>& test) { return std::string(test.param.name); });

TEST(ParserFaults, WhatNoTableHasKeepsMujocosWordsWithoutItsNumbers) {
  const std::string text = document_with(BODY("<joint name='j'/>"));
  const Problem problem = parser_problem(
      "Error: something new is below mjMINVAL (id = 7) in joint\nElement name 'j', id 7, line 3", text, "");
  EXPECT_EQ(
      problem_text(problem),
      "joint 'j' (line 3) is not valid in MuJoCo: something new is below 1e-15; correct it, or remove the element");
}

TEST(ParserFaults, OtherFormsOfFilesAreNamed) {
  const auto words = [](const std::string& text) { return refusal_of(inspect_model_text(text, "robot.xml")); };
  const std::string model = document_with(ARM);
  std::string wide = "\xff\xfe";
  for (const char c : model) wide += std::string(1, c) + '\0';
  EXPECT_THAT(words(wide), AllOf(HasSubstr("UTF-16"), HasSubstr("iconv -f UTF-16 -t UTF-8")));
  EXPECT_THAT(words(wide.substr(2)), HasSubstr("iconv -f UTF-16LE"));
  EXPECT_THAT(words("\xef\xbb\xbf" + model), "");  // UTF-8 with its mark
  EXPECT_THAT(words(std::string("\x47\0\0\0MJB", 7)), AllOf(HasSubstr("binary"), HasSubstr(".mjb")));
  EXPECT_THAT(words("PK\x03\x04zip"), AllOf(HasSubstr("archive"), HasSubstr("unpack it")));
  EXPECT_THAT(words("robot:\n  name: arm\n"), AllOf(HasSubstr("XML"), Not(HasSubstr("ErrorID"))));
}

using ParserFaultsInFiles = TempFolderTest;

TEST_F(ParserFaultsInFiles, OfIncludedAndAttachedFilesHaveTheirPlace) {
  const auto write = [&](const std::string& name, const std::string& text) {
    std::filesystem::create_directories((dir_ / name).parent_path());
    std::ofstream(dir_ / name) << text;
    return (dir_ / name).string();
  };
  const std::string robot =
      write("cell.xml", document_with("<asset><model name='arm' file='arm/arm.xml'/></asset>"
                                      "<worldbody><attach model='arm' prefix='a_'/></worldbody>"));
  const auto with = [&](const char* body) {
    write("arm/arm.xml", document_with(fmt::format("<worldbody>\n{}</worldbody>", body)));
    return refusal_of(inspect_model(robot));
  };
  EXPECT_EQ(with("<body name='b'><freejoint/><geom size='1'/></body>"), "");
  EXPECT_THAT(with("<body name='b'><freejoint/>\n<geom name='g' sise='1'/></body>"),
              StartsWith("geom 'g' (arm/arm.xml, line 4) has an attribute 'sise'"));
  EXPECT_THAT(with("<body name='b'><freejoint/>\n<geom name='g' size='-1'/></body>"),
              StartsWith("geom 'g' (arm/arm.xml, line 4) has a size"));
  EXPECT_THAT(with("<body name='b'><freejoint/>\n<inertial pos='0 0 0' mass='1' diaginertia='1 1 -1'/></body>"),
              AllOf(StartsWith("body 'b' (arm/arm.xml, line 4) has an inertia that is not positive"),
                    HasSubstr("give --repair, or"), HasSubstr("assay check arm/arm.xml --repair OUT")));
  const LoadReport repaired = inspect_model(robot, {.repair = true});
  ASSERT_TRUE(repaired.model) << refusal_of(repaired);
  EXPECT_THAT(repaired.model->notes,
              Contains(AllOf(HasSubstr("repaired: body 'b'"), HasSubstr("(arm/arm.xml, line 4)"))));
  EXPECT_THAT(with("<body name='b'>"), StartsWith("the file 'arm/arm.xml' (line 3) is not XML"));
}

// Of other versions of MuJoCo, or misspelled: what is left keeps its lines.
TEST(ParserFaults, WhatMjcfDoesNotKnowCanBeLeftOut) {
  const std::string text = document_with(
      "<worldbody>\n<body name='arm' colour='red\n'><joint name='elbow' slack='1' damping='2'/><geom name='ball' "
      "size='0.1'/>"
      "<skin>\n<bone/> <!-- </skin> --> </skin>\n<composite/></body>\n<body name='lid' gravcomp='1'/></worldbody>");
  const LoadReport refused = inspect_model_text(text, "r.xml");
  EXPECT_THAT(refusal_of(refused), AllOf(StartsWith("body 'arm' (line 3) has an attribute 'colour'"),
                                         HasSubstr("--drop-unsupported, which ignores it")));
  const LoadReport loaded = inspect_model_text(text, "r.xml", {.drop_unsupported = true});
  ASSERT_TRUE(loaded.model) << refusal_of(loaded);
  EXPECT_EQ(loaded.model->dof(), 1);
  EXPECT_EQ(loaded.model->joints.at(0).damping, 2);
  std::string all;
  for (const Problem& problem : loaded.problems) all += problem_text(problem) + "\n";
  EXPECT_THAT(all, AllOf(HasSubstr("body 'arm' (line 3) has an attribute 'colour'"),
                         HasSubstr("joint 'elbow' (line 4) has an attribute 'slack', which MJCF does not know there: "
                                   "--drop-unsupported ignores it"),
                         HasSubstr("a skin of body 'arm' (line 4) is an element that MJCF does not know"),
                         HasSubstr("a composite of body 'arm' (line 6) is an element that MJCF does not know"),
                         HasSubstr("body 'lid' (line 7)")));
  EXPECT_THAT(loaded.model->notes, Contains(HasSubstr("'slack'")));
}

TEST(ParserFaults, PluginsCanBeLeftOutWithWhatUsesThem) {
  const std::string text = document_with(
      "<extension><plugin plugin='mujoco.pid'><instance name='pid'/></plugin><plugin plugin='mujoco.sdf.nut'/>"
      "</extension>\n<asset><mesh name='nut'><plugin plugin='mujoco.sdf.nut'/></mesh></asset>\n<worldbody><body "
      "name='arm'><joint name='elbow'/><geom name='ball' size='0.1'/><geom type='sdf' mesh='nut' name='nut'><plugin "
      "plugin='mujoco.sdf.nut'/></geom></body></worldbody>\n<actuator><plugin name='a' joint='elbow' "
      "plugin='mujoco.pid' "
      "instance='pid'/><motor name='m' joint='elbow' ctrlrange='-1 1'/></actuator>");
  EXPECT_THAT(refusal_of(inspect_model_text(text, "r.xml")), HasSubstr("--drop-unsupported"));
  const LoadReport loaded = inspect_model_text(text, "r.xml", {.drop_unsupported = true});
  ASSERT_TRUE(loaded.model) << refusal_of(loaded);
  EXPECT_THAT(loaded.model->actuators, testing::SizeIs(1));
  EXPECT_THAT(loaded.model->shapes, testing::SizeIs(1));
  EXPECT_THAT(loaded.model->notes, Contains(HasSubstr("plugin 'a' (line 5) is a plugin, which is not supported")));
}

TEST_F(ParserFaultsInFiles, WhatIncludedFilesHaveTooMuchCanBeLeftOut) {
  const auto write = [&](const std::string& name, const std::string& text) {
    std::filesystem::create_directories((dir_ / name).parent_path());
    std::ofstream(dir_ / name) << text;
    return (dir_ / name).string();
  };
  write("parts/arm.xml",
        "<mujoco><worldbody>\n<body name='arm'><joint name='elbow' slack='1'/><geom size='1' slack='2'/>"
        "</body></worldbody></mujoco>");
  const std::string robot = write("robot.xml", document_with("<include file='parts/arm.xml'/>"));
  EXPECT_THAT(refusal_of(inspect_model(robot)),
              AllOf(StartsWith("joint 'elbow' (parts/arm.xml, line 2) has an attribute 'slack'"),
                    HasSubstr("--drop-unsupported")));
  const LoadReport loaded = inspect_model(robot, {.drop_unsupported = true});
  ASSERT_TRUE(loaded.model) << refusal_of(loaded);
  EXPECT_EQ(loaded.model->dof(), 1);
  EXPECT_THAT(loaded.problems, testing::SizeIs(2));
}

// As of a URDF file; without the switch the file is refused (MjcfRefusal).
TEST(ParserFaults, MissingMeshesThatCollideCanBeLeftOut) {
  const std::string text = document_with(
      "<asset><mesh name='m' file='nowhere.stl'/></asset><worldbody><geom name='floor' type='plane' size='1 1 "
      "1'/><body>"
      "<freejoint/><geom size='1'/><geom name='shell' type='mesh' mesh='m'/></body></worldbody><contact><pair "
      "geom1='shell' geom2='floor'/></contact>");
  EXPECT_THAT(refusal_of(inspect_model_text(text, "r.xml")),
              HasSubstr("--drop-unsupported, which leaves out its geom, which has no contact and no mass then"));
  const LoadReport loaded = inspect_model_text(text, "r.xml", {.drop_unsupported = true});
  ASSERT_TRUE(loaded.model) << refusal_of(loaded);
  EXPECT_THAT(loaded.model->shapes, testing::SizeIs(2));
  EXPECT_THAT(loaded.model->notes, Contains(AllOf(HasSubstr("mesh 'm' (line 2)"), HasSubstr("leaves out its geom"))));
}

}  // namespace
}  // namespace assay
