// Everything that the loader has to refuse, each with the words that name the element, its line and the remedy.
#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "model/mjcf.h"

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
    {"SlideJoint",
     "<worldbody><body name='cart'>\n<joint name='rail' type='slide'/>\n<geom size='1'/></body></worldbody>",
     {"joint 'rail' (line 3)", "slide joint", "replace it or remove it"}},
    {"BallJoint",
     "<worldbody><body name='arm'><joint type='ball'/><geom size='1'/></body></worldbody>",
     {"the joint of body 'arm' (line 2)", "ball joint", "three hinges"}},
    {"TwoJoints",
     "<worldbody><body name='arm'><joint axis='1 0 0'/><joint axis='0 1 0'/><geom size='1'/></body></worldbody>",
     {"body 'arm' (line 2) has 2 joints", "put a body of its own"}},
    {"Box",
     "<worldbody><body><freejoint/>\n<geom name='crate' type='box' size='1 1 1'/></body></worldbody>",
     {"geom 'crate' (line 3) is of type box", R"(contype="0" conaffinity="0")", "--drop-unsupported"}},
    {"UnnamedCylinder",
     "<worldbody><body name='b'><freejoint/><geom size='1'/><geom type='cylinder' size='1 1'/></body></worldbody>",
     {"geom 2 of body 'b' (line 2) is of type cylinder"}},
    {"Ellipsoid",
     "<worldbody><body><freejoint/><geom type='ellipsoid' size='1 2 3'/></body></worldbody>",
     {"is of type ellipsoid"}},
    {"Mesh",
     "<asset><mesh name='m' vertex='0 0 0 1 0 0 0 1 0 0 0 1'/></asset>\n"
     "<worldbody><body><freejoint/><geom name='hull' type='mesh' mesh='m'/></body></worldbody>",
     {"geom 'hull' (line 3) is of type mesh"}},
    {"HeightField",
     "<asset><hfield name='h' nrow='2' ncol='2' size='1 1 1 1' elevation='0 0 0 1'/></asset>\n"
     "<worldbody><geom name='hills' type='hfield' hfield='h'/><body><freejoint/><geom size='1'/></body></worldbody>",
     {"geom 'hills' (line 3) is of type height field"}},
    {"BoxOfAPair",
     "<worldbody><body><freejoint/><geom name='crate' type='box' size='1 1 1' contype='0' conaffinity='0'/></body>"
     "<geom name='floor' type='plane' size='1 1 1'/></worldbody><contact><pair geom1='crate' geom2='floor'/></contact>",
     {"geom 'crate'", "is of type box"}},
    {"DryFriction",
     "<worldbody><body><joint name='rusty' frictionloss='0.5'/><geom size='1'/></body></worldbody>",
     {"joint 'rusty'", "dry friction 0.5", "set it to 0"}},
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
     "<worldbody><body><joint name='j' range='-10 10' margin='0.1'/><geom size='1'/></body></worldbody>",
     {"joint 'j'", "limit margin", "narrow the range"}},
    {"DampedFreeJoint",
     "<worldbody><body><joint name='j' type='free' damping='0.1'/><geom size='1'/></body></worldbody>",
     {"joint 'j'", "free joint with damping or armature", "<freejoint/>"}},
    {"SprungFreeJoint",
     "<worldbody><body><joint name='j' type='free' stiffness='0.1'/><geom size='1'/></body></worldbody>",
     {"joint 'j'", "free joint with a spring", "<freejoint/>"}},
    {"GravityCompensation",
     "<worldbody><body name='kite' gravcomp='1'><freejoint/><geom size='1'/></body></worldbody>",
     {"body 'kite' (line 2)", "gravity compensation", "remove gravcomp"}},
    {"Mocap",
     "<worldbody><body name='hand' mocap='true'><geom size='1'/></body><body><freejoint/><geom "
     "size='1'/></body></worldbody>",
     {"body 'hand' (line 2)", "mocap", "remove mocap"}},
    {"Equality",
     "<worldbody><body name='a'><freejoint/><geom size='1'/></body><body name='b'><freejoint/><geom size='1'/></body>"
     "</worldbody>\n<equality>\n<weld name='glue' body1='a' body2='b'/></equality>",
     {"'glue' (line 4) of type weld", "active=\"false\""}},
    {"Tendon",
     "<worldbody><body><joint name='j'/><geom size='1'/></body></worldbody>\n"
     "<tendon><fixed name='cable'><joint joint='j' coef='1'/></fixed></tendon>",
     {"tendon 'cable' (line 3)", "springs and actuators on the joints"}},
    {"Flex",
     "<worldbody><body name='b'><freejoint/><geom size='1'/></body>\n"
     "<flexcomp name='cloth' type='grid' count='2 2 1' spacing='1 1 1' radius='0.01' dim='2' mass='1'/></worldbody>",
     {"flex 'cloth'", "deformable", "remove it"}},
    {"Density",
     "<option density='1.2'/><worldbody><body><freejoint/><geom size='1'/></body></worldbody>",
     {"a medium", "set them to 0"}},
    {"Viscosity",
     "<option viscosity='0.1'/><worldbody><body><freejoint/><geom size='1'/></body></worldbody>",
     {"a medium", "set them to 0"}},
    {"Wind",
     "<option wind='1 0 0'/><worldbody><body><freejoint/><geom size='1'/></body></worldbody>",
     {"a medium", "set them to 0"}},
    {"ContactOverride",
     "<option><flag override='enable'/></option><worldbody><body><freejoint/><geom size='1'/></body></worldbody>",
     {"contact override", "<flag override>"}},
    {"TorsionalFriction",
     "<worldbody><geom type='plane' size='1 1 1'/><body><freejoint/>\n<geom name='foot' size='1' condim='4'/></body>"
     "</worldbody>",
     {"geom 'foot' (line 3)", "torsional friction (condim 4)", "condim=\"3\""}},
    {"RollingFrictionOfAPair",
     "<worldbody><geom name='floor' type='plane' size='1 1 1'/><body><freejoint/><geom name='foot' size='1'/></body>"
     "</worldbody>\n<contact>\n<pair name='p' geom1='foot' geom2='floor' condim='6'/></contact>",
     {"'p' (line 4)", "torsional and rolling friction (condim 6)", "condim=\"3\""}},
    {"AnisotropicFriction",
     "<worldbody><geom name='floor' type='plane' size='1 1 1'/><body><freejoint/><geom name='skate' size='1'/></body>"
     "</worldbody><contact><pair name='p' geom1='skate' geom2='floor' friction='1 0.1'/></contact>",
     {"'p'", "depends on the direction", "make both equal"}},
    {"PairTwice",
     "<worldbody><geom name='floor' type='plane' size='1 1 1'/><body><freejoint/><geom name='foot' size='1'/></body>"
     "</worldbody><contact><pair geom1='foot' geom2='floor'/><pair name='q' geom1='floor' geom2='foot'/></contact>",
     {"'q'", "another pair names too", "remove one"}},
    {"PairMargin",
     "<worldbody><geom name='floor' type='plane' size='1 1 1'/><body><freejoint/><geom name='foot' size='1'/></body>"
     "</worldbody><contact><pair name='p' geom1='foot' geom2='floor' margin='0.1'/></contact>",
     {"'p'", "contact margin", "enlarge the shapes"}},
    {"GeomMargin",
     "<worldbody><geom type='plane' size='1 1 1'/><body><freejoint/><geom name='foot' size='1' margin='0.01'/></body>"
     "</worldbody>",
     {"geom 'foot'", "contact margin", "enlarge the shape"}},
    {"Adhesion",
     "<worldbody><geom type='plane' size='1 1 1'/><body><freejoint/><geom name='foot' size='1' adhesion='1'/></body>"
     "</worldbody>",
     {"geom 'foot'", "adhesion"}},
    {"SurfaceVelocity",
     "<worldbody><geom name='belt' type='plane' size='1 1 1' surfacevel='1 0 0 0 0 0'/><body><freejoint/>"
     "<geom size='1'/></body></worldbody>",
     {"geom 'belt'", "surface velocity", "remove surfacevel"}},
    {"Empty", "", {"nothing in it can move", "<freejoint/>"}},
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
    {"UnknownElement", "<worldbody>\n<bodi/></worldbody>", {"cannot parse", "'bodi', line 3"}},
    {"UnknownAttribute", "<worldbody>\n<body colour='red'/></worldbody>", {"cannot parse", "'colour'", "line 3"}},
    {"NotXml", "<worldbody>\n<body></worldbody>", {"cannot parse", "Line number=3"}},
    {"MissingInclude", "<include file='nowhere.xml'/>", {"cannot parse", "nowhere.xml"}},
    {"MasslessBody",
     "<worldbody>\n<body name='ghost'><joint/></body></worldbody>",
     {"cannot compile", "mass and inertia", "ghost", "line 3"}},
    {"MissingMeshFile",
     "<asset><mesh name='m' file='nowhere.stl'/></asset><worldbody><body><freejoint/><geom type='mesh' "
     "mesh='m'/></body>"
     "</worldbody>",
     {"cannot compile", "nowhere.stl"}},
    {"Plugin",
     "<extension><plugin plugin='mujoco.pid'/></extension><worldbody><body><freejoint/><geom "
     "size='1'/></body></worldbody>",
     {"cannot", "mujoco.pid", "line 2"}},
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
        {"Velocity", "<velocity name='a' joint='elbow' kv='1'/>", "neither a plain motor nor a position actuator"},
        {"Damper", "<damper name='a' joint='elbow' kv='1' ctrlrange='0 1'/>", "neither a plain motor"},
        {"Intvelocity", "<intvelocity name='a' joint='elbow' kp='1' actrange='0 1'/>", "neither a plain motor"},
        {"Cylinder", "<cylinder name='a' joint='elbow'/>", "neither a plain motor"},
        {"Muscle", "<muscle name='a' joint='elbow' lengthrange='0 1'/>", "neither a plain motor"},
        {"FilteredPosition", "<position name='a' joint='elbow' kp='1' timeconst='0.1'/>", "neither a plain motor"},
        {"Biased", "<general name='a' joint='elbow' gainprm='2' biastype='affine' biasprm='1 -2 0'/>",
         "neither a plain motor"},
        {"WrongBias", "<general name='a' joint='elbow' gainprm='2' biastype='affine' biasprm='0 -3 0'/>",
         "neither a plain motor"},
        {"Body", "<adhesion name='a' body='arm' ctrlrange='0 1'/>", "does not act on a hinge"},
        {"OwnArmature", "<motor name='a' joint='elbow' armature='0.1'/>", "give them to the joint"},
        {"OwnDamping", "<motor name='a' joint='elbow' damping='0.1'/>", "give them to the joint"},
        {"Delay", "<motor name='a' joint='elbow' delay='0.1' nsample='4'/>", "has a delay"},
    }),
    [](const testing::TestParamInfo<ActuatorCase>& test) { return std::string(test.param.name); });

