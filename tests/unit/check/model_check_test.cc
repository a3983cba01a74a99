// `assay check` on the model itself: every finding on a small model whose answer is known by hand.
#include "check/model_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "check/overlaps.h"
#include "load/mesh_facts.h"
#include "load/mjcf.h"

namespace assay {
namespace {

using testing::HasSubstr;

struct Checked {
  Model model;
  FileFacts facts;
  StepBounds bounds;
  std::vector<Finding> findings;

  const Finding* find(const std::string& kind) const {
    const auto found = std::ranges::find(findings, kind, &Finding::kind);
    return found == findings.end() ? nullptr : &*found;
  }
};

// `worldbody` is line 2 on.
Checked check_text(const std::string& text) {
  Checked checked;
  const LoadReport report = inspect_model_text(text, "robot", {}, &checked.facts);
  EXPECT_TRUE(report.model) << (report.problems.empty() ? "" : problem_text(report.problems.front()));
  if (report.model) checked.model = *report.model;
  checked.bounds = step_bounds(checked.model, checked.model.initial);
  checked.findings = check_model(checked.model, checked.facts, checked.bounds);
  return checked;
}

Checked check_bodies(const std::string& worldbody, const std::string& rest = "") {
  return check_text(
      fmt::format("<mujoco><compiler angle=\"radian\"/><worldbody>\n{}\n</worldbody>{}</mujoco>", worldbody, rest));
}

std::string disc(const std::string& name, double inertia, const std::string& joint, const std::string& inside = "") {
  return fmt::format(
      "<body name=\"{0}\"><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"{1} {1} {1}\"/>"
      "<joint name=\"{0}\" axis=\"0 0 1\" {2}/>{3}</body>",
      name, inertia, joint, inside);
}

// ---- timestep -------------------------------------------------------------------------------------------------------

TEST(StepBounds, OneDamperIsTwoInertiasOverIt) {
  const auto checked = check_bodies(disc("wheel", 0.02, R"(damping="0.5" armature="0.01")"));
  EXPECT_NEAR(checked.bounds.joints.largest, 2 * 0.03 / 0.5, 1e-12);
  ASSERT_EQ(checked.bounds.joints.springs.size(), 1);
  EXPECT_NEAR(checked.bounds.joints.springs.front().inertia, 0.03, 1e-14);
  EXPECT_NEAR(checked.bounds.joints.springs.front().held_inertia, 0.03, 1e-14);
  EXPECT_NEAR(checked.bounds.joints.decay, 0.5 / 0.03, 1e-9);
  EXPECT_EQ(checked.bounds.joints.frequency, 0);
  EXPECT_EQ(checked.facts.line_of("joint 'wheel'"), 2);
}

TEST(StepBounds, OneSpringIsTwoOverOmega) {
  const auto checked = check_bodies(
      R"(<body><joint name="way" type="slide" axis="0 0 1" stiffness="800"/><geom size="0.1" mass="2"/></body>)");
  EXPECT_NEAR(checked.bounds.joints.largest, 2 / std::sqrt(800 / 2.0), 1e-12);
  EXPECT_NEAR(checked.bounds.joints.frequency, std::sqrt(400) / (2 * std::numbers::pi), 1e-12);
}

TEST(StepBounds, SpringAndDamperTogether) {
  const auto checked = check_bodies(disc("wheel", 0.1, R"(damping="3" stiffness="70")"));
  // the root of h^2 omega^2 + 2 h b = 4
  const double h = checked.bounds.joints.largest, b = 30, omega2 = 700;
  EXPECT_NEAR(h * h * omega2 + 2 * h * b, 4, 1e-7);
  EXPECT_LT(h, std::min(2 / b, 2 / std::sqrt(omega2)));
}

// M = [I1 + I2, I2; I2, I2].
TEST(StepBounds, TwoDiscsInARowFeelEachOther) {
  const double I1 = 0.3, I2 = 0.02, B = 0.4;
  const auto checked = check_bodies(disc("inner", I1, R"(damping="0.4")", disc("outer", I2, R"(damping="0.4")")));
  const double fastest = B / (2 * I1 * I2) * (I1 + 2 * I2 + std::sqrt(I1 * I1 + 4 * I2 * I2));
  EXPECT_NEAR(checked.bounds.joints.largest, 2 / fastest, 1e-10);
  EXPECT_NEAR(checked.bounds.joints.decay, fastest, 1e-8);
  const ExplicitSpring& outer = checked.bounds.joints.springs.front();
  EXPECT_EQ(outer.element, "joint 'outer'");
  EXPECT_NEAR(outer.inertia, I1 * I2 / (I1 + I2), 1e-14);
  EXPECT_NEAR(outer.held_inertia, I2, 1e-14);
  EXPECT_NEAR(outer.damper_step(), 2 * outer.inertia / B, 1e-12);
  EXPECT_LT(checked.bounds.joints.largest, outer.damper_step());
  ASSERT_NE(checked.bounds.joints.critical(), nullptr);
  EXPECT_EQ(checked.bounds.joints.critical()->element, "joint 'outer'");
}

TEST(StepBounds, CoupledJointsMoveTogether) {
  const double I1 = 0.3, I2 = 0.02;
  const auto checked =
      check_bodies(disc("first", I1, R"(damping="0.4")") + disc("second", I2, "").replace(0, 5, "<body pos=\"1 0 0\""),
                   R"(<equality><joint joint1="second" joint2="first" polycoef="0 2 0 0 0"/></equality>)");
  EXPECT_NEAR(checked.bounds.joints.largest, 2 * (I1 + 4 * I2) / 0.4, 1e-10);
}

TEST(StepBounds, BallAndTendon) {
  const auto ball = check_bodies(
      R"(<body><joint type="ball" name="hip" damping="0.2"/><inertial pos="0 0 0" mass="1" diaginertia="0.3 0.2 0.15"/></body>)");
  EXPECT_NEAR(ball.bounds.joints.largest, 2 * 0.15 / 0.2, 1e-10);
  const auto tendon = check_bodies(
      disc("first", 0.3, "") + disc("second", 0.1, "").replace(0, 5, "<body pos=\"1 0 0\""),
      R"(<tendon><fixed name="rope" damping="0.6"><joint joint="first" coef="2"/><joint joint="second" coef="1"/></fixed></tendon>)");
  // mobility 4 / I1 + 1 / I2
  EXPECT_NEAR(tendon.bounds.joints.largest, 2 / (0.6 * (4 / 0.3 + 1 / 0.1)), 1e-10);
  EXPECT_EQ(tendon.bounds.joints.springs.front().element, "tendon 'rope'");
}

TEST(StepBounds, ServosCountThroughTheirGear) {
  const auto checked =
      check_bodies(disc("wheel", 0.02, R"(damping="0.1")"),
                   R"(<actuator><position name="servo" joint="wheel" kp="50" kv="0.2" gear="3"/></actuator>)");
  EXPECT_TRUE(checked.bounds.has_feedback);
  EXPECT_NEAR(checked.bounds.joints.largest, 2 * 0.02 / 0.1, 1e-12);
  const double omega2 = 50 * 9 / 0.02, b = (0.1 + 0.2 * 9) / 0.02, h = checked.bounds.with_feedback.largest;
  EXPECT_NEAR(h * h * omega2 + 2 * h * b, 4, 1e-7);
  EXPECT_EQ(checked.bounds.with_feedback.critical()->element, "actuator 'servo'");
  EXPECT_EQ(checked.find("actuator-unstable"), nullptr);
}

TEST(StepBounds, NothingBoundsWithoutSprings) {
  const auto checked = check_bodies(disc("wheel", 0.02, ""));
  EXPECT_TRUE(std::isinf(checked.bounds.joints.largest));
  EXPECT_FALSE(checked.bounds.has_feedback);
  EXPECT_EQ(checked.bounds.joints.critical(), nullptr);
}

// The paper's grasp: the distal link's damper stands 2 I / B = 1.34 ms while the other joints are held.
TEST(StepBounds, PaperGrasp) {
  const Model model = load_model(ASSAY_MODELS "/grasp.xml");
  const StepBounds bounds = step_bounds(model, model.initial);
  for (const char* distal : {"joint 'FFJ1'", "joint 'MFJ1'", "joint 'RFJ1'"}) {
    const auto found = std::ranges::find(bounds.joints.springs, distal, &ExplicitSpring::element);
    ASSERT_NE(found, bounds.joints.springs.end());
    EXPECT_NEAR(found->held_damper_step(), 1.34e-3, 0.01e-3);
    EXPECT_LT(found->damper_step(), found->held_damper_step());
  }
}

// ---- the start ------------------------------------------------------------------------------------------------------

TEST(ModelCheck, OverlapsOfEveryShapeHaveTheirDepth) {
  constexpr const char* kCube =
      R"(<asset><mesh name="cube" vertex="-.1 -.1 -.1 .1 -.1 -.1 -.1 .1 -.1 .1 .1 -.1 -.1 -.1 .1 .1 -.1 .1 -.1 .1 .1 .1 .1 .1"/></asset>)";
  for (const auto& [geom, depth] :
       {std::pair{R"(type="sphere" size=".1")", 0.03}, std::pair{R"(type="box" size=".1 .1 .1")", 0.03},
        std::pair{R"(type="capsule" size=".1 .2")", 0.03}, std::pair{R"(type="cylinder" size=".1 .2")", 0.03},
        std::pair{R"(type="ellipsoid" size=".1 .1 .1")", 0.03}, std::pair{R"(type="mesh" mesh="cube")", 0.03}}) {
    SCOPED_TRACE(geom);
    const auto checked = check_bodies(fmt::format(
                                          R"(<body><freejoint/><geom name="a" {0}/></body>
           <body pos="0.17 0 0"><freejoint/><geom name="b" {0}/></body>
           <body pos="9 0 0"><freejoint/><geom name="far" {0}/></body>)",
                                          geom),
                                      kCube);
    const Finding* overlap = checked.find("start-overlap");
    ASSERT_NE(overlap, nullptr);
    EXPECT_EQ(overlap->level, Level::kMend);
    ASSERT_EQ(overlap->places.size(), 1);
    EXPECT_EQ(overlap->places.front().element, "geoms 'a' and 'b'");
    EXPECT_EQ(overlap->places.front().line, 2);
    EXPECT_NEAR(overlap->places.front().value, depth, 5e-5);  // iterative of ellipsoids
  }
}

TEST(ModelCheck, PairsThatDoNotCollideDoNotOverlap) {
  const auto checked = check_bodies(R"(<body name="a"><freejoint/><geom size=".1"/></body>
      <body name="b" pos="0.1 0 0"><freejoint/><geom size=".1"/></body>)",
                                    R"(<contact><exclude body1="a" body2="b"/></contact>)");
  EXPECT_EQ(checked.find("start-overlap"), nullptr);
}

