#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include <fmt/format.h>

#include "base/text.h"
#include "conformance/models.h"
#include "conformance/tests.h"
#include "model/kinematics.h"

namespace assay::conformance {
namespace {

// Uniform numbers that are the same with every standard library.
class Random {
 public:
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  Vec3 vector(double size) {
    const double x = between(-size, size), y = between(-size, size), z = between(-size, size);
    return {x, y, z};
  }
  Quat rotation() {
    const Vec3 v = vector(1);
    const double w = between(-1, 1);
    const double length = std::hypot(w, v.norm());
    return length > 0.1 ? Quat(w / length, v.x() / length, v.y() / length, v.z() / length) : rotation();
  }

 private:
  std::mt19937_64 engine_{20150526};  // NOLINT(bugprone-random-generator-seed): the same states for every contender
};

State random_state(const Model& model, Random& random) {
  State state = model.initial;
  state.time = random.between(0, 100);
  for (double& angle : state.position) angle = random.between(-9, 9);
  for (double& rate : state.velocity) rate = random.between(-3, 3);
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    if (!model.bodies[i].is_free()) continue;
    // braces keep the order of the calls
    state.bodies[i] = BodyState{random.vector(2), random.rotation(), random.vector(3), random.vector(3)};
  }
  bodies_from_joints(model, state);
  return state;
}

// Converting a state to an engine's coordinates and back takes about forty roundings of numbers up to 10.
double conversion_tolerance(const Subject& subject) { return subject.rounding(10, 10); }

// Falling, sliding and touching capsules for engines with contact, else bodies on hinges.
Model eventful_model(const Subject& subject) {
  if (!subject.capabilities().contact) return oblique_trees();
  Model model;
  model.name = "conformance-eventful";
  add_shape(model, ShapeType::kPlane, kWorld);
  Random random;
  for (int i = 0; i < 4; ++i) {
    add_free_body(model, fmt::format("capsule_{}", i), capsule_solid(1, 0.08, 0.1, Vec3::UnitZ()),
                  {Vec3(0.05 * i, 0.03 * i, 0.15 + 0.2 * i), random.rotation()});
    const int shape = add_shape(model, ShapeType::kCapsule, i, {}, 0.08, 0.1);
    for (int other = 0; other < shape; ++other) add_contact(model, other, shape, 0.5);
  }
  return finished(std::move(model));
}

// One instance, stepped in pieces.
class Instance {
 public:
  Instance(const Subject& subject, const Model& model, const State& start, double timestep)
      : simulation_(subject.create(model, start, timestep)) {}
  void advance(int count) { simulation_->advance(count); }
  State state() const {
    State state;
    simulation_->read_state(state);
    return state;
  }

 private:
  std::unique_ptr<Simulation> simulation_;
};

// What the engine reports of itself against the model in `state`.
void check_view(const Model& model, const State& state, const EngineView& view, double tolerance, Checks& checks) {
  if (view.bodies.size() != model.bodies.size() || view.joints.size() != model.joints.size()) {
    throw EngineError(fmt::format("the engine has {} bodies and {} hinges and slides, the model {} and {}",
                                  view.bodies.size(), view.joints.size(), model.bodies.size(), model.joints.size()));
  }
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const EngineBody& seen = view.bodies[i];
    if (body.is_massless()) {
      checks.add(std::abs(seen.mass), 0, fmt::format("mass of '{}', which has none, kg", body.name));
      continue;
    }
    const Mat3 R = state.bodies[i].q_WB.toRotationMatrix();
    const Mat3 I_W = R * body.I_BBcm_B * R.transpose();
    checks.add(std::abs(seen.mass / body.mass - 1), tolerance, fmt::format("mass of '{}', relative", body.name));
    checks.add((seen.I_BBcm_W - I_W).cwiseAbs().maxCoeff() / I_W.trace(), tolerance,
               fmt::format("inertia of '{}' in the world, relative to its trace", body.name));
    checks.add((seen.p_WBcm - state.bodies[i].p_WBcm).norm(), tolerance,
               fmt::format("centre of mass of '{}', m", body.name));
  }
  for (size_t j = 0; j < model.joints.size(); ++j) {
    const Joint& hinge = model.joints[j];
    const EngineJoint& seen = view.joints[j];
    const JointFrames frames = joint_frames(model, state, static_cast<int>(j));
    const Vec3 offset = seen.p_WJ - frames.p_WJ_child;
    checks.add((seen.axis_W - frames.axis_W_child).norm(), tolerance, fmt::format("axis of '{}', rad", hinge.name));
    if (!hinge.is_slide()) {
      checks.add(offset.cross(frames.axis_W_child).norm(), tolerance,
                 fmt::format("axis of '{}', m beside", hinge.name));
    }
    checks.add(seen.limited == hinge.limited ? 0 : 1, tolerance,
               fmt::format("'{}' {} limited in the engine", hinge.name, seen.limited ? "is" : "is not"));
    if (!hinge.limited || !seen.limited) continue;
    checks.add(std::max(std::abs(seen.lower - hinge.lower), std::abs(seen.upper - hinge.upper)), tolerance,
               fmt::format("limits of '{}', {}", hinge.name, hinge.is_slide() ? "m" : "rad"));
  }
  checks.add((view.gravity - model.gravity).norm(), tolerance, "gravity, m/s^2");
}

