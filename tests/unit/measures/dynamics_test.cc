// Joint-space dynamics and the reference solution with every joint: against closed forms, conserved quantities, and
// models that are the same mechanism in other words.
#include "measures/reference/dynamics.h"

#include <cmath>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "conformance/models.h"
#include "measures/reference/closed_form.h"
#include "measures/reference/smooth.h"
#include "model/kinematics.h"

namespace assay {
namespace {

using namespace conformance;
using testing::HasSubstr;

constexpr unsigned kSeeds = 12;

double energy_of_motion(const Model& model, const State& state) {
  double energy = 0;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const BodyState& s = state.bodies[i];
    const Vec3 w_B = s.q_WB.conjugate() * s.w_WB;
    energy += body.mass * s.v_WBcm.squaredNorm() / 2 + w_B.dot(body.I_BBcm_B * w_B) / 2;
  }
  return energy;
}

double energy_of_height(const Model& model, const State& state) {
  double energy = 0;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    energy -= model.bodies[i].mass * model.gravity.dot(state.bodies[i].p_WBcm);
  }
  for (size_t j = 0; j < model.joints.size(); ++j) {
    energy += model.joints[j].stiffness * std::pow(state.position[j] - model.joints[j].spring_reference, 2) / 2;
  }
  for (size_t k = 0; k < model.balls.size(); ++k) {
    const BallJoint& ball = model.balls[k];
    const Quat deflection = ball.spring_reference.conjugate() * ball_rotation(model, state, static_cast<int>(k));
    energy += ball.stiffness * rotation_vector(deflection).squaredNorm() / 2;
  }
  for (const Tendon& tendon : model.tendons) {
    const double length = sum_of_terms(tendon.terms, state.position);
    energy += tendon.stiffness * std::pow(length - std::clamp(length, tendon.rest_lower, tendon.rest_upper), 2) / 2;
  }
  return energy;
}

double armature_energy(const Model& model, const State& state) {
  double energy = 0;
  for (size_t j = 0; j < model.joints.size(); ++j) {
    energy += model.joints[j].armature * state.velocity[j] * state.velocity[j] / 2;
  }
  for (size_t k = 0; k < model.balls.size(); ++k) {
    energy += model.balls[k].armature * ball_velocity(model, state, static_cast<int>(k)).squaredNorm() / 2;
  }
  return energy;
}

// Every joint with a spring and armature, and a tendon over the first two joints.
Model with_springs(Model model) {
  for (Joint& joint : model.joints) {
    joint.stiffness = 1.5;
    joint.spring_reference = 0.1;
    joint.armature = 0.02;
  }
  for (BallJoint& ball : model.balls) {
    ball.stiffness = 0.8;
    ball.spring_reference = Quat(Eigen::AngleAxisd(0.4, Vec3(1, 2, 2) / 3));
    ball.armature = 0.03;
  }
  Tendon tendon;
  tendon.name = "tendon";
  tendon.terms = {{0, 1.0}, {1, -0.7}};
  tendon.stiffness = 4;
  tendon.rest_lower = -0.05;
  tendon.rest_upper = 0.05;
  model.tendons.push_back(tendon);
  return model;
}

TEST(DynamicsTest, InertiaMatrixIsThatOfTheKineticEnergy) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const Model model = with_springs(random_tree(seed, {}));
    Dynamics dynamics(model);
    ASSERT_EQ(dynamics.size(), model.dof());
    const State& state = model.initial;
    const Eigen::VectorXd v = dynamics.velocities(state);
    const double energy = energy_of_motion(model, state) + armature_energy(model, state);
    EXPECT_NEAR(v.dot(dynamics.mass_matrix(state) * v) / 2, energy, 1e-12 * energy) << seed;
    // and the bodies' velocities are those of the joints' frames: no joint of the mechanism is read wrongly
    State moved = state;
    joints_from_bodies(model, moved);
    for (size_t j = 0; j < model.joints.size(); ++j) {
      EXPECT_NEAR(moved.velocity[j], state.velocity[j], 1e-11) << seed << " joint " << j;
      EXPECT_NEAR(moved.position[j], state.position[j], 1e-11) << seed << " joint " << j;
    }
  }
}

