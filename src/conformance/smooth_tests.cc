#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "conformance/models.h"
#include "conformance/tests.h"
#include "measures/reference/closed_form.h"
#include "measures/reference/smooth.h"
#include "model/kinematics.h"

namespace assay::conformance {
namespace {

// A free body under `gravity` against the parabola, first without spin, then with a spin about an axis of its spherical
// inertia that carries its frame's origin around the centre of mass.
void fall(const Subject& subject, const Vec3& gravity, Checks& checks) {
  constexpr double kDuration = 0.5;
  Model model;
  model.name = "conformance-free-fall";
  model.gravity = gravity;
  Solid solid = sphere_solid(2, 0.1);
  solid.p_BBcm = {0.1, -0.2, 0.05};
  add_free_body(model, "stone", solid, {Vec3(0.5, -0.3, 1.2), Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 2) / 3))});
  model = finished(std::move(model));
  for (const double spin : {0.0, 1.0}) {
    State start = model.initial;
    BodyState& body = start.bodies[0];
    body.v_WBcm = {1.5, -0.7, 2};
    body.w_WB = spin * Vec3(0.5, 2, -1);
    std::vector<double> position, velocity;
    for (int k = 0; k < 3; ++k) {
      const Motion motion = uniform_acceleration({body.p_WBcm[k], body.v_WBcm[k]}, gravity[k], kDuration);
      position.push_back(motion.position);
      velocity.push_back(motion.velocity);
    }
    State end;
    const auto measure = [&](double timestep) {
      end = subject.run(model, start, timestep, kDuration);
      return positions(end);
    };
    const std::string run =
        fmt::format("gravity ({}, {}, {}){}: ", gravity[0], gravity[1], gravity[2], spin > 0 ? ", spinning" : "");
    const Verdict verdict = converges(subject, measure, position, {.duration = kDuration, .unit = "m"});
    checks.add(verdict.figure, verdict.tolerance, run + verdict.note);
    // without spin every integrator gets the velocity right to rounding, for any order; `end` has the finest timestep
    if (spin > 0) continue;
    const double steps = 4 * kDuration / subject.coarse_timestep();
    const Vec3 truth(velocity[0], velocity[1], velocity[2]);
    checks.add((end.bodies[0].v_WBcm - truth).norm() * kDuration, subject.rounding(steps, truth.norm()) * kDuration,
               run + "velocity at the end times 0.5 s");
    checks.add(end.bodies[0].w_WB.norm() * kDuration, subject.rounding(steps, 1) * kDuration,
               run + "angular velocity gained without a torque, times 0.5 s");
  }
}

// The bodies' positions of a smooth model against the error-controlled solution.
Verdict follows_truth(const Subject& subject, const Model& model, const State& start, const State& truth,
                      std::span<const double> torques, int order) {
  const double duration = truth.time - start.time;
  const auto measure = [&](double timestep) {
    return positions(subject.run(model, start, timestep, duration, torques));
  };
  return converges(subject, measure, positions(truth), {.duration = duration, .unit = "m", .order = order});
}

// The angle of a single hinge against its value in closed form.
Verdict hinge_follows(const Subject& subject, const Model& model, const State& start, double duration, double angle,
                      std::span<const double> torques, int order) {
  const auto measure = [&](double timestep) { return subject.run(model, start, timestep, duration, torques).position; };
  return converges(subject, measure, {angle}, {.duration = duration, .unit = "rad", .order = order});
}

}  // namespace

Verdict free_fall(const Subject& subject) {
  Checks checks("m");
  fall(subject, {0, 0, -kGravity}, checks);
  return checks.worst();
}

Verdict gravity_direction(const Subject& subject) {
  Checks checks("m");
  for (const Vec3& gravity : {Vec3(3, -5, 7), Vec3(-kGravity, 0, 0), Vec3(0, 0, 0)}) fall(subject, gravity, checks);
  return checks.worst();
}

