#include "check/pairing/pairing.h"

#include <cmath>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "check/pairing/align.h"
#include "check/pairing/match.h"
#include "check/pairing/surfaces.h"
#include "load/mjcf.h"
#include "load/model_mjcf.h"
#include "message_of.h"
#include "model/kinematics.h"

namespace assay::pairing {
namespace {

using testing::HasSubstr;

constexpr const char* kArm = R"(<mujoco model="arm">
  <compiler angle="radian" autolimits="true"/>
  <worldbody>
    <body name="upper" pos="0 0 1" quat="0.9 0.1 0.3 -0.2">
      <joint name="shoulder" axis="0 1 0.2" damping="0.3" frictionloss="0.1" armature="0.01" range="-1 2"/>
      <inertial pos="0.1 0.01 0" mass="2" fullinertia="0.02 0.03 0.025 0.001 0.002 -0.001"/>
      <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03" friction="1.2"/>
      <body name="fore" pos="0.3 0 0" quat="0.9 0.3 0 0">
        <joint name="elbow" axis="0 1 0" damping="0.2" range="-2 2"/>
        <inertial pos="0.1 0 0.02" mass="1" fullinertia="0.005 0.012 0.013 0.0004 0 0"/>
        <geom type="box" size="0.1 0.02 0.03" pos="0.1 0 0" friction="1.1"/>
        <body name="tip" pos="0.2 0 0">
          <joint name="rail" type="slide" axis="1 0 0" damping="3" range="0 0.1"/>
          <inertial pos="0 0.01 0" mass="0.5" fullinertia="0.001 0.0012 0.0013 0 0 0"/>
          <geom type="sphere" size="0.04" friction="1.3"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="servo" joint="elbow" kp="30" kv="2" forcerange="-9 9"/>
    <motor name="drive" joint="shoulder" gear="3" ctrlrange="-5 5"/>
  </actuator>
</mujoco>)";

Side side_of(const Model& model) { return {.file = model.name, .model = model}; }

Model arm() { return load_model_text(kArm, "arm"); }

Comparison compared(const Model& a, const Model& b, const Options& options = {}) {
  return compare(side_of(a), side_of(b), options);
}

// Other frames in the bodies, and other names.
Model reframed(Model model) {
  std::vector<Pose> X_BF;  // the new frame in the old one
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const double turn = 0.5 + static_cast<double>(i);
    X_BF.push_back({Vec3(0.03, -0.05, 0.02) * turn, Quat(Eigen::AngleAxisd(turn, Vec3(1, 2, -1).normalized()))});
  }
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    Body& body = model.bodies[i];
    const Pose X_FB = X_BF[i].inverse();
    const Mat3 R = X_FB.q.toRotationMatrix();
    body.X_PB =
        (body.parent == kWorld ? Pose() : X_BF[static_cast<size_t>(body.parent)].inverse()) * body.X_PB * X_BF[i];
    body.p_BBcm = X_FB * body.p_BBcm;
    body.I_BBcm_B = R * body.I_BBcm_B * R.transpose();
    body.name = "part " + std::string(1, static_cast<char>('p' + i));
    if (body.joint < 0) continue;
    Joint& joint = model.joints[static_cast<size_t>(body.joint)];
    joint.p_BJ = X_FB * joint.p_BJ, joint.axis_B = X_FB.q * joint.axis_B;
    joint.name = std::string("axle ") + static_cast<char>('p' + i);
  }
  for (Shape& shape : model.shapes) {
    if (shape.body != kWorld) shape.X_BS = X_BF[static_cast<size_t>(shape.body)].inverse() * shape.X_BS;
  }
  bodies_from_joints(model, model.initial);
  return model;
}

TEST(Pairing, OtherFramesAndNamesAreNoDifference) {
  const Comparison comparison = compared(arm(), reframed(arm()));
  EXPECT_EQ(comparison.joints_matched, 3U);
  EXPECT_TRUE(comparison.findings.empty());
  for (const Difference& d : comparison.differences)
    ADD_FAILURE() << d.element << ": " << d.parameter << " " << d.words;
}

TEST(Pairing, AnotherZeroOfTheReferenceIsNoDifference) {
  Model other = arm();
  Joint& joint = other.joints[1];
  Body& body = other.bodies[static_cast<size_t>(joint.body)];
  joint.reference = 0.4;  // at 0.4 it lies where it did
  const Quat turn(Eigen::AngleAxisd(0.4, joint.axis_B));
  body.X_PB = body.X_PB * Pose{joint.p_BJ - turn * joint.p_BJ, turn};
  EXPECT_TRUE(compared(arm(), other).same());
}

