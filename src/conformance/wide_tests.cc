// What scales away in tests of one size: light and small bodies, fast spins, places far from the origin, impacts at
// every phase of a step, starts beyond a limit, slopes near the friction angle, heavy bodies on light ones.
#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include <fmt/format.h>

#include "base/text.h"
#include "conformance/models.h"
#include "conformance/tests.h"
#include "measures/reference/smooth.h"
#include "model/kinematics.h"

namespace assay::conformance {
namespace {

constexpr double kLightest = 1e-3, kHeaviest = 100;  // kg
constexpr double kSmallest = 1e-3, kLargest = 2;     // m

// A capsule lies along its body's z axis: these turn it to x, or to y.
const Quat kAlongX(std::sqrt(0.5), 0, std::sqrt(0.5), 0);
const Quat kAlongY(std::sqrt(0.5), -std::sqrt(0.5), 0, 0);

// Numbers of a seed, the same with every standard library.
class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random_()) / static_cast<double>(std::mt19937::max());
  }
  // every order of magnitude alike
  double scale(double low, double high) { return low * std::pow(high / low, uniform(0, 1)); }
  Vec3 direction() {
    Vec3 v = Vec3::Zero();
    do {
      for (double& x : v) x = uniform(-1, 1);
    } while (v.norm() > 1 || v.norm() < 0.1);
    return v.normalized();
  }
  Quat rotation() { return Quat(Eigen::AngleAxisd(uniform(-3, 3), direction())); }

 private:
  std::mt19937 random_;
};

int add_ball(Model& model, double mass, double radius, const Vec3& position, double friction) {
  const int body = static_cast<int>(model.bodies.size());
  add_free_body(model, fmt::format("ball_{}", body), sphere_solid(mass, radius), {position, Quat::Identity()});
  return add_shape(model, ShapeType::kSphere, body, {}, radius, 0, friction);
}

int add_bar(Model& model, double mass, double radius, double half_length, const Pose& pose, double friction) {
  const int body = static_cast<int>(model.bodies.size());
  add_free_body(model, fmt::format("bar_{}", body), capsule_solid(mass, radius, half_length, Vec3::UnitZ()), pose);
  return add_shape(model, ShapeType::kCapsule, body, {}, radius, half_length, friction);
}

// A random tree of any mass and size, fixed or floating, that spins fast, with springs, dampers and limits in reach of
// what the contender has. Its motion stays within the limits.
struct WideTree {
  Model model;
  double mass = 1, size = 0.3;
};
WideTree wide_tree(unsigned seed, const Subject& subject) {
  Draw draw(seed);
  WideTree tree;
  tree.mass = draw.scale(kLightest, kHeaviest);
  tree.size = draw.scale(kSmallest, kLargest);
  const bool floats = seed % 2 == 0;
  tree.model = random_tree(seed, {.bodies = 5,
                                  .mass = tree.mass,
                                  .size = tree.size,
                                  .free = floats,
                                  .slides = subject.is_exact(Feature::kSlide),
                                  .balls = subject.is_exact(Feature::kBall),
                                  .massless = false});
  Model& model = tree.model;
  const double rate = std::sqrt(kGravity / tree.size);  // 1/s
  if (floats) {
    model.initial.bodies[0].w_WB = rate * draw.direction();
    bodies_from_joints(model, model.initial);
  }
  const Capabilities can = subject.capabilities();
  for (size_t j = 0; j < model.joints.size(); ++j) {
    Joint& joint = model.joints[j];
    const double unit = joint.is_slide() ? tree.size : 1;
    const double force = tree.mass * kGravity * tree.size / unit;  // of the weight, or its moment
    if (can.springs != SpringKind::kNone && j % 2 == 0) {
      joint.stiffness = 0.3 * force / unit;
      joint.damping = 0.03 * force / unit / rate;
      joint.spring_reference = joint.reference + unit * draw.uniform(-0.3, 0.3);
    }
    // a joint has one pair of stops in some engines, for its range or for its spring
    if (can.joint_limits && j % 2 == 1) {
      joint.limited = true;
      joint.lower = model.initial.position[j] - 1.5 * unit;
      joint.upper = model.initial.position[j] + 1.3 * unit;
    }
  }
  model.hash = model_hash(model);
  return tree;
}

}  // namespace