TEST(ModelCheck, DepthBelowTheGround) {
  const auto plane = check_bodies(R"(<geom name="floor" type="plane" size="0 0 1" pos="0 0 1"/>
      <body pos="0 0 1.07"><freejoint/><geom name="foot" size=".1"/></body>)");
  const Finding* below = plane.find("start-below-ground");
  ASSERT_NE(below, nullptr);
  EXPECT_EQ(below->places.front().element, "geom 'foot'");
  EXPECT_EQ(below->places.front().line, 3);
  EXPECT_NEAR(below->places.front().value, 0.03, 1e-12);
  EXPECT_THAT(below->places.front().text, HasSubstr("below 'floor'"));
  const auto resting = check_bodies(R"(<geom type="plane" size="0 0 1"/>
      <body pos="0 0 .1"><freejoint/><geom size=".1"/></body>)");
  EXPECT_EQ(resting.find("start-below-ground"), nullptr);
  const auto field = check_bodies(
      R"(<geom name="hill" type="hfield" hfield="hill"/><body pos=".1 .1 .57"><freejoint/><geom size=".1"/></body>)",
      R"(<asset><hfield name="hill" nrow="3" ncol="3" size="1 1 .5 .1" elevation="1 1 1 1 1 1 1 1 0"/></asset>)");
  ASSERT_NE(field.find("start-below-ground"), nullptr);
  EXPECT_NEAR(field.find("start-below-ground")->places.front().value, 0.03, 1e-9);
}

