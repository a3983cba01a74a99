#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "conformance/models.h"
#include "conformance/tests.h"
#include "measures/reference/closed_form.h"
#include "model/kinematics.h"

namespace assay::conformance {
namespace {

constexpr double kRadius = 0.1, kHalfLength = 0.3;

// A capsule lies along its body's z axis: this turns it to x, or to y.
const Quat kAlongX(std::sqrt(0.5), 0, std::sqrt(0.5), 0);
const Quat kAlongY(std::sqrt(0.5), -std::sqrt(0.5), 0, 0);

int add_capsule(Model& model, const std::string& name, const Vec3& position, const Quat& orientation,
                double friction = 1) {
  const int body = static_cast<int>(model.bodies.size());
  add_free_body(model, name, capsule_solid(1, kRadius, kHalfLength, Vec3::UnitZ()), {position, orientation});
  return add_shape(model, ShapeType::kCapsule, body, {}, kRadius, kHalfLength, friction);
}

int add_sphere(Model& model, const std::string& name, const Vec3& position, double friction = 1) {
  const int body = static_cast<int>(model.bodies.size());
  add_free_body(model, name, sphere_solid(1, kRadius), {position, Quat::Identity()});
  return add_shape(model, ShapeType::kSphere, body, {}, kRadius, 0, friction);
}

}  // namespace

Verdict joint_limit(const Subject& subject) {
  // one bar falls onto its upper limit, one onto its lower, each with a reference angle of its own
  Model model;
  model.name = "conformance-limits";
  Solid bar = capsule_solid(1, 0.05, 0.15, Vec3::UnitX());
  bar.p_BBcm = {0.2, 0, 0};
  for (const double side : {1.0, -1.0}) {
    Joint& hinge = add_hinged_body(model, side > 0 ? "down" : "up", kWorld, {Vec3(0, side, 1), Quat::Identity()}, bar,
                                   Vec3(0, side, 0));
    hinge.reference = 0.3 * side;
    hinge.limited = true;
    hinge.lower = side > 0 ? -2 : -1;
    hinge.upper = side > 0 ? 1 : 2;
  }
  model = finished(std::move(model));
  const std::vector<State> states = subject.record(model, model.initial, kStep, 1.5);

  // the speed of arrival, from energy: I w^2 / 2 = m g d sin(angle), the bar starting level
  const double inertia = bar.I_BBcm_B(1, 1) + bar.mass * 0.2 * 0.2;
  const double speed = std::sqrt(2 * bar.mass * kGravity * 0.2 * std::sin(0.7) / inertia);
  Checks checks("rad");
  for (const int j : {0, 1}) {
    const double side = j == 0 ? 1 : -1;
    double beyond = 0;
    for (const State& state : states) beyond = std::max(beyond, side * state.position[j] - 1);
    checks.add(beyond, 0.02 * speed + 0.01, fmt::format("furthest beyond the limit, arriving at {:.2f} rad/s", speed));
    checks.add(std::abs(side * states.back().position[j] - 1), 0.01,
               "distance from the limit at the end, where it rests");
  }
  return checks.worst();
}

Verdict wide_range(const Subject& subject) {
  // engines that know an angle within one turn cannot hold ranges of two turns, or take one limit for the other
  constexpr double kTorque = 0.2, kInertia = 0.02, kDuration = 2;
  Model model;
  model.name = "conformance-wide-range";
  model.gravity.setZero();
  const Solid wheel = principal_solid(1, Vec3::Zero(), {kInertia, kInertia, kInertia}, Quat::Identity());
  const std::array<double, 2> halves = {2 * std::numbers::pi, std::numbers::pi - 0.005};
  for (const double half : halves) {
    for (const double side : {1.0, -1.0}) {
      Joint& hinge = add_hinged_body(model, fmt::format("{} {:.4g}", side > 0 ? "up" : "down", half), kWorld,
                                     {Vec3(half, side, 1), Quat::Identity()}, wheel, {2, 1, 2});
      hinge.reference = 0.3;
      hinge.limited = true;
      hinge.lower = -half;
      hinge.upper = half;
    }
  }
  model = finished(std::move(model));
  const std::vector<double> torques = {kTorque, -kTorque, kTorque, -kTorque};
  const std::vector<State> states = subject.record(model, model.initial, kStep, kDuration, torques);
  Checks checks("rad");
  for (int j = 0; j < 4; ++j) {
    const double side = j % 2 == 0 ? 1 : -1, end = halves[static_cast<size_t>(j / 2)];
    const double speed = std::sqrt(2 * kTorque / kInertia * (end - side * model.joints[j].reference));
    double beyond = 0;
    for (const State& state : states) beyond = std::max(beyond, side * state.position[j] - end);
    checks.add(beyond, 0.02 * speed + 0.01,
               fmt::format("'{}' furthest beyond the limit, arriving at {:.2f} rad/s", model.joints[j].name, speed));
    checks.add(std::abs(side * states.back().position[j] - end), 0.01 * end,
               fmt::format("'{}' distance from the limit at the end, where it rests", model.joints[j].name));
  }
  return checks.worst();
}

Verdict sliding_capsule(const Subject& subject) {
  constexpr double kSpeed = 3, kFriction = 0.5;
  Model model;
  model.name = "conformance-sliding";
  const int plane = add_shape(model, ShapeType::kPlane, kWorld, {}, 0, 0, kFriction);
  add_contact(model, plane, add_capsule(model, "capsule", {0, 0, kRadius}, kAlongX, kFriction), kFriction);
  model = finished(std::move(model));
  State start = model.initial;
  start.bodies[0].v_WBcm = {kSpeed, 0, 0};
  const double time = sliding_time(kSpeed, kFriction, kGravity),
               distance = sliding_distance(kSpeed, kFriction, kGravity);
  const State end = subject.run(model, start, kStep, std::ceil(time * 100 + 20) / 100);
  Checks checks("");
  checks.add(
      std::abs(end.bodies[0].p_WBcm.x() / distance - 1), 0.01,
      fmt::format("distance {:.4f} m against v^2/(2 mu g) = {:.4f} m, relative", end.bodies[0].p_WBcm.x(), distance));
  checks.add(std::abs(end.bodies[0].p_WBcm.y()) / distance, 0.01, "drift to the side, relative to the distance");
  checks.add(end.bodies[0].v_WBcm.norm() / kSpeed, 0.01, "speed 0.2 s after the stop, relative to the first");
  return checks.worst();
}

Verdict sphere_rolls(const Subject& subject) {
  constexpr double kSpeed = 2, kFriction = 0.3;
  Model model;
  model.name = "conformance-rolling";
  const int plane = add_shape(model, ShapeType::kPlane, kWorld, {}, 0, 0, kFriction);
  add_contact(model, plane, add_sphere(model, "ball", {0, 0, kRadius}, kFriction), kFriction);
  model = finished(std::move(model));
  State start = model.initial;
  start.bodies[0].v_WBcm = {kSpeed, 0, 0};
  const double rolling = rolling_time(kSpeed, kFriction, kGravity);
  const auto whole = [](double time) { return std::round(time / kStep) * kStep; };
  const State sliding = subject.run(model, start, kStep, whole(rolling / 2));
  const State end = subject.run(model, start, kStep, whole(2.5 * rolling));
  const double speed = rolling_speed(kSpeed),
               half_way = kSpeed - kFriction * (kGravity * sliding.time + sliding.bodies[0].v_WBcm.z());
  Checks checks("");
  checks.add(std::abs(sliding.bodies[0].v_WBcm.x() / half_way - 1), 0.01, "speed while it still slides, relative");
  checks.add(std::abs(end.bodies[0].v_WBcm.x() / speed - 1), 0.01,
             fmt::format("speed {:.4f} m/s against 5/7 v = {:.4f} m/s, relative", end.bodies[0].v_WBcm.x(), speed));
  checks.add(std::abs(end.bodies[0].w_WB.y() * kRadius / speed - 1), 0.01,
             "turning at the end against rolling, relative");
  return checks.worst();
}

Verdict resting_height(const Subject& subject) {
  // side by side: a ball and a capsule on the plane; a ball in the groove between two fixed rails; a capsule across
  // them
  constexpr double kRail = 0.05, kRailAt = 0.08, kRailHeight = 0.3, kDrop = 0.01;
  Model model;
  model.name = "conformance-resting";
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  const int left = add_shape(model, ShapeType::kCapsule, kWorld, {Vec3(-kRailAt, 2, kRailHeight), kAlongY}, kRail, 1);
  const int right = add_shape(model, ShapeType::kCapsule, kWorld, {Vec3(kRailAt, 2, kRailHeight), kAlongY}, kRail, 1);
  const double reach = kRail + kRadius;
  const double in_groove = kRailHeight + std::sqrt(reach * reach - kRailAt * kRailAt);
  const std::vector<double> heights = {kRadius, kRadius, in_groove, kRailHeight + reach};
  add_contact(model, plane, add_sphere(model, "ball on the plane", {0, 0, kRadius + kDrop}), 1);
  add_contact(model, plane, add_capsule(model, "capsule on the plane", {1, 0, kRadius + kDrop}, kAlongX), 1);
  const int ball = add_sphere(model, "ball on the rails", {0, 1.5, in_groove + kDrop});
  const int bar = add_capsule(model, "capsule on the rails", {0, 2.5, kRailHeight + reach + kDrop}, kAlongX);
  for (const int rail : {left, right}) {
    add_contact(model, rail, ball, 1);
    add_contact(model, rail, bar, 1);
  }
  model = finished(std::move(model));
  const State end = subject.run(model, model.initial, kStep, 1);
  Checks checks("m");
  for (size_t i = 0; i < heights.size(); ++i) {
    checks.add(std::abs(end.bodies[i].p_WBcm.z() - heights[i]), 0.02 * kRadius,
               fmt::format("height of the {} against {:.4f} m", model.bodies[i].name, heights[i]));
  }
  return checks.worst();
}

Verdict bodies_collide(const Subject& subject) {
  // without gravity, all central: a ball hits a capsule broadside, a capsule hits a crossed capsule, a ball hits a ball
  constexpr double kSpeed = 1;
  Model model;
  model.name = "conformance-collisions";
  model.gravity.setZero();
  std::vector<int> hitting = {add_sphere(model, "ball 1", {-0.3, 0, 0}),
                              add_capsule(model, "bar 1", {-0.3, 2, 0}, kAlongY),
                              add_sphere(model, "ball 2", {-0.3, 4, 0})};
  std::vector<int> hit = {add_capsule(model, "bar 2", {0, 0, 0}, kAlongY),
                          add_capsule(model, "bar 3", {0, 2, 0}, Quat::Identity()),
                          add_sphere(model, "ball 3", {0, 4, 0})};
  for (size_t i = 0; i < hit.size(); ++i) add_contact(model, hitting[i], hit[i], 0.5);
  model = finished(std::move(model));
  State start = model.initial;
  for (const int body : {0, 1, 2}) start.bodies[body].v_WBcm = {kSpeed, 0, 0};
  const std::vector<State> states = subject.record(model, start, kStep, 0.4);
  const State& end = states.back();
  Checks checks("m");
  for (int i = 0; i < 3; ++i) {
    const BodyState &first = end.bodies[i], &second = end.bodies[i + 3];
    const std::string pair = fmt::format("{} and {}", model.bodies[i].name, model.bodies[i + 3].name);
    // the first push occurs when the surfaces meet, within one step's travel
    const auto pushed = std::ranges::find_if(
        states, [&](const State& state) { return state.bodies[i + 3].v_WBcm.norm() > 1e-3 * kSpeed; });
    const BodyState &at_first = (pushed == states.end() ? end : *pushed).bodies[i],
                    &at_second = (pushed == states.end() ? end : *pushed).bodies[i + 3];
    checks.add(std::abs((at_second.p_WBcm - at_first.p_WBcm).norm() - 2 * kRadius), kSpeed * kStep + 0.01 * kRadius,
               pair + ": distance at the first push against two radii");
    // equal masses without restitution move on together; with or without a bounce they conserve momentum and do not
    // overlap
    checks.add(2 * kRadius - (second.p_WBcm.x() - first.p_WBcm.x()), 0.02 * kRadius, pair + ": overlap at the end");
    checks.add(std::abs(first.v_WBcm.x() + second.v_WBcm.x() - kSpeed), subject.rounding(400, kSpeed),
               pair + ": momentum lost, in kg m/s");
    const Vec3 aside = first.p_WBcm + second.p_WBcm - start.bodies[i].p_WBcm - start.bodies[i + 3].p_WBcm;
    checks.add(std::hypot(aside.y(), aside.z()), 0.02 * kRadius, pair + ": pushed aside");
  }
  return checks.worst();
}

Verdict armature_impact(const Subject& subject) {
  // without gravity and friction a ball hits a lever that turns about the origin with three times its inertia as
  // armature
  constexpr double kSpeed = 1, kArm = 0.4, kDuration = 0.1, kGap = 0.01;
  Model model;
  model.name = "conformance-armature-impact";
  model.gravity.setZero();
  const Solid bar = capsule_solid(1, kRadius, 0.5, Vec3::UnitX());
  const double inertia = Vec3::UnitY().dot(bar.I_BBcm_B * Vec3::UnitY());
  add_hinged_body(model, "lever", kWorld, {}, bar, Vec3::UnitY()).armature = 3 * inertia;
  const int lever = add_shape(model, ShapeType::kCapsule, 0, {Vec3::Zero(), kAlongX}, kRadius, 0.5, 0);
  add_contact(model, lever, add_sphere(model, "ball", {kArm, 0, 2 * kRadius + kGap}, 0), 0);
  model = finished(std::move(model));
  State start = model.initial;
  start.bodies[1].v_WBcm = {0, 0, -kSpeed};
  const State end = subject.run(model, start, kStep, kDuration);
  // the ground holds the lever's axis alone: angular momentum about it stays, with the armature's
  const BodyState& ball = end.bodies[1];
  const double of_lever = 4 * inertia * end.velocity[0];
  const double kept = of_lever + (ball.p_WBcm.cross(ball.v_WBcm)).y() + (0.4 * kRadius * kRadius * ball.w_WB.y());
  const double plastic = kSpeed * kArm / (4 * inertia + kArm * kArm);
  Checks checks("");
  checks.add(std::abs(kept / (kSpeed * kArm) - 1), 0.01, "angular momentum lost, relative");
  // soft contacts give a seventh of the speed back
  checks.add(std::abs(end.velocity[0] / plastic - 1), 0.25, "rate of the lever after the impact, relative");
  return checks.worst();
}

Verdict friction_per_pair(const Subject& subject) {
  // The pair's coefficient differs from the product, mean, maximum and minimum of the shapes' own.
  struct Track {
    double shape, pair;
  };
  const std::vector<Track> tracks = {{0.2, 0.3}, {1.0, 0.6}, {0.9, 0.1}};
  constexpr double kSpeed = 3, kFrom = 0.1, kTo = 0.3;
  Model model;
  model.name = "conformance-friction";
  const int plane = add_shape(model, ShapeType::kPlane, kWorld, {}, 0, 0, 0.7);
  for (size_t i = 0; i < tracks.size(); ++i) {
    const Vec3 place(0, static_cast<double>(i), kRadius);
    const int shape = add_capsule(model, fmt::format("capsule_{}", i), place, kAlongX, tracks[i].shape);
    add_contact(model, plane, shape, tracks[i].pair);
  }
  model = finished(std::move(model));
  State start = model.initial;
  for (BodyState& body : start.bodies) body.v_WBcm = {kSpeed, 0, 0};
  const std::vector<State> states = subject.record(model, start, kStep, kTo);
  const State &from = states.at(static_cast<size_t>(std::llround(kFrom / kStep))), &to = states.back();
  Checks checks("");
  for (size_t i = 0; i < tracks.size(); ++i) {
    // by impulses, so that a body that hops while it slides is judged by its actual normal force
    const Vec3 gained = to.bodies[i].v_WBcm - from.bodies[i].v_WBcm;
    const double coefficient = -gained.x() / ((kTo - kFrom) * kGravity + gained.z());
    checks.add(
        std::abs(coefficient / tracks[i].pair - 1), 0.01,
        fmt::format("friction impulse over normal impulse {:.4f} against {}, relative", coefficient, tracks[i].pair));
  }
  return checks.worst();
}

Verdict excluded_pairs(const Subject& subject) {
  // Two balls and a link that overlap, and a plane below. The model has one contact pair: the last ball and the plane.
  // Everything else falls freely through everything.
  Model model;
  model.name = "conformance-excluded";
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  add_sphere(model, "ball 1", {0, 0, 0.3});
  add_sphere(model, "ball 2", {0.05, 0.02, 0.4});
  add_capsule(model, "bar", {-0.05, 0, 0.35}, kAlongX);
  add_contact(model, plane, add_sphere(model, "ball 3", {0.03, 0.1, 0.35}), 1);
  model = finished(std::move(model));
  constexpr double kDuration = 0.5;
  const State end = subject.run(model, model.initial, kStep, kDuration);
  const double fall = kGravity * kDuration * kDuration / 2;
  Checks checks("m");
  for (const int i : {0, 1, 2}) {
    const Vec3 expected = model.initial.bodies[i].p_WBcm - Vec3(0, 0, fall);
    checks.add((end.bodies[i].p_WBcm - expected).norm(), kGravity * kDuration * kStep,
               fmt::format("'{}' against free fall", model.bodies[i].name));
  }
  // the plane still acts on the last ball
  checks.add(std::abs(end.bodies[3].p_WBcm.z() - kRadius), 0.05, "'ball 3' against its place on the plane");
  return checks.worst();
}

Verdict restitution(const Subject& subject) {
  // gaps that end at different moments of a step
  constexpr double kSpeed = 2;
  constexpr std::array kGaps = {0.01, 0.0104, 0.0109, 0.0117};
  Model model;
  model.name = "conformance-restitution";
  model.gravity.setZero();
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  for (size_t k = 0; k < kGaps.size(); ++k) {
    const auto y = static_cast<double>(k);
    add_contact(model, plane, add_sphere(model, fmt::format("falling {}", k), {0, y, kRadius + kGaps[k]}), 0);
    const int struck = add_sphere(model, fmt::format("struck {}", k), {1, y, 1});
    const Vec3 beside(1 - 2 * kRadius - kGaps[k], y, 1);
    add_contact(model, struck, add_sphere(model, fmt::format("striking {}", k), beside), 0);
  }
  model = finished(std::move(model));
  State start = model.initial;
  for (size_t k = 0; k < kGaps.size(); ++k) {
    start.bodies[3 * k].v_WBcm = {0, 0, -kSpeed};
    start.bodies[3 * k + 2].v_WBcm = {kSpeed, 0, 0};
  }
  Checks checks("");
  for (const double coefficient : {0.5, 0.9}) {
    const auto elastic = subject.with_restitution(coefficient);
    if (!elastic) {
      checks.add(1, 0, "it takes no restitution, though it declares one");
      return checks.worst();
    }
    for (const double timestep : {kStep, kStep / 4}) {
      const State end = Subject(*elastic).run(model, start, timestep, 0.1);
      const auto say = [&](const char* what, double found) {
        checks.add_at(timestep, std::abs(found / coefficient - 1), 0.02,
                      fmt::format("{}: {:.4f} of the speed against {}, relative", what, found, coefficient));
      };
      for (size_t k = 0; k < kGaps.size(); ++k) {
        const BodyState *falling = &end.bodies[3 * k], *struck = falling + 1, *striking = falling + 2;
        say("ball from the ground", falling->v_WBcm.z() / kSpeed);
        say("ball from a ball", (struck->v_WBcm - striking->v_WBcm).x() / kSpeed);
      }
    }
  }
  return checks.worst();
}

Verdict contact_compliance(const Subject& subject) {
  // a ball of 1 kg that sinks by about 1 mm
  constexpr double kStiffness = 1e4, kMass = 1, kSink = kMass * kGravity / kStiffness, kDamping = 0.1;
  const double critical = 2 * std::sqrt(kStiffness * kMass), frequency = std::sqrt(kStiffness / kMass);
  Model model;
  model.name = "conformance-compliance";
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  add_contact(model, plane, add_sphere(model, "ball", {0, 0, kRadius}), 1);
  model = finished(std::move(model));
  Checks checks("m");
  // put onto the plane, it comes to rest where the spring carries it, whatever the timestep
  const auto resting = subject.with_compliance(kStiffness, critical);
  const auto swinging = subject.with_compliance(kStiffness, kDamping * critical);
  if (!resting || !swinging) {
    checks.add(1, 0, "its contacts take no stiffness, though it takes a smaller one");
    return checks.worst();
  }
  for (const double timestep : {4e-3, 1e-3, 2.5e-4}) {
    const State end = Subject(*resting).run(model, model.initial, timestep, 0.6);
    checks.add(std::abs(kRadius - end.bodies[0].p_WBcm.z() - kSink), 0.01 * kSink,
               fmt::format("depth at rest against m g / k = {:.3g} m, at {:g} ms", kSink, 1e3 * timestep));
  }
  // deeper by less than the contact carries, it swings about that place without leaving the plane
  constexpr double kAmplitude = 0.5 * kSink, kDuration = 0.096;
  State start = model.initial;
  start.bodies[0].p_WBcm.z() = kRadius - kSink - kAmplitude;
  const double rate = kDamping * frequency, damped = frequency * std::sqrt(1 - kDamping * kDamping);
  const double expected = kRadius - kSink -
                          kAmplitude * std::exp(-rate * kDuration) *
                              (std::cos(damped * kDuration) + rate / damped * std::sin(damped * kDuration));
  const Subject soft(*swinging);
  const auto height = [&](double timestep) {
    return std::vector{soft.run(model, start, timestep, kDuration).bodies[0].p_WBcm.z()};
  };
  const Verdict decay = converges(soft, height, {expected},
                                  {.duration = kDuration,
                                   .unit = "m",
                                   .order = 1,
                                   .scale = kRadius,
                                   .floor = 2e-3 * kAmplitude,
                                   .time_scale = 0.25});
  checks.add(decay.figure, decay.tolerance, "height of the decaying oscillation: " + decay.note);
  return checks.worst();
}

}  // namespace assay::conformance