struct Change {
  const char *element, *parameter;
  std::function<void(Model&)> make;
};

class OneChange : public testing::TestWithParam<Change> {};

TEST_P(OneChange, IsTheOneDifferenceInAnyFrames) {
  for (const bool other_frames : {false, true}) {
    Model model = other_frames ? reframed(arm()) : arm();
    GetParam().make(model);
    const Comparison comparison = compared(arm(), model);
    ASSERT_EQ(comparison.differences.size(), 1U)
        << other_frames << (comparison.differences.empty() ? "" : comparison.differences[1].words);
    EXPECT_EQ(comparison.differences[0].element, GetParam().element);
    EXPECT_EQ(comparison.differences[0].parameter, GetParam().parameter);
    EXPECT_GT(comparison.differences[0].effect, 1e-5);
    EXPECT_DOUBLE_EQ(comparison.differences[0].share, 1);
    EXPECT_TRUE(comparison.findings.empty());
  }
}

INSTANTIATE_TEST_SUITE_P(
    Pairing, OneChange,
    testing::Values(Change{"body 'fore'", "mass", [](Model& m) { m.bodies[1].mass *= 1.01; }},
                    Change{"body 'tip'", "inertia", [](Model& m) { m.bodies[2].I_BBcm_B *= 1.01; }},
                    Change{"body 'upper'", "centre of mass", [](Model& m) { m.bodies[0].p_BBcm.y() += 0.001; }},
                    Change{"joint 'elbow'", "damping", [](Model& m) { m.joints[1].damping *= 1.01; }},
                    Change{"joint 'shoulder'", "dry friction", [](Model& m) { m.joints[0].dry_friction *= 1.01; }},
                    Change{"joint 'shoulder'", "armature", [](Model& m) { m.joints[0].armature *= 1.01; }},
                    Change{"joint 'rail'", "upper limit", [](Model& m) { m.joints[2].upper *= 1.01; }},
                    Change{"joint 'elbow'", "axis",
                           [](Model& m) {
                             Vec3& axis = m.joints[1].axis_B;
                             axis = Eigen::AngleAxisd(0.5 * M_PI / 180, axis.unitOrthogonal()) * axis;
                           }},
                    Change{"joint 'elbow'", "offset", [](Model& m) { m.bodies[1].X_PB.p.x() += 0.001; }},
                    Change{"joint 'elbow'", "anchor",
                           [](Model& m) { m.joints[1].p_BJ += 0.001 * m.joints[1].axis_B.unitOrthogonal(); }},
                    Change{"actuator 'servo'", "position gain (kp)",
                           [](Model& m) { m.actuators[0].gain *= 1.01, m.actuators[0].bias[1] *= 1.01; }},
                    Change{"actuator 'drive'", "gear", [](Model& m) { m.actuators[1].terms[0].coefficient *= 1.01; }},
                    Change{"actuator 'servo'", "force range, upper",
                           [](Model& m) { m.actuators[0].force_upper *= 1.01; }},
                    Change{"body 'tip'", "collision shape", [](Model& m) { m.shapes[2].radius *= 1.01; }}));

TEST(Pairing, LargestEffectComesFirst) {
  Model other = arm();
  other.joints[0].armature *= 1.01;
  other.bodies[0].mass *= 1.2;
  other.joints[1].damping *= 1.02;
  const Comparison comparison = compared(arm(), other);
  ASSERT_EQ(comparison.differences.size(), 3U);
  EXPECT_EQ(comparison.differences[0].parameter, "mass");
  EXPECT_GE(comparison.differences[1].effect, comparison.differences[2].effect);
  EXPECT_NEAR(comparison.differences[0].share + comparison.differences[1].share + comparison.differences[2].share, 1,
              1e-12);
  EXPECT_TRUE(comparison.differs_above(0.01));
  EXPECT_FALSE(comparison.differs_above(10));
}

// The axis points the other way; limits and drive follow it.
TEST(Pairing, TurnedRoundAxisIsOneFinding) {
  Model other = arm();
  Joint& joint = other.joints[0];
  joint.axis_B = -joint.axis_B;
  std::swap(joint.lower, joint.upper);
  joint.lower = -joint.lower, joint.upper = -joint.upper;
  const Comparison comparison = compared(arm(), other);
  ASSERT_EQ(comparison.findings.size(), 1U);
  EXPECT_EQ(comparison.findings[0].element, "joint 'shoulder'");
  EXPECT_TRUE(comparison.differences.empty()) << comparison.differences[0].words;
}

