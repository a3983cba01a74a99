// The closed forms against facts that do not come from them: limits, conserved quantities, the differential equations
// that they solve; and the error-controlled solution against closed forms, invariants and published figures.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
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

using conformance::add_contact, conformance::add_free_body, conformance::add_shape, conformance::with_joints;
using testing::HasSubstr;

constexpr double kPi = std::numbers::pi;

// Classical fourth-order Runge-Kutta, written out here so that nothing is shared with what it checks.
std::vector<double> integrate(const std::function<std::vector<double>(const std::vector<double>&)>& slope,
                              std::vector<double> y, double duration, int steps) {
  const double h = duration / steps;
  const auto moved = [](std::vector<double> from, const std::vector<double>& by, double factor) {
    for (size_t i = 0; i < from.size(); ++i) from[i] += factor * by[i];
    return from;
  };
  for (int n = 0; n < steps; ++n) {
    const auto k1 = slope(y), k2 = slope(moved(y, k1, h / 2)), k3 = slope(moved(y, k2, h / 2)),
               k4 = slope(moved(y, k3, h));
    for (size_t i = 0; i < y.size(); ++i) y[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
  }
  return y;
}

// ---- pendulum -------------------------------------------------------------------------------------------------------

TEST(PendulumTest, PeriodHasTheSmallSwingSeries) {
  constexpr double kFrequency = 3;
  for (const double a : {1e-3, 0.05, 0.2}) {
    // Bernoulli's series in the amplitude; the next term is 173 a^6 / 737280
    const double series = 2 * kPi / kFrequency * (1 + a * a / 16 + 11 * std::pow(a, 4) / 3072);
    EXPECT_NEAR(Pendulum(kFrequency, a).period() / series, 1, 3e-4 * std::pow(a, 6) + 1e-14) << a;
  }
}

TEST(PendulumTest, PeriodGrowsLogarithmicallyTowardsTheTop) {
  for (const double gap : {1e-1, 1e-2, 1e-3}) {
    const double asymptote = 4 / 2.0 * std::log(4 / std::cos((kPi - gap) / 2));
    EXPECT_NEAR(Pendulum(2, kPi - gap).period() / asymptote, 1, gap * gap) << gap;
  }
}

TEST(PendulumTest, KnownPeriodAtARightAngle) {
  // T / T0 = 1.18034059901609... at 90 degrees (Gauss: 1 / agm(1, cos 45 deg))
  EXPECT_NEAR(Pendulum(1, kPi / 2).period() / (2 * kPi), 1.1803405990160962, 1e-14);
}

TEST(PendulumTest, FollowsItsDifferentialEquation) {
  constexpr double kFrequency = 5.5, kAmplitude = 2.5;
  const Pendulum pendulum(kFrequency, kAmplitude);
  EXPECT_NEAR(pendulum.angle(0), kAmplitude, 1e-14);
  EXPECT_NEAR(pendulum.rate(0), 0, 1e-14);
  const auto slope = [&](const std::vector<double>& y) {
    return std::vector<double>{y[1], -kFrequency * kFrequency * std::sin(y[0])};
  };
  for (const double time : {0.3, 1.1, 2.9}) {
    const auto y = integrate(slope, {kAmplitude, 0}, time, 20000);
    EXPECT_NEAR(pendulum.angle(time), y[0], 1e-11) << time;
    EXPECT_NEAR(pendulum.rate(time), y[1], 1e-10) << time;
  }
  EXPECT_NEAR(pendulum.angle(pendulum.period()), kAmplitude, 1e-12);
  EXPECT_NEAR(pendulum.angle(pendulum.period() / 2), -kAmplitude, 1e-12);
  EXPECT_NEAR(pendulum.angle(pendulum.period() / 4), 0, 1e-12);
}

// ---- torque-free top ------------------------------------------------------------------------------------------------

struct TopCase {
  Vec3 moments, w;
};

class TopTest : public testing::TestWithParam<TopCase> {};

TEST_P(TopTest, StartsAsGivenAndReturnsAfterAPeriod) {
  const auto& [moments, w] = GetParam();
  const TorqueFreeTop top(moments, w);
  EXPECT_LT((top.angular_velocity(0) - w).norm(), 1e-13);
  EXPECT_LT((top.angular_velocity(top.period()) - w).norm(), 1e-12);
  EXPECT_LT((top.orientation(0).toRotationMatrix() - Mat3::Identity()).norm(), 1e-13);
}

TEST_P(TopTest, FollowsEulersEquationsAndTheRotationsRate) {
  const auto& [moments, w0] = GetParam();
  const TorqueFreeTop top(moments, w0);
  const auto slope = [m = moments](const std::vector<double>& y) {
    const Vec3 w(y[0], y[1], y[2]);
    const Vec3 a = -w.cross(m.cwiseProduct(w)).cwiseQuotient(m);
    const Quat q(y[3], y[4], y[5], y[6]);
    const Quat dq = q * Quat(0, w.x() / 2, w.y() / 2, w.z() / 2);  // body axes
    return std::vector<double>{a.x(), a.y(), a.z(), dq.w(), dq.x(), dq.y(), dq.z()};
  };
  for (const double time : {0.37, 1.9}) {
    const auto y = integrate(slope, {w0.x(), w0.y(), w0.z(), 1, 0, 0, 0}, time, 20000);
    EXPECT_LT((top.angular_velocity(time) - Vec3(y[0], y[1], y[2])).norm(), 1e-10) << time;
    const Mat3 R = Quat(y[3], y[4], y[5], y[6]).normalized().toRotationMatrix();
    EXPECT_LT((top.orientation(time).toRotationMatrix() - R).norm(), 1e-10) << time;
  }
}

TEST_P(TopTest, KeepsMomentumInSpaceAndEnergy) {
  const auto& [moments, w0] = GetParam();
  const TorqueFreeTop top(moments, w0);
  const Vec3 momentum = moments.cwiseProduct(w0);
  const double energy = momentum.dot(w0);
  for (int i = 0; i < 16; ++i) {
    const double time = 0.77 * i;
    const Vec3 w = top.angular_velocity(time);
    EXPECT_LT((top.orientation(time) * Vec3(moments.cwiseProduct(w)) - momentum).norm(), 1e-12 * momentum.norm())
        << time;
    EXPECT_NEAR(moments.cwiseProduct(w).dot(w) / energy, 1, 1e-12) << time;
  }
}

INSTANTIATE_TEST_SUITE_P(All, TopTest,
                         testing::Values(TopCase{{0.01, 0.02, 0.025}, {0.5, 4, 0.3}},   // about the middle axis
                                         TopCase{{0.01, 0.02, 0.025}, {5, 0.2, -0.4}},  // circulates about the smallest
                                         TopCase{{0.01, 0.02, 0.025}, {-5, 0.2, 0.4}},
                                         TopCase{{0.01, 0.02, 0.025}, {0.3, -0.5, 6}},  // about the largest
                                         TopCase{{0.025, 0.01, 0.02}, {0.3, -0.5, 6}},  // other orders of the axes
                                         TopCase{{0.02, 0.025, 0.01}, {-1, 2, -3}},
                                         TopCase{{0.02, 0.01, 0.025}, {1, 2, -3}},
                                         TopCase{{0.025, 0.02, 0.01}, {-1, -2, 0.5}}));

// ---- oscillator, sliding, rolling -----------------------------------------------------------------------------------

TEST(DampedOscillatorTest, FollowsItsDifferentialEquationInEveryRegime) {
  constexpr double kMass = 0.7, kStiffness = 30;
  const double critical = 2 * std::sqrt(kMass * kStiffness);
  for (const double damping : {0.0, 0.3, critical, 3 * critical}) {
    const auto slope = [&](const std::vector<double>& y) {
      return std::vector<double>{y[1], -(kStiffness * y[0] + damping * y[1]) / kMass};
    };
    const Motion start = {0.4, -2};
    for (const double time : {0.0, 0.21, 1.3}) {
      const Motion motion = damped_oscillator(kMass, kStiffness, damping, start, time);
      const auto y = integrate(slope, {start.position, start.velocity}, time, 5000);
      EXPECT_NEAR(motion.position, y[0], 1e-10) << damping << " " << time;
      EXPECT_NEAR(motion.velocity, y[1], 1e-9) << damping << " " << time;
    }
  }
}

TEST(DampedOscillatorTest, UndampedKeepsItsEnergyAndPeriod) {
  const double period = 2 * kPi / std::sqrt(30 / 0.7);
  const Motion motion = damped_oscillator(0.7, 30, 0, {0.4, -2}, 7 * period);
  EXPECT_NEAR(motion.position, 0.4, 1e-12);
  EXPECT_NEAR(motion.velocity, -2, 1e-11);
}

TEST(FrictionTest, SlidingTakesAllTheEnergy) {
  EXPECT_NEAR(0.5 * 9.81 * sliding_distance(3, 0.5, 9.81), 3.0 * 3.0 / 2, 1e-14);
  const Motion end = uniform_acceleration({0, 3}, -0.5 * 9.81, sliding_time(3, 0.5, 9.81));
  EXPECT_NEAR(end.velocity, 0, 1e-14);
  EXPECT_NEAR(end.position, sliding_distance(3, 0.5, 9.81), 1e-14);
}

TEST(FrictionTest, RollingBeginsWhenTheRimHasTheSpeed) {
  constexpr double kSpeed = 2, kFriction = 0.3, kGravity = 9.81, kRadius = 0.17;
  const double time = rolling_time(kSpeed, kFriction, kGravity);
  const double speed = kSpeed - kFriction * kGravity * time;
  const double spin = kFriction * kGravity * kRadius / (0.4 * kRadius * kRadius) * time;
  EXPECT_NEAR(speed, rolling_speed(kSpeed), 1e-14);
  EXPECT_NEAR(spin * kRadius, speed, 1e-14);
  // angular momentum about a point of the plane is conserved throughout
  EXPECT_NEAR(speed * kRadius + 0.4 * kRadius * kRadius * spin, kSpeed * kRadius, 1e-14);
}

// ---- the error-controlled solution ----------------------------------------------------------------------------------

// Last link's centre of mass after 1 s. Planar: three independent solvers that agree to 2e-13 (an integration of the
// Lagrangian, MuJoCo RK4, Simbody RK-Merson).
const Vec3 kPlanarEnd(-1.1380581024156, 0, 0.5467778217001);
// Spatial: this solution; MuJoCo RK4 and Simbody agree with it in tests/conformance/truth_test.cc.
const Vec3 kSpatialEnd(-1.1488993266247, -0.5413584894741, 0.2306489289331);

TEST(SmoothSolutionTest, GivesThePublishedPlanarChain) {
  const Model model = conformance::chain(false);
  const State end = smooth_solution(model, model.initial, 1);
  EXPECT_LT((end.bodies[4].p_WBcm - kPlanarEnd).norm(), 3e-13);
  EXPECT_EQ(end.time, 1);
}

TEST(SmoothSolutionTest, GivesTheSpatialChain) {
  const Model model = conformance::chain(true);
  EXPECT_LT((smooth_solution(model, model.initial, 1).bodies[4].p_WBcm - kSpatialEnd).norm(), 3e-13);
}

double energy_of(const Model& model, const State& state) {
  double energy = 0;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const BodyState& s = state.bodies[i];
    const Vec3 w_B = s.q_WB.conjugate() * s.w_WB;
    energy += body.mass * (s.v_WBcm.squaredNorm() / 2 - model.gravity.dot(s.p_WBcm)) + w_B.dot(body.I_BBcm_B * w_B) / 2;
  }
  for (size_t j = 0; j < model.joints.size(); ++j) {
    const Joint& hinge = model.joints[j];
    energy += hinge.stiffness * std::pow(state.position[j] - hinge.spring_reference, 2) / 2;
    energy += hinge.armature * state.velocity[j] * state.velocity[j] / 2;
  }
  return energy;
}

