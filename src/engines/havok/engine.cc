// Havok: bodies in maximal coordinates, hinges and contacts as constraints, single precision.
// README.md says what is exact, what is approximated and which defaults are overridden.
#include <algorithm>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "collision.h"
#include "engines/adapter.h"
#include "options.h"
#include "plugin.h"
#include "world.h"

namespace assay::havok_adapter {

namespace {

// Each is shown by a program in findings/havok, and what they make together by tests/engines/havok_test.cc.
std::vector<Deviation> deviations(const Options& options) {
  const char* gyroscopic = "Havok has no gyroscopic torque (findings/havok/no_gyroscopic_torque.cc)";
  const char* rounded =
      "Havok keeps inverse inertias in eight bits, wrong by up to 0.39 % (findings/havok/rounded_inverse_mass.cc)";
  const char* slow =
      "Havok brakes what is slower than 0.1 m/s (findings/havok/slow_bodies.cc) and has no gyroscopic torque";
  const char* late = "Havok brakes what is slower than 0.1 m/s, so a box tips late (findings/havok/tips_late.cc)";
  const char* corners = "an ellipsoid is a hull of 162 corners, and small swings feel its faces";
  const char* rolling =
      "Havok's cylinder is a prism of 16 sides, which loses speed at every edge (findings/havok/cylinder_is_prism.cc)";
  const char* mesh =
      "a lying cylinder, a prism of 16 sides, gains speed on a height field's triangles and rolls off "
      "(findings/havok/cylinder_on_mesh.cc)";
  const char* lent = "massless bodies borrow a share of the next body's mass, and Havok has no gyroscopic torque";
  std::vector<Deviation> list = {{"rolling-slows", 1.05, "contacts do not resist rolling"},
                                 {"torque-free-top", 1.0, gyroscopic},
                                 {"spatial-chain", 0.007, gyroscopic},
                                 {"oblique-trees", 0.008, gyroscopic},
                                 {"torque-reaction", 0.025, slow},
                                 {"torque-for-one-step", 3e-3, rounded},
                                 {"spring-damper", 2.5e-4, rounded},
                                 {"conical-pendulum", 0.05, gyroscopic},
                                 {"ball-spring", 0.015, gyroscopic},
                                 {"random-trees", 0.015, gyroscopic},
                                 {"spinning-bodies", 2, gyroscopic},
                                 {"wide-trees", 0.016, gyroscopic},
                                 {"stick-and-slip", 0.11, slow},
                                 {"dry-friction", 0.25, slow},
                                 {"near-equilibrium", 1.2e-4, slow},
                                 {"box-tips", 0.35, late},
                                 {"hull-tips", 0.35, late},
                                 {"cylinder-rolls", 0.04, rolling},
                                 {"cylinders-on-field", 1.05, mesh},
                                 {"ellipsoid-rocks", 0.3, corners},
                                 {"planar-root", 3.5e-3, lent},
                                 {"massless-joints", 0.08, lent},
                                 {"random-massless-trees", 0.022, lent}};
  if (options.ideal_step_time <= 0) return list;

  // Bounds: 1.5 times what the tests measure with Havok's own 1/60 s.
  const char* tuned =
      "Havok's solver is tuned for one timestep, and softer at the tests' (findings/havok/tuned_solver.cc)";
  const std::vector<Deviation> wider = {
      {"pendulum-period", 0.11, tuned},      {"planar-chain", 0.042, tuned}, {"spatial-chain", 0.14, tuned},
      {"bodies-collide", 0.041, tuned},      {"planar-root", 6e-3, tuned},   {"massless-joints", 0.18, tuned},
      {"random-massless-trees", 0.6, tuned}, {"stack-1000", 9.3, tuned},     {"stacks-at-rest", 3, tuned},
      {"weld-distances", 0.005, tuned},      {"restitution", 1.1, tuned}};
  std::erase_if(list, [&wider](const Deviation& plain) {
    return std::ranges::any_of(wider, [&plain](const Deviation& other) { return other.test == plain.test; });
  });
  list.insert(list.end(), wider.begin(), wider.end());
  return list;
}

void add_features(Capabilities& c, const Options& options) {
  using enum Feature;
  add_exact(c, {kSlide, kBall, kDryFriction, kConnect, kWeld, kBox});
  add_approximated(c, kCylinder, "Havok's own, a prism of 16 sides: within 1.9 % of the radius");
  add_lent_mass(c, options.lent_share);
  add_explicit_springs(c);
  add_joint_rows(c);
  add_approximated(c, kHull, "as Havok's own hull of the same points");
  add_approximated(c, kEllipsoid, "a polyhedron of 162 vertices, within 1.3 % of the ellipsoid's size");
  add_approximated(c, kHeightField,
                   "a surface of triangles: bodies below it are not pushed out, and a box that slides over its edges "
                   "turns and comes "
                   "3 % farther than on a plane");
  add_approximated(c, kTorsionalFriction, "contacts at one point do not resist spin about the normal");
  add_approximated(c, kRollingFriction, "contacts do not resist rolling");
}

class HavokEngine final : public Adapter {
 public:
  BuildFacts build() const override { return build_facts(); }

