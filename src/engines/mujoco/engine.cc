// MuJoCo: joint coordinates, soft convex contact. README.md says what is exact and which defaults are overridden.
#include <algorithm>
#include <mutex>
#include <utility>

#include <fmt/format.h>

#include "base/text.h"
#include "compiled.h"
#include "engines/adapter.h"
#include "library.h"
#include "options.h"
#include "release.h"
#include "world.h"

namespace assay::mujoco {
namespace {

constexpr const char* kExplicitRemedy = "; --set pd=native is MuJoCo's own";

// Steady violation of a soft constraint over the acceleration that it holds back, s^2: the impedance is that at no
// violation, which is the largest (MuJoCo's documentation, "Solver parameters").
double give_way(const Softness& soft) {
  const auto [timeconst, dampratio] = soft.reference;
  const double impedance = soft.impedance[0], largest = soft.impedance[1];
  const double stiffness = 1 / (largest * largest * timeconst * timeconst * dampratio * dampratio);
  return (1 - impedance) / (impedance * impedance * stiffness);
}

// The same of a velocity, s.
double creep(const Softness& soft) {
  return (1 - soft.impedance[0]) / soft.impedance[0] * soft.impedance[1] * soft.reference[0] / 2;
}

// The rate at which rolling friction reaches its bound, times its length over the square of the sliding coefficient,
// m/s: the softness of friction is scaled by the squares of the coefficients. With the pyramid some three times that.
double viscous_rolling(const Settings& settings) {
  constexpr double kGravity = 9.81;
  const double cone = settings.get<std::string>("cone") == "elliptic" ? 1 : 3;
  return cone * kGravity * creep(softness(settings, "contact")) / settings.get<double>("impratio");
}

// Bounds: 1.1 to 1.5 times what the tests measure with the default softness, and in proportion for what gives way more.
std::vector<Deviation> deviations_of(const Settings& settings) {
  constexpr double kDefault = 4.46e-5;  // s^2
  const auto softer_of = [&](const char* kind) { return std::max(1.0, give_way(softness(settings, kind)) / kDefault); };
  const double softer = softer_of("contact");
  const char* pushed =
      "the inner edges of a height field's prisms push a lying capsule or cylinder aside by 2 mm, where it stays "
      "(findings/mujoco/height_field_edges.cc)";
  std::vector<Deviation> deviations = {
      {"inelastic-impact", 0.17 * softer,
       "a contact is a critically damped spring that only pushes: a body leaves it with exp(-2) = 0.135 of its speed "
       "(0.155 at 4 ms; findings/mujoco/contact_rebound.cc)"},
      {"stack-1000", 3.1 * softer,
       "a contact is as soft as the lighter body on it is light: a bar goes through bars of a thousandth of its mass "
       "(findings/mujoco/contact_mass_ratio.cc)"},
      {"limits-under-load", 0.25 * softer_of("limit"),
       "a ball joint's limit is as soft as the mean of the inverse inertias about its axes is large: 0.22 rad under a "
       "bar of "
       "0.3 m and 1 cm (findings/mujoco/ball_limit_mean_inertia.cc)"},
      {"coupling-distances", 0.05 * softer_of("equality"),
       "a coupling is as soft as the sum of its joints' inverse inertias without their ratio is large: a wheel of "
       "0.012 "
       "kg m^2 and its rack of 1 kg lag by 3 %"},
      {"bodies-on-field", 4e-3, pushed},
      {"cylinders-on-field", 4e-3, pushed},
      {"height-field-edges", 1.1,
       "bodies with flat sides or edges catch on the inner edges of a height field's prisms and lose up to all of "
       "their "
       "speed within seconds (findings/mujoco/height_field_edges.cc)"}};
  if (settings.get<std::string>("cone") != "elliptic" || settings.get<double>("impratio") < 1) {
    deviations.push_back({"rolling-slows", 0.75,
                          "rolling friction brakes slow balls in proportion to their rate: a third of it at 5 rad/s "
                          "(findings/mujoco/rolling_friction_viscous.cc)"});
  }
  if (settings.get<std::string>("cone") == "pyramidal") {
    deviations.push_back({"friction-directions", 0.31,
                          "the friction pyramid lies inside Coulomb's cone: up to 29 % less friction between its axes "
                          "(findings/mujoco/pyramidal_cone.cc)"});
  }
  const auto integrator = settings.get<std::string>("integrator");
  if (has_own_actuators(settings) && (integrator == "euler" || integrator == "rk4")) {
    deviations.push_back(
        {"velocity-gain", 1,
         "the integrators euler and rk4 take actuators' velocity gains explicitly, so that servos beyond "
         "2 I / kv are unstable (findings/mujoco/explicit_velocity_gain.cc)"});
  }
  if (settings.get<std::string>("solver") == "pgs") {
    deviations.push_back(
        {"weld-distances", 0.006, "projected Gauss-Seidel leaves a weld of two bodies 10 m across 5 cm open"});
  }
  for (Deviation& former : former_deviations(settings)) {
    const auto same = std::ranges::find(deviations, former.test, &Deviation::test);
    if (same != deviations.end()) {
      *same = std::move(former);  // the larger one
    } else {
      deviations.push_back(std::move(former));
    }
  }
  return deviations;
}

void declare_features(Capabilities& c, const Settings& settings) {
  add_exact(c, {Feature::kSlide, Feature::kBall, Feature::kBallArmature, Feature::kMassless, Feature::kBox,
                Feature::kCylinder, Feature::kEllipsoid, Feature::kHull});
  for (const Feature spring : {Feature::kBallSpring, Feature::kTendonSpring}) {
    if (has_explicit_pd(settings)) {
      add_approximated(c, spring, fmt::format("explicit torque from the state at the step's start{}", kExplicitRemedy));
    } else {
      add_exact(c, {spring});
    }
  }
  const auto soft = [&](const Softness& of) {
    return fmt::format("soft constraint: gives way by about {:.2g} s^2 times the acceleration that it holds back",
                       give_way(of));
  };
  const std::string friction =
      fmt::format("soft constraint: creeps at about {:.2g} s times the acceleration that it holds back",
                  creep(dry_friction_softness(settings)));
  const std::string limit = soft(softness(settings, "limit")), equality = soft(softness(settings, "equality"));
  add_approximated(c, Feature::kTendonLimit, limit);
  // MuJoCo reckons with one inverse inertia where the constraint turns bodies about any axis: the mean of three
  const auto soft_turn = [&](const Softness& of) {
    return fmt::format(
        "gives way by about {:.2g} s^2 times the moment that it holds times the mean of the inverse "
        "inertias about three axes, which is far above that of the axis for slender bodies",
        give_way(of));
  };
  add_approximated(c, Feature::kBallLimit, "soft constraint: " + soft_turn(softness(settings, "limit")));
  add_approximated(
      c, Feature::kCoupling,
      fmt::format("soft constraint: gives way by about {:.2g} s^2 times its force times the sum of its joints' "
                  "inverse inertias, without their ratio",
                  give_way(softness(settings, "equality"))));
  for (const Feature feature : {Feature::kCouplingOfMany, Feature::kConnect}) {
    add_approximated(c, feature, equality);
  }
  add_approximated(c, Feature::kWeld,
                   equality + "; its angle " + soft_turn(softness(settings, "equality")) +
                       "; it holds the lighter body's centre of mass");
  for (const Feature feature : {Feature::kDryFriction, Feature::kBallDryFriction, Feature::kTendonDryFriction}) {
    add_approximated(c, feature, friction);
  }
  const std::string in_cone = "soft, in one friction cone with sliding: a contact that slides resists spin less";
  add_approximated(c, Feature::kTorsionalFriction, in_cone);
  add_approximated(c, Feature::kRollingFriction,
                   fmt::format("{}; it brakes in proportion to the rate below about {:.2g} m/s times mu^2 over its "
                               "length: --set cone=elliptic --set impratio=10 brings it near",
                               in_cone, viscous_rolling(settings)));
  add_approximated(
      c, Feature::kHeightField,
      "prisms: bodies with flat sides or edges catch on their inner edges, and lose up to all of their speed "
      "without friction within seconds; balls and ellipsoids pass");
}

class MujocoEngine final : public Adapter {
 public:
  BuildFacts build() const override {
    BuildFacts facts = Adapter::build();
    facts.version = mj_versionString();
    return facts;
  }