State moving_trees(const Model& model) {
  State start = with_joints(model, {0.9, -1.4, 0.5, -0.2}, {1.5, -2, 1, 2.5});
  start.bodies[0].v_WBcm = {0.4, -0.8, 1.5};
  start.bodies[0].w_WB = {1, -0.5, 1.5};
  bodies_from_joints(model, start);
  return start;
}

TEST(SmoothSolutionTest, KeepsEnergyWithSpringsAndArmature) {
  Model model = conformance::oblique_trees();
  for (Joint& hinge : model.joints) {
    hinge.stiffness = 1.5;
    hinge.spring_reference = 0.3;
    hinge.armature = 0.02;
  }
  const State start = moving_trees(model);
  const double before = energy_of(model, start);
  for (const State& state : smooth_solution(model, start, {0.2, 0.5, 2})) {
    EXPECT_NEAR(energy_of(model, state), before, 1e-11 * std::abs(before) + 1e-11) << state.time;
  }
}

TEST(SmoothSolutionTest, KeepsMomentaOfAFloatingTree) {
  // the tree on the world's hinge is left out: the world holds it
  Model model = without_gravity(conformance::oblique_trees());
  model.bodies.pop_back();
  model.joints.pop_back();
  State start = with_joints(model, {0.9, -1.4, 0.5}, {1.5, -2, 1});
  start.bodies.resize(4);
  start.bodies[0].v_WBcm = {0.4, -0.8, 1.5};
  start.bodies[0].w_WB = {1, -0.5, 1.5};
  bodies_from_joints(model, start);
  const auto momenta = [&](const State& state) {
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      const Body& body = model.bodies[i];
      const BodyState& s = state.bodies[i];
      linear += body.mass * s.v_WBcm;
      angular += body.mass * s.p_WBcm.cross(s.v_WBcm);
      angular += s.q_WB * Vec3(body.I_BBcm_B * (s.q_WB.conjugate() * s.w_WB));
    }
    return std::pair(linear, angular);
  };
  const auto [linear, angular] = momenta(start);
  SmoothOptions options;
  options.torques = [](double time, std::span<const double> angle, std::span<const double> rate,
                       std::span<double> torque) {
    for (size_t j = 0; j < torque.size(); ++j) torque[j] = std::sin(3 * time) - 0.5 * angle[j] - 0.1 * rate[j];
  };
  const auto [linear_end, angular_end] = momenta(smooth_solution(model, start, 1.5, options));
  EXPECT_LT((linear_end - linear).norm(), 1e-12);
  EXPECT_LT((angular_end - angular).norm(), 1e-12);
}

