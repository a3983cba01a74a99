// Everything that the loader has to refuse, each with the words that name the element, its line and the remedy.
#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "load/mjcf.h"
#include "message_of.h"

namespace assay {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// The message of the InputError, "" when the text is loaded.
std::string refusal(const std::string& text, const LoadOptions& options = {}) {
  try {
    load_model_text(text, "robot.xml", options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

struct Case {
  const char* name;
  const char* inside;  // of <mujoco>, each element on a line of its own from line 2 on
  std::vector<const char*> words;
};

std::string document(const Case& c) { return fmt::format("<mujoco>\n{}\n</mujoco>\n", c.inside); }

// A body that is fine, for cases about something else.
constexpr const char* kArm =
    "<worldbody><body name='arm'><joint name='elbow'/><geom name='ball' size='0.1'/></body></worldbody>\n";

class Refused : public testing::TestWithParam<Case> {};

TEST_P(Refused, NamesElementLineAndWayOut) {
  const std::string message = refusal(document(GetParam()));
  EXPECT_THAT(message, testing::StartsWith("robot.xml: "));
  for (const char* words : GetParam().words) EXPECT_THAT(message, HasSubstr(words));
  EXPECT_THAT(message, Not(HasSubstr("\n")));
}

const std::vector<Case> kCases = {
    {"NonlinearSpring",
     "<worldbody><body><joint name='j' stiffness='1 2'/><geom size='1'/></body></worldbody>",
     {"joint 'j'", "nonlinear spring", "one number"}},
    {"NonlinearDamping",
     "<worldbody><body><joint name='j' damping='1 2'/><geom size='1'/></body></worldbody>",
     {"joint 'j'", "nonlinear damping", "one number"}},
    {"SpringYield",
     "<worldbody><body><joint name='j' stiffness='1' springyield='0.1'/><geom size='1'/></body></worldbody>",
     {"joint 'j'", "yields", "springyield"}},
    {"LimitMargin",
     "<worldbody><body><joint name='j' range='-10 10' margin='0.2'/><geom size='1'/></body></worldbody>",
     {"joint 'j' (line 2)", "limit margin of 0.2 rad,", "widen the range"}},
    {"GravityCompensation",
     "<worldbody><body name='kite' gravcomp='1'><freejoint/><geom size='1'/></body></worldbody>",
     {"body 'kite' (line 2)", "gravity compensation", "remove gravcomp"}},
    {"PolynomialOfJoints",
     "<worldbody><body><joint name='a'/><geom size='1'/></body><body><joint name='b'/><geom size='1'/></body>"
     "</worldbody>\n<equality>\n<joint name='cam' joint1='a' joint2='b' polycoef='0 1 0.5 0 0'/></equality>",
     {"'cam' (line 4)", "polynomial of higher degree", "give polycoef two numbers", "move independently"}},
    {"TorqueScale",
     "<worldbody><body name='a'><freejoint/><geom size='1'/></body></worldbody>\n<equality>\n<weld name='w' body1='a' "
     "torquescale='0.5'/></equality>",
     {"'w' (line 4) has torquescale=\"0.5\"", "remove torquescale", "make it 0",
      "--drop-unsupported, which holds the orientation rigidly"}},
    {"SpatialTendon",
     "<worldbody><site name='s'/><body><joint name='j'/><geom size='1'/><site name='t' pos='0 0 1'/></body>"
     "</worldbody>\n<tendon><spatial name='cable'><site site='s'/><site site='t'/></spatial></tendon>\n"
     "<actuator><motor name='winch' tendon='cable'/></actuator>",
     {"tendon 'cable' (line 3)", "springs and actuators on the joints", "the actuators that pull on it", "1 more"}},
    {"TendonArmature",
     "<worldbody><body><joint name='j'/><geom size='1'/></body></worldbody>\n"
     "<tendon><fixed name='cable' armature='1'><joint joint='j' coef='1'/></fixed></tendon>",
     {"tendon 'cable' (line 3)", "armature", "give it to the joints"}},
    {"Flex",
     "<worldbody><body name='b'><freejoint/><geom size='1'/></body>\n"
     "<flexcomp name='cloth' type='grid' count='2 2 1' spacing='1 1 1' radius='0.01' dim='2' mass='1'/></worldbody>",
     {"flex 'cloth'", "deformable", "remove it"}},
    {"Density",
     "<option density='1.2' viscosity='0.5'/><worldbody><body><freejoint/><geom size='1'/></body></worldbody>",
     {"a medium with density 1.2 and viscosity 0.5", "set density and viscosity to 0", "drag"}},
    {"Viscosity",
     "<option viscosity='0.1'/><worldbody><body><freejoint/><geom size='1'/></body></worldbody>",
     {"a medium with viscosity 0.1 ", "--drop-unsupported"}},
    {"ContactOverride",
     "<option><flag override='enable'/></option><worldbody><body><freejoint/><geom size='1'/></body></worldbody>",
     {"contact override", "<flag override>"}},
    {"AnisotropicFriction",
     "<worldbody><geom name='floor' type='plane' size='1 1 1'/><body><freejoint/><geom name='skate' size='1'/></body>"
     "</worldbody><contact><pair name='p' geom1='skate' geom2='floor' friction='1 0.1'/></contact>",
     {"'p'", "depends on the direction", "make both equal"}},
    {"PairTwice",
     "<worldbody><geom name='floor' type='plane' size='1 1 1'/><body><freejoint/><geom name='foot' size='1'/></body>"
     "</worldbody><contact><pair geom1='foot' geom2='floor'/><pair name='q' geom1='floor' geom2='foot' "
     "friction='0.3 0.3'/></contact>",
     {"'q'", "another pair names too, with another friction", "remove one"}},
    {"MovingHeightField",
     "<asset><hfield name='h' nrow='2' ncol='2' size='1 1 1 1' elevation='0 0 0 1'/></asset>\n"
     "<worldbody><body><freejoint/><geom size='1'/><geom name='hills' type='hfield' hfield='h'/></body></worldbody>",
     {"'hills'"}},
    {"SingularJoints",
     "<worldbody>\n<body name='wheel'><joint axis='0 0 1'/><joint axis='0 0 1'/><geom size='1'/></body></worldbody>",
     {"body 'wheel' (line 3) has 2 joints in a row", "not all of them move it independently", "remove one"}},
    {"HingeAndBall",
     "<worldbody>\n<body name='eye'><joint axis='0 0 1'/><joint type='ball'/><geom size='1'/></body></worldbody>",
     {"body 'eye' (line 3) has 2 joints in a row"}},
    {"PairMargin",
     "<worldbody><geom name='floor' type='plane' size='1 1 1' margin='0.02'/><body><freejoint/>"
     "<geom name='foot' size='1' margin='0.01'/></body></worldbody>"
     "<contact><pair name='p' geom1='foot' geom2='floor' margin='0.1'/></contact>",
     {"'p'", "contact margin of 0.1 m", "add up to 0.03 m", "give the geoms the margin"}},
    {"Adhesion",
     "<worldbody><geom type='plane' size='1 1 1'/><body><freejoint/><geom name='foot' size='1' adhesion='1'/></body>"
     "</worldbody>",
     {"geom 'foot'", "adhesion"}},
    {"SurfaceVelocity",
     "<worldbody><geom name='belt' type='plane' size='1 1 1' surfacevel='1 0 0 0 0 0'/><body><freejoint/>"
     "<geom size='1'/></body></worldbody>",
     {"geom 'belt'", "surface velocity", "remove surfacevel"}},
    {"Empty", "", {"has no bodies", "name a file with bodies"}},
    {"NothingMoves",
     "<worldbody><geom type='plane' size='1 1 1'/><body><geom size='1'/></body></worldbody>",
     {"nothing in it can move", "<freejoint/>"}},
    {"InfiniteMass",
     "<worldbody><body name='star'><freejoint/><geom size='1e200'/></body></worldbody>",
     {"body 'star'", "positive, finite mass"}},
    {"NotANumber", "<worldbody><body pos='nan 0 0'><freejoint/><geom size='1'/></body></worldbody>", {"NaN"}},
    {"InfinitePosition",
     "<worldbody><body name='far' pos='1e400 0 0'><freejoint/><geom size='1'/></body></worldbody>",
     {"line 2"}},
    {"UnknownElement", "<worldbody>\n<bodi/></worldbody>", {"bodi", "(line 3)", "MJCF does not know"}},
    {"UnknownAttribute", "<worldbody>\n<body colour='red'/></worldbody>", {"'colour'", "(line 3)", "remove it"}},
    {"NotXml", "<worldbody>\n<body></worldbody>", {"(line 3) it is not XML", "<body>", "</body>"}},
    {"MissingInclude", "<include file='nowhere.xml'/>", {"<include> (line 2)", "'nowhere.xml'", "put it there"}},
    {"MasslessBody",
     "<worldbody>\n<body name='ghost'><joint/></body></worldbody>",
     {"body 'ghost' (line 3)", "mass or inertia", "give it an <inertial>"}},
    {"NegativeSize",
     "<worldbody><body><freejoint/>\n<geom size='-1'/></body></worldbody>",
     {"(line 3) has a size that is not positive; make it positive"}},
    {"JointEqualToItself",
     "<worldbody><body><joint name='j'/><geom size='1'/></body></worldbody>\n<equality><joint joint1='j' "
     "joint2='j'/></equality>",
     {"joins 'j' to itself", "(line 3)", "; name two different ones"}},
    {"MissingMeshFile",
     "<asset><mesh name='m' file='nowhere.stl'/></asset><worldbody><body><freejoint/><geom type='mesh' "
     "mesh='m'/></body>"
     "</worldbody>",
     {"mesh 'm' (line 2) is not found", "nowhere.stl"}},
    {"Plugin",
     "<extension><plugin plugin='mujoco.pid'/></extension><worldbody><body><freejoint/><geom "
     "size='1'/></body></worldbody>",
     {"plugin", "(line 2)", "remove it"}},
};

INSTANTIATE_TEST_SUITE_P(Mjcf, Refused, testing::ValuesIn(kCases),
                         [](const testing::TestParamInfo<Case>& test) { return std::string(test.param.name); });

struct ActuatorCase {
  const char* name;
  const char* element;
  const char* words;
};

class RefusedActuator : public testing::TestWithParam<ActuatorCase> {};

TEST_P(RefusedActuator, NamesItWithLineAndWayOut) {
  const std::string text = fmt::format("<mujoco>\n{}<actuator>\n{}\n</actuator></mujoco>", kArm, GetParam().element);
  EXPECT_THAT(refusal(text), AllOf(HasSubstr("actuator 'a' (line 4)"), HasSubstr(GetParam().words)));
}

INSTANTIATE_TEST_SUITE_P(
    Mjcf, RefusedActuator,
    testing::ValuesIn(std::vector<ActuatorCase>{
        {"AffineGain", "<damper name='a' joint='elbow' kv='1' ctrlrange='0 1'/>", "no affine function of control"},
        {"Muscle", "<muscle name='a' joint='elbow' lengthrange='0 1'/>", "is a muscle"},
        {"Body", "<adhesion name='a' body='arm' ctrlrange='0 1'/>", "acts on a body (adhesion)"},
        {"NonlinearDamping", "<motor name='a' joint='elbow' damping='0.1 2'/>", "keeps its linear part"},
        {"Delay", "<motor name='a' joint='elbow' delay='0.1' nsample='4'/>", "has a delay"},
    }),
    [](const testing::TestParamInfo<ActuatorCase>& test) { return std::string(test.param.name); });

// A clamp between a sine and what follows it has no closed form.
TEST(MjcfRefusal, SineOfALimitedActivation) {
  const std::string text = "<mujoco>" + std::string(kArm) +
                           "<custom><numeric name='assay:sine:a' data='1 1 0'/></custom><actuator>"
                           "<position name='a' joint='elbow' timeconst='0.1' {}/></actuator></mujoco>";
  EXPECT_EQ(refusal(fmt::format(fmt::runtime(text), "")), "");
  EXPECT_THAT(refusal(fmt::format(fmt::runtime(text), "ctrlrange='-1 1'")),
              AllOf(HasSubstr("actuator 'a'"), HasSubstr("remove its ctrlrange and actrange, or its dyntype")));
}

TEST(MjcfRefusal, SharedForceLimit) {
  EXPECT_THAT(
      refusal("<mujoco><worldbody><body><joint name='j' actuatorfrcrange='-1 1'/><geom size='1'/></body></worldbody>"
              "<actuator><motor joint='j'/><motor joint='j'/></actuator></mujoco>"),
      AllOf(HasSubstr("joint 'j'"), HasSubstr("give each actuator a forcerange")));
}

TEST(MjcfRefusal, ActuatorOnAFreeJoint) {
  EXPECT_THAT(refusal("<mujoco><worldbody><body><joint name='j' type='free'/><geom size='1'/></body></worldbody>"
                      "<actuator><motor name='rocket' joint='j'/></actuator></mujoco>"),
              AllOf(HasSubstr("actuator 'rocket'"), HasSubstr("only actuators on hinge joints")));
}

TEST(MjcfRefusal, UrdfJointsAndMimic) {
  const std::string links =
      "<robot name='r'><link name='a'/><link name='b'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' "
      "iyy='1' "
      "iyz='0' izz='1'/></inertial></link><link name='c'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' "
      "iyy='1' iyz='0' izz='1'/></inertial></link>";
  const std::string first =
      "<joint name='j1' type='{}'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/>{}</joint>";
  const std::string second =
      "<joint name='j2' type='continuous'><parent link='b'/><child link='c'/><axis xyz='0 0 1'/>{}</joint></robot>";
  const auto robot = [&](const char* type, const char* extra, const char* mimic) {
    return links + fmt::format(fmt::runtime(first), type, extra) + fmt::format(fmt::runtime(second), mimic);
  };
  EXPECT_EQ(refusal(robot("continuous", "", "")), "");
  EXPECT_EQ(refusal(robot("prismatic", "<limit lower='0' upper='1' effort='1' velocity='1'/>", "")), "");
  EXPECT_EQ(refusal(robot("continuous", "<dynamics friction='0.5'/>", "")), "");
  EXPECT_EQ(refusal(robot("continuous", "", "<mimic joint='j1'/>")), "");
  const std::string unknown = robot("continuous", "", "\n<mimic joint='j'/>");
  EXPECT_THAT(refusal(unknown),
              AllOf(HasSubstr("joint 'j2' (line 2) mimics the unknown joint 'j' (did you mean 'j1'?)"),
                    HasSubstr("correct <mimic>, or --drop-unsupported, which removes it")));
  const Model dropped = load_model_text(unknown, "robot.urdf", {.drop_unsupported = true});
  EXPECT_TRUE(dropped.couplings.empty());
  EXPECT_THAT(dropped.notes, testing::Contains(HasSubstr("so that it moves freely")));
}

// A URDF robot: `tip` is what its moving link in line 3 has beside mass, `more` follows the joint in lines 4 and 5.
std::string urdf(const std::string& tip, const std::string& inside, const std::string& more = "") {
  return fmt::format(
      "<robot name='r'>\n<link name='base'/>\n<link name='tip'><inertial><mass value='1'/><inertia ixx='1' ixy='0' "
      "ixz='0' iyy='1' iyz='0' izz='1'/></inertial>{}</link>\n<joint name='j' type='continuous'><parent link='base'/>"
      "<child link='tip'/>\n{}</joint>\n{}</robot>",
      tip, inside, more);
}

TEST(MjcfRefusal, UrdfSizesThatAreNotPositive) {
  const auto with = [](const char* shape) {
    return refusal(urdf(fmt::format("<collision><geometry><{}/></geometry></collision>", shape), ""));
  };
  EXPECT_EQ(with("sphere radius='0.1'"), "");
  EXPECT_EQ(with("sphere radius='-.05'"),
            "robot.xml: <sphere> of link 'tip' (line 3) has radius=\"-.05\"; give a positive number, or "
            "--drop-unsupported, which leaves it out");
  EXPECT_THAT(with("box size='1 -1 1'"), HasSubstr("<box> of link 'tip' (line 3) has size=\"1 -1 1\"; give positive"));
  EXPECT_EQ(with("cylinder radius='1' length='0'"), "");  // it has no volume and is left out
}

TEST(MjcfRefusal, UrdfLoopJoint) {
  const std::string text = urdf("", "", "<loop_joint name='l' type='ball'><link1 link='tip'/></loop_joint>");
  EXPECT_THAT(refusal(text), AllOf(HasSubstr("loop_joint 'l' (line 6) closes a loop of links"),
                                   HasSubstr("MJCF with a <connect> or <weld>"), HasSubstr("--drop-unsupported")));
  const Model dropped = load_model_text(text, "robot.urdf", {.drop_unsupported = true});
  EXPECT_THAT(dropped.notes, testing::Contains(HasSubstr("loop_joint 'l' closes a loop of links and is left out")));
}

TEST(MjcfRefusal, UrdfMimicsInACircle) {
  const std::string other =
      "<link name='top'><inertial><mass value='1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' "
      "izz='1'/></inertial>"
      "</link>\n<joint name='k' type='continuous'><parent link='tip'/><child link='top'/>{}</joint>";
  const auto robot = [&](const char* of_j, const char* of_k) {
    return urdf("", of_j, fmt::format(fmt::runtime(other), of_k));
  };
  EXPECT_EQ(refusal(robot("", "<mimic joint='j'/>")), "");
  EXPECT_THAT(
      refusal(robot("<mimic joint='j'/>", "")),
      AllOf(HasSubstr("joint 'j' (line 5) mimics itself; name another joint"), HasSubstr("--drop-unsupported")));
  const std::string circle = robot("<mimic joint='k' multiplier='2' offset='0.5'/>", "<mimic joint='j'/>");
  EXPECT_THAT(refusal(circle),
              AllOf(HasSubstr("joint 'j' (line 5) mimics itself by way of 'k'; remove <mimic> from one"),
                    Not(HasSubstr("more;"))));
  // a joint beside the circle is none of it
  EXPECT_THAT(refusal(robot("<mimic joint='k'/>", "<mimic joint='k'/>")),
              HasSubstr("joint 'k' (line 7) mimics itself;"));
  const Model dropped = load_model_text(circle, "robot.urdf", {.drop_unsupported = true});
  EXPECT_EQ(dropped.couplings.size(), 1U);
  EXPECT_EQ(dropped.joints.at(dropped.couplings.at(0).joint).name, "k");
}

// Every problem is found, each with its element, and the exception counts the others.
TEST(MjcfRefusal, AllProblemsAtOnce) {
  const std::string text =
      "<mujoco><option density='1'/><worldbody>\n<body name='a' gravcomp='1'><joint name='j' damping='1 2'/>"
      "<geom size='1'/></body>\n<body name='b' gravcomp='0.5'/></worldbody>\n"
      "<actuator><muscle name='m' joint='j' lengthrange='0 1'/></actuator></mujoco>";
  const LoadReport report = inspect_model_text(text, "robot.xml");
  EXPECT_FALSE(report.model.has_value());
  std::vector<std::pair<std::string, int>> elements;
  for (const Problem& problem : report.problems) {
    EXPECT_EQ(problem.severity, Severity::kRefused);
    EXPECT_FALSE(problem.mend.empty());
    EXPECT_THAT(problem.option, testing::StartsWith("--drop-unsupported, which "));
    elements.emplace_back(problem.element, problem.line);
  }
  EXPECT_THAT(elements,
              testing::UnorderedElementsAre(std::pair("", 0), std::pair("body 'a'", 2), std::pair("body 'b'", 3),
                                            std::pair("joint 'j'", 2), std::pair("actuator 'm'", 4)));
  EXPECT_THAT(refusal(text), AllOf(testing::StartsWith("robot.xml: "),
                                   testing::EndsWith("(and 4 more; `assay check robot.xml` lists all)")));

  const LoadReport dropped = inspect_model_text(text, "robot.xml", {.drop_unsupported = true});
  const Model model = dropped.model.value_or(Model{});
  EXPECT_EQ(dropped.problems.size(), 5U);
  EXPECT_FALSE(dropped.refused());
  for (const Problem& problem : dropped.problems) {
    EXPECT_EQ(problem.severity, Severity::kLeftOut);
    EXPECT_THAT(model.notes, testing::Contains(problem_text(problem)));
  }
  EXPECT_EQ(model.joints.at(0).damping, 1);
  EXPECT_EQ(model.bodies.size(), 1U);
  EXPECT_TRUE(model.actuators.empty());
}

TEST(MjcfRefusal, InactiveEqualityIsLeftOut) {
  const std::string body = "<worldbody><body name='a'><joint/><geom size='1'/></body></worldbody>";
  EXPECT_EQ(refusal("<mujoco>" + body + "<equality><weld body1='a' active='false'/></equality></mujoco>"), "");
  EXPECT_EQ(load_model_text("<mujoco>" + body + "<equality><weld body1='a'/></equality></mujoco>", "m").welds.size(),
            1U);
}

// ---- files ----------------------------------------------------------------------------------------------------------

std::string file_refusal(const std::string& path) {
  return message_of([&] { load_model(path); });
}

TEST(MjcfRefusal, FilesThatAreNotThere) {
  EXPECT_THAT(file_refusal("/nowhere/robot.xml"), AllOf(HasSubstr("'/nowhere/robot.xml'"), HasSubstr("no file")));
  EXPECT_THAT(file_refusal(""), HasSubstr("no file ''"));
  EXPECT_THAT(file_refusal("/tmp"), AllOf(HasSubstr("'/tmp'"), HasSubstr("is a folder")));
  EXPECT_THAT(file_refusal("/etc/passwd/x"), HasSubstr("no file"));
}

TEST(MjcfRefusal, FilesThatHoldNoModel) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / fmt::format("assay_refusal_{}", ::getpid());
  std::filesystem::create_directories(folder);
  const auto with = [&](const std::string& content) {
    const std::string path = folder / "robot.xml";
    std::ofstream(path, std::ios::binary) << content;
    return file_refusal(path);
  };
  EXPECT_THAT(with(""), AllOf(HasSubstr("robot.xml"), HasSubstr("it is empty")));
  EXPECT_THAT(with(" \n\t\r\n"), HasSubstr("it is empty"));
  EXPECT_THAT(with("<html></html>"), AllOf(HasSubstr("<html>"), HasSubstr("name an MJCF, URDF or SDF file")));
  EXPECT_THAT(with(std::string("\x89PNG\0\1\2", 7)), HasSubstr("binary"));
  EXPECT_THAT(with("<mujoco>\n<worldbody>"), HasSubstr("is not XML"));
  std::filesystem::remove_all(folder);
}

// MuJoCo's parser names neither the included file nor the line.
TEST(MjcfRefusal, FaultsInIncludedFilesHaveTheirPlace) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / fmt::format("assay_included_{}", ::getpid());
  std::filesystem::create_directories(folder);
  const auto with = [&](const std::string& geom) {
    std::ofstream(folder / "part.xml") << "<mujocoinclude><worldbody>\n<body name='b'><freejoint/><geom size='1'/>\n"
                                       << geom << "</body></worldbody></mujocoinclude>";
    std::ofstream(folder / "robot.xml") << "<mujoco><include file='part.xml'/></mujoco>";
    return file_refusal(folder / "robot.xml");
  };
  EXPECT_EQ(with("<geom size='1'/>"), "");
  EXPECT_THAT(with("<geom sise='1'/>"),
              HasSubstr("robot.xml: a geom of body 'b' (part.xml, line 3) has an attribute 'sise'"));
  EXPECT_THAT(with("<geo size='1'/>"), HasSubstr("a geo of body 'b' (part.xml, line 3) is an element"));
  EXPECT_THAT(with("<geom size='1 x'/>"), HasSubstr("a geom of body 'b' (part.xml, line 3) has size=\"1 x\""));
  std::filesystem::remove_all(folder);
}

TEST(MjcfRefusal, FilesThatCannotBeRead) {
  // opens for everybody, root too, and the first read fails
  EXPECT_THAT(file_refusal("/proc/self/mem"), AllOf(HasSubstr("'/proc/self/mem'"), HasSubstr("cannot be read")));
  EXPECT_THAT(file_refusal("/dev/zero"), HasSubstr("is not a file"));
}

TEST(MjcfRefusal, ARefusalLeavesTheNextLoadAlone) {
  EXPECT_NE(refusal("<mujoco><worldbody><body pos='nan 0 0'/></worldbody></mujoco>"), "");
  EXPECT_EQ(refusal(fmt::format("<mujoco>{}</mujoco>", kArm)), "");
}

// What MuJoCo's compiler says no to or cannot compute, where the model does not depend on it.
TEST(MjcfRefusal, WhatNoModelHasDoesNotKeepTheCompilerFromTheRest) {
  // lengths of muscles, by a simulation that does not converge for a joint without limits
  EXPECT_THAT(
      refusal(fmt::format("<mujoco>\n{}<actuator>\n<muscle name='a' joint='elbow'/></actuator></mujoco>", kArm)),
      AllOf(HasSubstr("actuator 'a' (line 4)"), HasSubstr("is a muscle"), HasSubstr("--drop-unsupported")));
  // a limit that its margin leaves nothing of
  const std::string narrow =
      "<mujoco><worldbody><body><joint name='j' type='slide' range='-0.1 0.1' margin='0.2'/><geom size='1'/></body>"
      "</worldbody></mujoco>";
  EXPECT_THAT(refusal(narrow), HasSubstr("--drop-unsupported, which takes the range without the margin"));
  const Model wide = load_model_text(narrow, "r", {.drop_unsupported = true});
  EXPECT_DOUBLE_EQ(wide.joints.at(0).lower, -0.1);
  EXPECT_DOUBLE_EQ(wide.joints.at(0).upper, 0.1);
  // a height field that is not there
  const std::string terrain =
      "<mujoco>\n<asset>\n<hfield name='hills' file='/nowhere/hills.png' size='1 1 1 1'/></asset><worldbody><geom "
      "type='hfield' hfield='hills'/><body><freejoint/><geom size='1'/></body></worldbody></mujoco>";
  EXPECT_THAT(refusal(terrain, {.allow_external_files = true}),
              AllOf(HasSubstr("hfield 'hills' (line 3) is not found (looked for: /nowhere/hills.png)"),
                    HasSubstr("--drop-unsupported, which leaves out its geoms")));
  EXPECT_EQ(load_model_text(terrain, "r", {.drop_unsupported = true, .allow_external_files = true}).dof(), 6);
}

// MuJoCo 3 had it at the geom, MuJoCo 4 has it at the mesh.
TEST(MjcfRefusal, ShellsOfMeshes) {
  const auto text = [](const char* mesh, const char* geom) {
    return fmt::format(
        "<mujoco><asset><mesh name='m' vertex='0 0 0 1 0 0 0 1 0 0 0 1' face='0 2 1 0 1 3 0 3 2 1 2 3' {}/></asset>"
        "<worldbody><body><freejoint/><geom type='mesh' mesh='m' {}/></body></worldbody></mujoco>",
        mesh, geom);
  };
  const Model model = load_model_text(text("", "shellinertia='true'"), "r");
  const Model shell = load_model_text(text("inertia='shell'", ""), "r");
  EXPECT_DOUBLE_EQ(model.total_mass(), shell.total_mass());
  EXPECT_EQ(model.bodies.at(0).I_BBcm_B, shell.bodies.at(0).I_BBcm_B);
  EXPECT_NE(model.total_mass(), load_model_text(text("", ""), "r").total_mass());
  EXPECT_THAT(model.notes, testing::Contains(HasSubstr("shellinertia of mesh geoms")));
}

// Whatever is wrong with a deformable body, it is left out.
TEST(MjcfRefusal, DeformableBodiesThatCannotBeRead) {
  const std::string text = fmt::format(
      "<mujoco>\n<worldbody>\n<flexcomp name='cloth' type='grid' count='0 1 1' spacing='1 1 1'><edge "
      "equality='vertices'/></flexcomp></worldbody>{}</mujoco>",
      kArm);
  EXPECT_THAT(refusal(text), AllOf(HasSubstr("(line 3)"), HasSubstr("--drop-unsupported")));
  EXPECT_EQ(load_model_text(text, "r", {.drop_unsupported = true}).dof(), 1);
  // its points lie between nodes, which alone have bodies
  const std::string between = fmt::format(
      "<mujoco>\n<worldbody><flexcomp name='soft' type='grid' dim='3' count='3 3 3' spacing='.1 .1 .1' mass='1' "
      "radius='0.01' dof='trilinear'/></worldbody>{}</mujoco>",
      kArm);
  EXPECT_THAT(refusal(between), AllOf(HasSubstr("flex 'soft'"), HasSubstr("--drop-unsupported")));
  EXPECT_EQ(load_model_text(between, "r", {.drop_unsupported = true}).dof(), 1);
}

}  // namespace
}  // namespace assay
