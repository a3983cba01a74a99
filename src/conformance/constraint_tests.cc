// Couplings, connects, welds and tendons.
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

// What constraints with a time constant of some steps give way under the loads of these tests, relative or in m.
constexpr double kRelative = 0.01, kGap = 1e-3;

// Balanced wheels on hinges to the world, without gravity, of these inertias.
Model wheels(const std::string& name, const std::vector<double>& inertias) {
  Model model;
  model.name = name;
  model.gravity.setZero();
  for (size_t i = 0; i < inertias.size(); ++i) {
    const Solid solid = principal_solid(1, Vec3::Zero(), {inertias[i], inertias[i], inertias[i]}, Quat::Identity());
    add_hinged_body(model, fmt::format("wheel_{}", i), kWorld, {Vec3(static_cast<double>(i), 0, 0), Quat::Identity()},
                    solid, {1, 2, 2});
  }
  return model;
}

// The wheels' turns, relative to the largest, against the reference solution, and how far they leave their couplings.
Verdict couplings_hold(const Subject& subject, const Model& model, const State& start,
                       const std::vector<double>& torques) {
  constexpr double kDuration = 0.5;
  SmoothOptions options;
  options.torques = [&](double, std::span<const double>, std::span<const double>, std::span<double> torque) {
    std::ranges::copy(torques, torque.begin());
  };
  const State truth = smooth_solution(model, start, kDuration, options);
  const std::vector<State> states = subject.record(model, start, kStep, kDuration, torques);
  double largest = 0;
  for (size_t j = 0; j < truth.position.size(); ++j) {
    largest = std::max(largest, std::abs(truth.position[j] - start.position[j]));
  }
  Checks checks("");
  for (size_t j = 0; j < truth.position.size(); ++j) {
    checks.add(
        std::abs(states.back().position[j] - truth.position[j]) / largest, kRelative,
        fmt::format("turn of '{}' against the reference solution, relative to the largest", model.joints[j].name));
  }
  for (const Coupling& coupling : model.couplings) {
    double off = 0;
    for (const State& state : states) {
      off = std::max(off, std::abs(state.position[coupling.joint] - coupling.offset -
                                   sum_of_terms(coupling.terms, state.position)));
    }
    checks.add(off / largest, kRelative,
               fmt::format("furthest off coupling '{}', relative to the largest turn", coupling.name));
  }
  return checks.worst();
}

}  // namespace

Verdict coupling(const Subject& subject) {
  Model model = wheels("conformance-coupling", {0.02, 0.01});
  model.couplings.push_back({"gears", 1, {{0, -2.5}}, 0.3});
  model = finished(std::move(model));
  return couplings_hold(subject, model, with_joints(model, {0.1, 0.05}, {0.2, -0.5}), {0.4, 0.1});
}

Verdict coupling_of_many(const Subject& subject) {
  Model model = wheels("conformance-coupling-of-many", {0.02, 0.01, 0.015, 0.01});
  model.couplings.push_back({"sum", 2, {{0, 0.5}, {1, -1.5}}, 0.1});
  model.couplings.push_back({"held", 3, {}, 0.2});
  model = finished(std::move(model));
  return couplings_hold(subject, model, with_joints(model, {0, 0, 0.1, 0.2}, {0, 0, 0, 0}), {0.1, -0.05, 0.1, 0.1});
}

Verdict connect(const Subject& subject) {
  // A parallelogram of bars, closed by a connect: its beam translates, so it swings as a pendulum with
  // I = 2 I_bar + m l^2 and the moment (2 m l / 2 + m l) g sin(angle).
  constexpr double kAmplitude = 1, kDuration = 1;
  Solid bar = capsule_solid(1, 0.02, 0.2, Vec3::UnitZ());
  bar.p_BBcm = {0, 0, -0.2};
  Solid beam = capsule_solid(1, 0.02, 0.3, Vec3::UnitX());
  beam.p_BBcm = {0.3, 0, 0};
  Model model;
  model.name = "conformance-connect";
  add_hinged_body(model, "left", kWorld, {Vec3(0, 0, 1), Quat::Identity()}, bar, Vec3::UnitY());
  add_hinged_body(model, "beam", 0, {Vec3(0, 0, -0.4), Quat::Identity()}, beam, Vec3::UnitY());
  add_hinged_body(model, "right", kWorld, {Vec3(0.6, 0, 1), Quat::Identity()}, bar, Vec3::UnitY());
  model.connects.push_back({"loop", 1, 2, Vec3(0.6, 0, 0), Vec3(0, 0, -0.4)});
  model = finished(std::move(model));
  const State start = with_joints(model, {kAmplitude, -kAmplitude, kAmplitude}, {0, 0, 0});
  const double inertia = 2 * (bar.I_BBcm_B(1, 1) + 0.04) + 0.16;
  const Pendulum truth(std::sqrt(kGravity * (2 * 0.2 + 0.4) / inertia), kAmplitude);
  const std::vector<State> states = subject.record(model, start, kStep, kDuration);
  double gap = 0;
  for (const State& state : states) {
    gap = std::max(gap, (body_pose(model.bodies[1], state.bodies[1]) * model.connects[0].p_A -
                         body_pose(model.bodies[2], state.bodies[2]) * model.connects[0].p_B)
                            .norm());
  }
  Checks checks("m");
  checks.add(gap, kGap, "largest gap of the connect");
  // a step's travel on top of one per cent of the way
  checks.add(std::abs(states.back().position[0] - truth.angle(kDuration)) * 0.4,
             (0.01 * kAmplitude + std::abs(truth.rate(kDuration)) * kStep) * 0.4, "way of the left bar's end");
  return checks.worst();
}