TEST(DynamicsTest, AccelerationsSolveTheEquationsOfMotion) {
  const Model model = with_springs(random_tree(3, {}));
  Dynamics dynamics(model);
  const State& state = model.initial;
  std::vector<double> forces(static_cast<size_t>(dynamics.size()));
  for (size_t k = 0; k < forces.size(); ++k) forces[k] = std::sin(static_cast<double>(k) + 1);
  const Eigen::Map<const Eigen::VectorXd> f(forces.data(), dynamics.size());
  const Eigen::VectorXd residual = dynamics.mass_matrix(state) * dynamics.accelerations(state, forces) +
                                   dynamics.bias_forces(state) - dynamics.spring_forces(state) - f;
  EXPECT_LT(residual.norm(), 1e-12 * dynamics.bias_forces(state).norm());
}

// Power: the kinetic energy grows by what gravity, springs and forces do, for any velocities. A wrong Coriolis term or
// spring fails here or in the conserved quantities below.
TEST(SmoothSolutionTest, KeepsEnergyWithAllJoints) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const Model model = with_springs(random_tree(seed, {}));
    const auto energy = [&](const State& state) {
      return energy_of_motion(model, state) + armature_energy(model, state) + energy_of_height(model, state);
    };
    const double before = energy(model.initial);
    for (const State& state : smooth_solution(model, model.initial, {0.1, 0.3})) {
      EXPECT_NEAR(energy(state), before, 1e-11 * std::abs(before) + 1e-11) << seed << " at " << state.time;
    }
  }
}

TEST(SmoothSolutionTest, KeepsMomentaWithAllJoints) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    Model model = without_gravity(random_tree(seed, {.bodies = 4}));
    // only the floating tree: the world holds the other
    const auto second = std::ranges::find_if(
        model.bodies, [&](const Body& b) { return b.parent == kWorld && &b != &model.bodies.front(); });
    const int kept = static_cast<int>(second - model.bodies.begin());
    const auto momenta = [&](const State& state) {
      Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
      for (int i = 0; i < kept; ++i) {
        const Body& body = model.bodies[i];
        const BodyState& s = state.bodies[i];
        linear += body.mass * s.v_WBcm;
        angular += body.mass * s.p_WBcm.cross(s.v_WBcm) + s.q_WB * (body.I_BBcm_B * (s.q_WB.conjugate() * s.w_WB));
      }
      return std::pair(linear, angular);
    };
    const auto [linear, angular] = momenta(model.initial);
    const auto [linear_end, angular_end] = momenta(smooth_solution(model, model.initial, 0.4));
    EXPECT_LT((linear_end - linear).norm(), 1e-12) << seed;
    EXPECT_LT((angular_end - angular).norm(), 1e-12) << seed;
  }
}

TEST(SmoothSolutionTest, SlidesAndABallInARowAreAFreeBody) {
  const Vec3 moments(0.01, 0.02, 0.025), w(0.5, 4, 0.3);
  const Quat q_BI(Eigen::AngleAxisd(1.1, Vec3(2, -1, 2) / 3));
  const Solid solid = principal_solid(1.3, {0.1, -0.05, 0.02}, moments, q_BI);
  Model composed;
  add_sliding_body(composed, "x", kWorld, {}, massless(), Vec3::UnitX());
  add_sliding_body(composed, "y", 0, {}, massless(), Vec3::UnitY());
  add_sliding_body(composed, "z", 1, {}, massless(), Vec3::UnitZ());
  add_ball_body(composed, "top", 2, {}, solid);
  composed = finished(std::move(composed));
  Model free;
  add_free_body(free, "top", solid);
  free = finished(std::move(free));

  State start = composed.initial;
  start.position = {0.3, -0.2, 0.5};
  start.velocity = {1, 0.5, -0.7};
  bodies_from_joints(composed, start);
  set_ball(composed, start, 0, Quat::Identity(), q_BI * w);
  bodies_from_joints(composed, start);
  State free_start = free.initial;
  free_start.bodies[0] = start.bodies[3];
  const BodyState end = smooth_solution(composed, start, 1.5).bodies[3];
  const BodyState expected = smooth_solution(free, free_start, 1.5).bodies[0];
  EXPECT_LT((end.p_WBcm - expected.p_WBcm).norm(), 1e-12);
  EXPECT_LT((end.v_WBcm - expected.v_WBcm).norm(), 1e-12);
  EXPECT_LT((end.w_WB - expected.w_WB).norm(), 1e-11);
  EXPECT_LT((end.q_WB.toRotationMatrix() - expected.q_WB.toRotationMatrix()).norm(), 1e-11);
}

