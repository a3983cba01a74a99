// Jolt: rigid bodies in maximal coordinates, hinges and contacts as constraints, semi-implicit Euler. README.md says
// what is exact, what is approximated and which defaults are overridden. Jolt itself is behind jolt_world.h
// (recipe/).
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "engines/adapter.h"
#include "options.h"
#include "world.h"

namespace assay::jolt {
namespace {

// Jolt's object layers are numbers of 16 bits, and each body that can touch something has its own.
constexpr size_t kMostBodies = 65000;

// Without the setting slow_turns: Jolt drops turns of at most 1e-6 rad a step, so turns at 0.5 mrad/s need steps of 2
// ms.
constexpr double kSlowTurn = 1e-6, kSlowRate = 0.5e-3;  // rad, rad/s

// Whether a body that can roll may touch another.
bool touches_roundly(const Model& model) {
  const auto rolls = [&](int shape) {
    using enum ShapeType;
    const ShapeType type = model.shapes[static_cast<size_t>(shape)].type;
    return type == kSphere || type == kCapsule || type == kCylinder || type == kEllipsoid;
  };
  return std::ranges::any_of(model.contacts,
                             [&](const ContactPair& pair) { return rolls(pair.shape_a) || rolls(pair.shape_b); });
}

void add_features(Capabilities& c, const Options& options) {
  using enum Feature;
  add_exact(c, {kSlide, kBall, kDryFriction, kConnect, kWeld, kBox, kCylinder});
  add_refused(c, kBallLimit,
              "Jolt limits a ball joint's swing and twist apart: remove the range or choose another engine");
  add_refused(c, kBallDryFriction,
              "Jolt's point constraint has no friction: set frictionloss to 0 or choose another engine");
  add_refused(c, kBallArmature, "Jolt's point constraint has no motor: set armature to 0 or choose another engine");
  add_explicit_springs(c);
  add_joint_rows(c);  // Jolt's gears hold the absolute rates of two bodies, not the rates of their joints
  add_lent_mass(c, options.lent_share);
  add_approximated(
      c, kHull,
      "hulls of more than 256 corners keep the 256 that stand out most: within 1.6 % of the radius on a ball of 2562");
  add_approximated(c, kEllipsoid, "a polyhedron of 162 vertices, within 0.9 % of the ellipsoid's size");
  add_approximated(
      c, kHeightField,
      options.world.inner_edges != 0
          ? "a surface of triangles: bodies below it are not pushed out; a capsule or cylinder at rest rolls away on "
            "their "
            "edges, by 0.2 m in a second; set inner_edges=off"
          : "a surface of triangles: bodies below it are not pushed out; at 4 ms and more a capsule at rest rolls by "
            "millimetres");
  add_approximated(c, kTorsionalFriction, "contacts at one point do not resist spin about the normal");
  add_approximated(c, kRollingFriction, "contacts do not resist rolling");
}

class JoltEngine final : public Adapter {
 public:
  std::vector<Setting> settings() const override { return declared_settings(); }

