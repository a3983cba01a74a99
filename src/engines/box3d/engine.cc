// Box3D: rigid bodies in maximal coordinates, joints and contacts as soft constraints in sub-steps. README.md says what
// is exact, what is approximated and which defaults are overridden.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "engines/adapter.h"
#include "options.h"
#include "shapes.h"
#include "world.h"

namespace assay::box3d {
namespace {

void add_features(Capabilities& c, const Options& options) {
  using enum Feature;
  add_exact(c, {kSlide, kBall, kDryFriction, kConnect, kWeld, kBox});
  add_refused(c, kBallLimit,
              "Box3D limits a ball joint's swing and twist apart: remove the range or choose another engine");
  add_refused(
      c, kBallDryFriction,
      "Box3D bounds the length of a ball joint's friction, not its components: set it to 0 or choose another engine");
  add_refused(c, kBallArmature, "Box3D has no joint armature: set it to 0 or choose another engine");
  add_refused(c, kTendonDryFriction, "Box3D has no tendons: set it to 0 or choose another engine");
  add_explicit_springs(c);
  add_joint_rows(c);
  add_lent_mass(c, options.lent_share);
  add_approximated(c, kCylinder,
                   "a prism of 42 sides: its edges lie outside the cylinder by 0.14 % of the radius and the middles of "
                   "its sides inside by as much, so it rolls from side to side");
  add_refused(
      c, kEllipsoid,
      "Box3D's hulls have at most 128 edges, an ellipsoid of so few corners stands on its faces: take a capsule or "
      "choose another engine");
  add_approximated(
      c, kHull,
      "hulls have at most 128 corners, faces and edges: of more, some corners are left out, 44 of a hull of "
      "triangles are kept");
  add_approximated(
      c, kHeightField,
      "a surface of the same triangles, without sides and base; level ground is right, on a slope of angle a "
      "bodies rest 5 mm (1 - cos a) higher");
  add_approximated(c, kTorsionalFriction, "contacts at one point do not resist spin about the normal");
  add_approximated(c, kRollingFriction, "contacts do not resist rolling");
}

std::vector<Deviation> deviations(const Options& options) {
  std::vector<Deviation> list = {
      {"rolling-slows", 1.05, "contacts do not resist rolling"},
      {"cylinder-rolls", options.contact_recycling ? 0.5 : 0.25,
       "a cylinder is a prism of 42 sides, which loses speed at each edge"},
      {"cylinders-at-rest", 0.01, "a cylinder is a prism of 42 sides, which falls from an edge to a side"},
      {"cylinders-on-field", 0.01, "a cylinder is a prism of 42 sides, which falls from an edge to a side"}};
  const std::string lent = fmt::format(
      "massless bodies borrow {:g} % of the next body's mass, because few sub-steps converge slowly with less",
      100 * options.lent_share);
  list.push_back({"planar-root", 3.5e-3, lent});
  list.push_back({"massless-joints", options.joint_hertz < 1e3 ? 0.035 : 5e-3, lent});
  list.push_back({"random-massless-trees", options.joint_hertz < 1e3 ? 0.09 : 9e-3, lent});
  if (options.contact_hertz < 200) {
    list.push_back(
        {"stack-1000", 2.5,
         "contacts of 30 Hz, Box3D's own, do not carry a load of a thousand times the mass that bears it; --set "
         "contact_hertz=200 does (findings/box3d/stack_mass_ratio.cc)"});
  }
  if (options.contact_recycling) {
    const char* kept =
        "a pair is not looked at again before it has moved by 2 cm where it did not touch, 5 cm or 10 degrees where it "
        "did; "
        "--set contact_recycling=off looks in each step (findings/box3d/recycled_contacts.cc)";
    list.push_back({"bodies-collide", 0.025, kept});
    list.push_back({"box-tips", 0.7, kept});
    list.push_back({"hull-tips", 0.7, kept});
  }
  if (options.joint_hertz < 1e3) {
    const char* soft =
        "hinges of 60 Hz, Box3D's own, lose energy at every timestep; --set joint_hertz=1e6 ties them to the sub-steps "
        "(findings/box3d/soft_joints_damp.cc)";
    for (const auto& [test, bound] : {std::pair{"pendulum-period", 6e-3},
                                      {"planar-chain", 0.018},
                                      {"spatial-chain", 0.02},
                                      {"torque-reaction", 8e-4},
                                      {"spring-damper", 1e-3},
                                      {"random-trees", 4e-3},
                                      {"wide-trees", 7e-3}}) {
      list.push_back({test, bound, soft});
    }
  }
  return list;
}

class Box3dEngine final : public Adapter {
 public:
  std::vector<Setting> settings() const override { return declared_settings(); }

  std::vector<Contender> contenders() const override {
    if (kDoublePositions) {
      return {{"box3d", "Box3D, positions in double precision, 4 sub-steps", {}},
              {"box3d-native-pd", "the same, joint springs and dampers by the joints' own", {{"pd", "native"}}}};
    }
    return {
        {"box3d-f32", "Box3D, single precision, 4 sub-steps", {}},
        {"box3d-default",
         "Box3D's own defaults, single precision: soft joints and contacts, kept contact points, fast bodies stopped",
         {{"joint_hertz", 60.0}, {"contact_hertz", 30.0}, {"contact_recycling", true}, {"continuous", true}}}};
  }