// A state that was read at once against the one that was given.
void check_state(const Model& model, const State& state, const State& read, double tolerance, Checks& checks) {
  if (read.bodies.size() != state.bodies.size() || read.position.size() != state.position.size() ||
      read.velocity.size() != state.velocity.size()) {
    throw EngineError("the state that was read back has another size");
  }
  // the adapter keeps the time, in double precision for every engine
  checks.add(std::abs(read.time - state.time), 1e-12, "time, s");
  for (size_t b = 0; b < state.bodies.size(); ++b) {
    const BodyState &is = read.bodies[b], &was = state.bodies[b];
    const std::string& name = model.bodies[b].name;
    checks.add((is.p_WBcm - was.p_WBcm).norm(), tolerance, fmt::format("position of '{}', m", name));
    checks.add(std::abs(is.q_WB.norm() - 1), tolerance, fmt::format("length of the quaternion of '{}'", name));
    checks.add(angle_between(is.q_WB, was.q_WB), tolerance, fmt::format("orientation of '{}', rad", name));
    checks.add((is.v_WBcm - was.v_WBcm).norm(), tolerance, fmt::format("velocity of '{}', m/s", name));
    checks.add((is.w_WB - was.w_WB).norm(), tolerance, fmt::format("angular velocity of '{}', rad/s", name));
  }
  for (size_t j = 0; j < state.position.size(); ++j) {
    const std::string& name = model.joints[j].name;
    checks.add(std::abs(read.position[j] - state.position[j]), tolerance, fmt::format("angle of '{}', rad", name));
    checks.add(std::abs(read.velocity[j] - state.velocity[j]), tolerance, fmt::format("rate of '{}', rad/s", name));
  }
}

// Trees of every joint that the contender has exactly beside hinges.
Model tree_of_joints(const Subject& subject, unsigned seed) {
  TreeOptions options;
  options.slides = subject.is_exact(Feature::kSlide);
  options.balls = subject.is_exact(Feature::kBall);
  options.massless = subject.is_exact(Feature::kMassless);
  return random_tree(seed, options);
}

}  // namespace

Verdict readback(const Subject& subject) {
  Model model = oblique_trees();
  if (subject.capabilities().joint_limits) {
    for (const int limited : {1, 3}) {
      Joint& hinge = model.joints[limited];
      hinge.limited = true;
      hinge.lower = hinge.reference - 1.1;
      hinge.upper = hinge.reference + 0.7;
    }
  }
  model.gravity = {0.3, -0.2, -9.7};
  model = finished(std::move(model));
  Random random;
  State state = random_state(model, random);
  for (size_t j = 0; j < model.joints.size(); ++j)
    state.position[j] = model.joints[j].reference + random.between(-1, 0.6);
  bodies_from_joints(model, state);
  const EngineView view = subject.create(model, state, 1e-3)->view();

  Checks checks("");
  check_view(model, state, view, conversion_tolerance(subject), checks);
  return checks.worst();
}