Verdict fast_motion(const Subject& subject) {
  // A body that flies at 300 m/s and spins at 100 rad/s, and a balanced wheel on a hinge at 120 rad/s, without any
  // force: a loss shows a clamp or damping. These speeds exceed the default limits of all engines that have one.
  Model model;
  model.name = "conformance-fast";
  model.gravity.setZero();
  add_free_body(model, "shot", sphere_solid(1, 0.1), {Vec3(0, 1, 0), Quat::Identity()});
  Solid wheel = sphere_solid(1, 0.1);
  wheel.p_BBcm = {0.1, 0, 0.05};
  add_hinged_body(model, "wheel", kWorld, {Vec3(0, -1, 0), Quat(Eigen::AngleAxisd(0.4, Vec3::UnitX()))}, wheel,
                  {1, 2, 2}, wheel.p_BBcm);
  model = finished(std::move(model));
  constexpr double kTimestep = 1e-3, kDuration = 0.1, kRate = 120;
  State start = with_joints(model, {0}, {kRate});
  start.bodies[0].v_WBcm = {200, -200, 100};
  start.bodies[0].w_WB = {80, 0, 60};
  const State end = subject.run(model, start, kTimestep, kDuration);
  // an engine that divides a step into substeps rounds in each of them
  constexpr int kSubsteps = 4;
  const double tolerance = subject.rounding(kSubsteps * kDuration / kTimestep, 1);
  Checks checks("");
  checks.add((end.bodies[0].v_WBcm - start.bodies[0].v_WBcm).norm() / 300, tolerance,
             "speed lost, relative to 300 m/s");
  checks.add((end.bodies[0].w_WB - start.bodies[0].w_WB).norm() / 100, tolerance, "spin lost, relative to 100 rad/s");
  checks.add(std::abs(end.velocity[0] / kRate - 1), tolerance, "hinge's rate lost, relative to 120 rad/s");
  return checks.worst();
}

Verdict torque_free_top(const Subject& subject) {
  constexpr double kDuration = 2;
  const Vec3 moments(0.01, 0.02, 0.025);
  const Quat q_BI(Eigen::AngleAxisd(1.1, Vec3(2, -1, 2) / 3));
  Model model;
  model.name = "conformance-top";
  model.gravity.setZero();
  add_free_body(model, "top", principal_solid(1, {0.03, 0.01, -0.02}, moments, q_BI),
                {Vec3(0.1, 0.2, 0.3), Quat(Eigen::AngleAxisd(-0.8, Vec3(2, 2, 1) / 3))});
  model = finished(std::move(model));

  // nearly about the middle axis, which is unstable: the body turns over within the two seconds
  const Vec3 w_I(0.5, 4, 0.3);
  State start = model.initial;
  const Quat q_WI = start.bodies[0].q_WB * q_BI;
  start.bodies[0].w_WB = q_WI * w_I;
  const TorqueFreeTop top(moments, w_I);
  static const Quat q_II_end = top.orientation(kDuration);  // a long quadrature, the same for all contenders
  const Quat q_WI_end = q_WI * q_II_end;
  const Quat q_WB_end = q_WI_end * q_BI.conjugate();
  const Vec3 w_W_end = q_WI_end * top.angular_velocity(kDuration);

  // unlike the quaternion, the matrix has no sign ambiguity; its entries differ by at most the angle
  const auto numbers = [](const Quat& q, const Vec3& w) {
    const Mat3 R = q.toRotationMatrix();
    std::vector<double> list(R.data(), R.data() + 9);
    list.insert(list.end(), w.begin(), w.end());
    return list;
  };
  const auto measure = [&](double timestep) {
    const State end = subject.run(model, start, timestep, kDuration);
    return numbers(end.bodies[0].q_WB, end.bodies[0].w_WB);
  };
  return converges(subject, measure, numbers(q_WB_end, w_W_end), {.duration = kDuration, .unit = "rad"});
}

Verdict pendulum_period(const Subject& subject) {
  const PendulumModel swing = pendulum();
  constexpr double kAmplitude = 2.5;
  const Pendulum truth(swing.frequency, kAmplitude);
  const State start = with_joints(swing.model, {kAmplitude}, {0});
  const double duration = std::ceil(1.3 * truth.period() * 100) / 100;

  // The time between two downward passages, each at the root of the cubic through angles and rates of two neighbours.
  const auto measure = [&](double timestep) {
    const std::vector<State> states = subject.record(swing.model, start, timestep, duration);
    std::vector<double> passages;
    for (size_t i = 1; i < states.size(); ++i) {
      const double a = states[i - 1].position[0], b = states[i].position[0];
      const bool downwards = a > 0 && b <= 0;
      if (!downwards) continue;
      const double slope_a = states[i - 1].velocity[0] * timestep, slope_b = states[i].velocity[0] * timestep;
      const auto cubic = [&](double s) {
        return (1 + 2 * s) * (1 - s) * (1 - s) * a + s * (1 - s) * (1 - s) * slope_a + s * s * (3 - 2 * s) * b -
               s * s * (1 - s) * slope_b;
      };
      double low = 0, high = 1;
      for (int k = 0; k < 60; ++k) {
        const double middle = (low + high) / 2;
        (cubic(middle) > 0 ? low : high) = middle;
      }
      passages.push_back((static_cast<double>(i - 1) + (low + high) / 2) * timestep);
    }
    if (passages.size() < 2) throw EngineError("the pendulum did not swing through twice within 1.3 periods");
    return std::vector<double>{passages[1] - passages[0]};
  };
  return converges(subject, measure, {truth.period()}, {.duration = duration, .unit = "s"});
}