TEST(SmoothSolutionTest, ThreeHingesInARowAreABall) {
  const Solid bob = principal_solid(0.8, {0.1, 0.05, -0.4}, {0.02, 0.03, 0.012}, Quat::Identity());
  const Pose X_WB = {Vec3(0, 0, 1), Quat(Eigen::AngleAxisd(0.3, Vec3::UnitY()))};
  Model hinges, ball;
  add_hinged_body(hinges, "x", kWorld, X_WB, massless(), Vec3::UnitX(), {0.01, 0, 0});
  add_hinged_body(hinges, "y", 0, {}, massless(), Vec3::UnitY(), {0.01, 0, 0});
  add_hinged_body(hinges, "bob", 1, {}, bob, Vec3::UnitZ(), {0.01, 0, 0});
  add_ball_body(ball, "bob", kWorld, X_WB, bob, {0.01, 0, 0});
  hinges = finished(std::move(hinges));
  ball = finished(std::move(ball));
  const State start = with_joints(hinges, {0.5, -0.3, 0.2}, {1, 2, -1});
  State ball_start = ball.initial;
  ball_start.bodies[0] = start.bodies[2];
  const BodyState end = smooth_solution(hinges, start, 0.7).bodies[2];
  const BodyState expected = smooth_solution(ball, ball_start, 0.7).bodies[0];
  EXPECT_LT((end.p_WBcm - expected.p_WBcm).norm(), 1e-11);
  EXPECT_LT((end.w_WB - expected.w_WB).norm(), 1e-10);
}

TEST(SmoothSolutionTest, ASlideOnASpringOscillates) {
  Model model;
  Joint& slide = add_sliding_body(model, "block", kWorld, {Vec3(1, 2, 3), Quat(Eigen::AngleAxisd(0.8, Vec3::UnitX()))},
                                  sphere_solid(2, 0.1), {1, 2, 2}, {0.3, 0.1, 0});
  slide.reference = 0.4;
  slide.spring_reference = 0.1;
  slide.stiffness = 50;
  slide.damping = 1.2;
  slide.armature = 0.5;
  model.gravity.setZero();
  model = finished(std::move(model));
  const State end = smooth_solution(model, with_joints(model, {0.25}, {-0.6}), 1.3);
  const Motion expected = damped_oscillator(2.5, 50, 1.2, {0.15, -0.6}, 1.3);
  EXPECT_NEAR(end.position[0], 0.1 + expected.position, 1e-14);
  EXPECT_NEAR(end.velocity[0], expected.velocity, 1e-13);
}

// ---- equality constraints -------------------------------------------------------------------------------------------

TEST(SmoothSolutionTest, AConnectedBodySwingsAsOnABallJoint) {
  const Solid bob = principal_solid(0.8, {0.1, 0.05, -0.4}, {0.02, 0.03, 0.012}, Quat::Identity());
  const Vec3 anchor(0.02, -0.01, 0.05);
  Model ball, connected;
  add_ball_body(ball, "bob", kWorld, {Vec3(0, 0, 1), Quat::Identity()}, bob, anchor);
  ball = finished(std::move(ball));
  add_free_body(connected, "bob", bob, {Vec3(0, 0, 1), Quat::Identity()});
  connected.connects.push_back({"pin", 0, kWorld, anchor, Vec3(0, 0, 1) + anchor});
  connected = finished(std::move(connected));
  State start = ball.initial;
  set_ball(ball, start, 0, Quat(Eigen::AngleAxisd(0.6, Vec3(1, 2, 2) / 3)), {1, -2, 3});
  bodies_from_joints(ball, start);
  const BodyState expected = smooth_solution(ball, start, 0.8).bodies[0];
  const BodyState end = smooth_solution(connected, start, 0.8).bodies[0];
  EXPECT_LT((end.p_WBcm - expected.p_WBcm).norm(), 1e-12);
  EXPECT_LT((end.w_WB - expected.w_WB).norm(), 1e-11);
}