Verdict tree_readback(const Subject& subject) {
  Checks checks("");
  for (const unsigned seed : {1U, 2U, 3U, 4U}) {
    Model model = tree_of_joints(subject, seed);
    if (subject.capabilities().joint_limits) {
      for (size_t j = 0; j < model.joints.size(); j += 2) {
        Joint& joint = model.joints[j];
        joint.limited = true;
        joint.lower = joint.reference - 1.1;
        joint.upper = joint.reference + 0.9;
      }
      model.hash = model_hash(model);
    }
    const EngineView view = subject.create(model, model.initial, 1e-3)->view();
    check_view(model, model.initial, view, conversion_tolerance(subject), checks);
  }
  return checks.worst();
}

Verdict state_round_trip(const Subject& subject) {
  const Model model = oblique_trees();
  const double tolerance = conversion_tolerance(subject);
  Random random;
  Checks checks("");
  for (int i = 0; i < 20; ++i) {
    const State state = random_state(model, random);
    State read;
    subject.create(model, state, 1e-3)->read_state(read);
    check_state(model, state, read, tolerance, checks);
    if (i % 10 != 0) continue;
    // bodies alone are a state, too
    State bodies = state;
    bodies.position.clear();
    bodies.velocity.clear();
    subject.create(model, bodies, 1e-3)->read_state(read);
    joints_from_bodies(model, bodies);
    check_state(model, bodies, read, tolerance, checks);
  }
  return checks.worst();
}

Verdict tree_round_trip(const Subject& subject) {
  Checks checks("");
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const Model model = tree_of_joints(subject, seed);
    State state = model.initial, read;
    state.time = 12.5 * seed;
    subject.create(model, state, 1e-3)->read_state(read);
    check_state(model, state, read, conversion_tolerance(subject), checks);
  }
  return checks.worst();
}

Verdict determinism(const Subject& subject) {
  const Model model = eventful_model(subject);
  const auto run = [&] {
    Instance instance(subject, model, model.initial, 2e-3);
    instance.advance(400);
    return instance.state();
  };
  const State first = run();
  return {static_cast<double>(differing_bits(first, run())), 0, "numbers", "numbers of the final state that differ"};
}

Verdict independence(const Subject& subject) {
  const Model eventful = eventful_model(subject);
  Model other = chain(true);
  other.gravity = {1, 2, 3};
  other = finished(std::move(other));
  const State other_start = with_joints(other, {0, 0.2, 0.4, 0.6, 0.8}, std::vector<double>(5, 1.0));
  constexpr int kPieces = 20, kSteps = 15;

  const auto alone = [&](const Model& model, const State& start, double timestep) {
    Instance instance(subject, model, start, timestep);
    for (int i = 0; i < kPieces; ++i) instance.advance(kSteps);
    return instance.state();
  };
  const State eventful_alone = alone(eventful, eventful.initial, 2e-3);
  const State other_alone = alone(other, other_start, 1e-3);

  Instance a(subject, eventful, eventful.initial, 2e-3);
  Instance b(subject, other, other_start, 1e-3);
  for (int i = 0; i < kPieces; ++i) {
    a.advance(kSteps);
    // a third instance is created and destroyed between two steps of the others
    if (i % 5 == 2) Instance(subject, eventful, eventful.initial, 5e-3).advance(3);
    b.advance(kSteps);
  }
  const int count = differing_bits(a.state(), eventful_alone) + differing_bits(b.state(), other_alone);
  return {static_cast<double>(count), 0, "numbers", "numbers that differ from those of separate runs"};
}

