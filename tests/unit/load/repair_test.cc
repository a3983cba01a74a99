// What `assay check --repair` writes: only what is wrong changes, and the result loads.
#include "load/repair.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "load/inertia.h"
#include "load/mjcf.h"
#include "temp_folder.h"

namespace assay {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

class Repair : public TempFolderTest {
 protected:
  std::string path(const std::string& name) const { return dir_ / name; }
  std::string write(const std::string& name, const std::string& text) {
    const fs::path file = path(name);
    fs::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }
  // Mends `from` into `to` and loads that.
  Model mended(const std::string& from, const std::string& to) {
    std::ifstream file(from);
    const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    mends_.clear();
    text_ = mended_model(text, from, to, mends_);
    std::ofstream(to, std::ios::binary) << text_;
    LoadOptions options;
    options.allow_external_files = true;  // a file that moved names its meshes where they were
    return load_model(to, options);
  }
  std::vector<std::string> changes() const {
    std::vector<std::string> result;
    result.reserve(mends_.size());
    for (const Mend& mend : mends_) result.push_back(fmt::format("{}: {}", mend.line, mend.what));
    return result;
  }

  std::vector<Mend> mends_;
  std::string text_;
};

constexpr const char* kArmInMjcf = R"(<mujoco>
  <!-- <joint range="1 -1"/> is wrong -->
  <default><default class="small"><joint range="30 -30"/></default></default>
  <worldbody>
    <body name="upper"><joint name="a" range="-1 1"/><joint name="b" axis="1 0 0" range='2 -2'/>
      <inertial pos="0 0 0" mass="2" diaginertia="1 1 3"/>
      <body name="lower"><inertial pos="0 0 1" mass="1" fullinertia="1 1 0 0.1 0 0"/><joint class="small"/></body>
    </body>
  </worldbody>
  <actuator><motor joint="a" ctrlrange="5 -5"/></actuator>
</mujoco>
)";

TEST_F(Repair, MjcfChangesWhatIsWrongOnly) {
  const std::string from = write("arm.xml", kArmInMjcf);
  const LoadReport report = inspect_model(from);
  EXPECT_FALSE(report.model.has_value());
  std::vector<std::pair<std::string, int>> found;
  found.reserve(report.problems.size());
  for (const Problem& problem : report.problems) found.emplace_back(problem.element, problem.line);
  EXPECT_THAT(found, ElementsAre(std::pair("a joint", 3), std::pair("joint 'b'", 5), std::pair("body 'upper'", 6),
                                 std::pair("body 'lower'", 7), std::pair("a motor", 10)));
  EXPECT_THAT(report.problems.at(2).message, HasSubstr("breaks the triangle inequality (principal moments 1, 1, 3"));
  EXPECT_THAT(report.problems.at(2).mend, HasSubstr("--repair OUT"));

  const Model model = mended(from, path("mended.xml"));
  EXPECT_THAT(changes(), ElementsAre("3: a joint: range 30 -30 -> -30 30", "5: joint 'b': range 2 -2 -> -2 2",
                                     HasSubstr("6: body 'upper'"), HasSubstr("7: body 'lower'"),
                                     "10: a motor: ctrlrange 5 -5 -> -5 5"));
  EXPECT_DOUBLE_EQ(model.joints.at(0).lower, -1 * EIGEN_PI / 180);
  EXPECT_DOUBLE_EQ(model.joints.at(1).lower, -2 * EIGEN_PI / 180);
  EXPECT_DOUBLE_EQ(model.joints.at(2).upper, 30 * EIGEN_PI / 180);
  EXPECT_EQ(model.actuators.at(0).control_upper, 5);
  for (const int b : {1, 2}) EXPECT_TRUE(inertia_valid(model.bodies.at(b).I_BBcm_B));
  // the nearest moments on the triangle's edge
  EXPECT_NEAR(model.bodies.at(1).I_BBcm_B(0, 0), 4.0 / 3, 1e-5);
  EXPECT_NEAR(model.bodies.at(1).I_BBcm_B(2, 2), 8.0 / 3, 1e-5);
  // the same axes: moments along and across (1, 1, 0) were 1.1 and 0.9, and 0 about z
  EXPECT_NEAR(model.bodies.at(2).I_BBcm_B(0, 0), model.bodies.at(2).I_BBcm_B(1, 1), 1e-12);
  EXPECT_NEAR(model.bodies.at(2).I_BBcm_B(0, 2), 0, 1e-12);
  // lines and everything else stay
  EXPECT_THAT(text_, HasSubstr("<!-- <joint range=\"1 -1\"/> is wrong -->"));
  EXPECT_EQ(std::ranges::count(text_, '\n'), std::ranges::count(std::string(kArmInMjcf), '\n'));
}