  std::vector<Contender> contenders() const override {
    if (kWebAssembly) return {{"jolt-f32-wasm", "Jolt as WebAssembly, turned into C: the same as jolt-f32", {}}};
    if (kDoublePositions) return {{"jolt-f64", "Jolt, positions in double precision, 50 velocity iterations", {}}};
    return {{"jolt-f32", "Jolt, single precision, 50 velocity iterations", {}},
            {"jolt-f32-10", "the same with Jolt's own 10 velocity iterations", {{"velocity_steps", 10LL}}},
            {"jolt-default",
             "Jolt's own defaults: 10 velocity iterations, a slop of 2 cm, kept contact points, no turns below 1e-6 "
             "rad a step, inner edges of height fields",
             {{"velocity_steps", 10LL},
              {"penetration_slop", 0.02},
              {"pair_cache", true},
              {"slow_turns", false},
              {"inner_edges", true}}},
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
    if (world.collision_steps > 1) {
      c.contact_forces_note = "those of the last substep alone could be read";
    } else {
      c.contact_forces = ContactForces::kAll;
      c.contact_forces_note =
          "impulses of the contact cache, read from PhysicsSystem::SaveState; a manifold's friction is shared out by "
          "its "
          "points' normal impulses, without its torque";
    }
    c.contact_solver = "the same, with the joints";
    c.contact_model = fmt::format("rigid, Baumgarte {:g}, slop {:g} m, speculative distance {:g} m", world.baumgarte,
                                  world.penetration_slop, world.speculative_distance);
    c.friction_cone = "circular, one force and one torque about the normal for all points of two shapes' contact";
    c.friction_combine = "the pair's own coefficient, through Jolt's combine function";
    c.joint_limits = true;
    c.armature = true;
    add_features(c, options);
    describe_springs(c, options.native_springs,
                     "the hinge's motor: an implicit linear spring and damper, solved with the joints");
    c.gyroscopic = world.gyroscopic != 0;
    c.sleep = "off";
    c.speed_limits = "none (1e18)";
    c.hidden_damping = "hinges: a body pinned beside its centre of mass slows by up to w' = -h w^3 / 2";
    c.deviations = {{"pendulum-period", 0.03,
                     "hinges take energy out at first order in the timestep, for the position correction does not turn "
                     "velocities: at 4 ms the test's pendulum is too far from its limit to extrapolate "
                     "(findings/jolt/hinge_damps.cc)"}};
    const std::string lent = fmt::format(
        "massless bodies borrow {:g} % of the next body's mass, because the iterative solver converges slowly with "
        "less",
        100 * options.lent_share);
    const bool few = world.velocity_steps < 50;
    c.deviations.push_back(
        {"ellipsoid-rocks", 0.5, "an ellipsoid is a hull of 162 corners, and small swings feel its faces"});
    // a ball on kept contact points gains speed instead
    c.deviations.push_back({"rolling-slows", world.pair_cache != 0 ? 1.9 : 1.05, "contacts do not resist rolling"});
    if (world.pair_cache != 0) {
      c.deviations.push_back({"cylinder-rolls", 0.04,
                              "Jolt keeps the contact points of bodies whose relative pose changes by less than 1 mm "
                              "and 2 degrees; --set pair_cache=off finds them anew (findings/jolt/kept_contacts.cc)"});
      for (const char* test : {"bodies-at-rest", "cylinders-at-rest", "bodies-on-field", "cylinders-on-field"}) {
        c.deviations.push_back({test, 1.05,
                                "on contact points that turn with it a round body at rest gains speed; --set "
                                "pair_cache=off finds them anew (findings/jolt/kept_contacts.cc)"});
      }
    } else if (world.inner_edges != 0) {
      for (const char* test : {"bodies-on-field", "cylinders-on-field"}) {
        c.deviations.push_back({test, 1.05,
                                "a capsule or cylinder at rest rolls away on the edges of a height field's triangles; "
                                "--set inner_edges=off removes them (findings/jolt/height_field_edges.cc)"});
      }
    } else {
      // with 50 iterations at 4 ms and more; the long series has cylinders, too
      for (const char* test : {"bodies-on-field", "cylinders-on-field"}) {
        c.deviations.push_back(
            {test, 0.1,
             "normals of a height field's triangles may lean by a degree, which moves a lying capsule "
             "by millimetres at 4 ms and more (findings/jolt/height_field_edges.cc)"});
      }
    }
    if (world.slow_turns == 0) {
      c.finest_timestep = kSlowTurn / kSlowRate;
      c.deviations.push_back(
          {"near-equilibrium", 4e-5,
           "Jolt drops turns of at most 1e-6 rad a step, so a rod falls from upright too late; --set "
           "slow_turns=on keeps them (findings/jolt/slow_turns.cc)",
           0, 2e-3});
    }
    c.deviations.push_back({"planar-root", 3.5e-3, lent});
    c.deviations.push_back({"massless-joints", few ? 0.15 : 5e-3, lent});
    c.deviations.push_back({"random-massless-trees", few ? 0.023 : 9e-3, lent});
    if (kDoublePositions) c.other = "positions are double; orientations, velocities, masses and the solver are float";
    if (world.gyroscopic != 0) {
      if (!c.other.empty()) c.other += "; ";
      c.other += "the gyroscopic torque is explicit and keeps the length of the angular momentum";
    }
    c.other += fmt::format("{}turns of at most 1e-6 rad a step are {}", c.other.empty() ? "" : "; ",
                           world.slow_turns != 0 ? "summed by the adapter, because Jolt drops them" : "dropped");
    if (world.collision_steps > 1) c.other += fmt::format("; {} substeps a step", world.collision_steps);
    return c;
  }

  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    const Options options = read_options(settings);
    std::vector<Limitation> limitations =
        feature_limitations("Jolt", model, capabilities(settings), settings,
                            {.in_double = kDoublePositions, .per_step = options.world.collision_steps});
    for (const Joint& hinge : model.joints) {
      check_hinge(hinge, options.native_springs, limitations);
    }
    if (options.world.pair_cache != 0 && touches_roundly(model)) {
      limitations.push_back({Fidelity::kApproximated, "contact pairs",
                             "contact points are kept from step to step and turn with their bodies: a round body at "
                             "rest rolls away, by metres in a minute; set pair_cache=off"});
    }
    if (model.bodies.size() + model.shapes.size() > kMostBodies) {
      limitations.push_back({Fidelity::kRefused,
                             fmt::format("{} bodies and shapes", model.bodies.size() + model.shapes.size()),
                             fmt::format("this adapter gives Jolt at most {}", kMostBodies)});
    }
    return limitations;
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    require_supported(model, settings);
    return std::make_unique<JoltSimulation>(model, state, read_options(settings));
  }

 private:
  static void check_hinge(const Joint& hinge, bool native_springs, std::vector<Limitation>& limitations) {
    if (const auto range = wide_range(hinge, "Jolt")) limitations.push_back(*range);
    if (!native_springs || hinge.stiffness == 0) return;
    if (!hinge.limited || is_wide(hinge)) {
      if (hinge.is_slide()) return;
      limitations.push_back(
          {Fidelity::kApproximated, joint_element(hinge, "spring"),
           "Jolt's motor turns the shorter way: beyond half a turn from its rest the spring's torque is "
           "another; use pd=explicit"});
      return;
    }
    const double below = hinge.spring_reference - hinge.lower, above = hinge.upper - hinge.spring_reference;
    const double farthest = hinge.is_slide() ? std::max(below, above) : std::numbers::pi;
    if (std::min(below, above) < 0 || std::max(below, above) > farthest) {
      limitations.push_back(
          {Fidelity::kRefused, joint_element(hinge, "spring"),
           "Jolt's motor needs its rest within the joint's limits and neither of them further than half a "
           "turn from it; use pd=explicit"});
    }
  }
};

}  // namespace
}  // namespace assay::jolt

ASSAY_ENGINE_PLUGIN(assay::jolt::JoltEngine)
