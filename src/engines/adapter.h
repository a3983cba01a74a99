// What adapters share beside the interface: build facts, settings, the clock, spring torques, contact pairs,
// limitations. An adapter uses what fits its engine; nothing here is required.
#pragma once

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "engines/engine.h"
#include "engines/springs.h"
#include "model/joint_rows.h"
#include "model/kinematics.h"
#include "model/massless.h"

namespace assay {

// An engine whose name and build are the facts that assay_add_engine() gives its sources.
class Adapter : public Engine {
 public:
  std::string name() const override { return ASSAY_ENGINE_NAME; }
  BuildFacts build() const override {
    return {.version = ASSAY_BUILD_VERSION,
            .source = ASSAY_BUILD_SOURCE,
            .compiler = ASSAY_BUILD_COMPILER,
            .flags = ASSAY_BUILD_FLAGS};
  }
};

// ---- settings -------------------------------------------------------------------------------------------------------

// Collects declared settings: one call a setting.
class SettingList {
 public:
  void add(std::string name, SettingValue default_value, std::string unit, std::string meaning,
           std::vector<std::string> choices = {}, std::optional<double> minimum = {},
           std::optional<double> maximum = {}) {
    settings_.push_back({std::move(name), std::move(default_value), std::move(unit), std::move(meaning),
                         std::move(choices), minimum, maximum});
  }
  std::vector<Setting> take() { return std::move(settings_); }

 private:
  std::vector<Setting> settings_;
};

// Says what a declared setting decides (SettingRole), and the values of others without which it does nothing. One
// setting a role.
inline void give_role(std::vector<Setting>& settings, const std::string& name, SettingRole role,
                      std::map<std::string, std::string> only_with = {}) {
  Setting& setting = *std::ranges::find(settings, name, &Setting::name);
  setting.role = role;
  setting.only_with = std::move(only_with);
}

// A contact point as a spring and damper along its normal, which only push: force k r + d r' at the depth r.
struct ContactCompliance {
  double stiffness = 0, damping = 0;  // N/m, N s/m; stiffness 0: the engine's own contacts

  bool is_set() const { return stiffness > 0; }
  // What makes a constraint with error reduction and force mixing this spring and damper in steps of `h` seconds,
  // implicitly (manual of the Open Dynamics Engine, "How to use ERP and CFM"). `cfm` counts against forces, s/kg.
  double erp(double h) const { return h * stiffness / (h * stiffness + damping); }
  double cfm(double h) const { return 1 / (h * stiffness + damping); }

  // For Capabilities::contact_model: this where it is set, else `otherwise`.
  std::string text(const std::string& otherwise) const {
    return is_set() ? fmt::format("spring of {:g} N/m, damper of {:g} N s/m", stiffness, damping) : otherwise;
  }
};

// The two settings of an adapter that can give contacts a compliance. `instead` says what they switch off.
inline void add_contact_compliance(std::vector<Setting>& settings, const std::string& instead,
                                   const std::map<std::string, std::string>& only_with = {}) {
  settings.push_back({.name = "contact_stiffness",
                      .default_value = 0.0,
                      .unit = "N/m",
                      .meaning = fmt::format("stiffness of each contact point along its normal, with contact_damping, "
                                             "instead of {}; 0: off",
                                             instead),
                      .minimum = 0,
                      .maximum = 1e12,
                      .role = SettingRole::kContactStiffness,
                      .only_with = only_with});
  settings.push_back({.name = "contact_damping",
                      .default_value = 0.0,
                      .unit = "N s/m",
                      .meaning = "damping of each contact point along its normal; acts with contact_stiffness",
                      .minimum = 0,
                      .maximum = 1e12,
                      .role = SettingRole::kContactDamping,
                      .only_with = only_with});
}
inline ContactCompliance contact_compliance(const Settings& settings) {
  return {settings.get<double>("contact_stiffness"), settings.get<double>("contact_damping")};
}

// What an impact gives back of the speed along its normal. Models have none, so 0 unless somebody asks.
struct Restitution {
  double coefficient = 0;  // of the pair, whatever the engine makes of two materials
  double threshold = 0;    // m/s, slower impacts give nothing back