TEST(ModelCheck, StartBeyondLimits) {
  const auto checked = check_bodies(disc("low", 0.1, R"(range="0.25 1")") + disc("fine", 0.1, R"(range="-1 1")"));
  const Finding* beyond = checked.find("start-beyond-limits");
  ASSERT_NE(beyond, nullptr);
  ASSERT_EQ(beyond->places.size(), 1);
  EXPECT_EQ(beyond->places.front().element, "joint 'low'");
  EXPECT_NEAR(beyond->places.front().value, 0.25, 1e-12);
  EXPECT_EQ(beyond->level, Level::kMend);
}

// ---- masses ---------------------------------------------------------------------------------------------------------

TEST(ModelCheck, MassRatios) {
  const auto chain = [](double light) {
    return check_bodies(fmt::format(
        R"(<body name="base"><freejoint/><geom size=".1" mass="2"/><body name="tip" pos="0 0 1"><joint/><geom size=".05" mass="{}"/></body></body>)",
        light));
  };
  const auto heavy = chain(0.01);
  const Finding* ratio = heavy.find("mass-ratio");
  ASSERT_NE(ratio, nullptr);
  EXPECT_NEAR(ratio->places.front().value, 200, 1e-9);
  EXPECT_THAT(ratio->advice, HasSubstr("iterations"));
  const auto even = chain(1);
  ASSERT_NE(even.find("mass-ratio"), nullptr);
  EXPECT_NEAR(even.find("mass-ratio")->places.front().value, 2, 1e-9);
  EXPECT_EQ(even.find("mass-ratio")->advice, "");
}