TEST(SmoothSolutionTest, AgreesWithClosedForms) {
  const conformance::PendulumModel swing = conformance::pendulum();
  const Pendulum pendulum(swing.frequency, 2.5);
  const State swung = smooth_solution(swing.model, with_joints(swing.model, {2.5}, {0}), 1.7);
  EXPECT_NEAR(swung.position[0], pendulum.angle(1.7), 1e-12);
  EXPECT_NEAR(swung.velocity[0], pendulum.rate(1.7), 1e-11);

  conformance::Flywheel wheel = conformance::flywheel();
  Joint& hinge = wheel.model.joints[0];
  hinge.stiffness = 2;
  hinge.spring_reference = 0.4;
  hinge.damping = 0.08;
  hinge.armature = 0.01;
  const State spun = smooth_solution(wheel.model, with_joints(wheel.model, {-0.2}, {3}), 0.9);
  const Motion motion = damped_oscillator(wheel.axial_inertia + 0.01, 2, 0.08, {-0.6, 3}, 0.9);
  EXPECT_NEAR(spun.position[0], motion.position + 0.4, 1e-13);
  EXPECT_NEAR(spun.velocity[0], motion.velocity, 1e-13);

  // tumbling: principal axes oblique in the body
  const Vec3 moments(0.01, 0.02, 0.025), w(0.5, 4, 0.3);
  const Quat q_BI(Eigen::AngleAxisd(1.1, Vec3(2, -1, 2) / 3));
  Model model;
  model.gravity.setZero();
  add_free_body(model, "top", conformance::principal_solid(1, {0.1, 0, 0}, moments, q_BI));
  model = conformance::finished(std::move(model));
  State start = model.initial;
  start.bodies[0].w_WB = q_BI * w;
  const State turned = smooth_solution(model, start, 3);
  const TorqueFreeTop top(moments, w);
  const Quat expected = q_BI * top.orientation(3) * q_BI.conjugate();
  EXPECT_LT((turned.bodies[0].q_WB.toRotationMatrix() - expected.toRotationMatrix()).norm(), 1e-11);
}

