// Rapier: impulse joints or multibody joints, float or double. README.md says what is exact, what is approximated and
// which defaults are overridden.
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "engines/adapter.h"
#include "options.h"
#include "world.h"

namespace assay::rapier {
namespace {

// Massless bodies have a share of mass, so the limit of small timesteps is that of a slightly different robot. Bounds:
// twice what the tests measure with the default shares, 2 % with impulse joints and 1e-5 with multibodies.
std::vector<Deviation> deviations(const Options& options) {
  const char* faces =
      "friction of a corner is not against its slip, and the face has 10 % less of it "
      "(findings/rapier/corners_slide_aslant.cc)";
  const char* polyhedron = "an ellipsoid is a polyhedron, which rocks from face to face";
  std::vector<Deviation> list = {
      {"box-slides", 0.11, faces},           {"hull-slides", 0.11, faces},
      {"far-from-origin", 0.13, faces},      {"forces-of-boxes", 0.1, faces},
      {"ellipsoid-rocks", 0.15, polyhedron}, {"rolling-slows", 1.05, "contacts do not resist rolling"}};
  if (options.world.coulomb != 0) {
    list.push_back({"friction-of-links", 0.15, faces});
    list.push_back({"friction-directions", 0.08, faces});
    list.push_back({"distances", 0.17, faces});
  }
  if (options.world.contact_coherence != 0 && options.world.contact_recycling == 0) {
    for (const char* test : {"bodies-at-rest", "cylinders-at-rest", "bodies-on-field", "cylinders-on-field"}) {
      list.push_back(
          {test, 1.05,
           "on contact points that turn with it a round body at rest gains speed; --set contact_coherence=off "
           "finds them anew (findings/rapier/kept_contacts.cc)"});
    }
  }
  if (!options.double_precision && options.world.contact_coherence == 0) {
    for (const char* test : {"cylinders-at-rest", "cylinders-on-field"}) {
      list.push_back(
          {test, 1.05,
           "in single precision the contact points of a lying cylinder on a box, hull or height field wander "
           "along its edge, which pushes it aside (findings/rapier/kept_contacts.cc)"});
    }
  }
  if (options.world.contact_frequency < 200) {
    list.push_back(
        {"stacks-at-rest", 3,
         "a stack on soft contacts sways by centimetres or buckles; --set contact_natural_frequency=200 keeps "
         "twenty boxes upright (findings/rapier/soft_stack.cc)"});
  }
  if (options.world.solver_iterations < 50) {
    // 0.049 with 500 iterations
    list.push_back({"stack-1000", 2.5,
                    "few iterations do not carry a load of a thousand times the mass that bears it "
                    "(findings/rapier/stack_mass_ratio.cc)"});
  }
  const auto add = [&list](const char* test, double bound, const char* why) { list.push_back({test, bound, why}); };
  const char* reason = "massless bodies have a share of mass, so the limit is that of a slightly different robot";
  const double scale = options.lent_share / (options.multibody() ? kDefaultLinkShare : kLentShare);
  if (options.multibody()) {
    if (!options.double_precision) {
      add("connect-distances", 3.5,
          "in single precision a connect between two links of one multibody does not hold where bodies are of 0.2 m: "
          "they end up to twice their size aside");
    }
    add("planar-root", 5e-6 * scale, reason);
    add("massless-joints", 7e-6 * scale, reason);
    add("random-massless-trees", 1.3e-5 * scale, reason);
    return list;
  }
  add("planar-root", 5e-3 * scale, reason);
  add("massless-joints", 6.5e-3 * scale, reason);
  add("random-massless-trees", 1.2e-2 * scale, reason);
  return list;
}

class RapierEngine final : public Adapter {
 public:
  BuildFacts build() const override {
    BuildFacts facts = Adapter::build();
    facts.version = assay_rapier_f64.version;
    return facts;
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
    list.push_back(
        {"rapier-default",
         "Rapier's own defaults, impulse joints, double: friction a manifold, contacts kept and softer, fast "
         "bodies stopped",
         {{"friction_model", "simplified"},
          {"contact_recycling", true},
          {"contact_coherence", true},
          {"contact_natural_frequency", 30.0},
          {"static_contact_natural_frequency", 60.0},
          {"ccd_substeps", 1LL}}});
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
    if (world.contact_recycling != 0) {
      c.contact_forces_note = "recycled contacts have points and gaps of earlier steps";
    } else {
      c.contact_forces = world.coulomb != 0 ? ContactForces::kAll : ContactForces::kNormal;
      c.contact_forces_note =
          world.coulomb != 0 ? "impulse and tangent_impulse of ContactData, over all substeps"
                             : "impulse of ContactData, over all substeps; the simplified friction model leaves none";
    }
    c.joint_limits = true;
    c.torques = true;
    c.armature = multibody;
    describe_springs(c, options.native_springs,
                     multibody ? "implicit in angle and rate, in the mass matrix"
                               : "force-based joint motor: a row of the solver, implicit");
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
    c.deviations = deviations(options);
    describe_features(c, options);
    return c;
  }

  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    const Options options = read_options(settings);
    std::vector<Limitation> limitations = feature_limitations("Rapier", model, capabilities(settings), settings);
    if (options.world.coulomb != 0) {
      if (auto friction = friction_limitation(
              model,
              "friction of a contact point is not against its slip: bodies on several points have up to 14 % less")) {
        limitations.push_back(std::move(*friction));
      }
    }
    for (const Joint& hinge : model.joints) {
      if (hinge.armature != 0 && !options.multibody()) {
        limitations.push_back({Fidelity::kRefused, joint_element(hinge, "armature"),
                               "impulse joints have no armature: set joints=multibody or armature to 0"});
      }
      if (hinge.dry_friction != 0 && hinge.has_spring() && options.native_springs && !options.multibody()) {
        limitations.push_back({Fidelity::kRefused, joint_element(hinge, "dry friction"),
                               "an impulse joint has one motor, which the native spring takes: set pd=explicit"});
      }
      if (hinge.stiffness != 0 && !hinge.is_slide() && options.native_springs && !options.multibody()) {
        limitations.push_back(
            {Fidelity::kApproximated, joint_element(hinge, "stiffness"),
             "the motor of an impulse joint knows the angle within half a turn of the reference; beyond "
             "it pulls the other way"});
      }
      if (options.multibody()) continue;
      if (const auto range = wide_range(hinge, "Rapier's impulse joint")) limitations.push_back(*range);
    }
    return limitations;
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    require_supported(model, settings);
    return make_simulation(model, state, read_options(settings));
  }