TEST(SmoothSolutionTest, WeldedBodiesMoveAsOne) {
  const Solid half = principal_solid(1, {0.05, 0, 0}, {0.01, 0.02, 0.015}, Quat::Identity());
  const Pose X_AB = {Vec3(0.3, 0.1, -0.1), Quat(Eigen::AngleAxisd(0.7, Vec3(2, -1, 2) / 3))};
  Model model;
  add_free_body(model, "a", half, {Vec3(0, 0, 1), Quat::Identity()});
  add_free_body(model, "b", half, Pose{Vec3(0, 0, 1), Quat::Identity()} * X_AB);
  model.welds.push_back({"weld", 0, 1, X_AB});
  model = finished(std::move(model));

  // one body of both halves
  const Vec3 other = X_AB * half.p_BBcm, centre = (half.p_BBcm + other) / 2;
  const Mat3 R = X_AB.q.toRotationMatrix();
  const auto steiner = [](const Vec3& r) { return Mat3(r.squaredNorm() * Mat3::Identity() - r * r.transpose()); };
  const Mat3 inertia =
      half.I_BBcm_B + steiner(half.p_BBcm - centre) + R * half.I_BBcm_B * R.transpose() + steiner(other - centre);
  Model whole;
  add_free_body(whole, "whole", {2, centre, inertia}, {Vec3(0, 0, 1), Quat::Identity()});
  whole = finished(std::move(whole));
  State start = whole.initial;
  start.bodies[0].w_WB = {3, 1, -2};
  start.bodies[0].v_WBcm = {0.5, 0.2, 1};
  State halves = model.initial;
  for (BodyState& body : halves.bodies) {
    body.w_WB = start.bodies[0].w_WB;
    body.v_WBcm = start.bodies[0].v_WBcm + body.w_WB.cross(body.p_WBcm - start.bodies[0].p_WBcm);
  }
  const State end = smooth_solution(model, halves, 1);
  const BodyState expected = smooth_solution(whole, start, 1).bodies[0];
  EXPECT_LT(((end.bodies[0].p_WBcm + end.bodies[1].p_WBcm) / 2 - expected.p_WBcm).norm(), 1e-12);
  EXPECT_LT((end.bodies[0].q_WB.toRotationMatrix() - expected.q_WB.toRotationMatrix()).norm(), 1e-11);
  EXPECT_LT((end.bodies[1].w_WB - expected.w_WB).norm(), 1e-11);
}

TEST(SmoothSolutionTest, CoupledJointsShareTheirInertia) {
  // two balanced wheels without gravity, the second held at 0.3 - 2.5 times the first
  Model model;
  model.gravity.setZero();
  add_hinged_body(model, "first", kWorld, {}, principal_solid(1, Vec3::Zero(), {1, 1, 0.02}, Quat::Identity()),
                  Vec3::UnitZ());
  add_hinged_body(model, "second", kWorld, {}, principal_solid(1, Vec3::Zero(), {1, 1, 0.01}, Quat::Identity()),
                  Vec3::UnitZ());
  model.couplings.push_back({"gears", 1, {{0, -2.5}}, 0.3});
  model = finished(std::move(model));
  SmoothOptions options;
  options.torques = [](double, std::span<const double>, std::span<const double>, std::span<double> torque) {
    torque[0] = 0.4;
    torque[1] = 0.1;
  };
  const State end = smooth_solution(model, with_joints(model, {0.1, 0.05}, {0.2, -0.5}), 1, options);
  const double rate = (0.4 - 2.5 * 0.1) / (0.02 + 2.5 * 2.5 * 0.01);
  EXPECT_NEAR(end.position[0], 0.1 + 0.2 + rate / 2, 1e-13);
  EXPECT_NEAR(end.position[1], 0.3 - 2.5 * end.position[0], 1e-13);
}

