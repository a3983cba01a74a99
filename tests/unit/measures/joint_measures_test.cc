// Measures over slides, ball joints, tendons and solids: conserved quantities of the reference solution, and geometry
// in closed form.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "conformance/models.h"
#include "measures/mechanics.h"
#include "measures/reference/smooth.h"
#include "measures/violation.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using namespace conformance;

TEST(MechanicsTest, EnergyOfAllJointsIsConserved) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    Model model = random_tree(seed, {});
    for (Joint& joint : model.joints) joint.stiffness = 1.5, joint.armature = 0.02;
    for (BallJoint& ball : model.balls) {
      ball.stiffness = 0.8, ball.armature = 0.03;
      ball.spring_reference = Quat(Eigen::AngleAxisd(0.4, Vec3::UnitX()));
    }
    model.tendons.push_back({.name = "t", .terms = {{0, 1.0}, {1, -0.7}}, .stiffness = 4});
    ASSERT_TRUE(conserved_quantities(model).energy);
    const State end = smooth_solution(model, model.initial, 0.2);
    const double before = kinetic_energy(model, model.initial) + potential_energy(model, model.initial);
    EXPECT_NEAR(kinetic_energy(model, end) + potential_energy(model, end), before, 1e-11 * std::abs(before) + 1e-11);
    model.tendons[0].damping = 0.1;
    EXPECT_FALSE(conserved_quantities(model).energy);
    model.tendons[0].damping = 0;
    model.joints[0].dry_friction = 0.1;
    EXPECT_FALSE(conserved_quantities(model).energy);
  }
}

TEST(MechanicsTest, ABallAtTheRootConservesNoMomentum) {
  Model model;
  model.gravity.setZero();
  add_ball_body(model, "ball", kWorld, {}, sphere_solid(1, 0.1), {0.1, 0, 0});
  model = finished(std::move(model));
  EXPECT_FALSE(conserved_quantities(model).linear_momentum);
  EXPECT_FALSE(conserved_quantities(model).angular_momentum_axis.has_value());
}

TEST(ViolationTest, SlidesAndBallsApart) {
  Model model;
  add_sliding_body(model, "slide", kWorld, {}, sphere_solid(1, 0.1), Vec3::UnitZ());
  BallJoint& ball = add_ball_body(model, "ball", kWorld, {}, sphere_solid(1, 0.1), {0.1, 0, 0});
  ball.limited = true;
  ball.upper = 0.5;
  model = finished(std::move(model));
  State state = with_joints(model, {0.3}, {0});
  EXPECT_NEAR(violation(model, state).dislocation, 0, 1e-15);
  state.bodies[0].p_WBcm += Vec3(0.003, 0.004, 7);  // along the axis it may move
  EXPECT_NEAR(violation(model, state).dislocation, 0.005, 1e-14);
  state.bodies[0].q_WB = Quat(Eigen::AngleAxisd(0.02, Vec3::UnitZ()));  // about its own axis too it may not turn
  EXPECT_NEAR(violation(model, state).misalignment, 0.02, 1e-14);
  set_ball(model, state, 0, Quat(Eigen::AngleAxisd(0.8, Vec3::UnitY())), Vec3::Zero());
  bodies_from_joints(model, state);
  state.bodies[1].p_WBcm.y() += 0.25;
  EXPECT_NEAR(violation(model, state).dislocation, 0.25, 1e-14);
  EXPECT_NEAR(violation(model, state).limit, 0.3, 1e-14);
}

TEST(ViolationTest, SolidsInAPlane) {
  Model model;
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  const Quat tilted(Eigen::AngleAxisd(0.3, Vec3::UnitY()));
  for (const ShapeType type : {ShapeType::kBox, ShapeType::kHull, ShapeType::kCylinder, ShapeType::kEllipsoid}) {
    const int body = static_cast<int>(model.bodies.size());
    add_free_body(model, "solid", sphere_solid(1, 0.1), {Vec3(0, 0, 0.1), tilted});
    const int shape = add_shape(model, type, body, {}, 0.1, 0.2);
    model.shapes[shape].half_size = {0.2, 0.1, 0.1};
    model.shapes[shape].data = 0;
    add_contact(model, plane, shape, 1);
  }
  model.hulls.push_back(box_hull({0.2, 0.1, 0.1}));
  model = finished(std::move(model));
  const double s = std::sin(0.3), c = std::cos(0.3);
  const std::vector<double> reach = {0.2 * s + 0.1 * c, 0.2 * s + 0.1 * c, 0.1 * s + 0.2 * c,
                                     std::hypot(0.2 * s, 0.1 * c)};
  const Separations separations(model);
  for (size_t i = 0; i < reach.size(); ++i) {
    EXPECT_NEAR(separations.of(static_cast<int>(i), model.initial), 0.1 - reach[i], 1e-14) << i;
  }
  EXPECT_NEAR(violation(model, model.initial).penetration, reach[2] - 0.1, 1e-14);
}

// Two solids on one line that runs along their flat sides' normals, turned and moved as a whole: the depth is that of
// the untouched line.
TEST(Measures, PenetrationOfSolidsInEachOther) {
  const Pose X_WL = {Vec3(0.7, -1.3, 0.4), Quat(Eigen::AngleAxisd(1.1, Vec3(1, 2, -2).normalized()))};
  struct Solid {
    ShapeType type;
    double reach;  // along the line
  };
  // half extents 0.2, 0.1, 0.1; the hull's frame is not at its middle
  const Solid solids[] = {
      {ShapeType::kBox, 0.2}, {ShapeType::kHull, 0.25}, {ShapeType::kEllipsoid, 0.2}, {ShapeType::kSphere, 0.1}};
  for (const Solid& a : solids) {
    for (const Solid& b : solids) {
      if (a.type == ShapeType::kSphere && b.type == ShapeType::kSphere) continue;
      Model model;
      constexpr double kDepth = 0.004;
      const double apart = a.reach + b.reach - kDepth;
      for (int k = 0; k < 2; ++k) {
        const Solid& solid = k == 0 ? a : b;
        // the second one looks back
        const Quat turned = k == 0 ? Quat(Quat::Identity()) : Quat(Eigen::AngleAxisd(std::numbers::pi, Vec3::UnitZ()));
        const Pose X_LB = {Vec3(k * apart, 0, 0), turned};
        add_free_body(model, k == 0 ? "a" : "b", sphere_solid(1, 0.1), X_WL * X_LB);
        const int shape = add_shape(model, solid.type, k, {}, 0.1, 0.2);
        model.shapes[shape].half_size = {0.2, 0.1, 0.1};
        model.shapes[shape].data = 0;
      }
      add_contact(model, 0, 1, 1);
      model.hulls.push_back(box_hull({0.2, 0.1, 0.1}));
      for (Vec3& vertex : model.hulls[0].vertices) vertex.x() += 0.05;
      model = finished(std::move(model));
      // between two smooth shapes the narrow phase expands a polytope that only approaches them
      const bool smooth = a.type == ShapeType::kEllipsoid && b.type == ShapeType::kEllipsoid;
      EXPECT_NEAR(violation(model, model.initial).penetration, kDepth, smooth ? 5e-5 : 1e-6)
          << static_cast<int>(a.type) << " " << static_cast<int>(b.type);
      State away = model.initial;
      away.bodies[1].p_WBcm += X_WL.q * Vec3(kDepth + 1e-5, 0, 0);
      EXPECT_EQ(violation(model, away).penetration, 0);
    }
  }
}

}  // namespace
}  // namespace assay