Verdict spinning_bodies(const Subject& subject) {
  // free asymmetric bodies of every mass and size, spinning at 10 to 40 rad/s, without gravity; all in one run
  constexpr int kBodies = 12;
  constexpr double kDuration = 0.15, kTimeScale = 0.25;
  struct Setup {
    Model model;
    std::vector<std::string> names;
    std::vector<Quat> ends;
    std::vector<double> turns;  // rad, what rounding adds up on
  };
  static const Setup setup = [] {
    Setup made;
    made.model.name = "conformance-spins";
    made.model.gravity.setZero();
    Draw draw(7);
    std::vector<Vec3> spins;
    for (int i = 0; i < kBodies; ++i) {
      const double mass = i == 0 ? kLightest : draw.scale(kLightest, kHeaviest);
      const double size = i == 0 ? kSmallest : draw.scale(kSmallest, kLargest);
      // a box whose edges differ by at least a fifth
      const Vec3 edge(size, size * draw.uniform(0.65, 0.8), size * draw.uniform(0.3, 0.5));
      const Vec3 square = edge.cwiseProduct(edge) * mass / 12;
      const Vec3 moments(square[1] + square[2], square[0] + square[2], square[0] + square[1]);
      add_free_body(made.model, fmt::format("body_{}", i),
                    principal_solid(mass, 0.3 * size * draw.direction(), moments, draw.rotation()),
                    {Vec3(3.0 * i, 0, 0), draw.rotation()});
      spins.emplace_back(draw.scale(10, 40) * draw.direction());
      made.turns.push_back(spins.back().norm() * kDuration);
      made.names.push_back(
          fmt::format("body of {:.2g} kg and {:.2g} m at {:.0f} rad/s", mass, size, spins.back().norm()));
    }
    made.model = finished(std::move(made.model));
    for (int i = 0; i < kBodies; ++i) {
      made.model.initial.bodies[i].w_WB = spins[i];
      Model alone;  // the equations of all together are much longer
      alone.gravity.setZero();
      alone.bodies = {made.model.bodies[i]};
      alone.initial.bodies = {made.model.initial.bodies[i]};
      made.ends.push_back(smooth_solution(alone, alone.initial, kDuration).bodies[0].q_WB);
    }
    return made;
  }();
  const auto matrix = [](const Quat& q) {
    const Mat3 R = q.toRotationMatrix();
    return std::vector<double>(R.data(), R.data() + 9);
  };
  std::map<double, State> ends;
  Checks checks("rad");
  for (int i = 0; i < kBodies; ++i) {
    const auto measure = [&](double timestep) {
      auto found = ends.find(timestep);
      if (found == ends.end()) {
        found = ends.emplace(timestep, subject.run(setup.model, setup.model.initial, timestep, kDuration)).first;
      }
      return matrix(found->second.bodies[i].q_WB);
    };
    const Verdict verdict =
        converges(subject, measure, matrix(setup.ends[i]),
                  {.duration = kDuration, .unit = "rad", .scale = setup.turns[i], .time_scale = kTimeScale});
    checks.add(verdict.figure, verdict.tolerance, setup.names[i] + ": " + verdict.note);
  }
  return checks.worst();
}

