#include "check/parity/experiments.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include "base/errors.h"
#include "model/joint.h"
#include "model/state_faults.h"

namespace assay::parity {
namespace {

constexpr double kSpeed = 1.5;           // rad/s, of joints; slides in m/s times the robot's size
constexpr double kAcceleration = 20;     // rad/s^2, what a torque asks for
constexpr int kSingleTorqueSamples = 2;  // configurations in which joints get a torque one by one

Model bench_model(Model model) {
  model.contacts.clear();
  model.shapes.clear();
  model.hulls.clear();
  model.height_fields.clear();
  model.couplings.clear();
  model.connects.clear();
  model.welds.clear();
  model.actuators.clear();
  model.control0.clear();
  each_joint(model, [](auto& joint) { joint.limited = false; });
  for (Tendon& tendon : model.tendons) tendon.limited = false;
  model.hash = model_hash(model);
  return model;
}

// A length that says how large the robot is: the largest distance between two bodies' joints, m.
double size_of(const Model& model) {
  double size = 0;
  for (const Body& body : model.bodies) {
    if (body.parent != kWorld) size = std::max(size, body.X_PB.p.norm());
    size = std::max(size, body.p_BBcm.norm());
  }
  return size > 0 ? size : 1;
}

// Uniform numbers that do not depend on the standard library.
class Random {
 public:
  explicit Random(unsigned long seed) : engine_(seed) {}
  double between(double lower, double upper) {
    return lower + (upper - lower) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  double sign() { return between(-1, 1) < 0 ? -1 : 1; }
  Vec3 direction() {
    Vec3 v;
    do v = Vec3(between(-1, 1), between(-1, 1), between(-1, 1));
    while (v.norm() > 1 || v.norm() < 0.1);
    return v.normalized();
  }

 private:
  std::mt19937_64 engine_;
};

// Within limits where there are some; speeds are well away from 0, so that dry friction has a direction.
State random_state(const Model& limited, Random& random, double size) {
  State state = limited.initial;
  for (size_t j = 0; j < limited.joints.size(); ++j) {
    const Joint& joint = limited.joints[j];
    if (joint.limited && joint.upper > joint.lower) {
      const double middle = (joint.lower + joint.upper) / 2, half = std::min((joint.upper - joint.lower) / 2, 3.0);
      state.position[j] = middle + half * random.between(-0.8, 0.8);
    } else {
      state.position[j] = joint.reference + random.between(-1, 1) * (joint.is_slide() ? size : 1.5);
    }
    state.velocity[j] = kSpeed * (joint.is_slide() ? size : 1) * random.sign() * random.between(0.5, 1);
  }
  // parents first, so that a ball's orientation is relative to its turned parent
  for (size_t i = 0; i < limited.bodies.size(); ++i) {
    const Body& body = limited.bodies[i];
    BodyState& s = state.bodies[i];
    if (body.is_free()) {
      s.q_WB = Quat(Eigen::AngleAxisd(random.between(0, 3), random.direction()));
      s.v_WBcm = random.direction() * kSpeed * size;
      s.w_WB = random.direction() * kSpeed;
    } else if (body.ball >= 0) {
      const BallJoint& ball = limited.balls[body.ball];
      const double most = ball.limited ? 0.8 * ball.upper : 1.5;
      const Quat turn(Eigen::AngleAxisd(random.between(0, most), random.direction()));
      bodies_from_joints(limited, state);
      const Quat q_WP = body.parent == kWorld ? Quat(Quat::Identity()) : state.bodies[body.parent].q_WB;
      const Vec3 w_WP = body.parent == kWorld ? Vec3(Vec3::Zero()) : state.bodies[body.parent].w_WB;
      s.q_WB = (q_WP * body.X_PB.q * turn).normalized();
      s.w_WB = w_WP + s.q_WB * Vec3(random.sign() * 0.7, random.sign() * 0.9, random.sign() * 0.5) * kSpeed;
    }
  }
  bodies_from_joints(limited, state);
  return state;
}

// All relative velocities times `factor`.
State with_velocities(const Model& model, const State& from, double factor) {
  State state = from;
  for (double& velocity : state.velocity) velocity *= factor;
  // every velocity of a body is linear in the generalized speeds
  for (BodyState& body : state.bodies) {
    body.v_WBcm *= factor;
    body.w_WB *= factor;
  }
  bodies_from_joints(model, state);
  return state;
}

Eigen::VectorXd given_forces(const Bench& bench, const Experiment& experiment) {
  Eigen::VectorXd forces = Eigen::VectorXd::Zero(bench.layout.count);
  for (size_t j = 0; j < experiment.torques.size(); ++j) forces[bench.layout.of_joint[j]] = experiment.torques[j];
  return forces;
}

// The state `steps` timesteps after `start_s`. Throws EngineError for one that cannot be.
void read_state(const Simulation& simulation, const Model& model, double start_s, double timestep_s, long long steps,
                State& out) {
  simulation.read_state(out);
  std::string fault = state_shape_fault(out, model.bodies.size(), model.joints.size());
  if (fault.empty()) fault = state_value_fault(out, &model);
  if (fault.empty()) fault = state_time_fault(out, start_s, timestep_s, steps);
  if (!fault.empty()) throw EngineError(fmt::format("the engine gave {}", fault));
}

// One step of the contender. In maximal coordinates it is a later one: a solver of constraints needs some steps until
// its warm start and its correction of the joints' drift are those of a motion, not of a start.
Step one_step(const Bench& bench, const Experiment& experiment, const ResolvedContender& contender, Settings settings,
              double timestep) {
  constexpr int kStepsBefore = 60;
  settings.timestep = timestep;
  const Model& model = bench.model_of(experiment);
  const auto simulation = contender.engine->create(model, experiment.state, settings);
  Step step;
  State after;
  long long steps = 0;
  const auto read = [&](State& out) { read_state(*simulation, model, experiment.state.time, timestep, steps, out); };
  if (contender.engine->capabilities(settings).coordinates == Coordinates::kMaximal) {
    for (; steps < kStepsBefore; ++steps) {
      simulation->set_torques(experiment.torques);
      simulation->advance(1);
    }
  }
  read(step.state);
  simulation->set_torques(experiment.torques);
  simulation->advance(1);
  ++steps;
  read(after);
  step.acceleration = (speeds(model, bench.layout, after) - speeds(model, bench.layout, step.state)) / timestep;
  return step;
}

// The largest power of two, s, at which the fastest rate of the model's springs and dampers leaves the extrapolation an
// error that does not count. `inertia` and the forces of `with` at unit positions and speeds are in one configuration.
double step_of_stiffest(const Bench& bench, const Eigen::MatrixXd& inertia) {
  constexpr double kPart = 1.0 / 1024, kLeast = 1.0 / (1 << 24);  // of the time constant; s, where rounding takes over
  const Model& model = bench.with_gravity;
  const auto count = bench.layout.count;
  Eigen::VectorXd damping = Eigen::VectorXd::Zero(count), stiffness = damping;
  each_joint(model, [&](const auto& joint) {
    damping.segment(bench.layout.first[joint.body], speeds_of(joint)).setConstant(joint.damping);
    stiffness.segment(bench.layout.first[joint.body], speeds_of(joint)).setConstant(joint.stiffness);
  });
  if (damping.isZero(0) && stiffness.isZero(0)) return std::numeric_limits<double>::infinity();
  // eigenvalues of M^-1 D and M^-1 K
  const auto fastest = [&](const Eigen::VectorXd& diagonal) {
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(
        Eigen::MatrixXd(diagonal.asDiagonal()), inertia, Eigen::EigenvaluesOnly | Eigen::Ax_lBx);
    return solver.info() == Eigen::Success ? std::max(0.0, solver.eigenvalues().maxCoeff()) : 0.0;
  };
  const double rate = std::max(fastest(damping), std::sqrt(fastest(stiffness)));
  if (!(rate > 0)) return std::numeric_limits<double>::infinity();
  return std::max(kLeast, std::exp2(std::floor(std::log2(kPart / rate))));
}

}  // namespace

Bench::Bench(const Model& model, const ExperimentOptions& options)
    : with_gravity(bench_model(model)), without_gravity(assay::without_gravity(with_gravity)), layout(model) {
  Random random(options.seed);
  const double size = size_of(model);
  Model still = without_gravity;
  each_joint(still, [](auto& joint) { joint.stiffness = joint.damping = joint.dry_friction = 0; });
  still.tendons.clear();

  for (int sample = 0; sample < options.samples; ++sample) {
    const State state = random_state(model, random, size);
    if (sample == 0) {
      const State rest = with_velocities(model, state, 0);
      Eigen::MatrixXd whole(layout.count, layout.count);
      for (int u = 0; u < layout.count; ++u) {
        whole.col(u) = inverse_dynamics(still, layout, rest, Eigen::VectorXd::Unit(layout.count, u));
      }
      inertia = whole.diagonal();
      scale = inertia * kAcceleration;
      stiff_step = step_of_stiffest(*this, (whole + whole.transpose()) / 2);
    }
    const std::vector<double> none(model.joints.size(), 0.0);
    const auto add = [&](Load load, const State& at, int joint, std::vector<double> torques) {
      experiments.push_back({load, sample, joint, at, std::move(torques)});
    };
    add(Load::kMotion, state, -1, none);
    add(Load::kReversed, with_velocities(model, state, -1), -1, none);
    add(Load::kDoubled, with_velocities(model, state, 2), -1, none);
    add(Load::kDoubledReversed, with_velocities(model, state, -2), -1, none);
    add(Load::kGravity, state, -1, none);
    std::vector<double> all = none;
    for (size_t j = 0; j < all.size(); ++j) {
      const double torque = scale[layout.of_joint[j]];
      all[j] = torque * random.sign() * random.between(0.2, 1);
      if (sample >= kSingleTorqueSamples) continue;
      std::vector<double> one = none;
      one[j] = torque;
      add(Load::kTorque, state, static_cast<int>(j), std::move(one));
    }
    add(Load::kAllTorques, state, -1, std::move(all));
  }
}

Eigen::VectorXd Bench::forces(Model& like, const Experiment& experiment, const Step& step) const {
  const Vec3 gravity = like.gravity;
  if (experiment.load != Load::kGravity) like.gravity.setZero();
  // a variant whose geometry differs has its bodies elsewhere for the same joint coordinates
  State state = step.state;
  bodies_from_joints(like, state);
  Eigen::VectorXd forces = inverse_dynamics(like, layout, state, step.acceleration);
  like.gravity = gravity;
  return forces;
}

Eigen::VectorXd Bench::forces(Model& like, const Experiment& experiment, const Response& response) const {
  return 2 * forces(like, experiment, response.fine) - forces(like, experiment, response.middle);
}

Settings exact_settings(const ResolvedContender& contender, std::string& raised) {
  constexpr long long kMost = 2000;
  Settings settings = contender.settings;
  std::vector<std::string> changed;
  for (const Setting& setting : contender.engine->settings()) {
    const bool counts = setting.name == "iterations" || setting.name.ends_with("_iterations");
    auto* value = counts ? std::get_if<long long>(&settings.values.at(setting.name)) : nullptr;
    if (value == nullptr || *value <= 1) continue;  // 0 and 1 mean off or a single pass by choice
    const auto most = static_cast<long long>(setting.maximum.value_or(static_cast<double>(kMost)));
    const long long enough = std::max(*value, std::min(kMost, most));
    if (enough != *value) {
      *value = enough;
      changed.push_back(fmt::format("{}={}", setting.name, enough));
    }
  }
  raised = fmt::format("{}", fmt::join(changed, " "));
  return settings;
}

std::vector<Response> respond(const Bench& bench, const ResolvedContender& contender, const Settings& settings) {
  const bool single = contender.engine->capabilities(contender.settings).precision == Precision::kSingle;
  // as small as rounding allows: the extrapolation leaves an error of second order in the step
  const double step =
      single ? std::clamp(bench.stiff_step, 1.0 / 16384, 1.0 / 512) : std::min(1.0 / 32768, bench.stiff_step);
  std::vector<Response> responses;
  responses.reserve(bench.experiments.size());
  Model like = bench.with_gravity;
  for (const Experiment& experiment : bench.experiments) {
    const Step coarse = one_step(bench, experiment, contender, settings, step);
    Response response{.middle = one_step(bench, experiment, contender, settings, step / 2),
                      .fine = one_step(bench, experiment, contender, settings, step / 4),
                      .residual = {},
                      .noise = {},
                      .change = {},
                      .own = Eigen::VectorXd::Zero(bench.layout.count)};
    const Eigen::VectorXd given = given_forces(bench, experiment);
    const Eigen::VectorXd first =
        2 * bench.forces(like, experiment, response.middle) - bench.forces(like, experiment, coarse) - given;
    response.residual = bench.forces(like, experiment, response) - given;
    response.change = first - response.residual;
    response.noise = response.change.cwiseAbs();
    responses.push_back(std::move(response));
  }
  return responses;
}

void take_off(std::vector<Response>& responses, const std::vector<Response>& others) {
  for (size_t e = 0; e < responses.size(); ++e) {
    Response& response = responses[e];
    response.own += others[e].residual;
    response.residual -= others[e].residual;
    response.change -= others[e].change;
    response.noise = response.change.cwiseAbs();
  }
}

std::vector<LimitPlace> find_limits(const Model& model, const ResolvedContender& contender, const Settings& settings) {
  constexpr double kWindow = 0.03, kResolution = 5e-4;  // of the range
  constexpr double kStep = 1e-3;
  constexpr double kReaction =
      3e-4;  // 1/s, of the range: above single precision's rounding, below any soft limit's pull
  Model limited = bench_model(model);
  limited.gravity.setZero();
  for (Joint& joint : limited.joints) joint.stiffness = joint.damping = joint.dry_friction = 0;
  limited.tendons.clear();
  std::vector<LimitPlace> places;
  for (size_t j = 0; j < model.joints.size(); ++j) {
    const Joint& joint = model.joints[j];
    if (!joint.limited || !(joint.upper > joint.lower)) continue;
    Model one = limited;  // only this joint has its limit: the others rest in the middle of theirs
    one.joints[j].limited = true;
    one.hash = model_hash(one);
    State middle = reference_state(one);
    for (size_t k = 0; k < model.joints.size(); ++k) {
      if (model.joints[k].limited) middle.position[k] = (model.joints[k].lower + model.joints[k].upper) / 2;
    }
    const double range = joint.upper - joint.lower;
    for (const bool upper : {false, true}) {
      const double outward = upper ? 1 : -1;
      LimitPlace place{.joint = static_cast<int>(j), .upper = upper, .expected = upper ? joint.upper : joint.lower};
      // whether the contender holds the joint up, `beyond` ranges beyond the limit at an outward speed
      const auto reacts = [&](double beyond, double speed) {
        State state = middle;
        state.position[j] = place.expected + outward * beyond * range;
        state.velocity[j] = outward * speed;
        bodies_from_joints(one, state);
        Settings used = settings;
        used.timestep = kStep;
        const auto simulation = contender.engine->create(one, state, used);
        const std::vector<double> none(model.joints.size(), 0.0);
        simulation->set_torques(none);
        simulation->advance(1);
        State after;
        read_state(*simulation, one, state.time, kStep, 1, after);
        const double back = speed - outward * after.velocity[j];
        return back > (speed > 0 ? speed / 2 : kReaction * range);
      };
      // at rest, else (an engine that only stops what goes on) at a speed that covers four resolutions in a step
      for (const double speed : {0.0, 4 * kResolution * range / kStep}) {
        double inside = -kWindow, outside = kWindow;
        if (reacts(inside, speed) || !reacts(outside, speed)) continue;
        while (outside - inside > kResolution) {
          const double between = (inside + outside) / 2;
          (reacts(between, speed) ? outside : inside) = between;
        }
        place.found = true;
        place.place = place.expected + outward * ((inside + outside) / 2 * range + speed * kStep);
        break;
      }
      places.push_back(place);
    }
  }
  return places;
}

}  // namespace assay::parity
