// Open Dynamics Engine: bodies in maximal coordinates, joints and contacts as constraints, semi-implicit Euler.
// README.md says what is exact, what is approximated and which defaults are overridden.
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "engines/adapter.h"
#include "library.h"
#include "options.h"
#include "world.h"

namespace assay::ode {
namespace {

Limitation spring_limitation(const Joint& hinge, const Options& options) {
  const std::string element = joint_element(hinge, "stiffness and damping");
  if (!options.native_springs) {
    return explicit_spring(hinge, "; --set pd=native is implicit");
  }
  if (hinge.limited && hinge.is_slide()) {
    return {Fidelity::kRefused, element,
            "a slide has one pair of stops, for its limits or for its spring: set pd=explicit or remove the range"};
  }
  if (hinge.limited && !is_wide(hinge)) {
    return {Fidelity::kApproximated, element, "implicit, of first order in the timestep"};
  }
  return {Fidelity::kApproximated, element,
          "a spring knows its angle within half a turn from its rest; beyond, it pulls the other way"};
}

// Polyhedra for ellipsoids; with the quick solver what massless bodies borrow and what few iterations leave.
std::vector<Deviation> deviations(const Options& options) {
  const Deviation rocking = {"ellipsoid-rocks", 0.15,
                             "an ellipsoid is a polyhedron of 642 vertices, and small swings feel its faces"};
  std::vector<Deviation> deviations = {
      rocking,
      {"rolling-slows", 0.45, "rolling friction is a four-sided pyramid: 1.41 times as strong between its axes"}};
  deviations.push_back(
      {"bodies-at-rest", 1.05,
       "the contact point of a ball on a convex body is 0.09 mm beside its centre, so a ball at rest on "
       "a hull rolls with 6 mm/s^2 (findings/ode/ball_on_convex.cc)"});
  deviations.push_back({"cylinders-at-rest", 1.05,
                        "a lying cylinder touches a convex body at one point 0.2 mm beside its axis, so it rolls on a "
                        "hull (findings/ode/ball_on_convex.cc)"});
  if (options.max_correcting_velocity <= 0 && !options.compliance.is_set()) {
    deviations.push_back({"inelastic-impact", 1.1 * options.contact_erp,  // by theory ERP
                          "without a cap of the correcting speed a body leaves an impact with up to ERP of its speed "
                          "(findings/ode/correcting_speed.cc)"});
  }
  deviations.push_back(
      {"friction-directions", options.along_slip ? 0.25 : 0.44,
       options.along_slip ? "friction of bodies at rest is up to 1.41 times too strong between the directions that the "
                            "normal fixes (findings/ode/friction_pyramid.cc)"
                          : "friction is up to 1.41 times too strong between the directions that the normal fixes "
                            "(findings/ode/friction_pyramid.cc)"});
  if (options.exact) return deviations;
  const std::string lent = fmt::format(
      "massless bodies borrow {:g} % of the next body's mass, because the iterative solver converges slowly with less",
      100 * options.lent_share);
  deviations.push_back({"planar-root", 3.5e-3, lent});
  deviations.push_back({"massless-joints", 5e-3, lent});
  deviations.push_back({"random-massless-trees", 9e-3, lent});
  if (options.iterations < 50) {
    deviations.push_back(
        {"slide-armature", 1e-9, "few iterations leave more than rounding (findings/ode/few_iterations.cc)"});
    deviations.push_back({"stack-1000", 0.16,
                          "few iterations do not carry a load of a thousand times the mass that bears it "
                          "(findings/ode/few_iterations.cc)"});
  }
  return deviations;
}

void add_features(Capabilities& c, const Options& options) {
  using enum Feature;
  add_exact(c, {kSlide, kBall, kBallLimit, kBallArmature, kDryFriction, kBallDryFriction, kConnect, kWeld, kBox,
                kHeightField, kTorsionalFriction});
  add_explicit_springs(c);
  add_joint_rows(c);
  add_approximated(c, kRollingFriction, "a four-sided pyramid, as sliding friction");
  add_lent_mass(c, options.lent_share);
  if (!has_libccd()) return;
  add_exact(c, {kCylinder});
  add_approximated(c, kHull,
                   "libccd finds one contact point of a hull with a box, a cylinder or another hull, however many "
                   "corners touch; against planes, height fields, spheres and capsules it is exact");
  add_approximated(c, kEllipsoid, "a polyhedron of 642 vertices, within 0.23 % of the ellipsoid's size");
}

class OdeEngine final : public Adapter {
 public:
  BuildFacts build() const override {
    BuildFacts facts = Adapter::build();
    facts.flags += std::string("; configuration ") + dGetConfiguration();
    return facts;
  }