  std::vector<Setting> settings() const override { return declared_settings(); }

  std::vector<Contender> contenders() const override { return plugin_contenders(); }

  Capabilities capabilities(const Settings& settings) const override {
    const Options options = read_options(settings);
    Capabilities c;
    c.precision = Precision::kSingle;
    c.coordinates = Coordinates::kMaximal;
    c.integrator = "semi-implicit Euler, four substeps of h/4 inside a step";
    c.order = 1;
    c.joint_solver = "iterative, Havok's own, four substeps; it has no setting for iterations";
    c.contact = true;
    c.contact_forces_note =
        "collision events have one number a point, which adds up to 97 to 103 % of a resting box's weight, and no "
        "friction";
    c.contact_solver = "iterative, with the joints";
    c.contact_model = "rigid";
    c.friction_cone = "one friction force within the circle";
    c.friction_combine = "materials chosen so that Havok's rule (maximum, minimum or product) gives each pair its own";
    c.joint_limits = true;
    add_features(c, options);
    describe_springs(c, options.native_springs, "Havok's motor of the kind spring force, a constraint of its solver");
    c.gyroscopic = false;
    c.iterations = "fixed inside, not published";
    c.sleep = "off (always active)";
    c.speed_limits = fmt::format("{:g} m/s, {:g} rad/s", options.max_speed, options.max_angular_speed);
    c.hidden_damping = "bodies below 0.1 m/s are braked at 0.03 g; hinges lose energy, at first order in h";
    c.other = "inverse masses and inertias are kept in eight bits: wrong by up to 0.39 %, +0.14 % in the mean" +
              plugin_note();
    c.deviations = deviations(options);
    return c;
  }

  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    const Options options = read_options(settings);
    std::vector<Limitation> limitations = feature_limitations("Havok", model, capabilities(settings), settings);
    for (const Joint& hinge : model.joints) check_hinge(hinge, options, limitations);
    if (model.contacts.empty()) return limitations;

    const bool plane = std::ranges::any_of(model.contacts, [&model](const ContactPair& pair) {
      return model.shapes[pair.shape_a].type == ShapeType::kPlane ||
             model.shapes[pair.shape_b].type == ShapeType::kPlane;
    });
    if (plane) {
      limitations.push_back({Fidelity::kApproximated, "planes",
                             fmt::format("a box whose upper side is at least {0:g} m x {0:g} m", options.ground_size)});
    }
    if (find_filters(model).of.empty()) {
      limitations.push_back({Fidelity::kRefused, "contact pairs",
                             "Havok's filters have 32 groups of shapes and these pairs need more; let fewer shapes "
                             "differ in what they may touch"});
    }
    if (!find_friction(model)) {
      limitations.push_back(
          {Fidelity::kRefused, "friction of contact pairs",
           "Havok combines the coefficients of two shapes (by maximum, minimum or product) and no such "
           "coefficients give these pairs; make them the maxima of the shapes' own"});
    }
    return limitations;
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    require_supported(model, settings);
    return make_simulation(model, state, read_options(settings));
  }

 private:
  static void check_hinge(const Joint& hinge, const Options& options, std::vector<Limitation>& limitations) {
    if (hinge.armature != 0) limitations.push_back(armature_refused(hinge, "Havok"));
    if (!hinge.limited || hinge.is_slide()) return;
    if (const auto range = wide_range(hinge, "Havok")) {
      limitations.push_back(*range);
      return;
    }
    const double zero = zero_angle(hinge, options);
    if (hinge.upper - zero >= std::numbers::pi || zero - hinge.lower >= std::numbers::pi) {
      limitations.push_back(
          {Fidelity::kRefused, joint_element(hinge, "range"),
           "Havok's own spring rests at the middle of the turn in which it knows the angle, and a limit lies "
           "beyond; "
           "use pd=explicit"});
    }
  }
};

}  // namespace
}  // namespace assay::havok_adapter

ASSAY_ENGINE_PLUGIN(assay::havok_adapter::HavokEngine)