// What one file has as a joint and the other holds is one finding; masses are compared together.
TEST(Pairing, JointThatOneFileHoldsIsOneFinding) {
  const Model held = locked(arm(), {2}).model;
  ASSERT_EQ(held.bodies.size(), 2U);
  EXPECT_NEAR(held.total_mass(), arm().total_mass(), 1e-12);
  const Comparison comparison = compared(arm(), held);
  ASSERT_EQ(comparison.findings.size(), 1U);
  EXPECT_THAT(comparison.findings[0].element, HasSubstr("'rail'"));
  for (const Difference& d : comparison.differences)
    ADD_FAILURE() << d.element << ": " << d.parameter << " " << d.words;
}

TEST(Pairing, MapDecidesAndIsChecked) {
  Model other = arm();
  other.joints[1].name = "shoulder", other.joints[0].name = "elbow";
  std::swap(other.bodies[0].name, other.bodies[1].name);
  const Comparison comparison = compared(arm(), other, {.map = {{"shoulder", "elbow"}, {"elbow", "shoulder"}}});
  EXPECT_TRUE(comparison.same());
  EXPECT_THAT(message_of<InputError>([] { compared(arm(), arm(), {.map = {{"sholder", "elbow"}}}); }),
              HasSubstr("--map names 'sholder'"));
  EXPECT_THAT(message_of<InputError>([] { compared(arm(), arm(), {.map = {{"rail", "elbow"}}}); }),
              HasSubstr("different types"));
}

// Names that lie elsewhere do not count where other joints coincide.
TEST(Pairing, MisleadingNamesAreLeft) {
  Model other = arm();
  other.joints[1].name = "shoulder", other.joints[0].name = "elbow";
  std::swap(other.bodies[0].name, other.bodies[1].name);
  const Comparison comparison = compared(arm(), other);
  EXPECT_TRUE(comparison.same());
  for (const Match& match : comparison.matches) {
    if (match.a != "shoulder") continue;
    EXPECT_EQ(match.b, "elbow");
  }
}

TEST(Pairing, FilesThatAreNoPairSaySo) {
  const Model other = load_model_text(R"(<mujoco><worldbody>
    <body><joint type="slide" axis="0 0 1"/><geom size="0.1" mass="1"/>
      <body pos="0 0 3"><joint type="ball"/><geom size="0.1" mass="1"/>
        <body pos="0 3 3"><joint type="slide" axis="1 0 0"/><geom size="0.1" mass="1"/></body></body></body>
  </worldbody></mujoco>)",
                                      "other");
  EXPECT_THAT(message_of<InputError>([&] { compared(arm(), other); }), HasSubstr("joints match: give --map"));
}

// B with A's values is A, in B's frames.
TEST(Pairing, AgreedIsThePair) {
  Model other = reframed(arm());
  other.bodies[1].mass *= 1.1, other.bodies[2].p_BBcm.x() += 0.01;
  other.joints[0].damping *= 2, other.joints[1].upper = 1;
  other.joints[1].axis_B = Eigen::AngleAxisd(0.1, Vec3::UnitX()) * other.joints[1].axis_B;
  other.bodies[1].X_PB.p.x() += 0.01;
  other.actuators[1].terms[0].coefficient = 4;
  EXPECT_FALSE(compared(arm(), other).same());
  const Model written = load_model_text(model_mjcf(agreed(side_of(arm()), side_of(other), {})), "written");
  const Comparison comparison = compared(arm(), written);
  EXPECT_TRUE(comparison.findings.empty());
  for (const Difference& d : comparison.differences)
    ADD_FAILURE() << d.element << ": " << d.parameter << " " << d.words;
}

// ---- surfaces -------------------------------------------------------------------------------------------------------

Shape rounded(ShapeType type, double radius, double half_length = 0) {
  Shape shape;
  shape.type = type, shape.radius = radius, shape.half_length = half_length;
  return shape;
}
Shape sized(ShapeType type, const Vec3& half_size) {
  Shape shape;
  shape.type = type, shape.half_size = half_size;
  return shape;
}