Verdict batches(const Subject& subject) {
  const Model model = eventful_model(subject);
  State start = model.initial;
  start.time = 3.25;
  constexpr int kSteps = 120;
  constexpr double kTimestep = 2e-3;
  Instance whole(subject, model, start, kTimestep), single(subject, model, start, kTimestep);
  whole.advance(kSteps);
  for (int i = 0; i < kSteps; ++i) {
    single.advance(1);
    if (i % 7 == 0) single.state();
  }
  Checks checks("numbers");
  State end = whole.state();
  const double time = start.time + kSteps * kTimestep;
  if (!(std::abs(end.time - time) < 1e-9)) {
    checks.add(1, 0, fmt::format("the time is {} s instead of {} s", shortest(end.time), shortest(time)));
  }
  // the sum of many timesteps may round differently from their product
  State one_by_one = single.state();
  one_by_one.time = end.time;
  checks.add(differing_bits(end, one_by_one), 0,
             "numbers that differ between advance(n) and n times advance(1) with reads between");
  return checks.worst();
}

Verdict restart(const Subject& subject) {
  const Model model = chain(true);
  const double timestep = subject.coarse_timestep();
  constexpr double kBefore = 0.5, kAfter = 0.248;
  const int before = static_cast<int>(std::llround(kBefore / timestep));
  const int after = static_cast<int>(std::llround(kAfter / timestep));
  Instance first(subject, model, model.initial, timestep);
  first.advance(before);
  const State middle = first.state();
  Instance second(subject, model, middle, timestep);
  first.advance(after);
  second.advance(after);
  const State a = first.state(), b = second.state();

  double speed = 0;
  for (const BodyState& body : middle.bodies) speed = std::max(speed, body.v_WBcm.norm());
  // Engines in joint coordinates have no hidden state: only rounding is allowed, amplified a hundredfold by the chain.
  // An engine in maximal coordinates loses its warm start: a hundredth of one step's travel is allowed.
  double tolerance = subject.rounding(after, 1.5) * 25;
  if (subject.capabilities().coordinates == Coordinates::kMaximal) tolerance += 0.01 * timestep * speed;
  Checks checks("m");
  if (!(std::abs(a.time - b.time) < 1e-9)) {
    checks.add(std::abs(a.time - b.time), 0, "seconds between the two instances' times");
  }
  const std::vector<double> p = positions(a), q = positions(b);
  double largest = 0;
  for (size_t i = 0; i < p.size(); ++i) largest = std::max(largest, std::abs(p[i] - q[i]));
  checks.add(largest, tolerance,
             fmt::format("after {} steps from the state at {} s, against the run itself", after, kBefore));
  return checks.worst();
}

Verdict torque_for_one_step(const Subject& subject) {
  // the wheel on an axis through its centre of mass: nothing but the torque changes its rate
  Model model;
  model.name = "conformance-balanced-wheel";
  model.gravity.setZero();
  const Quat q_BI(Eigen::AngleAxisd(0.9, Vec3(1, 2, 2) / 3));
  add_hinged_body(model, "wheel", kWorld, {Vec3(0.2, 0.1, 0.4), q_BI},
                  principal_solid(1.5, {0.1, 0, 0.05}, {0.02, 0.03, 0.025}, q_BI), q_BI * Vec3::UnitY(),
                  {0.1, 0, 0.05});
  model = finished(std::move(model));
  constexpr double kTimestep = 2e-3, kKick = 0.5;  // rad/s that one step's torque gives
  const double torque = kKick * 0.03 / kTimestep;
  const std::unique_ptr<Simulation> simulation = subject.create(model, model.initial, kTimestep);
  const double tolerance = subject.rounding(250, 1);
  State state;
  Checks checks("rad/s");
  double expected = 0;
  const auto check = [&](const std::string& what) {
    simulation->read_state(state);
    checks.add(std::abs(state.velocity[0] - expected), tolerance, what);
  };
  simulation->set_torques({&torque, 1});
  expected += kKick;
  simulation->advance(1);
  check("rate after one step with a torque");
  simulation->advance(1);
  check("rate after a step without set_torques");
  simulation->set_torques({&torque, 1});
  expected += kKick;
  simulation->advance(5);
  check("rate after set_torques and five steps: the torque acts in the first step only");
  const double back = -torque;
  simulation->set_torques({&torque, 1});
  simulation->set_torques({&back, 1});
  expected -= kKick;
  simulation->advance(1);
  check("rate after two calls of set_torques: the later one counts");
  return checks.worst();
}

}  // namespace assay::conformance