 private:
  static void describe_features(Capabilities& c, const Options& options) {
    const bool multibody = options.multibody();
    add_exact(c,
              {Feature::kSlide, Feature::kBall, Feature::kDryFriction, Feature::kBallDryFriction, Feature::kCylinder});
    const char* faces =
        "a face slides with K22 / sqrt(K22^2 + K12^2) of its friction, K a corner's inverse mass: 10 % less for a box "
        "of 2 x 2 x 1, 14 % for a thin square; --set friction_model=simplified is right";
    add_approximated(c, Feature::kBox, faces);
    add_approximated(c, Feature::kHull, faces);
    if (multibody) add_exact(c, {Feature::kBallArmature});
    add_lent_mass(c, options.lent_share, multibody ? "link_share" : "lent_share");
    add_explicit_springs(c);
    add_joint_rows(c);
    add_approximated(c, Feature::kEllipsoid,
                     "a polyhedron of 1280 faces, its radius within 0.23 %, which rocks and rolls from face to face");
    add_approximated(c, Feature::kHeightField, "a surface of the same triangles, without sides and base");
    add_approximated(c, Feature::kConnect,
                     std::string("an impulse joint between the bodies: they part by the error of a substep") +
                         (multibody && !options.double_precision
                              ? "; between two links of one multibody it does not hold in single precision"
                              : ""));
    add_approximated(c, Feature::kWeld, "an impulse joint between the bodies: they part by the error of a substep");
    add_approximated(c, Feature::kTorsionalFriction, "contacts at one point do not resist spin about the normal");
    add_approximated(c, Feature::kRollingFriction, "contacts do not resist rolling");
  }
};

}  // namespace
}  // namespace assay::rapier

ASSAY_ENGINE_PLUGIN(assay::rapier::RapierEngine)
