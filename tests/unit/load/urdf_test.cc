// What URDF files of people have in them, and what becomes of it: each right value is MuJoCo's or a closed form.
#include "load/urdf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "check/model_check.h"
#include "check/step_bounds.h"
#include "load/inertia.h"
#include "load/mjcf.h"
#include "temp_folder.h"

namespace assay {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;
using testing::SizeIs;

constexpr const char* kInertial =
    "<inertial><origin xyz='0 0 -0.2'/><mass value='1'/><inertia ixx='0.02' ixy='0' ixz='0' iyy='0.02' iyz='0' "
    "izz='0.01'/></inertial>";

// An arm whose link in line 3 has `inside` beside its inertia; `joint` follows its axis in line 4.
std::string arm(const std::string& inside, const std::string& joint = "", const std::string& more = "",
                const std::string& inertial = kInertial, const char* type = "revolute") {
  return fmt::format(
      "<robot name='r'>\n<link name='base'/>\n<link name='arm'>{}{}</link>\n<joint name='j' type='{}'><parent "
      "link='base'/><child link='arm'/><origin xyz='0 0 1'/><axis xyz='0 1 0'/>{}</joint>\n{}</robot>",
      inertial, inside, type, joint, more);
}

std::string compiled_with(const std::string& attributes) {
  return fmt::format("<mujoco><compiler {}/></mujoco>", attributes);
}

Model loaded(const std::string& text, const LoadOptions& options = {}) {
  return load_model_text(text, "r.urdf", options);
}

std::string refusal_of(const std::string& text, const LoadOptions& options = {}) {
  const LoadReport report = inspect_model_text(text, "r.urdf", options);
  return report.model ? "" : problem_text(report.problems.front());
}

// The findings of a text, by kind.
std::vector<Finding> findings_in(const std::string& text) {
  FileFacts facts;
  const LoadReport report = inspect_model_text(text, "r.urdf", {}, &facts);
  if (!report.model) return {};
  return check_model(*report.model, facts, step_bounds(*report.model, report.model->initial));
}
const Finding* find(const std::vector<Finding>& findings, const std::string& kind) {
  const auto found = std::ranges::find(findings, kind, &Finding::kind);
  return found == findings.end() ? nullptr : &*found;
}

// ---- pictures -------------------------------------------------------------------------------------------------------

TEST(Urdf, WhatOnlyDrawsNeverRefuses) {
  const std::string red = "<material name='a'><color rgba='1 0 0 1'/></material>";
  const auto visual = [](const std::string& shape, const std::string& after = "") {
    return fmt::format("<visual><geometry>{}</geometry>{}</visual>", shape, after);
  };
  const std::string box = "<box size='1 1 1'/>";
  for (const std::string& drawn :
       {visual(box, red + "<material name='b'><color rgba='0 1 0 1'/></material>"), visual(box, red + red),
        visual(box, "<material name='a'><color rgba='1 0 0 1 1'/></material>"),
        visual(box, "<material name='a'><color rgba='red'/></material>"), visual(box, "<material/>"),
        visual(box, "<material name='nowhere'/>"), visual(""), std::string("<visual/>"),
        visual("<drake:ellipsoid a='1' b='1' c='1'/>"), visual("<sphere radius='-1'/>"), visual("<box/>"),
        visual("<mesh/>"), visual("<mesh filename='nowhere.step'/>"), visual("<mesh filename='a.dae' scale='x'/>"),
        visual(box + box), "<visual><origin xyz='a b c'/><geometry>" + box + "</geometry></visual>",
        "<visual name='v'/>" + visual(box) + visual(box)}) {
    const Model model = loaded(arm(drawn));
    EXPECT_EQ(model.dof(), 1) << drawn;
    EXPECT_DOUBLE_EQ(model.total_mass(), 1) << drawn;
  }
  EXPECT_THAT(loaded(arm(visual(box, red + red))).notes, Contains(HasSubstr("second <material>")));
  // twice the same material, at the robot
  EXPECT_EQ(loaded(arm("", "", red + red)).dof(), 1);
}

TEST(Urdf, CollisionShapesHaveTheirLinksColour) {
  const Model model = loaded(
      arm("<visual><geometry><box size='1 1 1'/></geometry><material name='a'/></visual><collision><geometry><sphere "
          "radius='1'/></geometry></collision>",
          "", "<material name='a'><color rgba='0 1 0 1'/></material>"));
  ASSERT_THAT(model.shapes, SizeIs(1));
  EXPECT_EQ(model.shapes.front().rgba, (std::array<float, 4>{0, 1, 0, 1}));
}

// ---- shapes ---------------------------------------------------------------------------------------------------------

TEST(Urdf, ShapesThatCannotCollide) {
  const auto with = [](const std::string& shape) {
    return arm(
        fmt::format("<collision><geometry>{}</geometry></collision><collision><geometry><box size='1 1 1'/>"
                    "</geometry></collision>",
                    shape));
  };
  for (const char* shape : {"<sphere radius='0.0'/>", "<box size='1 0 1'/>", "<cylinder radius='1' length='0'/>", ""}) {
    const Model model = loaded(with(shape));
    EXPECT_THAT(model.shapes, SizeIs(1)) << shape;
    EXPECT_THAT(model.notes, Contains(HasSubstr("left out"))) << shape;
  }
  for (const char* shape : {"<sphere radius='-.1'/>", "<sphere/>", "<drake:ellipsoid a='1' b='1' c='1'/>"}) {
    EXPECT_THAT(refusal_of(with(shape)), AllOf(HasSubstr("link 'arm' (line 3)"), HasSubstr("--drop-unsupported")))
        << shape;
    EXPECT_THAT(loaded(with(shape), {.drop_unsupported = true}).shapes, SizeIs(1)) << shape;
  }
}

// ---- inertia --------------------------------------------------------------------------------------------------------

TEST(Urdf, PartsThatAreTooLightForMujocoFuse) {
  const auto logo = [](const char* mass, const char* moment, const char* type) {
    return fmt::format(
        "<link name='logo'><inertial><mass value='{0}'/><inertia ixx='{1}' ixy='0' ixz='0' iyy='{1}' "
        "iyz='0' izz='{1}'/></inertial></link><joint name='f' type='{2}'><parent link='arm'/><child "
        "link='logo'/><axis xyz='1 0 0'/></joint>",
        mass, moment, type);
  };
  const Model fixed = loaded(arm("", "", logo("6.5e-8", "1.6e-15", "fixed")));
  EXPECT_NEAR(fixed.total_mass(), 1.000000065, 1e-12);
  const Model moving = loaded(arm("", "", logo("6.5e-8", "1.6e-15", "continuous")));
  ASSERT_THAT(moving.bodies, SizeIs(2));
  EXPECT_DOUBLE_EQ(moving.bodies[1].mass, 6.5e-8);
  EXPECT_DOUBLE_EQ(moving.bodies[1].I_BBcm_B(0, 0), 1.6e-15);
}

TEST(Urdf, MissingInertiaIsRepairedInMemory) {
  const std::string text = arm("", "", "", "<inertial><mass value='1'/></inertial>");
  EXPECT_THAT(refusal_of(text), AllOf(HasSubstr("link 'arm' (line 3)"), HasSubstr("--repair")));
  const Model model = loaded(text, {.repair = true});
  // a ball of water
  EXPECT_NEAR(model.bodies.at(0).I_BBcm_B(0, 0), 0.4 * std::pow(3e-3 / (4 * EIGEN_PI), 2.0 / 3), 1e-12);
  EXPECT_THAT(model.notes, Contains(AllOf(HasSubstr("repaired: inertia of link 'arm'"), HasSubstr("(line 3)"))));
  const std::string weightless =
      "<link name='tip'><inertial><mass value='0'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' "
      "iyz='0'/></inertial>"
      "</link><joint name='t' type='continuous'><parent link='arm'/><child link='tip'/></joint>";
  EXPECT_THAT(refusal_of(arm("", "", weightless)), Not(HasSubstr("--repair")));
}

TEST(Urdf, InvalidInertiaAndLimitsAreRepairedInMemory) {
  const std::string wrong =
      "<inertial><mass value='1'/><inertia ixx='-1' ixy='0' ixz='0' iyy='1' iyz='0' izz='5'/></inertial>";
  const std::string text = arm("", "<limit lower='1' upper='-1' effort='1'/>", "", wrong);
  EXPECT_NE(refusal_of(text), "");
  const Model model = loaded(text, {.repair = true});
  EXPECT_DOUBLE_EQ(model.joints.at(0).lower, -1);
  EXPECT_THAT(model.notes, Contains(HasSubstr("repaired: limits of joint 'j'")));
  // what has nothing to repair stays
  EXPECT_EQ(loaded(arm(""), {.repair = true}).hash, loaded(arm("")).hash);
}

TEST(Urdf, CompilerOfMujocoCounts) {
  const std::string box =
      "<collision><origin xyz='0 0 -0.2'/><geometry><box size='0.1 0.1 0.1'/></geometry></collision>";
  const auto body = [&](const std::string& attributes, const std::string& inertial = kInertial,
                        const std::string& more = "") {
    return loaded(arm(box, "", compiled_with(attributes) + more, inertial)).bodies.at(0);
  };
  EXPECT_NEAR(body("inertiafromgeom='true'").mass, 1, 1e-12);
  EXPECT_NEAR(body("inertiafromgeom='true'").I_BBcm_B(0, 0), 1 * 0.01 / 6, 1e-12);
  EXPECT_NEAR(body("inertiafromgeom='auto'", "").mass, 1, 1e-12);
  EXPECT_DOUBLE_EQ(body("inertiafromgeom='auto'").I_BBcm_B(0, 0), 0.02);
  EXPECT_DOUBLE_EQ(body("inertiafromgeom='true' inertiagrouprange='1 2'").I_BBcm_B(0, 0), 0.02);
  EXPECT_NEAR(body("boundmass='3'").mass, 3, 1e-12);
  EXPECT_NEAR(body("boundinertia='0.015'").I_BBcm_B(2, 2), 0.015, 1e-12);
  const std::string unbalanced =
      "<inertial><mass value='1'/><inertia ixx='0.02' ixy='0' ixz='0' iyy='0.02' iyz='0' izz='0.09'/></inertial>";
  EXPECT_NEAR(body("balanceinertia='true'", unbalanced).I_BBcm_B(0, 0), 0.13 / 3, 1e-12);
  // what MuJoCo fuses with a body of shapes loses its own mass
  const std::string tip = fmt::format(
      "<link name='tip'>{}</link><joint name='f' type='fixed'><parent link='arm'/><child link='tip'/></joint>",
      kInertial);
  EXPECT_NEAR(body("inertiafromgeom='true'", kInertial, tip).mass, 1, 1e-12);
  EXPECT_THAT(refusal_of(arm("", "", compiled_with("boundmass='x'"))),
              HasSubstr("<compiler> of <mujoco> (line 5) has boundmass=\"x\""));
  for (const char* without : {"angle='degree'", "eulerseq='zyx'", "autolimits='false'", "coordinate='global'",
                              "discardvisual='false'", "fusestatic='false'"}) {
    EXPECT_EQ(loaded(arm(box, "<limit lower='-1' upper='1'/>", compiled_with(without))).hash,
              loaded(arm(box, "<limit lower='-1' upper='1'/>")).hash)
        << without;
  }
  EXPECT_THAT(loaded(arm("", "", compiled_with("foo='1'"))).notes, Contains(HasSubstr("attribute 'foo'")));
}

TEST(Urdf, TotalMassIsThatOfWhatHasMass) {
  const std::string frame =
      "<link name='frame'/><joint name='a' type='continuous'><parent link='base'/><child link='frame'/></joint>";
  const std::string text = fmt::format(
      "<robot name='r'>{}<link name='base'/>{}<link name='arm'>{}</link><joint name='b' type='continuous'><parent "
      "link='frame'/><child link='arm'/><axis xyz='0 1 0'/></joint></robot>",
      compiled_with("settotalmass='10'"), frame, kInertial);
  const Model model = loaded(text);
  EXPECT_NEAR(model.total_mass(), 10, 1e-12);
  EXPECT_NEAR(model.bodies.back().I_BBcm_B(0, 0), 0.2, 1e-12);
}

// ---- limits ---------------------------------------------------------------------------------------------------------

TEST(Urdf, EqualLimitsLock) {
  const std::string limit = "<limit lower='0.5' upper='0.5' effort='5' velocity='1'/>";
  // alone, the joint stays, held by its limits where they are
  const std::string alone = arm("", limit);
  const Model held = loaded(alone);
  ASSERT_EQ(held.dof(), 1);
  EXPECT_TRUE(held.joints[0].limited);
  EXPECT_NEAR(held.joints[0].lower, 0.5, 1e-5);
  EXPECT_NEAR(held.joints[0].upper, 0.5, 1e-5);
  EXPECT_NEAR(held.initial.position.at(0), 0.5, 1e-12);
  const std::vector<Finding> findings = findings_in(alone);
  const Finding* locked = find(findings, "joint-locked");
  ASSERT_NE(locked, nullptr);
  EXPECT_EQ(locked->level, Level::kMend);
  EXPECT_EQ(locked->places.front().element, "joint 'j'");
  EXPECT_EQ(locked->places.front().line, 4);
  EXPECT_EQ(find(findings, "joint-unlimited"), nullptr);

  // beside others it is fixed there, and so is what mimics it
  const std::string tip = fmt::format(
      "<link name='tip'>{0}</link><joint name='t' type='continuous'><parent link='arm'/><child link='tip'/><axis "
      "xyz='0 1 "
      "0'/></joint><link name='f'>{0}</link><joint name='k' type='revolute'><parent link='base'/><child "
      "link='f'/><axis "
      "xyz='0 1 0'/><mimic joint='j' multiplier='-2' offset='0.1'/></joint>",
      kInertial);
  const Model fixed = loaded(arm("", limit, tip));
  EXPECT_EQ(fixed.dof(), 1);
  // the tip's joint is on the turned arm
  EXPECT_LT((fixed.initial.bodies.at(0).p_WBcm - Vec3(-0.2 * std::sin(0.5), 0, 1 - 0.2 * std::cos(0.5))).norm(), 1e-12);
  EXPECT_NE(find(findings_in(arm("", limit, tip)), "joint-locked"), nullptr);
}

TEST(Urdf, InfiniteAndHugeLimitsAreNone) {
  for (const char* none :
       {"lower='-inf' upper='inf'", "lower='-1e16' upper='1e16'", "lower='-Infinity' upper='+inf'"}) {
    EXPECT_FALSE(loaded(arm("", fmt::format("<limit {}/>", none))).joints.at(0).limited) << none;
  }
  const Model half = loaded(arm("", "<limit lower='-inf' upper='1' effort='inf' velocity='inf'/>"));
  EXPECT_TRUE(half.joints.at(0).limited);
  EXPECT_EQ(half.joints.at(0).upper, 1);
  EXPECT_EQ(half.joints.at(0).lower, -1e4);
  EXPECT_THAT(refusal_of(arm("", "<limit lower='nan' upper='1'/>")),
              HasSubstr("<limit> of joint 'j' (line 4) has lower=\"nan\""));
}

// ---- findings -------------------------------------------------------------------------------------------------------

TEST(Urdf, NegativeDampingAndFrictionAreFound) {
  for (const char* dynamics : {"damping='-1' friction='0'", "friction='-0.5'"}) {
    const std::vector<Finding> findings = findings_in(arm("", fmt::format("<dynamics {}/>", dynamics)));
    const Finding* negative = find(findings, "damping-negative");
    ASSERT_NE(negative, nullptr) << dynamics;
    EXPECT_EQ(negative->level, Level::kMend);
    EXPECT_EQ(negative->places.front().line, 4);
  }
  EXPECT_EQ(find(findings_in(arm("", "<dynamics damping='1' friction='1'/>")), "damping-negative"), nullptr);
}

TEST(Urdf, InertiaInOtherUnitsIsFoundWithoutCollisionShapes) {
  const auto inertial = [](const char* moment) {
    return fmt::format(
        "<inertial><origin xyz='0 0 -0.2'/><mass value='1'/><inertia ixx='{0}' ixy='0' ixz='0' iyy='{0}' "
        "iyz='0' izz='{0}'/></inertial>",
        moment);
  };
  const std::string drawn = "<visual><origin xyz='0 0 -0.2'/><geometry><box size='0.1 0.1 0.4'/></geometry></visual>";
  const std::string mesh = "<visual><geometry><mesh filename='nowhere.stl'/></geometry></visual>";
  for (const std::string& visual : {drawn, mesh, std::string()}) {
    EXPECT_NE(find(findings_in(arm(visual, "", "", inertial("20000"))), "inertia-far"), nullptr) << visual;
    EXPECT_EQ(find(findings_in(arm(visual, "", "", inertial("0.02"))), "inertia-far"), nullptr) << visual;
  }
}

// ---- objects --------------------------------------------------------------------------------------------------------

TEST(Urdf, ObjectsAreFree) {
  const std::string mug = fmt::format("<robot name='mug'><link name='mug'>{}</link></robot>", kInertial);
  const Model model = loaded(mug);
  EXPECT_EQ(model.dof(), 6);
  EXPECT_THAT(model.notes, Contains(kFreeObject));
  EXPECT_EQ(loaded(mug, {.root_joint = RootJoint::kFloating}).hash, model.hash);
  EXPECT_THAT(refusal_of(mug, {.root_joint = RootJoint::kFixed}), HasSubstr("nothing in it can move"));
  const std::string two = fmt::format(
      "<robot name='mug'><link name='mug'>{0}</link><link name='handle'>{0}</link><joint name='f' type='fixed'><parent "
      "link='mug'/><child link='handle'/></joint></robot>",
      kInertial);
  EXPECT_DOUBLE_EQ(loaded(two).bodies.at(0).mass, 2);
  EXPECT_EQ(loaded(two).dof(), 6);
  EXPECT_EQ(loaded(arm("")).dof(), 1);
  // on a link that is the world it is fixed there
  const std::string shelf = fmt::format(
      "<robot name='shelf'><link name='world'/><link name='shelf'>{}</link><joint name='f' type='fixed'><parent "
      "link='world'/><child link='shelf'/></joint></robot>",
      kInertial);
  EXPECT_THAT(refusal_of(shelf), HasSubstr("nothing in it can move"));
}

// ---- files ----------------------------------------------------------------------------------------------------------

// ---- trees ----------------------------------------------------------------------------------------------------------

// Drake's files hang their root on a world that is no link.
TEST(Urdf, TheParentWorldNeedsNoLink) {
  const std::string text = fmt::format(
      "<robot name='r'>\n<link name='base'/>\n<link name='arm'>{}</link>\n<joint name='weld' type='fixed'><parent "
      "link='world'/><child link='base'/><origin xyz='0 0 2'/></joint>\n<joint name='j' type='revolute'><parent "
      "link='base'/><child link='arm'/><axis xyz='0 1 0'/></joint></robot>",
      kInertial);
  const Model model = loaded(text);
  EXPECT_EQ(model.dof(), 1);
  EXPECT_DOUBLE_EQ(model.total_mass(), 1);
  EXPECT_NEAR(model.initial.bodies.at(0).p_WBcm.z(), 1.8, 1e-12);  // of its centre of mass
  EXPECT_THAT(model.notes, Contains(AllOf(HasSubstr("joint 'weld' (line 4)"), HasSubstr("is the world"))));
  const std::string misspelled = refusal_of(arm("", "",
                                                "<joint name='k' type='fixed'><parent link='wurld'/><child "
                                                "link='base'/></joint>"));
  EXPECT_THAT(misspelled, HasSubstr("unknown parent link 'wurld'"));
}

TEST(Urdf, OfTwoTreesTheLargerStays) {
  const std::string text =
      arm("", "",
          fmt::format("<link name='cup'>{}</link>\n<link name='lid'>{}</link>\n<link name='knob'>{}"
                      "</link>\n<joint name='k' type='revolute'><parent link='cup'/><child "
                      "link='lid'/></joint><joint name='l' type='revolute'><parent link='lid'/>"
                      "<child link='knob'/><mimic joint='j'/></joint>",
                      kInertial, kInertial, kInertial));
  EXPECT_THAT(refusal_of(text), AllOf(HasSubstr("two links have no parent, 'base' (line 2) and 'cup' (line 5)"),
                                      HasSubstr("--drop-unsupported, which leaves out all but link 'cup'")));
  const Model model = loaded(text, {.drop_unsupported = true});
  EXPECT_EQ(model.dof(), 2);
  EXPECT_EQ(model.joints.at(0).name, "k");
  EXPECT_TRUE(model.couplings.empty()) << "what it mimics is left out";
  EXPECT_THAT(model.notes, Contains(AllOf(HasSubstr("link 'base'"), HasSubstr("left out"))));
}

TEST(Urdf, RepairTakesCommasOutOfNumbers) {
  const std::string wrong =
      "<robot name='r'>\n<link name='base'/>\n<link name='arm'><inertial><origin xyz='0, 0 ,-0.2'/>"
      "<mass value='1'/><inertia ixx='0.02' ixy='0' ixz='0' iyy='0.02' iyz='0' izz='0.01'/>"
      "</inertial></link>\n<joint name='j' type='revolute'><parent link='base'/><child link='arm'/>"
      "<origin xyz='0;0;1'/></joint>\n</robot>";
  EXPECT_THAT(refusal_of(wrong), AllOf(HasSubstr("<origin> of link 'arm' (line 3) has xyz=\"0, 0 ,-0.2\", with commas"),
                                       HasSubstr("--repair")));
  const Model model = loaded(wrong, {.repair = true});
  EXPECT_NEAR(model.initial.bodies.at(0).p_WBcm.z(), 0.8, 1e-12);
  EXPECT_THAT(model.notes, Contains(HasSubstr("repaired: <origin> of joint 'j': xyz=\"0;0;1\" -> \"0 0 1\"")));
  // a decimal comma is another fault
  EXPECT_THAT(refusal_of(arm("", "<dynamics damping='0,5'/>")), HasSubstr("give 1 finite number"));
}

// What is left out before an element in its line must not move the change to another one.
TEST(Urdf, RepairChangesTheRightElementOfALine) {
  const std::string text =
      "<robot name='r'><link name='base'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' "
      "iyz='0'/></inertial><inertial><mass value='2'/><inertia ixx='2' iyy='2' izz='2' ixy='0' ixz='0' iyz='0'/>"
      "</inertial></link><link name='arm'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='5' ixy='0' ixz='0' "
      "iyz='0'/></inertial></link><joint name='j' type='continuous'><parent link='base'/><child link='arm'/></joint>"
      "</robot>";
  const Model model = loaded(text, {.repair = true});
  EXPECT_TRUE(inertia_valid(model.bodies.at(0).I_BBcm_B)) << model.bodies.at(0).I_BBcm_B;
}

class UrdfFiles : public TempFolderTest {
 protected:
  void write(const std::string& name, const std::string& text) {
    const fs::path file = fs::path(dir_) / name;
    fs::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
  }
  Model with_mesh(const std::string& uri, const std::string& compiler = "") {
    write("r.urdf", arm(fmt::format("<collision><geometry><mesh filename='{}'/></geometry></collision>", uri), "",
                        compiler.empty() ? "" : compiled_with(compiler)));
    return load_model(fs::path(dir_) / "r.urdf");
  }
  static constexpr const char* kTetrahedron =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
};

TEST_F(UrdfFiles, MeshesThatAreThereUnderAnotherName) {
  write("meshes/Tip.OBJ", kTetrahedron);
  const Model model = with_mesh("meshes/Tip.OBJ");
  EXPECT_THAT(model.hulls, SizeIs(1));
  for (const char* uri : {"meshes/tip.obj", "meshes\\\\Tip.OBJ", "Meshes/TIP.obj", "meshes\\Tip.OBJ"}) {
    EXPECT_THAT(with_mesh(uri).hulls, SizeIs(1)) << uri;
  }
  EXPECT_THAT(with_mesh("meshes/tip.obj").notes, Contains(HasSubstr("differs in upper and lower case")));
  EXPECT_THROW(with_mesh("meshes/top.obj"), InputError);
  write("meshes/tip.obj", kTetrahedron);
  write("meshes/TIP.obj", kTetrahedron);
  EXPECT_THROW(with_mesh("meshes/tIP.obj"), InputError) << "two files may be meant";
}

TEST_F(UrdfFiles, MeshesWhereMujocoLooks) {
  write("meshes/tip.obj", kTetrahedron);
  EXPECT_THAT(with_mesh("package://elsewhere/visual/tip.obj", "meshdir='meshes'").hulls, SizeIs(1));
  EXPECT_THAT(with_mesh("tip.obj", "meshdir='meshes/' strippath='false'").hulls, SizeIs(1));
  EXPECT_THROW(with_mesh("package://elsewhere/visual/tip.obj", "meshdir='meshes' strippath='false'"), InputError);
}

}  // namespace
}  // namespace assay