TEST(ModelCheck, WhatTheSuiteDoesNotTest) {
  const auto checked = check_bodies(R"(<geom type="plane" size="0 0 1"/>
      <body pos="0 0 1"><freejoint/><geom name="grain" size=".001" mass="0.0001"/></body>)");
  ASSERT_NE(checked.find("mass-range"), nullptr);
  EXPECT_NEAR(checked.find("mass-range")->places.front().value, 1e-4, 1e-15);
  ASSERT_NE(checked.find("size-range"), nullptr);
  EXPECT_NEAR(checked.find("size-range")->places.front().value, 2e-3, 1e-12);
}

TEST(ModelCheck, InertiaAgainstTheShapes) {
  const auto with = [](const char* inertia) {
    return check_bodies(fmt::format(
        R"(<body name="b"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="{0} {0} {0}"/><geom type="box" size=".1 .1 .1"/></body>)",
        inertia));
  };
  // radius of gyration 1 m; the corner is at 0.173 m
  const auto far = with("1");
  ASSERT_NE(far.find("inertia-far"), nullptr);
  EXPECT_EQ(far.find("inertia-far")->level, Level::kMend);
  EXPECT_NEAR(far.find("inertia-far")->places.front().value, 1, 1e-12);
  ASSERT_NE(with("1e-5").find("inertia-near"), nullptr);
  const auto solid = with("0.00667");  // m (2 a)^2 / 6
  EXPECT_EQ(solid.find("inertia-far"), nullptr);
  EXPECT_EQ(solid.find("inertia-near"), nullptr);
}