TEST(SmoothSolutionTest, RestartsExactlyWhereItStopped) {
  const Model model = conformance::chain(true);
  const State middle = smooth_solution(model, model.initial, 0.4);
  const State end = smooth_solution(model, middle, 1);
  EXPECT_EQ(end.time, 1);
  EXPECT_LT((end.bodies[4].p_WBcm - kSpatialEnd).norm(), 1e-12);
}

TEST(SmoothSolutionTest, GivesEveryTimeThatIsAskedFor) {
  const Model model = conformance::chain(false);
  const auto states = smooth_solution(model, model.initial, {0, 0.3, 0.3, 1});
  ASSERT_EQ(states.size(), 4U);
  EXPECT_EQ(states[0].position, model.initial.position);
  EXPECT_EQ(states[1].position, states[2].position);
  EXPECT_LT((states[3].bodies[4].p_WBcm - kPlanarEnd).norm(), 1e-12);
}

TEST(SmoothSolutionTest, ErrorFollowsTheTolerance) {
  const Model model = conformance::chain(true);
  const auto error = [&](double tolerance) {
    return (smooth_solution(model, model.initial, 1, {.tolerance = tolerance, .torques = {}}).bodies[4].p_WBcm -
            kSpatialEnd)
        .norm();
  };
  EXPECT_LT(error(1e-6), 1e-4);
  EXPECT_GT(error(1e-3), error(1e-12));
  EXPECT_LT(error(1e-12), 1e-10);
}

