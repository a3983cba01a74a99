// Rapier: impulse joints or multibody joints, float or double. README.md says what is exact, what is approximated and
// which defaults are overridden.
#include "engines/engine.h"

#include <algorithm>
#include <numbers>

#include <fmt/format.h>

#include "options.h"
#include "simulation.h"

namespace assay::rapier {
namespace {

class RapierEngine final : public Engine {
 public:
  std::string name() const override { return ASSAY_ENGINE_NAME; }

  BuildFacts build() const override {
    return {assay_rapier_f64.version, ASSAY_BUILD_SOURCE, ASSAY_BUILD_COMPILER, ASSAY_BUILD_FLAGS};
  }

  std::vector<Setting> settings() const override { return declared_settings(); }

  std::vector<Contender> contenders() const override {
    std::vector<Contender> list;
    for (const std::string joints : {"impulse", "multibody"}) {
      for (const std::string precision : {"f32", "f64"}) {
        list.push_back({fmt::format("rapier-{}-{}", joints, precision),
                        fmt::format("Rapier, {} joints, {}", joints, precision == "f32" ? "float" : "double"),
                        {{"joints", joints}, {"precision", precision}}});
      }
      list.push_back({fmt::format("rapier-{}-f64-native-pd", joints),
                      fmt::format("Rapier, {} joints, double, joint springs and dampers by its motors", joints),
                      {{"joints", joints}, {"precision", "f64"}, {"pd", "native"}}});
    }
    return list;
  }

  Capabilities capabilities(const Settings& settings) const override {
    const Options options = read_options(settings);
    const RapierOptions& world = options.world;
    const bool multibody = options.multibody();
    const std::string sweeps = fmt::format("{} substeps of {} + {} sweeps", world.solver_iterations,
                                           world.pgs_iterations, world.stabilization_iterations);
    Capabilities c;
    c.precision = options.double_precision ? Precision::kDouble : Precision::kSingle;
    c.coordinates = multibody ? Coordinates::kJoint : Coordinates::kMaximal;
    c.integrator = fmt::format("semi-implicit Euler, {} substeps a step", world.solver_iterations);
    c.order = 1;
    c.joint_solver = multibody ? "none (joint coordinates)" : "projected Gauss-Seidel, " + sweeps;
    c.contact_solver = "projected Gauss-Seidel, " + sweeps;
    c.contact_model = fmt::format(
        "soft position correction, {:g} Hz and damping ratio {:g} ({:g} Hz, {:g} with what is fixed), at "
        "most {:g} m/s",
        world.contact_frequency, world.contact_damping_ratio, world.static_contact_frequency,
        world.static_contact_damping_ratio, world.max_corrective_speed);
    c.friction_cone = world.coulomb != 0 ? "circular cone a contact point"
                                         : "circular cone and torsion a manifold; multibodies: a contact point";
    c.friction_combine =
        "larger of the shapes' coefficients, or the pair's own through a hook where that cannot say it";
    c.contact = true;
    c.joint_limits = true;
    c.torques = true;
    c.armature = multibody;
    c.springs = options.native_springs ? SpringKind::kNative : SpringKind::kExplicit;
    c.spring_note = "explicit torques from the state at the step's start";
    if (options.native_springs) {
      c.spring_note = multibody ? "implicit in angle and rate, in the mass matrix"
                                : "force-based joint motor: a row of the solver, implicit";
    }
    c.gyroscopic = multibody || world.gyroscopic != 0;
    c.iterations = sweeps;
    c.sleep = "off";
    c.speed_limits = "none";
    c.other = fmt::format("a step is {} substeps", world.solver_iterations);
    if (multibody) {
      c.other +=
          "; Coriolis terms are implicit, and explicit in substeps that would gain more than 1 % of the kinetic "
          "energy";
    }
    if (world.contact_recycling != 0) c.other += "; contact points and normals may be old by 0.05 m and 0.2 rad";
    if (world.ccd_substeps > 0) c.other += "; fast bodies are stopped where they would touch (continuous collision)";
    return c;
  }

  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    const Options options = read_options(settings);
    std::vector<Limitation> limitations;
    for (const Hinge& hinge : model.hinges) {
      const std::string joint = fmt::format("joint '{}'", hinge.name);
      if (hinge.armature != 0 && !options.multibody()) {
        limitations.push_back({Fidelity::kRefused, joint + " armature",
                               "impulse joints have no armature: set joints=multibody or armature to 0"});
      }
      if (hinge.stiffness != 0 && options.native_springs && !options.multibody()) {
        limitations.push_back(
            {Fidelity::kApproximated, joint + " stiffness",
             "the motor of an impulse joint knows the angle within half a turn of the reference; beyond "
             "it pulls the other way"});
      }
      if (hinge.limited && !options.multibody() && hinge.upper - hinge.lower >= 2 * std::numbers::pi) {
        limitations.push_back({Fidelity::kRefused, joint + " range",
                               "limits of impulse joints span less than a turn: narrow the range, remove it, or set "
                               "joints=multibody"});
      }
    }
    return limitations;
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    require_supported(model, settings);
    return make_simulation(model, state, read_options(settings));
  }
};

}  // namespace
}  // namespace assay::rapier

ASSAY_ENGINE_PLUGIN(assay::rapier::RapierEngine)