TEST(Surfaces, DistancesAreClosedForms) {
  const Model model;
  const Shape sphere = rounded(ShapeType::kSphere, 0.3), capsule = rounded(ShapeType::kCapsule, 0.1, 0.2),
              cylinder = rounded(ShapeType::kCylinder, 0.1, 0.2), box = sized(ShapeType::kBox, {0.1, 0.2, 0.3}),
              ellipsoid = sized(ShapeType::kEllipsoid, {0.1, 0.2, 0.3});
  EXPECT_NEAR(signed_distance(model, sphere, {0, 0.5, 0}), 0.2, 1e-12);
  EXPECT_NEAR(signed_distance(model, capsule, {0, 0.3, 0.2}), 0.2, 1e-12);
  EXPECT_NEAR(signed_distance(model, capsule, {0, 0, 0.5}), 0.2, 1e-12);
  EXPECT_NEAR(signed_distance(model, cylinder, {0.4, 0, 0.6}), 0.5, 1e-12);
  EXPECT_NEAR(signed_distance(model, cylinder, {0.05, 0, 0}), -0.05, 1e-12);
  EXPECT_NEAR(signed_distance(model, box, {0.1, 0.5, 0.7}), 0.5, 1e-12);
  EXPECT_NEAR(signed_distance(model, box, {0.09, 0, 0}), -0.01, 1e-12);
  EXPECT_NEAR(signed_distance(model, ellipsoid, {0, 0.5, 0}), 0.3, 1e-9);
  EXPECT_NEAR(signed_distance(model, ellipsoid, {0, 0, 0}), -0.1, 1e-9);
  // the foot of a point outside lies along the surface's normal
  const Vec3 foot = Vec3(0.1, 0.2, 0.3).cwiseProduct(Vec3(1, 2, -1).normalized());
  const Vec3 normal = foot.cwiseQuotient(Vec3(0.01, 0.04, 0.09)).normalized();
  EXPECT_NEAR(signed_distance(model, ellipsoid, foot + 0.05 * normal), 0.05, 1e-9);
  EXPECT_NEAR(signed_distance(model, ellipsoid, foot - 0.004 * normal), -0.004, 1e-9);
}

TEST(Surfaces, PointsLieOnTheSurface) {
  const Model model;
  for (const ShapeType type :
       {ShapeType::kSphere, ShapeType::kCapsule, ShapeType::kCylinder, ShapeType::kBox, ShapeType::kEllipsoid}) {
    Shape shape = sized(type, {0.1, 0.2, 0.3});
    shape.radius = 0.1, shape.half_length = 0.2;
    for (const Vec3& p : surface_points(model, shape)) EXPECT_NEAR(signed_distance(model, shape, p), 0, 1e-9);
  }
}

TEST(Surfaces, HullOfABoxIsTheBox) {
  Model model;
  Hull hull;
  for (int k = 0; k < 8; ++k)
    hull.vertices.emplace_back((k & 1) != 0 ? 0.1 : -0.1, (k & 2) != 0 ? 0.2 : -0.2, (k & 4) != 0 ? 0.3 : -0.3);
  hull.faces = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  model.hulls = {hull};
  const Shape box = sized(ShapeType::kBox, {0.1, 0.2, 0.3});
  Shape mesh;
  mesh.type = ShapeType::kHull, mesh.data = 0;
  for (const Vec3& p : {Vec3(0.3, 0.1, 0), Vec3(0.2, 0.4, 0.5), Vec3(0.05, 0.1, 0), Vec3(-0.4, 0, 0.31)}) {
    EXPECT_NEAR(signed_distance(model, mesh, p), signed_distance(model, box, p), 1e-12);
  }
  EXPECT_NEAR(surface_distance({&model, {&box}}, {&model, {&mesh}}), 0, 1e-9);
  const Shape larger = sized(ShapeType::kBox, {0.1, 0.2, 0.31});
  EXPECT_NEAR(surface_distance({&model, {&larger}}, {&model, {&mesh}}), 0.01, 1e-9);
}

// A shape within another one of its own set is no surface.
TEST(Surfaces, InnerShapesDoNotCount) {
  const Model model;
  const Shape outer = rounded(ShapeType::kSphere, 0.3), inner = sized(ShapeType::kBox, {0.05, 0.05, 0.05});
  EXPECT_NEAR(surface_distance({&model, {&outer, &inner}}, {&model, {&outer}}), 0, 1e-12);
}

TEST(Surfaces, BestFitLeavesOutliersAside) {
  const Pose X{Vec3(0.1, -0.2, 0.4), Quat(Eigen::AngleAxisd(0.7, Vec3(1, 1, 0.3).normalized()))};
  const std::vector<Vec3> from = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.5, 0.4, 0.2}, {-0.3, 0.2, 0.6}};
  std::vector<Vec3> to;
  for (const Vec3& p : from) to.push_back(X * p);
  to[4] += Vec3(0.05, 0, 0);
  const auto fit = best_fit(from, to);
  ASSERT_TRUE(fit.has_value());
  EXPECT_LT((fit->p - X.p).norm(), 1e-5);
  EXPECT_LT(fit->q.angularDistance(X.q), 1e-5);
}

}  // namespace
}  // namespace assay::pairing