  std::vector<Setting> settings() const override { return declared_settings(); }

  std::vector<Contender> contenders() const override {
    using Set = std::map<std::string, SettingValue>;
    const auto text = [](const char* value) { return std::string(value); };
    const auto contender = [](const char* name, const char* summary, const Set& set) {
      return Contender{.name = name, .summary = summary, .set = set};
    };
    return {
        contender("mujoco-euler", "semi-implicit Euler, Newton solver, sparse", {}),
        contender("mujoco-default", "MuJoCo's own defaults: semi-implicit Euler, Newton solver, Jacobian by size",
                  {{"jacobian", text("auto")}}),
        contender("mujoco-rk4", "Runge-Kutta 4, Newton solver, sparse", {{"integrator", text("rk4")}}),
        contender("mujoco-implicitfast", "implicit in velocity without Coriolis derivatives, Newton solver, sparse",
                  {{"integrator", text("implicitfast")}}),
        contender("mujoco-implicit", "implicit in velocity, Newton solver, sparse", {{"integrator", text("implicit")}}),
        contender("mujoco-euler-dense", "semi-implicit Euler, Newton solver, dense", {{"jacobian", text("dense")}}),
        contender("mujoco-euler-pgs", "semi-implicit Euler, projected Gauss-Seidel, sparse", {{"solver", text("pgs")}}),
        contender("mujoco-euler-pgs-dense", "semi-implicit Euler, projected Gauss-Seidel, dense",
                  {{"solver", text("pgs")}, {"jacobian", text("dense")}}),
        contender("mujoco-euler-cg", "semi-implicit Euler, conjugate gradients, sparse", {{"solver", text("cg")}}),
        contender("mujoco-euler-cg-dense", "semi-implicit Euler, conjugate gradients, dense",
                  {{"solver", text("cg")}, {"jacobian", text("dense")}}),
        contender("mujoco-euler-elliptic", "semi-implicit Euler, Newton solver, sparse, elliptic friction cone",
                  {{"cone", text("elliptic")}}),
        contender(
            "mujoco-euler-noslip",
            "semi-implicit Euler, Newton solver, elliptic friction cone, impratio 10, 10 iterations without slip",
            {{"jacobian", text("auto")}, {"cone", text("elliptic")}, {"impratio", 10.0}, {"noslip_iterations", 10LL}}),
        contender("mujoco-euler-explicit-pd",
                  "semi-implicit Euler, Newton solver, sparse, explicit springs and dampers",
                  {{"pd", text("explicit")}}),
        contender("mujoco-rk4-explicit-pd", "Runge-Kutta 4, Newton solver, sparse, explicit springs and dampers",
                  {{"integrator", text("rk4")}, {"pd", text("explicit")}}),
    };
  }

