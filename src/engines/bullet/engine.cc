// Bullet as an engine of assay: what it is, what it can do, and which of its two formulations runs.
#include <algorithm>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <fmt/format.h>

#include "engines/adapter.h"
#include "options.h"
#include "world.h"

namespace assay::bullet {
namespace {

// Settings of contenders beside the declared defaults.
using Set = std::map<std::string, SettingValue>;

// Bounds: 1.5 times what the tests measure.
std::vector<Deviation> rk4_deviations() {
  const std::string reason =
      "Bullet's Runge-Kutta uses the free base's orientation at the step's start in all stages: first order where a "
      "floating body rotates (findings/bullet/rk4_free_base.cc)";
  return {{"torque-free-top", 5e-3, reason},  {"oblique-trees", 1.2e-4, reason},
          {"torque-reaction", 6e-5, reason},  {"massless-joints", 7e-5, reason},
          {"random-trees", 1.4e-4, reason},   {"random-massless-trees", 1.6e-4, reason},
          {"spinning-bodies", 2.6e-3, reason}};
}

// Bound: what theory gives.
Deviation multibody_impact(const Options& options) {
  return {"inelastic-impact", 1.05 * options.contact_erp,
          "contacts of multibodies have no split impulse: a body leaves an impact with up to ERP of its speed "
          "(findings/bullet/multibody_contact.cc)"};
}

// Bound: what theory gives at the test's smaller coefficient, 0.5.
Deviation added_to_restitution(const Options& options, const char* program) {
  return {"restitution", 2.1 * options.contact_erp,
          fmt::format("a body leaves an impact with up to ERP of its speed more, by which its depth is corrected ({})",
                      program)};
}

// On a plane in the long series only.
Deviation first_contact(const char* test) {
  return {
      test, 0.1,
      "the first contact of a lying capsule is at one end only and gives it up to 1 mm/s, on a height field 5 mm/s, "
      "with which it rolls on (findings/bullet/kept_contacts.cc)"};
}

// Bounds: 1.5 times what the tests measure.
std::vector<Deviation> rigid_deviations(const Options& options) {
  const std::string lent = fmt::format("massless bodies borrow {:g} % of the next body's mass: rigid bodies need mass",
                                       100 * options.lent_share);
  const std::string slides = "a box that slides straight down a plane turns (findings/bullet/box_turns.cc)";
  const bool few = options.solver == Solver::kSequentialImpulse && options.iterations < 50;
  std::vector<Deviation> deviations = {
      {"planar-root", 3.5e-3, lent},
      {"massless-joints", 5e-3, lent},
      {"random-massless-trees", few ? 0.17 : 9e-3, few ? lent + ", and few iterations solve their joints" : lent},
      {"box-slides", few ? 0.039 : 0.018, slides},
      {"hull-slides", 0.057, slides}};
  if (options.split_impulse_depth > 0 || !options.split_impulse) {
    // by theory
    deviations.push_back({"inelastic-impact", 1.05 * options.contact_erp,
                          "penetrations that split impulse leaves are corrected by velocities: a body leaves an impact "
                          "with up to ERP of its speed (findings/bullet/split_impulse_depth.cc)"});
    deviations.push_back(added_to_restitution(options, "findings/bullet/split_impulse_depth.cc"));
  }
  if (few) {
    deviations.push_back({"stacks-at-rest", 1.5,
                          "few iterations do not carry a stack of ten boxes (findings/bullet/stack_mass_ratio.cc)"});
    deviations.push_back({"stack-1000", 0.47,
                          "few iterations do not carry a load of a thousand times the mass that bears it "
                          "(findings/bullet/stack_mass_ratio.cc)"});
  }
  return deviations;
}

// What bodies with flat sides or edges lose on a height field, and rolling that nothing resists. Bounds: 1.1 times what
// the tests measure.
void add_surface_deviations(Capabilities& c, const Options& options) {
  c.deviations.push_back({"height-field-edges", 1.15,
                          "boxes, hulls, cylinders and capsules catch on the inner edges of a height field's triangles "
                          "(findings/bullet/height_field_edges.cc)"});
  if (!options.turns_resist()) c.deviations.push_back({"rolling-slows", 1.05, "contacts do not resist rolling"});
}

// A multibody's joint stands still while the inertia that it moves is below Bullet's epsilon, 1.2e-7 in float. The last
// bodies of a chain are those that can be so small.
std::vector<Limitation> frozen_joints(const Model& model) {
  std::vector<bool> is_last(model.bodies.size(), true);
  for (const Body& body : model.bodies) {
    if (body.parent != kWorld) is_last[body.parent] = false;
  }
  std::vector<Limitation> frozen;
  for (const Joint& joint : model.joints) {
    const Body& body = model.bodies[joint.body];
    if (!is_last[joint.body]) continue;
    const double swung = body.mass * joint.axis_B.cross(body.p_BBcm - joint.p_BJ).squaredNorm();
    const double inertia = joint.is_slide() ? body.mass : joint.axis_B.dot(body.I_BBcm_B * joint.axis_B) + swung;
    if (inertia >= SIMD_EPSILON) continue;
    frozen.push_back({Fidelity::kRefused, joint_element(joint, "inertia"),
                      fmt::format("Bullet does not move a multibody's joint with an inertia below {:.2g}: take "
                                  "bullet-mb or model=rigid",
                                  SIMD_EPSILON)});
  }
  return frozen;
}

std::vector<Limitation> couplings_between_trees(const Model& model) {
  const auto root = [&model](int joint) {
    int body = model.joints[joint].body;
    while (model.bodies[body].parent != kWorld) body = model.bodies[body].parent;
    return model.bodies[body].is_free() ? body : kWorld;  // trees on the fixed world can be one of Bullet's
  };
  std::vector<Limitation> refused;
  for (const Coupling& coupling : model.couplings) {
    if (coupling.terms.size() < 2) continue;
    std::set<int> roots = {root(coupling.joint)};
    for (const JointTerm& term : coupling.terms) roots.insert(root(term.joint));
    if (roots.size() <= 2) continue;
    refused.push_back({Fidelity::kRefused, fmt::format("coupling '{}'", coupling.name),
                       "Bullet's constraints act on two trees at most: take another engine"});
  }
  return refused;
}

// A row of the sequential solver for multibodies: rows between rigid bodies diverge where the armature is below the
// inertia that the joint turns (findings/bullet/joint_cfm.cc), Dantzig's method takes no soft rows, and Runge-Kutta
// leaves rows to a step of first order.
bool has_armature(const Options& options) {
  return options.multibody && !options.rk4 && options.solver == Solver::kSequentialImpulse;
}
constexpr const char* kNoArmature =
    "Bullet has armature only as a row of multibodies with sequential impulse and without Runge-Kutta: take bullet-mb";

void add_features(Capabilities& c, const Options& options) {
  add_exact(c, {Feature::kBox, Feature::kCylinder, Feature::kEllipsoid, Feature::kHull});
  add_approximated(c, Feature::kHeightField,
                   "a surface without thickness, with a margin of 1 mm: slopes of 30 degrees lie 0.15 mm lower; bodies "
                   "with flat sides or edges catch on the triangles' inner edges, turn, and lose up to all of their "
                   "speed within seconds without friction; balls pass" +
                       std::string(kDoublePrecision ? ""
                                                    : "; in float a lying cylinder at rest rolls by centimetres in a "
                                                      "second"));
  if (options.turns_resist()) {
    add_exact(c, {Feature::kTorsionalFriction, Feature::kRollingFriction});
  } else {
    add_approximated(c, Feature::kTorsionalFriction, "left out: contacts do not resist spin about their normal");
    add_approximated(c, Feature::kRollingFriction, "left out: contacts do not resist rolling");
  }
  add_exact(c, {Feature::kSlide, Feature::kDryFriction});
  if (options.multibody) {
    add_exact(c, {Feature::kMassless, Feature::kCoupling, Feature::kCouplingOfMany, Feature::kConnect, Feature::kWeld});
    add_approximated(c, Feature::kTendonLimit, kJointRow);
  } else {
    add_lent_mass(c, options.lent_share);
    add_joint_rows(c);
  }
  if (options.multibody && options.rk4) {
    add_approximated(c, Feature::kBall,
                     "Bullet's Runge-Kutta adds up the stages' angular velocities: second order where their direction "
                     "changes");
  } else {
    add_exact(c, {Feature::kBall});
  }
  add_explicit_springs(c);
  if (has_armature(options)) add_exact(c, {Feature::kBallArmature});
}

class BulletEngine final : public Adapter {
 public:
  std::vector<Setting> settings() const override { return declared_settings(); }