Verdict wide_trees(const Subject& subject) {
  constexpr double kDuration = 0.2;  // s at 0.3 m
  static std::map<std::string, State> solutions;
  Checks checks("");
  for (unsigned seed = 21; seed < 27; ++seed) {
    const WideTree tree = wide_tree(seed, subject);
    const double time_scale = std::sqrt(tree.size / 0.3), duration = kDuration * time_scale;
    auto found = solutions.find(tree.model.hash);
    if (found == solutions.end()) {
      found = solutions.emplace(tree.model.hash, smooth_solution(tree.model, tree.model.initial, duration)).first;
    }
    const auto relative = [&](const State& state) {
      std::vector<double> numbers = positions(state);
      for (double& number : numbers) number /= tree.size;
      return numbers;
    };
    const auto measure = [&](double timestep) {
      return relative(subject.run(tree.model, tree.model.initial, timestep, duration));
    };
    // springs that act as torques held for a step are of first order with every integrator
    const Verdict verdict = converges(
        subject, measure, relative(found->second),
        {.duration = duration, .unit = "", .order = tree.model.has_springs() ? 1 : 0, .time_scale = time_scale});
    checks.add(verdict.figure, verdict.tolerance,
               fmt::format("tree {} of {:.2g} kg and {:.2g} m, {}, relative to its size: {}", seed, tree.mass,
                           tree.size, seed % 2 == 0 ? "floating" : "fixed", verdict.note));
  }
  return checks.worst();
}

Verdict far_from_origin(const Subject& subject) {
  // a sled of two runners, a capsule and a box, if there are boxes, slide some metres away from the origin
  constexpr double kSpeed = 3, kFriction = 0.4, kFrom = 0.1, kTo = 0.2, kRadius = 0.1;
  Model model;
  model.name = "conformance-far";
  const int plane = add_shape(model, ShapeType::kPlane, kWorld, {}, 0, 0, kFriction);
  std::vector<std::string> names = {"sled", "capsule"};
  const Solid sled = principal_solid(1, Vec3::Zero(), {0.03, 0.05, 0.06}, Quat::Identity());
  add_free_body(model, "sled", sled, {Vec3(-5, 5, kRadius), Quat::Identity()});
  for (const double side : {-0.25, 0.25}) {
    const int runner = add_shape(model, ShapeType::kCapsule, 0, {Vec3(0, side, 0), kAlongX}, kRadius, 0.3, kFriction);
    add_contact(model, plane, runner, kFriction);
  }
  add_contact(model, plane, add_bar(model, 1, kRadius, 0.3, {Vec3(-5, -8, kRadius), kAlongX}, kFriction), kFriction);
  if (subject.is_exact(Feature::kBox)) {
    const Vec3 half(0.2, 0.2, 0.05);
    const int body = static_cast<int>(model.bodies.size());
    add_free_body(model, "box", principal_solid(1, Vec3::Zero(), {0.015, 0.015, 0.03}, Quat::Identity()),
                  {Vec3(-5, 10, half.z()), Quat::Identity()});
    const int shape = add_shape(model, ShapeType::kBox, body, {}, 0, 0, kFriction);
    model.shapes[shape].half_size = half;
    add_contact(model, plane, shape, kFriction);
    names.emplace_back("box");
  }
  model = finished(std::move(model));
  State start = model.initial;
  for (BodyState& body : start.bodies) body.v_WBcm = {kSpeed, 0, 0};
  Checks checks("");
  // small steps too: what a position is rounded to there grows against the way of a step
  for (const double timestep : {kStep, kStep / 8}) {
    const std::vector<State> states = subject.record(model, start, timestep, kTo);
    const State &from = states.at(static_cast<size_t>(std::llround(kFrom / timestep))), &to = states.back();
    for (size_t i = 0; i < names.size(); ++i) {
      // by impulses, as in friction-per-pair
      const Vec3 gained = to.bodies[i].v_WBcm - from.bodies[i].v_WBcm;
      const double coefficient = -gained.x() / ((kTo - kFrom) * kGravity + gained.z());
      checks.add(std::abs(coefficient / kFriction - 1), 0.01,
                 fmt::format("friction impulse over normal impulse of the {} {:.4f} against {} at {} ms, relative",
                             names[i], coefficient, kFriction, shortest(1e3 * timestep)));
    }
  }
  return checks.worst();
}