  std::vector<Setting> settings() const override { return declared_settings(); }

  std::vector<Contender> contenders() const override {
    return {
        {"ode-quick", "ODE, iterative solver (dWorldQuickStep), 50 iterations", {}},
        {"ode-quick20", "ODE, iterative solver (dWorldQuickStep), 20 iterations", {{"iterations", 20LL}}},
        {"ode-default",
         "ODE's own defaults: iterative solver, 20 iterations, no cap of the correcting speed",
         {{"iterations", 20LL}, {"contact_max_correcting_velocity", 0.0}}},
        {"ode-quick200", "ODE, iterative solver (dWorldQuickStep), 200 iterations", {{"iterations", 200LL}}},
        {"ode-quick-native-pd",
         "ODE, iterative solver (dWorldQuickStep), 50 iterations, springs and dampers by ERP and CFM",
         {{"pd", "native"}}},
        {"ode-step", "ODE, exact solver (dWorldStep)", {{"solver", "exact"}}},
        {"ode-step-native-pd",
         "ODE, exact solver (dWorldStep), springs and dampers by ERP and CFM",
         {{"solver", "exact"}, {"pd", "native"}}},
    };
  }

  Capabilities capabilities(const Settings& settings) const override {
    const Options options = read_options(settings);
    Capabilities c;
    c.precision = Precision::kDouble;
    c.coordinates = Coordinates::kMaximal;
    c.integrator = "semi-implicit Euler";
    c.order = 1;
    c.joint_solver = options.exact
                         ? "direct: Dantzig LCP over all rows"
                         : "projected SOR, " + std::to_string(options.iterations) + " iterations, no warm start";
    c.contact = true;
    c.contact_forces = ContactForces::kAll;
    c.contact_forces_note = "dJointFeedback of each contact joint times the timestep, with what ERP adds";
    c.contact_solver = c.joint_solver + ", with the joints";
    c.contact_model = fmt::format("rigid, ERP {:g}, CFM {:g}", options.contact_erp, options.contact_cfm);
    if (options.max_correcting_velocity > 0) {
      c.contact_model += fmt::format(", apart at most at {:g} m/s", options.max_correcting_velocity);
    }
    c.contact_model = options.compliance.text(c.contact_model);
    c.friction_cone = options.along_slip ? "pyramid, 4 sides, first direction along the slip"
                                         : "pyramid, 4 sides, directions fixed by the normal";
    c.friction_combine = "the pair's own coefficient, set for each contact point";
    c.deviations = deviations(options);
    c.joint_limits = true;
    c.armature = true;
    add_features(c, options);
    describe_springs(
        c, options.native_springs,
        "implicit: stops at the rest angle with ERP = hK / (hK + B), CFM = 1 / (hK + B); on a limited hinge a "
        "motor with these beside its stops");
    c.gyroscopic = options.gyroscopic;
    if (!options.exact) c.iterations = std::to_string(options.iterations);
    c.sleep = "off";
    c.speed_limits = "none";
    c.hidden_damping = "";
    if (options.gyroscopic)
      c.other = "the gyroscopic torque is implicit: it takes energy out, at first order in the step";
    if (!options.exact) {
      if (!c.other.empty()) c.other += "; ";
      c.other += "constraint rows are reordered at random, seeded by the step's number";
    }
    return c;
  }

  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    const Options options = read_options(settings);
    std::vector<Limitation> limitations = feature_limitations("ODE", model, capabilities(settings), settings);
    for (const Joint& hinge : model.joints) {
      if (hinge.has_spring()) limitations.push_back(spring_limitation(hinge, options));
      if (const auto range = wide_range(hinge, "ODE")) limitations.push_back(*range);
    }
    auto friction = options.along_slip
                        ? friction_limitation(model,
                                              "a pyramid of four sides, its first direction along the slip at the "
                                              "step's start: of bodies at rest up to 1.41 times the coefficient")
                        : fixed_friction_axes(model);
    if (friction) limitations.push_back(std::move(*friction));
    return limitations;
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    require_supported(model, settings);
    initialise_library();
    return std::make_unique<OdeSimulation>(model, state, read_options(settings));
  }
};

}  // namespace
}  // namespace assay::ode

ASSAY_ENGINE_PLUGIN(assay::ode::OdeEngine)
