// Jolt: rigid bodies in maximal coordinates, hinges and contacts as constraints, semi-implicit Euler. README.md says
// what is exact, what is approximated and which defaults are overridden. Jolt itself is behind jolt_world.h
// (recipe/).
#include "engines/engine.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "model/kinematics.h"
#include "options.h"
#include "scene.h"

namespace assay::jolt {
namespace {

// Half of what a range leaves of the full turn: a limit passed by more than this is taken for the other one.
double limit_margin(const Hinge& hinge) { return std::numbers::pi - (hinge.upper - hinge.lower) / 2; }
constexpr double kNarrowMargin = 0.1;  // rad

// Jolt's object layers are numbers of 16 bits, and each body that can touch something has its own.
constexpr size_t kMostBodies = 65000;

Vec3 vec3(const double* v) { return {v[0], v[1], v[2]}; }
Quat quat(const double* q) { return {q[0], q[1], q[2], q[3]}; }

State with_joints(const Model& model, const State& state) {
  State result = state;
  if (result.angle.size() != model.hinges.size() || result.rate.size() != model.hinges.size()) {
    joints_from_bodies(model, result);
  }
  return result;
}

class JoltSimulation final : public Simulation {
 public:
  JoltSimulation(const Model& model, const State& state, const Options& options)
      : model_(model),
        options_(options),
        start_time_(state.time),
        frames_(body_frames(model)),
        springs_(model.has_springs() && !options.native_springs),
        world_(make_world(model, state, frames_, options)),
        torques_(model.hinges.size(), 0.0),
        bodies_(model.bodies.size()),
        last_(with_joints(model, state)) {
    model_.keyframes.clear();
  }

  void set_torques(std::span<const double> torques) override {
    std::ranges::fill(torques_, 0.0);
    std::ranges::copy(torques.first(std::min(torques.size(), torques_.size())), torques_.begin());
    if (springs_) {
      read();
      for (size_t j = 0; j < torques_.size(); ++j) {
        torques_[j] += spring_torque(model_.hinges[j], last_.angle[j], last_.rate[j]);
      }
    }
    jolt_set_torques(world_.get(), torques_.data());
  }

  void advance(int count) override {
    const int32_t error = jolt_step(world_.get(), count);
    steps_ += count;
    if (error == 0) return;
    if (error < 0) throw EngineError("Jolt trapped: out of memory or of bounds");
    throw EngineError(fmt::format("Jolt ran out of room for contacts (EPhysicsUpdateError {})", error));
  }

  void read_state(State& out) const override {
    read();
    out = last_;
  }

  EngineView view() const override {
    EngineView out;
    std::vector<jolt_body_view> bodies(model_.bodies.size());
    std::vector<jolt_hinge_view> hinges(model_.hinges.size());
    jolt_view(world_.get(), bodies.data(), hinges.data(), out.gravity.data());
    jolt_read(world_.get(), bodies_.data());
    for (size_t b = 0; b < bodies.size(); ++b) {
      out.bodies.push_back({.mass = bodies[b].mass,
                            .p_WBcm = vec3(bodies_[b].p),
                            .I_BBcm_W = Eigen::Map<const Mat3>(bodies[b].inertia)});
    }
    for (size_t j = 0; j < hinges.size(); ++j) {
      const jolt_body_state& child = bodies_[model_.hinges[j].body];
      EngineHinge hinge{.p_WJ = vec3(child.p) + quat(child.q) * vec3(hinges[j].p_child),
                        .axis_W = quat(child.q) * vec3(hinges[j].axis_child),
                        .limited = hinges[j].limited != 0};
      if (hinge.limited) {
        const double zero = zero_angle(model_.hinges[j], options_.native_springs);
        hinge.lower = zero + hinges[j].lower;
        hinge.upper = zero + hinges[j].upper;
      }
      out.hinges.push_back(hinge);
    }
    return out;
  }

 private:
  // Fills last_, whose angles before unwrap the new ones.
  void read() const {
    last_.time = start_time_ + static_cast<double>(steps_) * options_.world.timestep;
    jolt_read(world_.get(), bodies_.data());
    for (size_t b = 0; b < bodies_.size(); ++b) {
      const jolt_body_state& body = bodies_[b];
      last_.bodies[b] = {.p_WBcm = vec3(body.p),
                         .q_WB = (quat(body.q) * frames_[b].q.conjugate()).normalized(),
                         .v_WBcm = vec3(body.v),
                         .w_WB = vec3(body.w)};
    }
    joints_from_bodies(model_, last_);
  }

  Model model_;  // our own copy: the caller's need not live on
  const Options options_;
  double start_time_;
  const std::vector<Pose> frames_;
  bool springs_;  // explicit ones
  World world_;
  long long steps_ = 0;
  std::vector<double> torques_;
  mutable std::vector<jolt_body_state> bodies_;  // scratch
  mutable State last_;                           // of the last read
};

class JoltEngine final : public Engine {
 public:
  std::string name() const override { return ASSAY_ENGINE_NAME; }

  BuildFacts build() const override {
    return {.version = ASSAY_BUILD_VERSION,
            .source = ASSAY_BUILD_SOURCE,
            .compiler = ASSAY_BUILD_COMPILER,
            .flags = ASSAY_BUILD_FLAGS};
  }

  std::vector<Setting> settings() const override { return declared_settings(); }