Verdict inelastic_impact(const Subject& subject) {
  // balls that reach the plane at fifty phases of a step
  constexpr int kPhases = 50;
  constexpr double kSpeed = 3, kRadius = 0.1, kDuration = 0.12;
  Checks checks("");
  for (const double timestep : {1e-3, 4e-3}) {
    Model model;
    model.name = "conformance-impacts";
    const int plane = add_shape(model, ShapeType::kPlane, kWorld);
    for (int i = 0; i < kPhases; ++i) {
      const double gap = kSpeed * timestep * (1.5 + static_cast<double>(i) / kPhases);
      const int row = i / 10, column = i % 10;
      add_contact(model, plane, add_ball(model, 1, kRadius, {0.5 * column, 0.5 * row, kRadius + gap}, 1), 1);
    }
    model = finished(std::move(model));
    State start = model.initial;
    for (BodyState& body : start.bodies) body.v_WBcm = {0, 0, -kSpeed};
    const std::vector<State> states = subject.record(model, start, timestep, kDuration);
    double rebound = 0;
    int phase = 0;
    for (const State& state : states) {
      for (int i = 0; i < kPhases; ++i) {
        if (state.bodies[i].v_WBcm.z() <= rebound) continue;
        rebound = state.bodies[i].v_WBcm.z();
        phase = i;
      }
    }
    checks.add(rebound / kSpeed, 0.05,
               fmt::format("largest speed after an impact without restitution, relative to that before, at phase {} of "
                           "{} of a step of {} ms",
                           phase, kPhases, shortest(1e3 * timestep)));
    double lowest = kRadius;
    for (int i = 0; i < kPhases; ++i) lowest = std::min(lowest, states.back().bodies[i].p_WBcm.z());
    checks.add((kRadius - lowest) / kRadius, 0.05,
               fmt::format("depth in the plane after {} s, relative to the radius, at {} ms", kDuration,
                           shortest(1e3 * timestep)));
  }
  return checks.worst();
}

Verdict beyond_limit(const Subject& subject) {
  // wheels, and blocks if there are slides, that start at rest beyond either limit come back to it
  constexpr double kExcess = 0.08, kDuration = 1;
  Model model;
  model.name = "conformance-beyond-limits";
  model.gravity.setZero();
  const bool slides = subject.accepts(Feature::kSlide);
  std::vector<double> starts;
  for (const bool slide : {false, true}) {
    if (slide && !slides) continue;
    for (const double side : {1.0, -1.0}) {
      const Vec3 place(side, slide ? 2 : 0, 1);
      const std::string name = fmt::format("{}_{}", slide ? "block" : "wheel", side > 0 ? "upper" : "lower");
      Joint& joint =
          slide ? add_sliding_body(model, name, kWorld, {place, Quat::Identity()}, sphere_solid(1, 0.1), {1, 2, 2})
                : add_hinged_body(model, name, kWorld, {place, Quat::Identity()}, sphere_solid(1, 0.1), {1, 2, 2});
      joint.reference = 0.2 * side;
      joint.limited = true;
      joint.lower = side > 0 ? -1.2 : -0.6;
      joint.upper = side > 0 ? 0.6 : 1.2;
      starts.push_back(side * (0.6 + kExcess));
    }
  }
  model = finished(std::move(model));
  const State start = with_joints(model, starts, std::vector<double>(starts.size(), 0.0));
  const std::vector<State> states = subject.record(model, start, kStep, kDuration);
  Checks checks("rad or m");
  for (size_t j = 0; j < model.joints.size(); ++j) {
    const Joint& joint = model.joints[j];
    // the nearest that it came: afterwards nothing holds it
    double beyond = kExcess;
    for (const State& state : states) {
      beyond = std::min(beyond, std::max(state.position[j] - joint.upper, joint.lower - state.position[j]));
    }
    checks.add(std::max(beyond, 0.0), 0.01,
               fmt::format("'{}' remains beyond its limit within {} s, from {}", joint.name, kDuration, kExcess));
  }
  return checks.worst();
}