  std::vector<Contender> contenders() const override {
    const std::string dantzig = "dantzig", multibody = "multibody";
    if (!kDoublePrecision) {
      return {{"bullet-si-f32", "Bullet, rigid bodies and hinges, sequential impulse, float", Set{}},
              {"bullet-si10-f32", "Bullet, rigid bodies and hinges, sequential impulse with 10 iterations, float",
               Set{{"iterations", 10LL}}},
              {"bullet-si200-f32", "Bullet, rigid bodies and hinges, sequential impulse with 200 iterations, float",
               Set{{"iterations", 200LL}}},
              {"bullet-mlcp-f32", "Bullet, rigid bodies and hinges, Dantzig's LCP solver, float",
               Set{{"solver", dantzig}}}};
    }
    return {
        {"bullet-si-f64", "Bullet, rigid bodies and hinges, sequential impulse, double", Set{}},
        {"bullet-si10-f64", "Bullet, rigid bodies and hinges, sequential impulse with 10 iterations, double",
         Set{{"iterations", 10LL}}},
        {"bullet-si200-f64", "Bullet, rigid bodies and hinges, sequential impulse with 200 iterations, double",
         Set{{"iterations", 200LL}}},
        {"bullet-default",
         "Bullet's own defaults: rigid bodies, sequential impulse, 10 iterations, split impulse from 4 cm, one tangent",
         Set{{"iterations", 10LL}, {"split_impulse_depth", 0.04}, {"friction_directions", 1LL}}},
        {"bullet-mlcp-f64", "Bullet, rigid bodies and hinges, Dantzig's LCP solver, double", Set{{"solver", dantzig}}},
        {"bullet-mb", "Bullet, joint coordinates (Featherstone), double", Set{{"model", multibody}}},
        {"bullet-mb-rk4", "Bullet, joint coordinates (Featherstone), Runge-Kutta 4, double",
         Set{{"model", multibody}, {"rk4", true}}}};
  }