  std::vector<Contender> contenders() const override {
    if (kWebAssembly) return {{"jolt-f32-wasm", "Jolt as WebAssembly, turned into C: the same as jolt-f32", {}}};
    if (kDoublePositions) return {{"jolt-f64", "Jolt, positions in double precision, 50 velocity iterations", {}}};
    return {{"jolt-f32", "Jolt, single precision, 50 velocity iterations", {}},
            {"jolt-f32-10", "the same with Jolt's own 10 velocity iterations", {{"velocity_steps", 10LL}}},
            {"jolt-f32-native-pd", "the same, joint springs and dampers by the hinge's motor", {{"pd", "native"}}}};
  }

  Capabilities capabilities(const Settings& settings) const override {
    const Options options = read_options(settings);
    const jolt_settings& world = options.world;
    Capabilities c;
    c.precision = Precision::kSingle;
    c.coordinates = Coordinates::kMaximal;
    c.integrator = "semi-implicit Euler, exact rotation by a step's angular velocity";
    c.order = 1;
    c.iterations = fmt::format("{} for velocities, {} for positions", world.velocity_steps, world.position_steps);
    c.joint_solver =
        fmt::format("sequential impulses, {} iterations{}; positions corrected apart, {} iterations",
                    world.velocity_steps, world.warm_start != 0 ? ", warm start" : "", world.position_steps);
    c.contact = true;
    c.contact_solver = "the same, with the joints";
    c.contact_model = fmt::format("rigid, Baumgarte {:g}, slop {:g} m, speculative distance {:g} m", world.baumgarte,
                                  world.penetration_slop, world.speculative_distance);
    c.friction_cone = "circular, one force and one torque about the normal for all points of two shapes' contact";
    c.friction_combine = "the pair's own coefficient, through Jolt's combine function";
    c.joint_limits = true;
    c.springs = options.native_springs ? SpringKind::kNative : SpringKind::kExplicit;
    c.spring_note = options.native_springs
                        ? "the hinge's motor: an implicit linear spring and damper, solved with the joints"
                        : "torque from the state at the step's start, held for the step";
    c.gyroscopic = world.gyroscopic != 0;
    c.sleep = "off";
    c.speed_limits = "none (1e18)";
    c.hidden_damping = "hinges: a body pinned beside its centre of mass slows by up to w' = -h w^3 / 2";
    c.deviations = {{"pendulum-period", 0.03,
                     "hinges take energy out at first order in the timestep, for the position correction does not turn "
                     "velocities: at 4 ms the test's pendulum is too far from its limit to extrapolate "
                     "(findings/jolt/hinge_damps.cc)"}};
    if (kDoublePositions) c.other = "positions are double; orientations, velocities, masses and the solver are float";
    if (world.gyroscopic != 0) {
      if (!c.other.empty()) c.other += "; ";
      c.other += "the gyroscopic torque is explicit and keeps the length of the angular momentum";
    }
    if (world.collision_steps > 1) c.other += fmt::format("; {} substeps a step", world.collision_steps);
    return c;
  }

  std::vector<Finding> check(const Model& model, const Settings& settings) const override {
    const Options options = read_options(settings);
    std::vector<Finding> findings;
    for (const Hinge& hinge : model.hinges) {
      check_hinge(hinge, options.native_springs, findings);
    }
    if (model.bodies.size() + model.shapes.size() > kMostBodies) {
      findings.push_back({Fidelity::kRefused,
                          fmt::format("{} bodies and shapes", model.bodies.size() + model.shapes.size()),
                          fmt::format("this adapter gives Jolt at most {}", kMostBodies)});
    }
    return findings;
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    require_supported(model, settings);
    return std::make_unique<JoltSimulation>(model, state, read_options(settings));
  }

 private:
  static void check_hinge(const Hinge& hinge, bool native_springs, std::vector<Finding>& findings) {
    if (hinge.armature != 0) {
      findings.push_back(
          {Fidelity::kRefused, "joint '" + hinge.name + "' armature",
           "Jolt has no rotor inertia in a hinge; remove the armature or use an engine with joint coordinates"});
    }
    if (hinge.limited && limit_margin(hinge) <= 0) {
      findings.push_back({Fidelity::kRefused, "joint '" + hinge.name + "' range",
                          "Jolt knows an angle within one turn only; narrow the range below 2 pi or remove it"});
    } else if (hinge.limited && limit_margin(hinge) < kNarrowMargin) {
      findings.push_back(
          {Fidelity::kApproximated, "joint '" + hinge.name + "' range",
           fmt::format(
               "Jolt knows an angle within one turn only; a limit that is passed by more than {:g} rad is taken for "
               "the other one",
               limit_margin(hinge))});
    }
    if (!native_springs || hinge.stiffness == 0) return;
    if (!hinge.limited) {
      findings.push_back({Fidelity::kApproximated, "joint '" + hinge.name + "' spring",
                          "Jolt's motor turns the shorter way: beyond half a turn from its rest the spring's torque is "
                          "another; use pd=explicit"});
      return;
    }
    const double below = hinge.spring_reference - hinge.lower, above = hinge.upper - hinge.spring_reference;
    if (std::min(below, above) < 0 || std::max(below, above) > std::numbers::pi) {
      findings.push_back(
          {Fidelity::kRefused, "joint '" + hinge.name + "' spring",
           "Jolt's motor needs its rest within the joint's limits and neither of them further than half a "
           "turn from it; use pd=explicit"});
    }
  }
};

}  // namespace
}  // namespace assay::jolt

ASSAY_ENGINE_PLUGIN(assay::jolt::JoltEngine)
