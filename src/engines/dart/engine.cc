// DART: joint coordinates (articulated bodies), contacts and limits as a linear complementarity problem.
// README.md says what is exact, what is approximated and which defaults are overridden.
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "engines/adapter.h"
#include "model/pair_groups.h"
#include "options.h"
#include "world.h"

namespace assay::dartsim {
namespace {

// Bound: twice what the test measures.
const char* const kSeriesReason =
    "DART rotates free bodies that turn by less than 1 mrad a step by a second-order series, which is not a rotation: "
    "speed grows by the fourth power of that angle over 8 a step (findings/dart/exponential_series.cc)";

// DART treats pairs with at most this coefficient as frictionless.
constexpr double kLeastFriction = 1e-3;

bool is_mesh(const Shape& shape) { return shape.type == ShapeType::kHull || shape.type == ShapeType::kEllipsoid; }

void add_features(Capabilities& c) {
  add_exact(c, {Feature::kSlide, Feature::kBall, Feature::kBallArmature, Feature::kMassless, Feature::kDryFriction,
                Feature::kBallDryFriction, Feature::kBox, Feature::kCylinder});
  add_approximated(c, Feature::kHull, "the surface of the hull, as triangles; two meshes are refused");
  add_approximated(c, Feature::kEllipsoid,
                   "the surface of a polyhedron of 162 vertices, as triangles: within 0.9 % of the ellipsoid; refused "
                   "against meshes and ellipsoids");
  add_approximated(c, Feature::kHeightField, "a surface of triangles");
  add_explicit_springs(c);
  add_joint_rows(c);
  add_approximated(c, Feature::kTorsionalFriction, "left out: contacts do not resist spin about their normal");
  add_approximated(c, Feature::kRollingFriction, "left out: contacts do not resist rolling");
}

class DartEngine final : public Adapter {
 public:
  std::vector<Setting> settings() const override { return declared_settings(); }

  std::vector<Contender> contenders() const override {
    return {
        {"dart", "DART, joint coordinates, Dantzig's LCP solver", {}},
        {"dart-pgs", "DART, joint coordinates, projected Gauss-Seidel", {{"lcp", "pgs"}}},
        {"dart-default",
         "DART's own defaults: Dantzig's LCP solver, a hundredth of a depth corrected in a step, at most at 1 mm/s, "
         "directions of friction fixed by the normal",
         {{"contact_erp", 0.01},
          {"contact_max_correcting_velocity", 0.001},
          {"friction_direction", "world"},
          {"limit_max_correcting_velocity", 10.0},
          {"pgs_iterations", 30LL}}},
        {"dart-explicit-pd", "the same as dart, joint springs and dampers as explicit torques", {{"pd", "explicit"}}}};
  }

  Capabilities capabilities(const Settings& settings) const override {
    const Options options = read_options(settings);
    Capabilities c;
    c.precision = Precision::kDouble;
    c.coordinates = Coordinates::kJoint;
    c.integrator = "semi-implicit Euler";
    c.order = 1;
    c.joint_solver = "none (joint coordinates)";
    const std::string iterations =
        options.pgs_tolerance > 0
            ? fmt::format("at most {}, relative change {:g}", options.pgs_iterations, options.pgs_tolerance)
            : fmt::format("{}", options.pgs_iterations);
    c.iterations = options.pgs ? iterations : fmt::format("direct; {} where PGS steps in", iterations);
    c.contact = c.joint_limits = c.torques = c.armature = true;
    c.contact_forces = ContactForces::kAll;
    c.contact_forces_note = "Contact::force times the timestep";
    c.contact_solver = options.pgs ? "projected Gauss-Seidel, no warm start"
                                   : "Dantzig's LCP method, projected Gauss-Seidel where it fails";
    c.contact_model =
        fmt::format("rigid, ERP {:g}, CFM {:g} of the diagonal", options.contact_erp, options.contact_cfm);
    if (options.contact_max_correcting_velocity > 0) {
      c.contact_model += fmt::format(", apart at most at {:g} m/s", options.contact_max_correcting_velocity);
    }
    c.friction_cone = options.along_slip ? "pyramid, 4 sides, first direction along the slip"
                                         : "pyramid, 4 sides, directions fixed by the normal";
    c.friction_combine = "the pair's coefficient: the smaller of two shapes, chosen to give it";
    describe_springs(c, options.native_pd, "DART's own, implicit in position and velocity at the step's end");
    c.gyroscopic = true;
    c.sleep = "none (it has none)";
    c.speed_limits = "none";
    add_features(c);
    c.deviations = {{"gravity-direction", 3.3e-11, kSeriesReason},
                    {"ellipsoid-rocks", 0.42, "DART has no ellipsoid: its polyhedron rocks from face to face"},
                    {"rolling-slows", 1.05, "contacts do not resist rolling"}};
    if (!options.along_slip) {
      c.deviations.push_back({"friction-directions", 0.44,
                              "friction is up to 1.41 times too strong between the directions that the normal fixes "
                              "(findings/dart/friction_pyramid.cc)"});
    }
    if (options.contact_max_correcting_velocity > 0 && options.contact_max_correcting_velocity < 0.01) {
      // 1.5 times what the test measures with DART's own 1 mm/s
      c.deviations.push_back(
          {"inelastic-impact", 0.19,
           "so slow a correction leaves a body in the ground after an impact (findings/dart/slow_correction.cc)"});
    }
    return c;
  }

  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    const Options options = read_options(settings);
    std::vector<Limitation> limitations = feature_limitations("DART", model, capabilities(settings), settings);
    for (const Joint& hinge : model.joints) {
      if (options.native_pd && (hinge.stiffness < 0 || hinge.damping < 0)) {
        limitations.push_back({Fidelity::kRefused, joint_element(hinge, "stiffness and damping"),
                               "DART's own springs and dampers cannot be negative: set pd=explicit"});
      } else if (hinge.has_spring()) {
        const Limitation native{Fidelity::kApproximated, joint_element(hinge, "stiffness and damping"),
                                "DART's own spring and damper, implicit in the step"};
        limitations.push_back(options.native_pd ? native : explicit_spring(hinge));
      }
    }
    if (!options.along_slip) {
      if (auto friction = fixed_friction_axes(model)) limitations.push_back(std::move(*friction));
    }
    PairGroups meshes(model), smooth(model);
    for (const ContactPair& pair : model.contacts) {
      if (is_mesh(model.shapes[pair.shape_a]) && is_mesh(model.shapes[pair.shape_b])) meshes.add(pair);
      if (pair.friction > 0 && pair.friction <= kLeastFriction) {
        smooth.add(pair, fmt::format(", friction {:g}", pair.friction));
      }
    }
    for (const std::string& element : meshes.elements()) {
      limitations.push_back({Fidelity::kRefused, element,
                             "DART takes meshes and ellipsoids as surfaces of triangles, which do not hold each other "
                             "apart: exclude the pair or replace one by a box, capsule, cylinder or sphere"});
    }
    for (const std::string& element : smooth.elements()) {
      limitations.push_back({Fidelity::kApproximated, element,
                             fmt::format("without friction: DART drops coefficients up to {:g}", kLeastFriction)});
    }
    return limitations;
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    require_supported(model, settings);
    return std::make_unique<DartSimulation>(model, state, read_options(settings));
  }
};

}  // namespace
}  // namespace assay::dartsim

ASSAY_ENGINE_PLUGIN(assay::dartsim::DartEngine)
