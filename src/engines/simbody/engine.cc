// Simbody: joint coordinates, integrators of fixed step. No contact. README.md says what is exact, what is approximated
// and which defaults are overridden.
#include "engines/engine.h"

#include <array>

#include <fmt/format.h>

#include "model/kinematics.h"
#include "world.h"

namespace assay::simbody {
namespace {

struct MethodFacts {
  const char* name;
  Method method;
  int order;
  const char* text;
};
constexpr std::array<MethodFacts, 6> kMethods = {
    {{"euler", Method::kSemiExplicitEuler, 1, "semi-implicit Euler"},
     {"verlet", Method::kVerlet, 2, "velocity Verlet, trapezoidal in the velocities"},
     {"rk2", Method::kRungeKutta2, 2, "Runge-Kutta 2"},
     {"rk3", Method::kRungeKutta3, 3, "Runge-Kutta 3"},
     {"rkm", Method::kRungeKuttaMerson, 4, "Runge-Kutta-Merson"},
     {"rkf", Method::kRungeKuttaFehlberg, 4, "Runge-Kutta-Fehlberg"}}};

const MethodFacts& facts_of(const Settings& settings) {
  const auto& name = settings.get<std::string>("integrator");
  for (const MethodFacts& facts : kMethods) {
    if (name == facts.name) return facts;
  }
  throw EngineError("Simbody has no integrator '" + name + "'");
}

Options read_options(const Settings& settings) {
  return {settings.timestep, facts_of(settings).method, settings.get<std::string>("pd") == "native",
          settings.get<double>("limit_frequency"), settings.get<double>("limit_dissipation")};
}

class SimbodySimulation final : public Simulation {
 public:
  SimbodySimulation(const Model& model, const State& state, const Options& options)
      : world_(model, state, options), model_(model), start_time_(state.time), timestep_(options.timestep) {
    model_.keyframes.clear();
  }

  void set_torques(std::span<const double> torques) override {
    world_.set_torques(torques.empty() ? nullptr : torques.data());
  }

  void advance(int count) override {
    world_.advance(count);
    steps_ += count;
  }

  void read_state(State& out) const override {
    out.time = start_time_ + static_cast<double>(steps_) * timestep_;
    world_.read_joints(out);
    bodies_from_joints(model_, out);
  }

  EngineView view() const override {
    const Held held = world_.held();
    EngineView view;
    view.gravity = held.gravity;
    for (const HeldBody& body : held.bodies) view.bodies.push_back({body.mass, body.p_WBcm, body.I_BBcm_W});
    for (const HeldHinge& hinge : held.hinges) {
      view.hinges.push_back({hinge.p_WJ, hinge.axis_W, hinge.limited, hinge.lower, hinge.upper});
    }
    return view;
  }

 private:
  World world_;
  Model model_;  // our own copy: the caller's need not live on
  double start_time_, timestep_;
  long long steps_ = 0;
};

class SimbodyEngine final : public Engine {
 public:
  std::string name() const override { return ASSAY_ENGINE_NAME; }

  BuildFacts build() const override {
    return {ASSAY_BUILD_VERSION, ASSAY_BUILD_SOURCE, ASSAY_BUILD_COMPILER, ASSAY_BUILD_FLAGS};
  }

  std::vector<Setting> settings() const override {
    return {{"integrator",
             "euler",
             "",
             "one step of it is one of assay's, whatever its own error estimate says: euler (semi-explicit), verlet, "
             "rk2, rk3, rkm (Merson), rkf (Fehlberg)",
             {"euler", "verlet", "rk2", "rk3", "rkm", "rkf"}},
            {"pd",
             "native",
             "",
             "joint springs and dampers: native: Simbody's own, evaluated in every stage of a step; explicit: torque "
             "from the state at the step's start",
             {"native", "explicit"}},
            {"limit_frequency",
             0.2,
             "rad",
             "a joint limit is a spring: how far it swings in a step; the stiffness follows from the joint's inertia",
             {},
             1e-3,
             1.0},
            {"limit_dissipation", 0.5, "s/rad", "Hunt-Crossley dissipation of joint limits", {}, 0.0, 1e3}};
  }

  std::vector<Contender> contenders() const override {
    return {{"simbody-euler", "Simbody, joint coordinates, semi-implicit Euler", {}},
            {"simbody-verlet", "Simbody, joint coordinates, velocity Verlet", {{"integrator", "verlet"}}},
            {"simbody-rkm", "Simbody, joint coordinates, Runge-Kutta-Merson", {{"integrator", "rkm"}}},
            {"simbody-euler-explicit-pd",
             "the same as simbody-euler, joint springs and dampers as explicit torques",
             {{"pd", "explicit"}}}};
  }

  Capabilities capabilities(const Settings& settings) const override {
    const Options options = read_options(settings);
    const MethodFacts& facts = facts_of(settings);
    Capabilities c;
    c.precision = Precision::kDouble;
    c.coordinates = Coordinates::kJoint;
    c.integrator = fmt::format("{}, fixed step", facts.text);
    c.order = facts.order;
    c.joint_solver = "none (joint coordinates)";
    c.contact = false;
    c.torques = true;
    c.joint_limits = options.method != Method::kVerlet;
    c.springs = options.native_pd ? SpringKind::kNative : SpringKind::kExplicit;
    c.spring_note = options.native_pd ? "Simbody's own, evaluated in every stage of a step"
                                      : "torque from the state at the step's start, held for the step";
    c.gyroscopic = true;
    if (options.method == Method::kVerlet) c.iterations = "at most 10 for the velocities, relative change 1e-12";
    c.sleep = "none (it has none)";
    c.speed_limits = "none";
    if (c.joint_limits) {
      c.other = fmt::format("joint limits are springs that swing {:g} rad a step", options.limit_frequency);
    }
    return c;
  }

  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    const Options options = read_options(settings);
    std::vector<Limitation> limitations;
    for (const Hinge& hinge : model.hinges) {
      const std::string joint = fmt::format("joint '{}'", hinge.name);
      if (hinge.armature != 0) {
        limitations.push_back({Fidelity::kRefused, joint + " armature", "Simbody has no joint armature: set it to 0"});
      }
      if (hinge.has_spring() && !options.native_pd) {
        limitations.push_back({Fidelity::kApproximated, joint + " stiffness and damping",
                               "explicit torque from the state at the step's start"});
      }
      if (hinge.limited && options.method == Method::kVerlet) {
        limitations.push_back(
            {Fidelity::kRefused, joint + " range",
             "Verlet's iteration does not converge in the spring that stands for a limit: choose another "
             "integrator"});
      } else if (hinge.limited) {
        limitations.push_back(
            {Fidelity::kApproximated, joint + " range",
             fmt::format("a spring beyond the limit that swings {:g} rad a step, with dissipation {:g} "
                         "s/rad",
                         options.limit_frequency, options.limit_dissipation)});
      }
    }
    if (!model.contacts.empty()) {
      limitations.push_back({Fidelity::kRefused, "contacts",
                             "Simbody has no contact geometry for capsules: use --contacts off or another engine"});
    }
    return limitations;
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    require_supported(model, settings);
    return std::make_unique<SimbodySimulation>(model, state, read_options(settings));
  }
};

}  // namespace
}  // namespace assay::simbody

ASSAY_ENGINE_PLUGIN(assay::simbody::SimbodyEngine)