TEST_F(Repair, IncludedFilesAreWrittenIntoTheText) {
  write("robot/parts/hand.xml",
        "<mujocoinclude>\n<body name='hand'><joint name='j' limited='true' range='1 -1'/><geom type='mesh' "
        "mesh='tip'/></body>\n"
        "</mujocoinclude>\n");
  write("robot/parts/fine.xml", "<mujocoinclude><geom type='plane' size='1 1 1'/></mujocoinclude>");
  write("robot/meshes/tip.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const std::string from =
      write("robot/arm.xml",
            "<mujoco><compiler meshdir='meshes'/><asset><mesh name='tip' file='tip.obj'/></asset><worldbody>\n"
            "<include file='parts/fine.xml'/><include file='parts/hand.xml'/></worldbody></mujoco>");
  EXPECT_THAT(problem_text(inspect_model(from).problems.at(0)),
              AllOf(HasSubstr("joint 'j' (parts/hand.xml, line 2)"), HasSubstr("range=\"1 -1\"")));
  const Model beside = mended(from, path("robot/mended.xml"));
  EXPECT_LT(beside.joints.at(0).lower, 0);
  fs::create_directories(path("elsewhere"));
  const Model moved = mended(from, path("elsewhere/mended.xml"));
  EXPECT_EQ(moved.hash, beside.hash);
  EXPECT_THAT(moved.shapes, SizeIs(2));
}

TEST_F(Repair, UrdfMeshesAreFoundFromElsewhere) {
  write("ws/robot/meshes/tip.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const std::string from = write("ws/robot/urdf/arm.urdf", R"(<robot name="arm"><link name="base"/>
<link name="tip"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="3" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><mesh filename="package://robot/meshes/tip.obj"/></geometry></collision></link>
<joint name="j" type="continuous"><parent link="base"/><child link="tip"/></joint></robot>)");
  const Model beside = mended(from, path("ws/robot/urdf/mended.urdf"));
  EXPECT_THAT(mends_, SizeIs(1));
  EXPECT_THAT(beside.hulls, SizeIs(1));
  const Model moved = mended(from, path("mended.urdf"));
  EXPECT_THAT(changes(), ElementsAre(HasSubstr("2: inertia of link 'tip'"),
                                     "0: names of mesh files that are absolute paths now: 1"));
  EXPECT_EQ(moved.hash, beside.hash);
}

// MuJoCo takes swapped bounds for no limits, unless the file says that there are some.
TEST_F(Repair, SwappedBoundsThatMujocoAcceptsAreNoted) {
  const std::string from = write("arm.xml",
                                 "<mujoco><worldbody><body><joint name='j' range='1 -1'/><geom size='1'/></body>"
                                 "</worldbody></mujoco>");
  const Model model = load_model(from);
  EXPECT_FALSE(model.joints.at(0).limited);
  EXPECT_THAT(model.notes, testing::Contains(AllOf(HasSubstr("swapped"), HasSubstr("joint 'j'"))));
  EXPECT_TRUE(mended(from, path("mended.xml")).joints.at(0).limited);
}

TEST_F(Repair, NothingToMend) {
  std::vector<Mend> mends;
  EXPECT_THROW(mended_model("<sdf/>", "a.sdf", "b.sdf", mends), InputError);
  // MuJoCo mends the second one itself
  for (const std::string text : {"<mujoco><worldbody/></mujoco>",
                                 "<mujoco><compiler balanceinertia='true'/><worldbody><body><inertial mass='1' "
                                 "pos='0 0 0' diaginertia='1 1 3'/></body></worldbody></mujoco>"}) {
    EXPECT_EQ(mended_model(text, "a.xml", "b.xml", mends), text);
    EXPECT_TRUE(mends.empty()) << text;
  }
}

// A negative mass has no obvious mend, and a joint that moves it is no idle one.
TEST_F(Repair, NegativeMassIsLeftToTheUser) {
  const std::string from = write("arm.urdf", R"(<robot name="arm"><link name="base"/>
<link name="tip"><inertial><mass value="-1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="continuous"><parent link="base"/><child link="tip"/></joint></robot>)");
  const LoadReport report = inspect_model(from);
  ASSERT_THAT(report.problems, SizeIs(1));
  EXPECT_EQ(problem_text(report.problems.front()), "link 'tip' (line 2) has the mass -1 kg; give a positive mass");
  std::vector<Mend> mends;
  std::ifstream file(from);
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  EXPECT_EQ(mended_model(text, from, path("mended.urdf"), mends), text);
  EXPECT_TRUE(mends.empty());
}

}  // namespace
}  // namespace assay
