// Havok: bodies in maximal coordinates, hinges and contacts as constraints, single precision.
// README.md says what is exact, what is approximated and which defaults are overridden.
#include "engines/engine.h"

#include <algorithm>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "build_facts.h"
#include "pairs.h"
#include "simulation.h"

namespace assay::havok_adapter {

Options::Options(const Settings& s)
    : native_springs(s.get<std::string>("pd") == "native"),
      ideal_step_time(s.get<double>("ideal_step_time")),
      max_speed(s.get<double>("max_speed")),
      max_angular_speed(s.get<double>("max_angular_speed")),
      ground_size(s.get<double>("ground_size")),
      ground_thickness(s.get<double>("ground_thickness")) {}

namespace {

class HavokEngine final : public Engine {
 public:
  std::string name() const override { return ASSAY_ENGINE_NAME; }

  BuildFacts build() const override { return build_facts(); }

  std::vector<Setting> settings() const override {
    return {
        {"pd",
         "explicit",
         "",
         "joint springs and dampers: explicit: torques from the state at the step's start; native: Havok's own motor "
         "(spring force) on the hinge's axis",
         {"explicit", "native"},
         {},
         {}},
        {"ideal_step_time",
         0.0,
         "s",
         "timestep that the solver's stiffness is tuned for; 0: none, the same solver at every timestep (Havok's own "
         "default is 1/60)",
         {},
         0.0,
         1.0},
        {"max_speed",
         1e6,
         "m/s",
         "speed above which bodies are slowed down (Havok's own default is 200)",
         {},
         1.0,
         1e9},
        {"max_angular_speed",
         1e6,
         "rad/s",
         "angular speed above which bodies are slowed down (Havok's own default is 100)",
         {},
         1.0,
         1e9},
        {"ground_size", 1000.0, "m", "side of the box that stands for a plane, which Havok has not", {}, 1.0, 1e5},
        {"ground_thickness", 10.0, "m", "thickness of that box", {}, 0.1, 1e4},
    };
  }

  std::vector<Contender> contenders() const override { return {{ASSAY_ENGINE_NAME, summary(), {}}}; }

  Capabilities capabilities(const Settings& settings) const override {
    const Options options(settings);
    Capabilities c;
    c.precision = Precision::kSingle;
    c.coordinates = Coordinates::kMaximal;
    c.integrator = "semi-implicit Euler";
    c.order = 1;
    c.joint_solver = "iterative, Havok's own; it has no setting for iterations";
    c.contact = true;
    c.contact_solver = "with the joints";
    c.contact_model = "rigid";
    c.friction_cone = "Havok's own";
    c.friction_combine = "materials chosen so that Havok's rule gives each pair its coefficient";
    c.joint_limits = true;
    c.springs = options.native_springs ? SpringKind::kNative : SpringKind::kExplicit;
    c.spring_note = options.native_springs ? "Havok's motor of the kind spring force"
                                           : "angular impulses from the state at the step's start";
    c.gyroscopic = false;
    c.iterations = "fixed inside";
    c.sleep = "off (always active)";
    c.speed_limits = fmt::format("{:g} m/s, {:g} rad/s", options.max_speed, options.max_angular_speed);
    return c;
  }

  std::vector<Finding> check(const Model& model, const Settings& settings) const override {
    const Options options(settings);
    std::vector<Finding> findings;
    for (const Hinge& hinge : model.hinges) check_hinge(hinge, findings);
    if (model.contacts.empty()) return findings;

    const bool plane = std::ranges::any_of(model.contacts, [&model](const ContactPair& pair) {
      return model.shapes[pair.shape_a].type == ShapeType::kPlane ||
             model.shapes[pair.shape_b].type == ShapeType::kPlane;
    });
    if (plane) {
      findings.push_back({Fidelity::kApproximated, "planes",
                          fmt::format("a box whose upper side is {0:g} m x {0:g} m", options.ground_size)});
    }
    if (const Filters filters = find_filters(model); filters.of.empty()) {
      findings.push_back({Fidelity::kRefused, "contact pairs",
                          fmt::format("Havok's filters have 32 groups of shapes and these pairs need {}; let fewer "
                                      "shapes differ in what they may touch",
                                      filters.groups)});
    }
    if (!find_friction(model)) {
      findings.push_back({Fidelity::kRefused, "friction of contact pairs",
                          "Havok combines the coefficients of two shapes (by maximum, minimum or product) and no such "
                          "coefficients give these pairs; make them the maxima of the shapes' own"});
    }
    return findings;
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    for (const Finding& finding : check(model, settings)) {
      if (finding.fidelity == Fidelity::kRefused) throw UnsupportedError(finding.element + ": " + finding.how);
    }
    return make_simulation(model, state, settings);
  }

 private:
  static void check_hinge(const Hinge& hinge, std::vector<Finding>& findings) {
    if (hinge.armature != 0) {
      findings.push_back(
          {Fidelity::kRefused, fmt::format("joint '{}' armature", hinge.name),
           "Havok has no rotor inertia in a hinge; remove the armature or use an engine with joint coordinates"});
    }
    if (hinge.limited && hinge.upper - hinge.lower >= 2 * std::numbers::pi) {
      findings.push_back(
          {Fidelity::kRefused, fmt::format("joint '{}' range", hinge.name),
           "Havok knows a hinge's angle within one turn only; narrow the range below 2 pi or remove it"});
    }
  }
};

}  // namespace
}  // namespace assay::havok_adapter

ASSAY_ENGINE_PLUGIN(assay::havok_adapter::HavokEngine)