Verdict stick_and_slip(const Subject& subject) {
  // capsules of 1 g to 100 kg on a slope, pointing downhill: they hold below the friction's angle and slide above it
  constexpr double kFriction = 0.5, kDuration = 0.6, kFrom = 0.1;
  struct Bar {
    double mass, radius, half_length;
  };
  const std::vector<Bar> bars = {{1e-3, 2.5e-3, 5e-3}, {1, 0.05, 0.1}, {100, 0.4, 0.6}};
  Checks checks("");
  for (const double share : {0.9, 1.1}) {
    const double angle = std::atan(share * kFriction);
    Model model;
    model.name = "conformance-slope";
    model.gravity = kGravity * Vec3(std::sin(angle), 0, -std::cos(angle));
    const int plane = add_shape(model, ShapeType::kPlane, kWorld, {}, 0, 0, kFriction);
    for (size_t i = 0; i < bars.size(); ++i) {
      const Vec3 place(0, 2.0 * static_cast<double>(i), bars[i].radius);
      add_contact(model, plane,
                  add_bar(model, bars[i].mass, bars[i].radius, bars[i].half_length, {place, kAlongX}, kFriction),
                  kFriction);
    }
    model = finished(std::move(model));
    const std::vector<State> states = subject.record(model, model.initial, kStep, kDuration);
    const State &from = states.at(static_cast<size_t>(std::llround(kFrom / kStep))), &to = states.back();
    const double time = to.time - from.time;
    for (size_t i = 0; i < bars.size(); ++i) {
      const Vec3 gained = to.bodies[i].v_WBcm - from.bodies[i].v_WBcm;
      const std::string bar = fmt::format("capsule of {} kg and {} m at {} of the slope at which it slides",
                                          shortest(bars[i].mass), shortest(2 * bars[i].radius), share);
      if (share < 1) {
        checks.add(to.bodies[i].p_WBcm.x() / (model.gravity.x() * kDuration * kDuration / 2), 0.01,
                   bar + ": way relative to the way without friction");
      } else {
        const double coefficient = (model.gravity.x() * time - gained.x()) / (gained.z() - model.gravity.z() * time);
        checks.add(std::abs(coefficient / kFriction - 1), 0.02,
                   fmt::format("{}: friction impulse over normal impulse {:.4f}, relative", bar, coefficient));
      }
      checks.add(std::abs(to.bodies[i].p_WBcm.z() / bars[i].radius - 1), 0.1,
                 bar + ": height against the radius, relative");
    }
  }
  return checks.worst();
}

namespace {

// A bar across two others on the plane, heavier than these by `ratios`: how far it sinks, relative to the radius.
Verdict stack(const Subject& subject, const std::vector<double>& ratios) {
  constexpr double kRadius = 0.1, kDuration = 0.5, kAside = 0.3;
  Model model;
  model.name = "conformance-stack";
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  for (size_t i = 0; i < ratios.size(); ++i) {
    const double y = 3.0 * static_cast<double>(i);
    const int top = add_bar(model, ratios[i], kRadius, 0.5, {Vec3(0, y, 3 * kRadius), kAlongX}, 1);
    for (const double x : {-kAside, kAside}) {
      const int bottom = add_bar(model, 1, kRadius, 0.5, {Vec3(x, y, kRadius), kAlongY}, 1);
      add_contact(model, plane, bottom, 1);
      add_contact(model, bottom, top, 1);
    }
  }
  model = finished(std::move(model));
  const State end = subject.run(model, model.initial, kStep, kDuration);
  Checks checks("");
  for (size_t i = 0; i < ratios.size(); ++i) {
    const BodyState& top = end.bodies[3 * i];
    checks.add((top.p_WBcm - model.initial.bodies[3 * i].p_WBcm).norm() / kRadius, 0.05,
               fmt::format("way of a bar on two bars of 1/{} of its mass within {} s, relative to the radius",
                           shortest(ratios[i]), kDuration));
  }
  return checks.worst();
}

}  // namespace

Verdict stack_of_ten(const Subject& subject) { return stack(subject, {1, 10}); }
Verdict stack_of_thousand(const Subject& subject) { return stack(subject, {100, 1000}); }

}  // namespace assay::conformance