  // For engines that multiply two materials.
  double of_material() const { return std::sqrt(coefficient); }
};

// The settings for it. `own_threshold`: the engine's default and what bounds it; "" where the engine has none.
inline void add_restitution(std::vector<Setting>& settings, const std::string& own_threshold) {
  settings.push_back({.name = "restitution",
                      .default_value = 0.0,
                      .unit = "",
                      .meaning = "part of the speed along its normal that an impact gives back",
                      .minimum = 0,
                      .maximum = 1,
                      .role = SettingRole::kContactRebound});
  if (own_threshold.empty()) return;
  settings.push_back(
      {.name = "restitution_threshold",
       .default_value = 0.1,
       .unit = "m/s",
       .meaning = fmt::format("slower impacts give nothing back; acts with restitution ({})", own_threshold),
       .minimum = 0,
       .maximum = 1e3});
}
inline Restitution restitution(const Settings& settings) {
  const auto threshold = settings.values.find("restitution_threshold");
  return {settings.get<double>("restitution"),
          threshold == settings.values.end() ? 0.0 : std::get<double>(threshold->second)};
}

// The value of a declared setting as engines want it; whether a setting of text has the value `choice`.
inline int integer(const Settings& settings, const std::string& name) {
  return static_cast<int>(settings.get<long long>(name));
}
inline bool is(const Settings& settings, const std::string& name, const char* choice) {
  return settings.get<std::string>(name) == choice;
}

// ---- time, state, torques -------------------------------------------------------------------------------------------

// A simulation's time: its start plus whole steps. A sum of timesteps would drift.
struct Clock {
  double start = 0, timestep = 1e-3;  // s
  long long steps = 0;

  double time() const { return start + static_cast<double>(steps) * timestep; }
};

// `state` with joint coordinates: computed from its bodies when it has none.
inline State with_joint_coordinates(const Model& model, State state) {
  if (state.position.size() != model.joints.size() || state.velocity.size() != model.joints.size()) {
    joints_from_bodies(model, state);
  }
  return state;
}

// The torques of the next step, one per hinge or slide: the caller's (0 where `torques` ends earlier) and, when
// `springs` is given, those of the joints' own springs and dampers in that state. Neither holds those of tendons
// (add_tendon_tensions) and ball joints (ball_spring_torque).
inline void collect_torques(const Model& model, std::span<const double> torques, const State* springs,
                            std::vector<double>& out) {
  out.assign(model.joints.size(), 0.0);
  std::copy_n(torques.begin(), std::min(torques.size(), out.size()), out.begin());
  if (springs == nullptr) return;
  for (size_t j = 0; j < out.size(); ++j) {
    out[j] += spring_torque(model.joints[j], springs->position[j], springs->velocity[j]);
  }
}

// Adds the joint torques of the tendons' own springs and dampers in `state`.
inline void add_tendon_tensions(const Model& model, const State& state, std::vector<double>& torques) {
  for (const Tendon& tendon : model.tendons) {
    if (!tendon.has_spring()) continue;
    const double tension =
        tendon_tension(tendon, sum_of_terms(tendon.terms, state.position), sum_of_terms(tendon.terms, state.velocity));
    for (const JointTerm& term : tendon.terms) torques[term.joint] += term.coefficient * tension;
  }
}

// ---- massless bodies in maximal coordinates --------------------------------------------------------------------------

// The setting of an adapter that lends mass (model/massless.h).
inline Setting lent_share_setting() {
  return {.name = "lent_share",
          .default_value = kLentShare,
          .unit = "",
          .meaning =
              "part of a body's mass and inertia that each massless body before it borrows: less is more exact, "
              "more converges faster",
          .minimum = 1e-6,
          .maximum = kLargestLentShare};
}
inline void add_lent_mass(Capabilities& capabilities, double share, const char* setting = "lent_share") {
  capabilities.features.push_back(
      {Feature::kMassless, Fidelity::kApproximated,
       fmt::format("borrows {:g} % of the mass and inertia of the body that it leads to: exact at the reference "
                   "configuration, elsewhere accelerations differ by about that part; --set {} changes it",
                   100 * share, setting)});
}

// What the engine holds of `lent.model`, in terms of the original: lenders have their whole mass, borrowers none.
inline void return_lent_mass(const Lent& lent, EngineView& view) {
  if (!lent.any) return;
  std::vector<double> whole;  // by body
  whole.reserve(view.bodies.size());
  for (const EngineBody& body : view.bodies) whole.push_back(body.mass);
  for (size_t i = 0; i < lent.lender.size(); ++i) {
    if (lent.lender[i] < 0) continue;
    whole[lent.lender[i]] += view.bodies[i].mass;
    whole[i] = 0;
  }
  for (size_t i = 0; i < whole.size(); ++i) {
    EngineBody& body = view.bodies[i];
    body.I_BBcm_W /= lent.inertia_kept[i];
    body.mass = whole[i];
  }
}

// ---- contact pairs --------------------------------------------------------------------------------------------------

// The shapes that are in a contact pair, numbered in the model's order.
struct ContactShapes {
  std::vector<int> row;  // by Model::shapes; -1: in no pair
  int count = 0;