Verdict weld(const Subject& subject) {
  // a body welded to a wheel, off its axis: both turn as one
  constexpr double kDuration = 0.5, kOff = 0.2, kTorque = 0.5;
  Model model = wheels("conformance-weld", {0.02});
  const Solid load = principal_solid(0.5, Vec3::Zero(), {0.004, 0.004, 0.004}, Quat::Identity());
  const Vec3 axis = model.joints[0].axis_B;
  const Pose X_AB = {kOff * Vec3(0, 1, -1).normalized(), Quat(Eigen::AngleAxisd(0.6, Vec3(1, 0, 2).normalized()))};
  add_free_body(model, "load", load, X_AB);
  model.welds.push_back({"weld", 0, 1, X_AB});
  model = finished(std::move(model));
  const double inertia = 0.02 + 0.004 + 0.5 * kOff * kOff;
  const double turn = kTorque / inertia * kDuration * kDuration / 2;
  const std::vector<State> states = subject.record(model, model.initial, kStep, kDuration, {&kTorque, 1});
  double gap = 0, twist = 0;
  for (const State& state : states) {
    const Pose X_WB = body_pose(model.bodies[0], state.bodies[0]) * X_AB;
    gap = std::max(gap, (X_WB.p - state.bodies[1].p_WBcm).norm());
    twist = std::max(twist, angle_between(X_WB.q, state.bodies[1].q_WB));
  }
  Checks checks("m");
  checks.add(gap, kGap, "largest gap of the weld");
  checks.add(twist * kOff, kGap, fmt::format("largest twist of the weld, times {} m", kOff));
  checks.add(std::abs(states.back().position[0] - turn) * kOff, kRelative * turn * kOff,
             fmt::format("turn about {:.2f} {:.2f} {:.2f} against that of both inertias, times {} m", axis.x(),
                         axis.y(), axis.z(), kOff));
  return checks.worst();
}

Verdict tendon_spring(const Subject& subject) {
  Model model = wheels("conformance-tendon-spring", {0.02, 0.01});
  model.tendons.push_back({.name = "tendon",
                           .terms = {{0, 1.0}, {1, -1.5}},
                           .stiffness = 2,
                           .rest_lower = 0.1,
                           .rest_upper = 0.1,
                           .damping = 0.03});
  model = finished(std::move(model));
  constexpr double kDuration = 0.5;
  const State start = with_joints(model, {0.5, -0.2}, {1, 0.5});
  static const State truth = smooth_solution(model, start, kDuration);
  const auto measure = [&](double timestep) { return subject.run(model, start, timestep, kDuration).position; };
  return converges(subject, measure, truth.position, {.duration = kDuration, .unit = "rad", .order = 1});
}

Verdict tendon_limit(const Subject& subject) {
  // the first wheel turns freely until the tendon takes the second along
  constexpr double kDuration = 1, kTorque = 0.04, kSlack = 0.5;
  Model model = wheels("conformance-tendon-limit", {0.02, 0.01});
  model.tendons.push_back(
      {.name = "tendon", .terms = {{0, 1.0}, {1, -1.0}}, .limited = true, .lower = -kSlack, .upper = kSlack});
  model = finished(std::move(model));
  const std::vector<double> torques = {kTorque, 0};
  const std::vector<State> states = subject.record(model, model.initial, kStep, kDuration, torques);
  double beyond = 0;
  for (const State& state : states) beyond = std::max(beyond, state.position[0] - state.position[1] - kSlack);
  const double speed = std::sqrt(2 * kTorque / 0.02 * kSlack);
  Checks checks("rad");
  checks.add(beyond, 0.02 * speed + 0.01, fmt::format("furthest beyond the limit, arriving at {:.2f} rad/s", speed));
  // whatever the limit does, the angular momentum is the torque's
  const double momentum = 0.02 * states.back().velocity[0] + 0.01 * states.back().velocity[1];
  checks.add(std::abs(momentum / (kTorque * kDuration) - 1) * 0.01, 0.01 * kRelative,
             "angular momentum against torque times time, relative, times 0.01 rad");
  checks.add(states.back().position[1] > 0.05 ? 0 : 1, 0.01, "the second wheel is taken along");
  return checks.worst();
}

Verdict tendon_dry_friction(const Subject& subject) {
  constexpr double kDuration = 0.5, kFriction = 0.1, kInertia = 0.02;
  Model model = wheels("conformance-tendon-friction", {kInertia, kInertia});
  for (const int j : {0, 1}) {
    model.tendons.push_back({.name = fmt::format("tendon_{}", j), .terms = {{j, 2.0}}, .dry_friction = kFriction});
  }
  model = finished(std::move(model));
  const std::vector<double> torques = {1.6 * kFriction, 3 * kFriction};
  const State end = subject.record(model, model.initial, kStep, kDuration, torques).back();
  const auto moved = [](double torque) { return torque / kInertia * kDuration * kDuration / 2; };
  Checks checks("");
  checks.add(std::abs(end.position[0]) / moved(1.6 * kFriction), kRelative,
             "turn of the wheel that is held, relative to its turn without friction");
  checks.add(std::abs(end.position[1] / moved(kFriction) - 1), kRelative, "turn of the wheel that slips, relative");
  return checks.worst();
}

}  // namespace assay::conformance