  Capabilities capabilities(const Settings& settings) const override {
    const Options options = read_options(settings);
    Capabilities c;
    c.precision = Precision::kSingle;
    c.coordinates = Coordinates::kMaximal;
    c.integrator = fmt::format("semi-implicit Euler, {} sub-steps a step", options.sub_steps);
    c.order = 1;
    c.iterations = fmt::format("{} sub-steps of one sweep with and one without position correction", options.sub_steps);
    c.joint_solver =
        fmt::format("sequential impulses, {}{}; {:g} Hz, damping ratio {:g}", c.iterations,
                    options.warm_start ? ", warm start" : "", options.joint_hertz, options.joint_damping_ratio);
    c.contact = true;
    c.contact_solver = "the same, with the joints";
    c.contact_model = fmt::format(
        "soft position correction, {:g} Hz and damping ratio {:g} ({:g} Hz, {:g} with what is fixed), at most "
        "{:g} m/s",
        options.contact_hertz, options.contact_damping_ratio, 2 * options.contact_hertz,
        options.contact_damping_ratio / 2, options.contact_speed);
    c.friction_cone = "circular, one force and one torque about the normal for all points of two shapes' contact";
    c.friction_combine =
        "larger of the shapes' coefficients, or the pair's own where that cannot say it, through Box3D's callback";
    if (options.sub_steps > 1) {
      c.contact_forces_note = "Box3D keeps the friction of the last sub-step only: --set sub_steps=1 gives them";
    } else {
      c.contact_forces = ContactForces::kAll;
      c.contact_forces_note =
          "normalImpulse and frictionImpulse of b3Body_GetContactData; a manifold's friction is shared out equally, "
          "without "
          "its torque";
    }
    c.joint_limits = true;
    describe_springs(c, options.native_springs, "the joint's own: an implicit linear spring and damper");
    c.gyroscopic = true;
    c.sleep = "off";
    c.speed_limits = "none (1e9 m/s)";
    c.other =
        fmt::format("{}the gyroscopic torque is one Newton iteration of the implicit equation",
                    kDoublePositions ? "positions are double; orientations, velocities, masses and the solver are "
                                       "float; "
                                     : "");
    if (options.contact_recycling) c.other += "; contact points may be old by 5 cm and 10 degrees";
    if (options.continuous) c.other += "; fast bodies are stopped where they would meet what is fixed";
    c.deviations = deviations(options);
    add_features(c, options);
    return c;
  }

  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    const Options options = read_options(settings);
    std::vector<Limitation> limitations =
        feature_limitations("Box3D", model, capabilities(settings), settings, {.in_double = kDoublePositions});
    for (const Joint& joint : model.joints) check_joint(joint, options, limitations);
    const ContactShapes touching = contact_shapes(model);
    for (size_t s = 0; s < model.shapes.size(); ++s) {
      if (touching.contains(s)) check_shape(model, model.shapes[s], limitations);
    }
    return limitations;
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    require_supported(model, settings);
    return std::make_unique<Box3dSimulation>(model, state, read_options(settings));
  }

 private:
  static void check_joint(const Joint& joint, const Options& options, std::vector<Limitation>& limitations) {
    if (joint.armature != 0) limitations.push_back(armature_refused(joint, "Box3D"));
    if (const auto range = wide_range(joint, "Box3D")) limitations.push_back(*range);
    if (options.native_springs && joint.stiffness != 0 && !joint.is_slide() && (!joint.limited || is_wide(joint))) {
      limitations.push_back({Fidelity::kApproximated, joint_element(joint, "spring"),
                             "Box3D's spring turns the shorter way: beyond half a turn from its rest its torque is "
                             "another; use pd=explicit"});
    }
  }

  static void check_shape(const Model& model, const Shape& shape, std::vector<Limitation>& limitations) {
    if (shape.type == ShapeType::kCapsule && 2 * shape.half_length <= kShortestCapsule) {
      limitations.push_back({Fidelity::kApproximated, fmt::format("geom '{}' (capsule)", shape.name),
                             fmt::format("a ball: Box3D makes one of capsules of at most {:g} m", kShortestCapsule)});
    }
    if (shape.type == ShapeType::kBox && 2 * shape.half_size.minCoeff() < kThinnestBox) {
      limitations.push_back({Fidelity::kApproximated, fmt::format("geom '{}' (box)", shape.name),
                             fmt::format("Box3D's boxes are at least {:g} m thick", kThinnestBox)});
    }
    if (shape.type == ShapeType::kHeightField) {
      const HeightField& field = model.height_fields[shape.data];
      const double cell = 4 * field.half_x * field.half_y / ((field.rows - 1) * (field.columns - 1));  // m^2
      if (cell / 2 < kSmallestTriangle) {
        limitations.push_back(
            {Fidelity::kRefused, fmt::format("geom '{}' (height field)", shape.name),
             fmt::format("Box3D drops triangles below {:g} m^2, these have {:g} m^2", kSmallestTriangle, cell / 2)});
      }
    }
  }
};

}  // namespace
}  // namespace assay::box3d

ASSAY_ENGINE_PLUGIN(assay::box3d::Box3dEngine)