  bool contains(size_t shape) const { return row[shape] >= 0; }
};
inline ContactShapes contact_shapes(const Model& model) {
  ContactShapes shapes{.row = std::vector<int>(model.shapes.size(), -1)};
  for (const ContactPair& pair : model.contacts) shapes.row[pair.shape_a] = shapes.row[pair.shape_b] = 0;
  for (int& row : shapes.row) {
    if (row == 0) row = shapes.count++;
  }
  return shapes;
}

// The rule by which an engine combines the friction coefficients of two shapes.
enum class FrictionRule { kLarger, kSmaller };

// One coefficient a shape. With kLarger it is the smallest of the shape's pairs, with kSmaller the largest: if any
// coefficients give every pair its own by that rule, these do.
struct ShapeFriction {
  FrictionRule rule = FrictionRule::kLarger;
  std::vector<double> of;  // by Model::shapes; -1: in no pair

  bool gives(const ContactPair& pair) const {
    const auto [smaller, larger] = std::minmax(of[pair.shape_a], of[pair.shape_b]);
    return (rule == FrictionRule::kLarger ? larger : smaller) == pair.friction;
  }
  bool gives_all(const Model& model) const {
    return std::ranges::all_of(model.contacts, [this](const ContactPair& pair) { return gives(pair); });
  }
};
inline ShapeFriction shape_friction(const Model& model, FrictionRule rule) {
  ShapeFriction friction{rule, std::vector<double>(model.shapes.size(), -1)};
  for (const ContactPair& pair : model.contacts) {
    for (const int shape : {pair.shape_a, pair.shape_b}) {
      double& own = friction.of[shape];
      const bool closer = rule == FrictionRule::kLarger ? pair.friction < own : pair.friction > own;
      if (own < 0 || closer) own = pair.friction;
    }
  }
  return friction;
}

// ---- margins of contacts ---------------------------------------------------------------------------------------------

// The largest extent of a shape, m; 0 for planes and height fields.
inline double shape_extent(const Model& model, const Shape& shape) {
  switch (shape.type) {
    case ShapeType::kSphere:
      return 2 * shape.radius;
    case ShapeType::kCapsule:
      return 2 * (shape.radius + shape.half_length);
    case ShapeType::kCylinder:
      return 2 * std::max(shape.radius, shape.half_length);
    case ShapeType::kBox:
    case ShapeType::kEllipsoid:
      return 2 * shape.half_size.maxCoeff();
    case ShapeType::kHull: {
      Eigen::AlignedBox3d box;
      for (const Vec3& vertex : model.hulls[shape.data].vertices) box.extend(vertex);
      return box.sizes().maxCoeff();
    }
    case ShapeType::kPlane:
    case ShapeType::kHeightField:
      break;
  }
  return 0;
}

// Mean extent of the shapes of moving bodies that can touch something, m; 1 without any.
inline double mean_extent(const Model& model) {
  const ContactShapes touching = contact_shapes(model);
  double sum = 0;
  int count = 0;
  for (size_t s = 0; s < model.shapes.size(); ++s) {
    if (!touching.contains(s) || model.shapes[s].body == kWorld) continue;
    sum += shape_extent(model, model.shapes[s]);
    ++count;
  }
  return count > 0 ? sum / count : 1;
}

// The distance at which an engine that looks ahead begins a contact of two shapes, m: a fiftieth of their size, and
// what a body moves within a step of `h` seconds at the speed that it has fallen through the model's own height with.
inline double contact_margin(const Model& model, double h) {
  const double g = model.gravity.norm();
  double low = 0, high = 0;  // of the bodies' centres at the start along gravity, from the first one's
  for (const BodyState& body : model.initial.bodies) {
    const double height = g > 0 ? (body.p_WBcm - model.initial.bodies.front().p_WBcm).dot(model.gravity) / g : 0;
    low = std::min(low, height);
    high = std::max(high, height);
  }
  return 0.02 * mean_extent(model) + h * std::sqrt(2 * g * (high - low));
}

// ---- angles within one turn -----------------------------------------------------------------------------------------

// Where an engine that knows an angle within one turn best counts it from: the middle of a limited range, which then
// may lie anywhere, else `otherwise`.
inline double middle_of_range(const Joint& hinge, double otherwise) {
  return hinge.limited ? (hinge.lower + hinge.upper) / 2 : otherwise;
}

// ---- friction --------------------------------------------------------------------------------------------------------

// What an engine does with Coulomb's cone, for check(); nothing for a model without friction.
inline std::optional<Limitation> friction_limitation(const Model& model, std::string how) {
  if (std::ranges::none_of(model.contacts, [](const ContactPair& pair) { return pair.friction > 0; })) return {};
  return Limitation{Fidelity::kApproximated, "friction of contact pairs", std::move(how)};
}
inline std::optional<Limitation> fixed_friction_axes(const Model& model) {
  return friction_limitation(model,
                             "a pyramid of four sides along directions that the contact's normal fixes: right along "
                             "them, up to 1.41 times the coefficient between them");
}

// ---- limitations ----------------------------------------------------------------------------------------------------

// How an engine in single precision adds ways to positions: `per_step` times a step, where its steps have substeps.
struct PositionSums {
  bool in_double = false;
  int per_step = 1;
};

// Where an engine in single precision holds `model` too far from the origin for steps of `h` seconds: where rounding
// the positions there can take or give a hundredth of a typical speed and more. Nothing where it does not.
inline std::optional<Limitation> coarse_positions(const Model& model, double h, const PositionSums& sums) {
  constexpr double kWorthSaying = 0.01, kGravity = 9.81;
  double far = 0;              // m, the largest coordinate of a body
  double speed = 0;            // m/s, of a fall through a body's size or the model's
  Eigen::AlignedBox3d extent;  // of the bodies
  for (const BodyState& body : model.initial.bodies) {
    far = std::max(far, body.p_WBcm.cwiseAbs().maxCoeff());
    extent.extend(body.p_WBcm);
    speed = std::max(speed, body.v_WBcm.norm());
  }
  if (far == 0) return std::nullopt;
  speed = std::max(speed, std::sqrt(kGravity * extent.sizes().maxCoeff()));
  const double spacing = std::exp2(std::ilogb(far)) * std::numeric_limits<float>::epsilon();  // m, of floats there
  const double lost = sums.per_step * spacing / 2 / h;                                        // m/s
  if (lost < kWorthSaying * speed) return std::nullopt;
  speed = std::max(speed, std::sqrt(kGravity * mean_extent(model)));
  if (lost < kWorthSaying * speed) return std::nullopt;
  return Limitation{
      Fidelity::kApproximated, fmt::format("positions at {:.3g} m from the origin", far),
      fmt::format("single precision: coordinates are multiples of {:.2g} m there, and {} a step of {:g} ms rounds to "
                  "them, so speeds can be off by {:.2g} m/s and slower bodies stand still: move the model to "
                  "the origin, take longer steps or an engine in double precision",
                  spacing, sums.per_step == 1 ? std::string("once") : fmt::format("{} times", sums.per_step), 1e3 * h,
                  lost)};
}

// What Capabilities::features and the precision say about `model` in steps of `settings.timestep`: how every adapter's
// check() begins.
inline std::vector<Limitation> feature_limitations(const std::string& engine, const Model& model,
                                                   const Capabilities& capabilities, const Settings& settings,
                                                   const PositionSums& sums = {}) {
  std::vector<Limitation> limitations;
  for (FeatureUse& use : features_of(model)) {
    const FeatureSupport* support = capabilities.support(use.feature);
    if (support == nullptr) {
      limitations.push_back(
          {Fidelity::kRefused, std::move(use.element), fmt::format("{} has no {}", engine, feature_name(use.feature))});
    } else if (support->fidelity != Fidelity::kExact) {
      limitations.push_back({support->fidelity, std::move(use.element), support->how});
    }
  }
  if (capabilities.precision == Precision::kSingle && !sums.in_double) {
    if (auto coarse = coarse_positions(model, settings.timestep, sums)) limitations.push_back(std::move(*coarse));
  }
  return limitations;
}

// Declares features as exact: one call for several.
inline void add_exact(Capabilities& capabilities, std::initializer_list<Feature> features) {
  for (const Feature feature : features) capabilities.features.push_back({feature, Fidelity::kExact, ""});
}
inline void add_approximated(Capabilities& capabilities, Feature feature, std::string how) {
  capabilities.features.push_back({feature, Fidelity::kApproximated, std::move(how)});
}

inline void add_refused(Capabilities& capabilities, Feature feature, std::string why) {
  capabilities.features.push_back({feature, Fidelity::kRefused, std::move(why)});
}

// Springs and dampers of ball joints and tendons that the adapter computes (ball_spring_torque, add_tendon_tensions).
inline void add_explicit_springs(Capabilities& capabilities) {
  add_approximated(capabilities, Feature::kBallSpring, "explicit torque from the state at the step's start");
  add_approximated(capabilities, Feature::kTendonSpring, "explicit tension from the state at the step's start");
}

// Couplings and limits of tendons that the adapter holds (model/joint_rows.h).
inline constexpr const char* kJointRow =
    "a spring and a damper between the joints, as stiff as the timestep h stands: gives way by 5 h^2 times the "
    "acceleration that it holds back";
inline void add_joint_rows(Capabilities& capabilities) {
  for (const Feature feature : {Feature::kCoupling, Feature::kCouplingOfMany, Feature::kTendonLimit}) {
    add_approximated(capabilities, feature, kJointRow);
  }
}

// "joint 'knee' armature"
inline std::string joint_element(const Joint& hinge, const char* what) {
  return fmt::format("joint '{}' {}", hinge.name, what);
}

inline Limitation armature_refused(const Joint& hinge, const char* engine) {
  return {Fidelity::kRefused, joint_element(hinge, "armature"),
          fmt::format("{} has no joint armature: set it to 0 or choose another engine", engine)};
}

// `remedy`: what the user can do, with its separator; "" for nothing.
inline Limitation explicit_spring(const Joint& hinge, const char* remedy = "") {
  return {Fidelity::kApproximated, joint_element(hinge, "stiffness and damping"),
          fmt::format("explicit torque from the state at the step's start{}", remedy)};
}

// A range that an engine which knows an angle within one turn cannot hold, and the adapter does (model/joint_rows.h).
inline std::optional<Limitation> wide_range(const Joint& hinge, const char* engine) {
  if (!is_wide(hinge)) return std::nullopt;
  return Limitation{
      Fidelity::kApproximated, joint_element(hinge, "range"),
      fmt::format(
          "{} knows an angle within one turn: a spring and a damper, as stiff as the timestep h stands, give way "
          "by 5 h^2 times the acceleration that they hold back",
          engine)};
}

}  // namespace assay