TEST(ModelCheck, MassNeedsNotFillWhatIsOnlyDrawn) {
  const auto beside = [](const char* filter) {
    return check_bodies(
        fmt::format(R"(<body name="b"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia=".01 .01 .01"/>)"
                    R"(<geom size=".1"/><geom size="5" {}/></body>)",
                    filter));
  };
  ASSERT_NE(beside("").find("inertia-near"), nullptr);
  EXPECT_NEAR(beside("").find("inertia-near")->places.front().value, 0.1, 1e-12);
  EXPECT_EQ(beside(R"(contype="0" conaffinity="0")").find("inertia-near"), nullptr);
}

// ---- joints ---------------------------------------------------------------------------------------------------------

TEST(ModelCheck, JointsWithoutLimitsEffortAndDamping) {
  const auto checked =
      check_bodies(disc("free", 0.1, "") + disc("held", 0.1, R"(range="-1 1" damping="1")"),
                   R"(<actuator><motor name="open" joint="free"/><motor name="bounded" joint="held" ctrlrange="-1 1"/>
                   <general name="runaway" joint="held" biastype="affine" biasprm="0 5 0" forcerange="-1 1"/></actuator>)");
  for (const auto& [kind, element] :
       {std::pair{"joint-unlimited", "joint 'free'"}, std::pair{"damping-missing", "joint 'free'"},
        std::pair{"effort-missing", "actuator 'open'"}, std::pair{"actuator-unstable", "actuator 'runaway'"}}) {
    const Finding* finding = checked.find(kind);
    ASSERT_NE(finding, nullptr) << kind;
    ASSERT_EQ(finding->places.size(), 1) << kind;
    EXPECT_EQ(finding->places.front().element, element);
    EXPECT_FALSE(finding->all);
  }
}

TEST(ModelCheck, PlanarRootsNeedNoLimits) {
  const auto checked = check_bodies(
      R"(<body name="torso"><joint name="x" type="slide" axis="1 0 0"/><joint name="z" type="slide" axis="0 0 1"/>
         <joint name="y" axis="0 1 0"/><geom size=".1"/></body>)");
  EXPECT_EQ(checked.find("joint-unlimited"), nullptr);
  EXPECT_EQ(checked.find("damping-missing"), nullptr);
}

TEST(ModelCheck, UrdfEffortsAndLockedJoints) {
  const auto checked = check_text(R"(<robot name="arm"><link name="base"/>
<link name="a"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="first" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" velocity="1"/></joint>
<joint name="second" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="5" velocity="1"/></joint>
</robot>)");
  ASSERT_NE(checked.find("effort-missing"), nullptr);
  EXPECT_EQ(checked.find("effort-missing")->places.front().element, "joint 'first'");
  EXPECT_EQ(checked.find("effort-missing")->places.front().line, 4);
  EXPECT_EQ(checked.find("effort-missing")->places.size(), 1);
  EXPECT_EQ(checked.find("joint-locked"), nullptr);
  Model locked = checked.model;
  locked.joints[1].lower = locked.joints[1].upper;
  const std::vector<Finding> findings = check_model(locked, checked.facts, checked.bounds);
  const auto found = std::ranges::find(findings, "joint-locked", &Finding::kind);
  ASSERT_NE(found, findings.end());
  EXPECT_EQ(found->places.front().element, "joint 'second'");
  EXPECT_EQ(found->places.front().line, 5);
}

// ---- meshes ---------------------------------------------------------------------------------------------------------

const std::vector<Vec3> kCubeVertices = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {2, 2, 0},
                                         {0, 0, 2}, {2, 0, 2}, {0, 2, 2}, {2, 2, 2}};
const std::vector<std::array<int, 3>> kCubeFaces = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};