  Capabilities capabilities(const Settings& settings) const override {
    const auto integrator = settings.get<std::string>("integrator");
    Capabilities c;
    c.precision = Precision::kDouble;
    c.coordinates = Coordinates::kJoint;
    c.order = 1;
    c.spring_note = "stiffness explicit, damping implicit in velocity";
    if (integrator == "euler") {
      c.integrator = "semi-implicit Euler";
      if (!settings.get<bool>("euler_damping")) c.spring_note = "stiffness and damping explicit";
    } else if (integrator == "rk4") {
      c.integrator = "Runge-Kutta 4";
      c.order = 4;
      c.spring_note = "evaluated in each of the four stages";
    } else if (integrator == "implicitfast") {
      c.integrator = "implicit in velocity, without Coriolis derivatives";
    } else if (integrator == "implicit") {
      c.integrator = "implicit in velocity";
    } else {
      c.integrator = "discrete step map";
      c.spring_note = "stiffness and damping implicit";
    }
    describe_springs(c, !has_explicit_pd(settings), c.spring_note);
    c.joint_solver = "none (joint coordinates)";
    c.contact_solver = fmt::format("{}, at most {} iterations, tolerance {}, {} Jacobian", solver_text(settings),
                                   settings.get<long long>("iterations"), shortest(settings.get<double>("tolerance")),
                                   settings.get<std::string>("jacobian"));
    c.contact_model = fmt::format("soft: time constant {} s{}, damping ratio {}, impedance {} to {} over {} m",
                                  shortest(settings.get<double>("contact_timeconst")),
                                  settings.get<bool>("refsafe") ? " (at least 2 timesteps)" : "",
                                  shortest(settings.get<double>("contact_dampratio")),
                                  shortest(settings.get<double>("contact_impedance_min")),
                                  shortest(settings.get<double>("contact_impedance_max")),
                                  shortest(settings.get<double>("contact_impedance_width")));
    c.contact_model = contact_compliance(settings).text(c.contact_model);
    c.friction_cone = settings.get<std::string>("cone") == "elliptic" ? "elliptic" : "pyramid inside the cone, 4 sides";
    c.friction_combine = "larger of two, as the model's pairs; explicit pairs where they differ";
    c.contact = true;
    c.joint_limits = true;
    c.other = fmt::format("joint limits are soft: time constant {} s, damping ratio {}",
                          shortest(settings.get<double>("limit_timeconst")),
                          shortest(settings.get<double>("limit_dampratio")));
    c.armature = true;
    c.actuators = has_own_actuators(settings);
    c.gyroscopic = true;
    c.iterations = fmt::format("at most {}, tolerance {}", settings.get<long long>("iterations"),
                               shortest(settings.get<double>("tolerance")));
    if (const auto extra = settings.get<long long>("noslip_iterations"); extra > 0) {
      c.iterations += fmt::format("; without slip: at most {}", extra);
    }
    c.sleep = "off";
    c.speed_limits = "none";
    if (integrator == "rk4") {
      c.contact_forces_note = "a Runge-Kutta step has four sets of them";
    } else {
      c.contact_forces = ContactForces::kAll;
      c.contact_forces_note = "mj_contactForce times the timestep";
    }
    c.deviations = deviations_of(settings);
    declare_features(c, settings);
    return c;
  }

  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    std::vector<Limitation> limitations = feature_limitations("MuJoCo", model, capabilities(settings), settings);
    if (!model.contacts.empty()) {
      limitations.push_back({.fidelity = Fidelity::kApproximated,
                             .element = "contacts",
                             .how = "soft constraints: bodies sink in a little and friction creeps"});
      if (settings.get<std::string>("cone") == "pyramidal") {
        limitations.push_back({.fidelity = Fidelity::kApproximated,
                               .element = "friction",
                               .how =
                                   "a four-sided pyramid inside Coulomb's cone: up to 29 % less friction between its "
                                   "axes; --set cone=elliptic is exact"});
      }
    }
    const auto integrator = settings.get<std::string>("integrator");
    for (const Actuator& actuator : model.actuators) {
      if (!has_own_actuators(settings) || actuator.bias[2] == 0 || (integrator != "euler" && integrator != "rk4"))
        continue;
      limitations.push_back({.fidelity = Fidelity::kApproximated,
                             .element = fmt::format("feedback of actuator '{}'", actuator.name),
                             .how = fmt::format("MuJoCo's own actuator; its velocity gain acts explicitly{}: --set "
                                                "integrator=implicitfast takes it implicitly",
                                                integrator == "rk4" ? ", in each of the four stages" : "")});
    }
    for (const Joint& joint : model.joints) {
      if (joint.has_spring() && has_explicit_pd(settings)) {
        limitations.push_back(explicit_spring(joint, kExplicitRemedy));
      }
      if (joint.limited) {
        limitations.push_back({.fidelity = Fidelity::kApproximated,
                               .element = fmt::format("limit of joint '{}'", joint.name),
                               .how = "soft constraint: the limit gives way a little under load"});
      }
    }
    return limitations;
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    initialise_library();
    return std::make_unique<MujocoSimulation>(compiled(model, settings), state, settings.timestep);
  }

 private:
  // The last model compiled: campaigns create hundreds of simulations that differ only in state and timestep.
  std::shared_ptr<const Compiled> compiled(const Model& model, const Settings& settings) const {
    std::pair key{model_hash(model), settings.values};
    const std::scoped_lock lock(mutex_);
    if (cached_ == nullptr || key != key_) {
      cached_ = compile(model, settings);
      key_ = std::move(key);
    }
    return cached_;
  }

  mutable std::mutex mutex_;
  mutable std::pair<std::string, std::map<std::string, SettingValue>> key_;
  mutable std::shared_ptr<const Compiled> cached_;
};

}  // namespace
}  // namespace assay::mujoco

ASSAY_ENGINE_PLUGIN(assay::mujoco::MujocoEngine)