TEST(MjcfRefusal, MoreMemoryThanThereIs) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer ends the process at such an allocation";
#endif
  EXPECT_THAT(refusal("<mujoco><size memory='900000T'/><worldbody><body><freejoint/><geom size='1'/></body></worldbody>"
                      "</mujoco>"),
              AllOf(HasSubstr("robot.xml: MuJoCo cannot compile it"), HasSubstr("memory")));
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
              AllOf(HasSubstr("actuator 'rocket'"), HasSubstr("only actuators on hinges")));
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
  EXPECT_THAT(refusal(robot("prismatic", "<limit lower='0' upper='1' effort='1' velocity='1'/>", "")),
              AllOf(HasSubstr("joint 'j1'"), HasSubstr("slide joint")));
  EXPECT_THAT(refusal(robot("continuous", "<dynamics friction='0.5'/>", "")),
              AllOf(HasSubstr("joint 'j1'"), HasSubstr("dry friction")));
  EXPECT_THAT(refusal(robot("continuous", "", "<mimic joint='j1'/>")), HasSubstr("mimic"));
}

TEST(MjcfRefusal, CondimOfShapesThatNeverTouchDoesNotMatter) {
  EXPECT_EQ(
      refusal(
          "<mujoco><worldbody><body><freejoint/><geom size='1' condim='6' margin='1'/></body></worldbody></mujoco>"),
      "");
}

TEST(MjcfRefusal, InactiveEqualityIsLeftOut) {
  const std::string body = "<worldbody><body name='a'><joint/><geom size='1'/></body></worldbody>";
  EXPECT_EQ(refusal("<mujoco>" + body + "<equality><weld body1='a' active='false'/></equality></mujoco>"), "");
  EXPECT_NE(refusal("<mujoco>" + body + "<equality><weld body1='a'/></equality></mujoco>"), "");
}

// ---- files ----------------------------------------------------------------------------------------------------------

std::string file_refusal(const std::string& path) {
  try {
    load_model(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
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
  EXPECT_THAT(with("<html></html>"), AllOf(HasSubstr("cannot parse"), HasSubstr("html")));
  EXPECT_THAT(with(std::string("\x89PNG\0\1\2", 7)), HasSubstr("cannot parse"));
  EXPECT_THAT(with("<mujoco>\n<worldbody>"), HasSubstr("cannot parse"));
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

}  // namespace
}  // namespace assay