Verdict constant_torque(const Subject& subject) {
  const Flywheel wheel = flywheel();
  // The final 7.5 rad/s turn the wheel by less than 2 degrees a step at 4 ms. At 13.5 rad/s a Cartesian engine that
  // corrects a fifth of its joint error per step, as Bullet and ODE do, is not yet of first order there, in float and
  // double alike.
  constexpr double kDuration = 1, kAngle = 2.4, kRate = 1.5, kAcceleration = 6;
  const State start = with_joints(wheel.model, {kAngle}, {kRate});
  const double torque = kAcceleration * wheel.axial_inertia;
  const double end = uniform_acceleration({kAngle, kRate}, kAcceleration, kDuration).position;
  return hinge_follows(subject, wheel.model, start, kDuration, end, {&torque, 1}, 0);
}

Verdict armature(const Subject& subject) {
  Flywheel wheel = flywheel();
  wheel.model.joints[0].armature = 0.6 * wheel.axial_inertia;
  wheel.model = finished(std::move(wheel.model));
  constexpr double kDuration = 1, kAcceleration = 12;
  const State start = with_joints(wheel.model, {0}, {1});
  const double torque = kAcceleration * 1.6 * wheel.axial_inertia;
  const double end = uniform_acceleration({0, 1}, kAcceleration, kDuration).position;
  return hinge_follows(subject, wheel.model, start, kDuration, end, {&torque, 1}, 0);
}

Verdict spring_damper(const Subject& subject) {
  Flywheel wheel = flywheel();
  Joint& hinge = wheel.model.joints[0];
  hinge.reference = 0.2;
  hinge.spring_reference = -0.3;
  hinge.stiffness = 100 * wheel.axial_inertia;  // 10 rad/s
  hinge.damping = 3 * wheel.axial_inertia;
  wheel.model = finished(std::move(wheel.model));
  constexpr double kDuration = 0.5, kAngle = 0.7, kRate = -1;
  const State start = with_joints(wheel.model, {kAngle}, {kRate});
  const Motion end = damped_oscillator(wheel.axial_inertia, 100 * wheel.axial_inertia, 3 * wheel.axial_inertia,
                                       {kAngle + 0.3, kRate}, kDuration);
  // springs that act as torques held for a step are of first order with every integrator
  return hinge_follows(subject, wheel.model, start, kDuration, end.position - 0.3, {}, 1);
}

Verdict torque_reaction(const Subject& subject) {
  const Model model = without_gravity(oblique_trees());
  const std::vector<double> torques = {0.3, -0.2, 0.25, 0.1};
  static const State truth =
      smooth_solution(model, model.initial, 0.5,
                      {.torques = [&](double, std::span<const double>, std::span<const double>,
                                      std::span<double> torque) { std::ranges::copy(torques, torque.begin()); }});
  return follows_truth(subject, model, model.initial, truth, torques, 0);
}

Verdict planar_chain(const Subject& subject) {
  const Model model = chain(false);
  static const State truth = smooth_solution(model, model.initial, 1);
  return follows_truth(subject, model, model.initial, truth, {}, 0);
}

Verdict spatial_chain(const Subject& subject) {
  const Model model = chain(true);
  static const State truth = smooth_solution(model, model.initial, 1);
  return follows_truth(subject, model, model.initial, truth, {}, 0);
}

Verdict oblique_trees_converge(const Subject& subject) {
  const Model model = oblique_trees();
  State start = with_joints(model, {0.9, -1.4, 0.5, -0.2}, {1.5, -2, 1, 2.5});
  start.bodies[0].v_WBcm = {0.4, -0.8, 1.5};
  start.bodies[0].w_WB = {1, -0.5, 1.5};
  bodies_from_joints(model, start);
  static const State truth = smooth_solution(model, start, 0.5);
  return follows_truth(subject, model, start, truth, {}, 0);
}

}  // namespace assay::conformance