  Capabilities capabilities(const Settings& settings) const override {
    const Options options = read_options(settings);
    Capabilities c;
    c.precision = kDoublePrecision ? Precision::kDouble : Precision::kSingle;
    c.coordinates = options.multibody ? Coordinates::kJoint : Coordinates::kMaximal;
    c.contact = c.joint_limits = c.torques = true;
    c.armature = has_armature(options);
    describe_springs(c, false, "");
    const std::string solver = options.solver == Solver::kDantzig
                                   ? "Dantzig's LCP method, sequential impulse where it fails"
                                   : fmt::format("sequential impulse, {} iterations", options.iterations);
    c.contact_solver = solver;
    c.contact_forces = ContactForces::kAll;
    c.contact_forces_note = "impulses of btManifoldPoint; what split impulse moves is none";
    c.joint_solver = options.multibody ? "none (joint coordinates)" : solver;
    c.contact_model = fmt::format("rigid, ERP {:g}", options.contact_erp);
    if (options.split_impulse && !options.multibody) {
      c.contact_model += ", split impulse";
      if (options.split_impulse_depth > 0) {
        c.contact_model += fmt::format(" beyond {:g} m", options.split_impulse_depth);
      }
    }
    c.contact_model = options.compliance.text(c.contact_model);
    c.friction_combine = "the pair's coefficient, set on every contact point";
    if (options.solver == Solver::kSequentialImpulse) {
      c.iterations = std::to_string(options.iterations);
      if (options.residual > 0) c.iterations = fmt::format("at most {}, residual {:g}", c.iterations, options.residual);
    } else {
      c.iterations = fmt::format("direct; {} where sequential impulse steps in", options.iterations);
    }
    c.sleep = "off";
    c.speed_limits = options.multibody ? "a free base turns by 45 degrees a step at most"
                                       : "90 degrees a step, of which 45 are turned";
    c.other = fmt::format(
        "a body turns at most 45 degrees a step; contact points are kept between steps; a joint leaves its limit with "
        "up "
        "to {:g} of its arrival speed (ERP)",
        options.erp);
    if (options.multibody) {
      c.integrator = options.rk4 ? "Runge-Kutta 4, semi-implicit Euler where constraints act" : "semi-implicit Euler";
      c.order = options.rk4 ? 4 : 1;
      if (options.rk4) c.deviations = rk4_deviations();
      c.deviations.push_back(multibody_impact(options));
      c.deviations.push_back(added_to_restitution(options, "findings/bullet/multibody_contact.cc"));
      c.friction_cone = options.friction_cone ? "circular cone a contact point" : "box";
    } else {
      c.integrator = "semi-implicit Euler";
      c.friction_cone =
          options.friction_directions == 1 ? "one tangent, along the slip" : "box, one side along the slip";
      c.gyroscopic = options.gyroscopic != 0;
      c.deviations = rigid_deviations(options);
    }
    c.deviations.push_back(first_contact("bodies-at-rest"));
    c.deviations.push_back(first_contact("bodies-on-field"));
    if (!kDoublePrecision) {
      c.deviations.push_back({"cylinders-on-field", 1.05,
                              "in single precision the normals of a lying cylinder on a height field lean, so that it "
                              "gains speed and rolls off (findings/bullet/cylinder_on_height_field.cc)"});
    }
    add_features(c, options);
    add_surface_deviations(c, options);
    return c;
  }

  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    const Options options = read_options(settings);
    std::vector<Limitation> limitations = feature_limitations("Bullet", model, capabilities(settings), settings);
    if (options.rk4 && !options.multibody) {
      limitations.push_back(
          {Fidelity::kRefused, "setting rk4", "rigid bodies have no Runge-Kutta: set model=multibody"});
    }
    if (options.multibody && options.friction_directions == 1 && !model.contacts.empty()) {
      limitations.push_back(
          {Fidelity::kRefused, "setting friction_directions",
           "one tangent of a multibody's contact is fixed and leaves the other without friction: set 2"});
    }
    if (options.multibody) std::ranges::copy(frozen_joints(model), std::back_inserter(limitations));
    if (options.multibody) std::ranges::copy(couplings_between_trees(model), std::back_inserter(limitations));
    for (const Joint& hinge : model.joints) {
      if (hinge.armature != 0 && !has_armature(options)) {
        limitations.push_back({Fidelity::kRefused, joint_element(hinge, "armature"), kNoArmature});
      }
      if (hinge.has_spring()) limitations.push_back(explicit_spring(hinge));
      if (options.multibody) continue;
      if (const auto range = wide_range(hinge, "Bullet's hinge")) limitations.push_back(*range);
    }
    return limitations;
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    require_supported(model, settings);
    const Options options = read_options(settings);
    return options.multibody ? make_multibody(model, state, options) : make_rigid(model, state, options);
  }
};

}  // namespace
}  // namespace assay::bullet

ASSAY_ENGINE_PLUGIN(assay::bullet::BulletEngine)