TEST(SmoothSolutionTest, AClosedFourBarKeepsItsLoopAndItsEnergy) {
  // a parallelogram of bars in the x-z plane, closed by a connect that repeats what the hinges hold out of the plane
  Solid bar = capsule_solid(1, 0.02, 0.2, Vec3::UnitZ());
  bar.p_BBcm = {0, 0, -0.2};
  Solid beam = capsule_solid(1, 0.02, 0.3, Vec3::UnitX());
  beam.p_BBcm = {0.3, 0, 0};
  Model model;
  add_hinged_body(model, "left", kWorld, {}, bar, Vec3::UnitY());
  add_hinged_body(model, "beam", 0, {Vec3(0, 0, -0.4), Quat::Identity()}, beam, Vec3::UnitY());
  add_hinged_body(model, "right", kWorld, {Vec3(0.6, 0, 0), Quat::Identity()}, bar, Vec3::UnitY());
  model.connects.push_back({"loop", 1, 2, Vec3(0.6, 0, 0), Vec3(0, 0, -0.4)});
  model = finished(std::move(model));
  const State start = with_joints(model, {1, -1, 1}, {0, 0, 0});
  // a parallelogram: the beam translates, so this is a pendulum with I = 2 I_bar + m l^2 and torque 2 m g l/2 + m g l
  const double inertia = 2 * (bar.I_BBcm_B(1, 1) + 0.04) + 0.16;
  const Pendulum truth(std::sqrt(kGravity * (2 * 0.2 + 0.4) / inertia), 1);
  for (const State& state : smooth_solution(model, start, {0.5, 1, 2})) {
    EXPECT_NEAR(state.position[0], truth.angle(state.time), 1e-12) << state.time;
    EXPECT_NEAR(state.position[2], state.position[0], 1e-12) << state.time;
  }
}

TEST(SmoothSolutionTest, RefusesAStartOffItsConstraintsAndDryFriction) {
  Model model;
  add_hinged_body(model, "first", kWorld, {}, sphere_solid(1, 0.1), Vec3::UnitZ());
  add_hinged_body(model, "second", kWorld, {}, sphere_solid(1, 0.1), Vec3::UnitZ()).limited = false;
  model.couplings.push_back({"gears", 1, {{0, 2.0}}, 0});
  model = finished(std::move(model));
  try {
    smooth_solution(model, with_joints(model, {0.1, 0.1}, {0, 0}), 1);
    FAIL() << "the start is off the coupling by 0.1";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("0.1 (m or rad) off its equality constraints"));
  }
  model.joints[0].dry_friction = 0.1;
  EXPECT_THAT(smooth_obstacle(model), HasSubstr("dry friction of joint 'first_hinge'"));
}

TEST(SmoothSolutionTest, StopsAtTheLimitsOfSlidesBallsAndTendons) {
  Model model;
  Joint& slide = add_sliding_body(model, "block", kWorld, {}, sphere_solid(1, 0.1), Vec3::UnitZ());
  slide.limited = true;
  slide.lower = -1;
  slide.upper = 1;
  model = finished(std::move(model));
  const auto refusal = [](const Model& m, const State& start) -> std::string {
    try {
      smooth_solution(m, start, 2);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal(model, model.initial), HasSubstr("slide 'block_slide' reaches its limit"));

  Model ball;
  Solid bob = sphere_solid(1, 0.1);
  bob.p_BBcm = {0.3, 0, 0};
  BallJoint& joint = add_ball_body(ball, "bob", kWorld, {}, bob);
  joint.limited = true;
  joint.upper = 0.5;
  ball = finished(std::move(ball));
  EXPECT_THAT(refusal(ball, ball.initial), HasSubstr("ball joint 'bob_ball' reaches its limit"));

  model.joints[0].limited = false;
  Tendon tendon;
  tendon.name = "rope";
  tendon.terms = {{0, 2.0}};
  tendon.limited = true;
  tendon.lower = -0.5;
  tendon.upper = 0.5;
  model.tendons.push_back(tendon);
  EXPECT_THAT(refusal(model, model.initial), HasSubstr("tendon 'rope' reaches its limit"));
}

}  // namespace
}  // namespace assay