std::string refusal(const Model& model, const State& start, const std::vector<double>& times) {
  try {
    smooth_solution(model, start, times);
  } catch (const InputError& error) {
    return error.what();
  }
  return "nothing was refused";
}

TEST(SmoothSolutionTest, RefusesWhatIsNotSmooth) {
  Model model = conformance::chain(false);
  const int a = add_shape(model, ShapeType::kSphere, 0, {}, 0.1), b = add_shape(model, ShapeType::kPlane, kWorld);
  add_contact(model, a, b, 1);
  EXPECT_THAT(smooth_obstacle(model), HasSubstr("1 contact pair"));
  EXPECT_THAT(refusal(model, model.initial, {1}), HasSubstr("contacts off"));

  Model limited = conformance::pendulum().model;
  limited.joints[0].limited = true;
  limited.joints[0].lower = -1;
  limited.joints[0].upper = 2;
  EXPECT_EQ(smooth_obstacle(limited), "");
  // it swings from 0.5 to -0.5 and back: within the limits; from 1.5 it would pass -1
  EXPECT_NEAR(smooth_solution(limited, with_joints(limited, {0.5}, {0}), 2.0).time, 2, 0);
  EXPECT_THAT(refusal(limited, with_joints(limited, {1.5}, {0}), {2}), HasSubstr("'bob_hinge' reaches its limit"));

  Model locked = conformance::pendulum().model;
  locked.joints[0].damping = 1e3;  // stiff, and a second is still within reach
  EXPECT_NEAR(smooth_solution(locked, with_joints(locked, {0.5}, {0}), 0.25).time, 0.25, 0);
  locked.joints[0].damping = 1e11;
  EXPECT_THAT(refusal(locked, with_joints(locked, {0.5}, {0}), {0.1, 1}), HasSubstr("springs or dampers are stiff"));

  const Model chain = conformance::chain(false);
  EXPECT_THAT(refusal(chain, chain.initial, {0.5, 0.4}), HasSubstr("must ascend"));
}

}  // namespace
}  // namespace assay