TEST(MeshFacts, ClosedAndOpenSurfaces) {
  EXPECT_EQ(open_edges(kCubeVertices, kCubeFaces), 0);
  EXPECT_NEAR(enclosed_volume(kCubeVertices, kCubeFaces), 8, 1e-12);
  std::vector<std::array<int, 3>> holed(kCubeFaces.begin() + 1, kCubeFaces.end());
  EXPECT_EQ(open_edges(kCubeVertices, holed), 3);
  // each triangle with vertices of its own
  std::vector<Vec3> soup;
  std::vector<std::array<int, 3>> faces;
  for (const auto& face : kCubeFaces) {
    const int first = static_cast<int>(soup.size());
    faces.push_back({first, first + 1, first + 2});
    for (const int v : face) soup.push_back(kCubeVertices[v]);
  }
  EXPECT_EQ(open_edges(soup, faces), 0);
}

// A prism over an L: legs of 10, thickness 1. Its area is 19, that of its hull 100 - 81 / 2.
std::string bracket_mesh(bool closed) {
  const std::vector<std::pair<int, int>> corners = {{0, 0}, {10, 0}, {10, 1}, {1, 1}, {1, 10}, {0, 10}};
  std::string vertices, faces;
  for (const int z : {0, 1}) {
    for (const auto& [x, y] : corners) vertices += fmt::format("{} {} {} ", x * 0.01, y * 0.01, z * 0.01);
  }
  for (const auto& [a, b, c] : {std::tuple{0, 1, 2}, std::tuple{0, 2, 3}, std::tuple{0, 3, 5}, std::tuple{3, 4, 5}}) {
    faces += fmt::format("{} {} {} {} {} {} ", a, c, b, a + 6, b + 6, c + 6);
  }
  for (int i = 0; i < (closed ? 6 : 5); ++i) {
    const int k = (i + 1) % 6;
    faces += fmt::format("{} {} {} {} {} {} ", i, k, k + 6, i, k + 6, i + 6);
  }
  return fmt::format(R"(<asset><mesh name="bracket" inertia="convex" vertex="{}" face="{}"/></asset>)", vertices,
                     faces);
}

constexpr const char* kBracketBody = R"(<geom type="plane" size="0 0 1"/>
    <body pos="0 0 1"><freejoint/><geom type="mesh" mesh="bracket"/></body>)";

TEST(ModelCheck, ConcaveMesh) {
  const auto checked = check_bodies(kBracketBody, bracket_mesh(true));
  ASSERT_EQ(checked.facts.meshes.size(), 1);
  EXPECT_EQ(checked.facts.meshes.front().triangles, 20);
  EXPECT_EQ(checked.find("mesh-open"), nullptr);
  ASSERT_NE(checked.find("mesh-concave"), nullptr);
  EXPECT_NEAR(checked.find("mesh-concave")->places.front().value, 59.5 / 19, 1e-3);
}

TEST(ModelCheck, OpenMesh) {
  const auto checked = check_bodies(kBracketBody, bracket_mesh(false));
  ASSERT_NE(checked.find("mesh-open"), nullptr);
  EXPECT_EQ(checked.find("mesh-open")->places.front().value, 4);
  EXPECT_EQ(checked.find("mesh-concave"), nullptr);
}

TEST(ModelCheck, HugeMesh) {
  const auto checked = check_bodies(kBracketBody, bracket_mesh(true));
  FileFacts facts = checked.facts;
  facts.meshes.front().triangles = 600'000;
  const std::vector<Finding> findings = check_model(checked.model, facts, checked.bounds);
  const auto huge = std::ranges::find(findings, "mesh-huge", &Finding::kind);
  ASSERT_NE(huge, findings.end());
  EXPECT_THAT(huge->places.front().text, HasSubstr("600000 triangles"));
}

TEST(ModelCheck, WhatIsToMendComesFirst) {
  const auto checked = check_bodies(disc("low", 0.1, R"(range="0.25 1")") + disc("other", 0.1, ""));
  EXPECT_TRUE(std::ranges::is_sorted(checked.findings, {}, &Finding::level));
  EXPECT_EQ(checked.findings.front().level, Level::kMend);
  EXPECT_EQ(checked.findings.back().level, Level::kKnow);
}

}  // namespace
}  // namespace assay
