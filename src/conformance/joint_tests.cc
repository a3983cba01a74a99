// Slides, ball joints, several joints in a row, and dry friction.
#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "base/text.h"
#include "conformance/models.h"
#include "conformance/tests.h"
#include "measures/reference/closed_form.h"
#include "measures/reference/smooth.h"
#include "model/kinematics.h"

namespace assay::conformance {
namespace {

// A block that slides along an oblique axis in a rotated frame, off its anchor and its centre of mass; no gravity.
Model sliding_block() {
  Model model;
  model.name = "conformance-slide";
  model.gravity.setZero();
  const Solid block = principal_solid(2, {0.05, -0.02, 0.03}, {0.02, 0.03, 0.025}, about_axis(0.9, {1, 2, 2}));
  add_sliding_body(model, "block", kWorld, {Vec3(0.2, 0.3, 0.5), about_axis(0.5, {0, 1, 1})}, block, {1, 2, -2},
                   {0.1, 0.05, -0.02})
      .reference = 0.2;
  return finished(std::move(model));
}

// Positions of all bodies against the error-controlled solution, relative to `length`. Reference solutions are computed
// once for all contenders.
Verdict follows(const Subject& subject, const Model& model, double duration, const std::vector<double>& torques,
                const ConvergenceOptions& options, double length = 1) {
  static std::map<std::string, State> solutions;
  std::string key = model.hash;
  for (const double torque : torques) key += fmt::format(" {}", torque);
  auto found = solutions.find(key);
  if (found == solutions.end()) {
    SmoothOptions smooth;
    if (!torques.empty()) {
      smooth.torques = [&](double, std::span<const double>, std::span<const double>, std::span<double> torque) {
        std::ranges::copy(torques, torque.begin());
      };
    }
    found = solutions.emplace(key, smooth_solution(model, model.initial, duration, smooth)).first;
  }
  const auto relative = [length](const State& state) {
    std::vector<double> numbers = positions(state);
    for (double& number : numbers) number /= length;
    return numbers;
  };
  const auto measure = [&](double timestep) {
    return relative(subject.run(model, model.initial, timestep, duration, torques));
  };
  ConvergenceOptions with_duration = options;
  with_duration.duration = duration;
  return converges(subject, measure, relative(found->second), with_duration);
}

Model moving(Model model, const State& state) {
  model.initial = state;
  model.hash = model_hash(model);
  return model;
}

TreeOptions declared_joints(const Subject& subject) {
  return {.slides = subject.is_exact(Feature::kSlide), .balls = subject.is_exact(Feature::kBall), .massless = false};
}

// Random trees from 1 g and 5 mm to 100 kg and 2 m, under gravity and constant torques. Lengths are relative to the
// size, and the timestep follows the motion's time scale, so that all of them are similar.
Verdict random_trees_follow(const Subject& subject, TreeOptions options) {
  struct Scale {
    unsigned seed;
    double mass, size;
  };
  constexpr double kDuration = 0.2;  // s at 0.3 m
  Checks checks("");
  for (const Scale& scale : {Scale{11, 1, 0.3}, Scale{12, 1e-3, 5e-3}, Scale{13, 100, 2}, Scale{14, 1e-3, 2}}) {
    options.mass = scale.mass;
    options.size = scale.size;
    const Model model = random_tree(scale.seed, options);
    std::vector<double> torques;
    if (subject.capabilities().torques) {
      for (size_t j = 0; j < model.joints.size(); ++j) {
        const double force = 0.2 * scale.mass * kGravity * std::sin(static_cast<double>(j) + 1);
        torques.push_back(model.joints[j].is_slide() ? force : 0.3 * force * scale.size);
      }
    }
    const double time_scale = std::sqrt(scale.size / 0.3);
    const Verdict verdict =
        follows(subject, model, kDuration * time_scale, torques, {.unit = "", .time_scale = time_scale}, scale.size);
    checks.add(verdict.figure, verdict.tolerance,
               fmt::format("tree {} of {} kg and {} m, relative to its size: {}", scale.seed, shortest(scale.mass),
                           shortest(scale.size), verdict.note));
  }
  return checks.worst();
}

}  // namespace

Verdict slide_force(const Subject& subject) {
  Model model = sliding_block();
  model.gravity = {1, -2, -kGravity};
  model.hash = model_hash(model);
  const Vec3 axis_W = axis_in_parent(model, 0);
  constexpr double kDuration = 0.5, kForce = 14;
  const double acceleration = kForce / 2 + model.gravity.dot(axis_W);
  const State start = with_joints(model, {0.3}, {-1});
  const Motion end = uniform_acceleration({0.3, -1}, acceleration, kDuration);
  // the block as well as the joint's own coordinate, which counts from its reference
  const Vec3 p_end = start.bodies[0].p_WBcm + axis_W * (end.position - 0.3);
  const double torque = kForce;
  const auto measure = [&](double timestep) {
    const State state = subject.run(model, start, timestep, kDuration, {&torque, 1});
    std::vector<double> numbers = positions(state);
    numbers.push_back(state.position[0]);
    return numbers;
  };
  return converges(subject, measure, {p_end.x(), p_end.y(), p_end.z(), end.position},
                   {.duration = kDuration, .unit = "m"});
}

Verdict slide_spring(const Subject& subject) {
  Model model = sliding_block();
  Joint& slide = model.joints[0];
  slide.spring_reference = -0.1;
  slide.stiffness = 200;  // 10 rad/s
  slide.damping = 6;
  model = finished(std::move(model));
  constexpr double kDuration = 0.5, kPosition = 0.15, kVelocity = -0.8;
  const State start = with_joints(model, {kPosition}, {kVelocity});
  const Motion end = damped_oscillator(2, 200, 6, {kPosition + 0.1, kVelocity}, kDuration);
  const auto measure = [&](double timestep) { return subject.run(model, start, timestep, kDuration).position; };
  // springs that act as forces held for a step are of first order with every integrator
  return converges(subject, measure, {end.position - 0.1}, {.duration = kDuration, .unit = "m", .order = 1});
}

Verdict slide_armature(const Subject& subject) {
  Model model = sliding_block();
  model.joints[0].armature = 1.2;
  model.hash = model_hash(model);
  constexpr double kDuration = 0.5, kAcceleration = 5;
  const State start = with_joints(model, {0.1}, {1});
  const double force = kAcceleration * 3.2;
  const auto measure = [&](double timestep) {
    return subject.run(model, start, timestep, kDuration, {&force, 1}).position;
  };
  return converges(subject, measure, {uniform_acceleration({0.1, 1}, kAcceleration, kDuration).position},
                   {.duration = kDuration, .unit = "m"});
}

Verdict slide_limit(const Subject& subject) {
  // one block slides down an oblique axis onto its upper limit, one onto its lower, each with its own reference
  Model model;
  model.name = "conformance-slide-limits";
  const Vec3 slope = Vec3(1, 1, -2).normalized();
  for (const double side : {1.0, -1.0}) {
    Joint& slide =
        add_sliding_body(model, side > 0 ? "down" : "up", kWorld, {Vec3(0, side, 1), about_axis(0.4, {0, 0, 1})},
                         sphere_solid(1, 0.05), about_axis(-0.4, {0, 0, 1}) * (side * slope), {0.1, 0, 0});
    slide.reference = 0.15 * side;
    slide.limited = true;
    slide.lower = side > 0 ? -1 : -0.4;
    slide.upper = side > 0 ? 0.4 : 1;
  }
  model = finished(std::move(model));
  const std::vector<State> states = subject.record(model, model.initial, kStep, 1.5);
  const double speed = std::sqrt(2 * kGravity * -slope.z() * 0.25);
  Checks checks("m");
  for (const int j : {0, 1}) {
    const double side = j == 0 ? 1 : -1;
    double beyond = 0;
    for (const State& state : states) beyond = std::max(beyond, side * state.position[j] - 0.4);
    checks.add(beyond, 0.02 * speed + 2e-3, fmt::format("furthest beyond the limit, arriving at {:.2f} m/s", speed));
    checks.add(std::abs(side * states.back().position[j] - 0.4), 2e-3, "distance from the limit at the end");
  }
  return checks.worst();
}

Verdict planar_root(const Subject& subject) {
  // two slides and a hinge in one body, and a leg on a hinge: a planar walker without ground
  Model model;
  model.name = "conformance-planar-root";
  Solid torso = capsule_solid(2, 0.05, 0.15, Vec3::UnitZ());
  torso.p_BBcm = {0.02, 0, 0.1};
  Solid leg = capsule_solid(1, 0.04, 0.15, Vec3::UnitZ());
  leg.p_BBcm = {0, 0, -0.2};
  add_sliding_body(model, "root_x", kWorld, {Vec3(0, 0, 1), Quat::Identity()}, massless(), Vec3::UnitX());
  add_sliding_body(model, "root_z", 0, {}, massless(), Vec3::UnitZ()).reference = 1;
  add_hinged_body(model, "torso", 1, {}, torso, Vec3::UnitY());
  add_hinged_body(model, "leg", 2, {Vec3(0, 0, -0.05), Quat::Identity()}, leg, Vec3::UnitY());
  model = finished(std::move(model));
  model = moving(model, with_joints(model, {0.1, 1.3, 0.3, -0.6}, {0.5, 1.2, -1.5, 2}));
  const std::vector<double> torques =
      subject.capabilities().torques ? std::vector<double>{1, -2, 0.4, 0.3} : std::vector<double>{};
  return follows(subject, model, 0.5, torques, {.unit = "m"});
}

Verdict massless_joints(const Subject& subject) {
  // a floating trunk with a shoulder of three hinges and a wrist of two, as robots have them
  Model model;
  model.name = "conformance-massless";
  const Solid trunk = principal_solid(3, {0.04, -0.03, 0.05}, {0.05, 0.07, 0.04}, about_axis(0.7, {1, 2, 3}));
  const Solid arm = principal_solid(1.2, {0.02, 0.01, -0.15}, {0.012, 0.014, 0.004}, about_axis(0.4, {0, 1, 1}));
  const Solid hand = principal_solid(0.7, {0.02, 0.04, -0.06}, {0.003, 0.004, 0.002}, about_axis(-1.2, {2, -1, 1}));
  add_free_body(model, "trunk", trunk, {Vec3(0.3, -0.2, 1.1), about_axis(0.6, {1, 1, -1})});
  const Vec3 shoulder(0.01, -0.02, 0.03), wrist(0, 0.01, 0.02);
  add_hinged_body(model, "shoulder_1", 0, {Vec3(0.1, 0.2, 0.15), about_axis(1, {0, 1, 2})}, massless(), Vec3::UnitX(),
                  shoulder);
  add_hinged_body(model, "shoulder_2", 1, {}, massless(), Vec3::UnitY(), shoulder).reference = 0.2;
  add_hinged_body(model, "arm", 2, {}, arm, Vec3::UnitZ(), shoulder);
  add_hinged_body(model, "wrist", 3, {Vec3(0.02, 0, -0.3), about_axis(-0.8, {3, 1, 0})}, massless(), {1, 1, 0}, wrist);
  add_hinged_body(model, "hand", 4, {}, hand, {0, -1, 2}, wrist).reference = -0.3;
  model = finished(std::move(model));
  State start = with_joints(model, {0.4, 0.5, -0.3, 0.6, -0.5}, {1, -1.5, 2, -1, 2});
  start.bodies[0].v_WBcm = {0.4, -0.8, 1.5};
  start.bodies[0].w_WB = {1, -0.5, 1.5};
  bodies_from_joints(model, start);
  model = moving(model, start);
  const std::vector<double> torques =
      subject.capabilities().torques ? std::vector<double>{0.2, -0.1, 0.1, 0.05, -0.04} : std::vector<double>{};
  return follows(subject, model, 0.5, torques, {.unit = "m"});
}

Verdict conical_pendulum(const Subject& subject) {
  // A rod on a ball joint circles about the vertical at a constant angle. With I the moments about the pivot, across
  // and along the rod: W^2 = m g l / ((I_across - I_along) cos angle).
  constexpr double kLength = 0.25, kAngle = 0.6, kDuration = 0.75;
  Solid rod = capsule_solid(1, 0.05, 0.15, Vec3::UnitZ());
  const double across = rod.I_BBcm_B(0, 0) + rod.mass * kLength * kLength, along = rod.I_BBcm_B(2, 2);
  const double rate = std::sqrt(rod.mass * kGravity * kLength / ((across - along) * std::cos(kAngle)));
  // in a frame that is rotated, with the anchor off its origin
  const Quat frame = about_axis(0.8, {1, 2, -1});
  const Vec3 anchor(0.03, -0.02, 0.04), pivot(0.2, -0.1, 1.2);
  const Solid turned_rod = {rod.mass, anchor + frame.conjugate() * Vec3(0, 0, -kLength),
                            frame.conjugate() * rod.I_BBcm_B * frame.toRotationMatrix()};
  Model model;
  model.name = "conformance-conical-pendulum";
  add_ball_body(model, "rod", kWorld, {pivot - frame * anchor, frame}, turned_rod, anchor);
  model = finished(std::move(model));
  const Quat q_WP_start = about_axis(-kAngle, Vec3::UnitY());  // leans towards +x
  State start = model.initial;
  start.bodies[0].q_WB = q_WP_start * frame;
  start.bodies[0].w_WB = rate * Vec3::UnitZ();
  bodies_from_joints(model, start);

  const Quat q_end = about_axis(rate * kDuration, Vec3::UnitZ()) * q_WP_start;
  const auto numbers = [&](const Vec3& p, const Mat3& R) {
    std::vector<double> list(p.begin(), p.end());
    for (const double entry : R.reshaped()) list.push_back(entry * kLength);
    return list;
  };
  const auto measure = [&](double timestep) {
    const BodyState end = subject.run(model, start, timestep, kDuration).bodies[0];
    return numbers(end.p_WBcm, end.q_WB.toRotationMatrix());
  };
  return converges(subject, measure, numbers(pivot + q_end * Vec3(0, 0, -kLength), (q_end * frame).toRotationMatrix()),
                   {.duration = kDuration, .unit = "m"});
}

Verdict ball_spring(const Subject& subject) {
  // an asymmetric body on a ball joint with a spring to an oblique rotation and a damper, on a floating one
  Model model;
  model.name = "conformance-ball-spring";
  model.gravity.setZero();
  const Solid base = principal_solid(2, {0.03, 0.01, -0.02}, {0.03, 0.04, 0.05}, about_axis(0.5, {1, 0, 1}));
  const Solid wing = principal_solid(1, {0.05, 0.02, 0.01}, {0.01, 0.015, 0.02}, about_axis(1.1, {2, -1, 2}));
  add_free_body(model, "base", base, {Vec3(0, 0, 1), about_axis(0.4, {1, 1, 1})});
  BallJoint& ball =
      add_ball_body(model, "wing", 0, {Vec3(0.1, 0, 0.1), about_axis(-0.7, {0, 1, 3})}, wing, {-0.05, 0, 0});
  ball.stiffness = 1.5;
  ball.damping = 0.05;
  ball.spring_reference = about_axis(0.5, {1, -1, 2});
  model = finished(std::move(model));
  State start = model.initial;
  start.bodies[0].w_WB = {0.3, -0.2, 0.4};
  set_ball(model, start, 0, about_axis(-0.6, {1, 2, 0}), {1, 2, -1.5});
  bodies_from_joints(model, start);
  return follows(subject, moving(model, start), 0.5, {}, {.unit = "m", .order = 1});
}

Verdict ball_armature(const Subject& subject) {
  Model model;
  model.name = "conformance-ball-armature";
  const Solid bob = principal_solid(1, {0.1, 0.05, -0.2}, {0.01, 0.015, 0.02}, about_axis(1.1, {2, -1, 2}));
  const Solid base = principal_solid(2, {0.03, 0.01, -0.02}, {0.03, 0.04, 0.05}, about_axis(0.5, {1, 0, 1}));
  add_free_body(model, "base", base, {Vec3(0, 0, 1), about_axis(0.4, {1, 1, 1})});
  add_ball_body(model, "bob", 0, {Vec3(0.1, 0, 0.1), about_axis(-0.7, {0, 1, 3})}, bob, {-0.05, 0, 0}).armature = 0.03;
  add_ball_body(model, "pendulum", kWorld, {Vec3(1, 0, 1), about_axis(0.3, {1, 0, 0})}, bob).armature = 0.04;
  model = finished(std::move(model));
  State start = model.initial;
  start.bodies[0].w_WB = {0.3, -0.2, 0.4};
  set_ball(model, start, 0, about_axis(-0.6, {1, 2, 0}), {2, 3, -2.5});
  set_ball(model, start, 1, about_axis(0.9, {1, 0, 2}), {1, -2, 3});
  bodies_from_joints(model, start);
  return follows(subject, moving(model, start), 0.5, {}, {.unit = "m"});
}

Verdict ball_limit(const Subject& subject) {
  // a rod that is level at the reference falls until it has turned by 0.7 rad, about an axis of no frame
  constexpr double kLimit = 0.7, kLength = 0.2;
  Model model;
  model.name = "conformance-ball-limit";
  const Quat level = about_axis(0.5, Vec3::UnitZ());
  Solid bar = capsule_solid(1, 0.05, 0.15, Vec3::UnitX());
  bar.p_BBcm = {kLength, 0, 0};
  BallJoint& ball = add_ball_body(model, "bar", kWorld, {Vec3(0, 0, 1), level}, bar);
  ball.limited = true;
  ball.upper = kLimit;
  model = finished(std::move(model));
  const std::vector<State> states = subject.record(model, model.initial, kStep, 1.5);
  const double inertia = bar.I_BBcm_B(1, 1) + bar.mass * kLength * kLength;
  const double speed = std::sqrt(2 * bar.mass * kGravity * kLength * std::sin(kLimit) / inertia);
  const auto deflection = [&](const State& state) { return rotation_vector(ball_rotation(model, state, 0)).norm(); };
  double beyond = 0;
  for (const State& state : states) beyond = std::max(beyond, deflection(state) - kLimit);
  Checks checks("rad");
  checks.add(beyond, 0.02 * speed + 0.01, fmt::format("furthest beyond the limit, arriving at {:.2f} rad/s", speed));
  checks.add(std::abs(deflection(states.back()) - kLimit), 0.01, "distance from the limit at the end, where it rests");
  const Vec3 rest = level * Vec3(std::cos(kLimit), 0, -std::sin(kLimit));
  checks.add(std::acos(std::clamp(rest.dot(states.back().bodies[0].q_WB * Vec3(Vec3::UnitX())), -1.0, 1.0)), 0.01,
             "direction of the bar at the end");
  return checks.worst();
}

Verdict dry_friction(const Subject& subject) {
  // A wheel and a block under a torque and a force, below and above the friction: the first hold, the second slip, and
  // a wheel that turns stops after I w / friction. All relative to what they would do without friction.
  const Flywheel wheel = flywheel();
  Model model = wheel.model;
  model.name = "conformance-dry-friction";
  const double inertia = wheel.axial_inertia;
  const auto copy_wheel = [&](const char* name, double at) {
    Body body = model.bodies[0];
    Joint hinge = model.joints[0];
    body.name = name;
    body.X_PB.p.x() += at;
    body.joint = hinge.body = static_cast<int>(model.bodies.size());
    hinge.name = fmt::format("{}_hinge", name);
    model.bodies.push_back(body);
    model.joints.push_back(hinge);
  };
  copy_wheel("slips", 2);
  copy_wheel("stops", 4);
  constexpr double kDuration = 0.5, kRate = 3, kDeceleration = 10;
  for (Joint& joint : model.joints) joint.dry_friction = kDeceleration * inertia;
  std::vector<double> torques = {0.8 * kDeceleration * inertia, 1.5 * kDeceleration * inertia, 0};
  const bool slides = subject.accepts(Feature::kSlide);
  if (slides) {
    const Solid block = sphere_solid(2, 0.05);
    for (const double at : {0.0, 2.0}) {
      add_sliding_body(model, at > 0 ? "block_slips" : "block_holds", kWorld, {Vec3(at, 3, 0), Quat::Identity()}, block,
                       {1, 2, 2})
          .dry_friction = 6;
    }
    torques.insert(torques.end(), {4.8, 9});
  }
  model = finished(std::move(model));
  std::vector<double> rates = {0, 0, kRate};
  if (slides) rates.insert(rates.end(), {0, 0});
  const State start = with_joints(model, std::vector<double>(rates.size(), 0.0), rates);
  const std::vector<State> states = subject.record(model, start, kStep, kDuration, torques);
  const State& end = states.back();
  const auto moved = [](double acceleration) { return acceleration * kDuration * kDuration / 2; };
  Checks checks("");
  checks.add(std::abs(end.position[0]) / moved(0.8 * kDeceleration), 0.01,
             "turn of the wheel that is held, relative to its turn without friction");
  checks.add(std::abs(end.position[1] / moved(0.5 * kDeceleration) - 1), 0.01,
             "turn of the wheel that slips, relative");
  const State& half = states[states.size() * 3 / 10];
  checks.add(std::abs(half.velocity[2] / (kRate - kDeceleration * (half.time - start.time)) - 1), 0.01,
             "rate of the wheel that friction brakes, relative");
  const double stop = kRate * kRate / (2 * kDeceleration);
  checks.add(std::abs(end.position[2] / stop - 1), 0.01, "turn of the wheel until it stops, relative");
  checks.add(std::abs(end.velocity[2]) / kRate, 0.01, "rate after the stop, relative to the first");
  if (slides) {
    checks.add(std::abs(end.position[3]) / moved(2.4), 0.01,
               "way of the block that is held, relative to its way without friction");
    checks.add(std::abs(end.position[4] / moved(1.5) - 1), 0.01, "way of the block that slips, relative");
  }
  return checks.worst();
}

Verdict ball_dry_friction(const Subject& subject) {
  // a ball about its centre spins about one axis of the child: it stops after I w / friction
  constexpr double kRate = 3, kDeceleration = 10, kDuration = 0.5;
  Model model;
  model.name = "conformance-ball-dry-friction";
  model.gravity.setZero();
  const Solid solid = sphere_solid(2, 0.1);
  add_ball_body(model, "wheel", kWorld, {Vec3(0, 0, 1), about_axis(0.6, {1, 2, 0})}, solid).dry_friction =
      kDeceleration * solid.I_BBcm_B(0, 0);
  model = finished(std::move(model));
  State start = model.initial;
  set_ball(model, start, 0, Quat::Identity(), {0, kRate, 0});
  const std::vector<State> states = subject.record(model, start, kStep, kDuration);
  const State& half = states[states.size() * 3 / 10];
  Checks checks("");
  const double expected = kRate - kDeceleration * (half.time - start.time);
  checks.add((ball_velocity(model, half, 0) - Vec3(0, expected, 0)).norm() / expected, 0.01,
             "rate while friction brakes, relative");
  const double stop = kRate * kRate / (2 * kDeceleration);
  checks.add((rotation_vector(ball_rotation(model, states.back(), 0)) - Vec3(0, stop, 0)).norm() / stop, 0.01,
             "turn until it stops, relative");
  checks.add(ball_velocity(model, states.back(), 0).norm() / kRate, 0.01, "rate after the stop, relative to the first");
  return checks.worst();
}

Verdict random_trees(const Subject& subject) { return random_trees_follow(subject, declared_joints(subject)); }

Verdict random_massless_trees(const Subject& subject) {
  TreeOptions options = declared_joints(subject);
  options.massless = true;
  return random_trees_follow(subject, options);
}

}  // namespace assay::conformance
