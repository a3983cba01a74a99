#include "conformance/conformance.h"

#include <algorithm>
#include <cmath>
#include <exception>

#include <fmt/format.h>

#include "base/text.h"
#include "conformance/tests.h"
#include "isolate/machine_lack.h"

namespace assay {
namespace {

using conformance::Subject;
using conformance::TimestepVerdict;
using conformance::Verdict;

// The capability that a test requires of a contender.
// kRigidContact: contacts that do not give way more than the engine's own do.
enum class Need {
  kNothing,
  kTorques,
  kSprings,
  kArmature,
  kArmatureInContact,
  kJointLimits,
  kContact,
  kRigidContact,
  kCompliance,
  kRestitution,
  kContactForces,
  kActuators
};

// The features of models that a test requires: all of them declared, or with kAny one. An approximated one counts,
// unless the test is `exact`; the contender then declares a deviation where its approximation exceeds the tolerance.
struct Features {
  std::vector<Feature> of = {};
  bool any = false, exact = false;
};

struct Entry {
  const char* name;
  const char* meaning;
  Need need;
  Verdict (*run)(const Subject&);
  Features features = {};
};

// The most basic tests first: a later failure may follow from an earlier one.
const std::vector<Entry>& entries() {
  using enum Feature;
  static const std::vector<Entry> list = {
      {"readback", "the engine itself reports the model's mass, inertia, frames, limits and gravity", Need::kNothing,
       conformance::readback},
      {"state-round-trip", "a state of any time, pose and velocity is read back as it was given", Need::kNothing,
       conformance::state_round_trip},
      {"determinism", "the same run twice gives the same bits", Need::kNothing, conformance::determinism},
      {"independence", "instances stepped in turns give the same bits as separate runs", Need::kNothing,
       conformance::independence},
      {"batches", "advance(n) gives the bits of n times advance(1), and the time is right", Need::kNothing,
       conformance::batches},
      {"free-fall", "a moving, spinning body follows the parabola", Need::kNothing, conformance::free_fall},
      {"gravity-direction", "oblique, horizontal and no gravity", Need::kNothing, conformance::gravity_direction},
      {"fast-motion", "nothing slows a body at 300 m/s and 100 rad/s, or a hinge at 120 rad/s", Need::kNothing,
       conformance::fast_motion},
      {"torque-free-top", "an asymmetric body turns over as Jacobi's elliptic functions say", Need::kNothing,
       conformance::torque_free_top},
      {"pendulum-period", "the period at 143 degrees is the complete elliptic integral's", Need::kNothing,
       conformance::pendulum_period},
      {"planar-chain", "five links in a plane converge to the independent solution", Need::kNothing,
       conformance::planar_chain},
      {"spatial-chain", "five links in space converge to the independent solution", Need::kNothing,
       conformance::spatial_chain},
      {"oblique-trees", "a floating and a fixed tree with oblique frames converge to the independent solution",
       Need::kNothing, conformance::oblique_trees_converge},
      {"restart", "a new instance in a state of the run continues the run", Need::kNothing, conformance::restart},
      {"torque-for-one-step", "a torque acts for one step, and the later of two calls counts", Need::kTorques,
       conformance::torque_for_one_step},
      {"constant-torque", "a hinge under constant torque follows the parabola, past whole turns", Need::kTorques,
       conformance::constant_torque},
      {"torque-reaction", "torques on a floating tree act on both bodies of a hinge", Need::kTorques,
       conformance::torque_reaction},
      {"armature", "armature adds to the inertia about the hinge", Need::kArmature, conformance::armature},
      {"spring-damper", "a hinge's spring and damper follow the damped oscillator", Need::kSprings,
       conformance::spring_damper},
      {"joint-limit", "a bar that falls onto its joint's limit rests there", Need::kJointLimits,
       conformance::joint_limit},
      {"wide-range", "a wheel under a torque turns more than once, to the end of its range, and rests there",
       Need::kJointLimits, conformance::wide_range},
      {"resting-height", "balls and capsules rest on a plane and on fixed capsules at their radius",
       Need::kRigidContact, conformance::resting_height},
      {"sliding-capsule", "a sliding capsule stops after v^2/(2 mu g)", Need::kRigidContact,
       conformance::sliding_capsule},
      {"sphere-rolls", "a sliding ball rolls at 5/7 of its speed", Need::kRigidContact, conformance::sphere_rolls},
      {"friction-per-pair", "each pair has the model's friction, however the shapes' own would combine", Need::kContact,
       conformance::friction_per_pair},
      {"bodies-collide", "moving balls and capsules stop each other and keep their momentum", Need::kRigidContact,
       conformance::bodies_collide},
      {"armature-impact", "a ball that hits a lever feels the lever's armature", Need::kArmatureInContact,
       conformance::armature_impact},
      {"excluded-pairs", "what is no contact pair of the model does not collide", Need::kContact,
       conformance::excluded_pairs},
      {"declared-features", "features that are not declared are refused, those that are run", Need::kNothing,
       conformance::declared_features},
      {"tree-readback",
       "readback on random trees of the joints that the contender has",
       Need::kNothing,
       conformance::tree_readback,
       {.of = {kSlide, kBall, kMassless}, .any = true, .exact = true}},
      {"tree-round-trip",
       "state-round-trip on random trees of the joints that the contender has",
       Need::kNothing,
       conformance::tree_round_trip,
       {.of = {kSlide, kBall, kMassless}, .any = true, .exact = true}},
      {"slide-force",
       "a block on an oblique slide under gravity and a force follows the parabola",
       Need::kTorques,
       conformance::slide_force,
       {.of = {kSlide}}},
      {"slide-spring",
       "a slide with a spring and a damper follows the damped oscillator",
       Need::kSprings,
       conformance::slide_spring,
       {.of = {kSlide}}},
      {"slide-armature",
       "armature adds to the mass along a slide",
       Need::kArmature,
       conformance::slide_armature,
       {.of = {kSlide}}},
      {"slide-limit",
       "a block that slides down onto its joint's limit rests there",
       Need::kJointLimits,
       conformance::slide_limit,
       {.of = {kSlide}}},
      {"planar-root",
       "slide, slide and hinge in one body converge to the reference solution",
       Need::kNothing,
       conformance::planar_root,
       {.of = {kSlide, kMassless}}},
      {"massless-joints",
       "two and three hinges in one body converge to the reference solution",
       Need::kNothing,
       conformance::massless_joints,
       {.of = {kMassless}}},
      {"conical-pendulum",
       "a rod on a ball joint circles at a constant angle",
       Need::kNothing,
       conformance::conical_pendulum,
       {.of = {kBall}}},
      {"ball-limit",
       "a bar on a ball joint falls onto the joint's limit and rests there",
       Need::kJointLimits,
       conformance::ball_limit,
       {.of = {kBall, kBallLimit}}},
      {"ball-spring",
       "a ball joint's spring and damper converge to the reference solution",
       Need::kNothing,
       conformance::ball_spring,
       {.of = {kBall, kBallSpring}}},
      {"ball-armature",
       "armature of ball joints converges to the reference solution",
       Need::kNothing,
       conformance::ball_armature,
       {.of = {kBall, kBallArmature}}},
      {"dry-friction",
       "dry friction of joints holds below its bound and brakes by it above",
       Need::kTorques,
       conformance::dry_friction,
       {.of = {kDryFriction}}},
      {"ball-dry-friction",
       "dry friction stops a ball joint",
       Need::kNothing,
       conformance::ball_dry_friction,
       {.of = {kBall, kBallDryFriction}}},
      {"random-trees", "random trees of the contender's joints, 1 g to 100 kg and 5 mm to 2 m, converge",
       Need::kNothing, conformance::random_trees},
      {"random-massless-trees",
       "the same with up to three joints in a row",
       Need::kNothing,
       conformance::random_massless_trees,
       {.of = {kMassless}}},
      {"coupling",
       "coupled joints keep their ratio and share their inertia",
       Need::kTorques,
       conformance::coupling,
       {.of = {kCoupling}}},
      {"coupling-of-many",
       "a joint follows a sum of joints, and another is held",
       Need::kTorques,
       conformance::coupling_of_many,
       {.of = {kCouplingOfMany}}},
      {"connect",
       "a closed parallelogram swings as a pendulum",
       Need::kNothing,
       conformance::connect,
       {.of = {kConnect}}},
      {"weld", "a welded body turns with its wheel as one", Need::kTorques, conformance::weld, {.of = {kWeld}}},
      {"tendon-spring",
       "a tendon's spring and damper converge to the reference solution",
       Need::kNothing,
       conformance::tendon_spring,
       {.of = {kTendonSpring}}},
      {"tendon-limit",
       "a tendon at its limit takes the second wheel along",
       Need::kTorques,
       conformance::tendon_limit,
       {.of = {kTendonLimit}}},
      {"tendon-dry-friction",
       "dry friction of a tendon holds below its bound and brakes by it above",
       Need::kTorques,
       conformance::tendon_dry_friction,
       {.of = {kTendonDryFriction}}},
      {"resting-shapes",
       "boxes, hulls, cylinders and ellipsoids rest on a plane and on a fixed box",
       Need::kRigidContact,
       conformance::resting_shapes,
       {.of = {kBox, kHull, kCylinder, kEllipsoid}, .any = true}},
      {"box-slides",
       "a box on a slope slides where tan(angle) exceeds mu",
       Need::kRigidContact,
       conformance::box_slides,
       {.of = {kBox}}},
      {"box-tips",
       "a box on a slope tips where tan(angle) exceeds width over height",
       Need::kRigidContact,
       conformance::box_tips,
       {.of = {kBox}}},
      {"hull-slides",
       "the hull of a box slides as the box",
       Need::kRigidContact,
       conformance::hull_slides,
       {.of = {kHull}}},
      {"hull-tips", "the hull of a box tips as the box", Need::kRigidContact, conformance::hull_tips, {.of = {kHull}}},
      {"cylinder-rolls",
       "a cylinder rolls down a slope at 2/3 g sin(angle)",
       Need::kRigidContact,
       conformance::cylinder_rolls,
       {.of = {kCylinder}}},
      {"ellipsoid-rocks",
       "an ellipsoid rocks about its flat side in the right period",
       Need::kRigidContact,
       conformance::ellipsoid_rocks,
       {.of = {kEllipsoid}}},
      {"height-field",
       "a flat height field is a plane, one with a slope a tilted plane",
       Need::kRigidContact,
       conformance::height_field,
       {.of = {kHeightField}}},
      {"torsional-friction",
       "torsional friction stops a spinning ball in time",
       Need::kRigidContact,
       conformance::torsional_friction,
       {.of = {kTorsionalFriction}, .exact = true}},
      {"rolling-friction",
       "rolling friction stops a rolling ball in time",
       Need::kRigidContact,
       conformance::rolling_friction,
       {.of = {kRollingFriction}, .exact = true}},
      {"weld-distances",
       "welds between free, fixed and articulated bodies hold 0.1 to 10 m away, in both orders",
       Need::kNothing,
       conformance::welds_hold,
       {.of = {kWeld}}},
      {"connect-distances",
       "connects between free, fixed and articulated bodies hold 0.1 to 10 m away, in both orders",
       Need::kNothing,
       conformance::connects_hold,
       {.of = {kConnect}}},
      {"coupling-distances",
       "a wheel and its rack move as one 0.1 to 10 m away, in both orders",
       Need::kNothing,
       conformance::couplings_apart,
       {.of = {kCoupling, kSlide}}},
      {"limits-under-load", "limits of hinges, slides and ball joints carry slender bodies", Need::kJointLimits,
       conformance::limits_under_load},
      {"rolling-slows",
       "rolling friction slows balls that roll without slip",
       Need::kRigidContact,
       conformance::rolling_slows,
       {.of = {kRollingFriction}}},
      {"height-field-edges",
       "bodies slide over a flat height field without friction as over a plane",
       Need::kRigidContact,
       conformance::height_field_edges,
       {.of = {kHeightField}}},
      {"actuator-laws", "the engine's own actuators follow the model's law, from any time on", Need::kActuators,
       conformance::actuator_laws},
      {"velocity-gain", "the engine's own servos are stable with a velocity gain 20 times beyond an explicit step's",
       Need::kActuators, conformance::velocity_gain},
      {"spinning-bodies", "bodies of 1 g to 100 kg and 1 mm to 2 m that spin fast converge to the reference solution",
       Need::kNothing, conformance::spinning_bodies},
      {"wide-trees", "random trees of any mass and size, fast, with springs and limits, converge", Need::kNothing,
       conformance::wide_trees},
      {"beyond-limit", "a joint that starts beyond its limit comes back", Need::kJointLimits,
       conformance::beyond_limit},
      {"far-from-origin", "friction is the same metres away from the origin", Need::kRigidContact,
       conformance::far_from_origin},
      {"friction-of-links", "links of articulated bodies hold and slide on one contact point as on many",
       Need::kRigidContact, conformance::friction_of_links},
      {"friction-directions", "friction is mu times the normal force in every direction, in motion and at rest",
       Need::kRigidContact, conformance::friction_directions},
      {"distances", "sleds slide as far at 1 m to 10 km from the origin, but for what the precision resolves",
       Need::kRigidContact, conformance::distances},
      {"inelastic-impact", "a ball does not leave the ground at any phase of an impact within a step",
       Need::kRigidContact, conformance::inelastic_impact},
      {"stick-and-slip", "capsules of 1 g to 100 kg hold and slide on either side of the friction's angle",
       Need::kRigidContact, conformance::stick_and_slip},
      {"stack-10", "a bar rests on two bars of its mass, and of a tenth of it", Need::kRigidContact,
       conformance::stack_of_ten},
      {"stack-1000", "a bar rests on two bars of a hundredth and a thousandth of its mass", Need::kRigidContact,
       conformance::stack_of_thousand},
      {"bodies-at-rest", "balls, capsules and boxes stay where they lie, on a plane, box and hull, at every timestep",
       Need::kRigidContact, conformance::bodies_at_rest},
      {"cylinders-at-rest",
       "cylinders stay where they lie, on a plane, box and hull, at every timestep",
       Need::kRigidContact,
       conformance::cylinders_at_rest,
       {.of = {kCylinder}}},
      {"bodies-on-field",
       "balls, capsules and boxes stay where they lie on a flat height field, at every timestep",
       Need::kRigidContact,
       conformance::bodies_on_field,
       {.of = {kHeightField}}},
      {"cylinders-on-field",
       "cylinders stay where they lie on a flat height field, at every timestep",
       Need::kRigidContact,
       conformance::cylinders_on_field,
       {.of = {kCylinder, kHeightField}}},
      {"stacks-at-rest",
       "stacks of up to ten boxes, each a little aside, stay as they are, at every timestep",
       Need::kRigidContact,
       conformance::stacks_at_rest,
       {.of = {kBox}}},
      {"slow-rotations", "bodies that turn slowly do so at every timestep", Need::kNothing,
       conformance::slow_rotations},
      {"near-equilibrium", "rods close to an equilibrium leave it or swing about it, no worse at a shorter timestep",
       Need::kNothing, conformance::near_equilibrium},
      {"contact-compliance",
       "contacts with a given stiffness and damping: a ball sinks by m g / k, and its oscillation decays as it has to",
       Need::kCompliance, conformance::contact_compliance},
      {"restitution", "a ball leaves the ground, and another ball, with the given part of its speed",
       Need::kRestitution, conformance::restitution},
      {"contact-forces", "the impulses of contacts are what changes the momenta of sliding and colliding balls",
       Need::kContactForces, conformance::contact_forces},
      {"forces-of-boxes",
       "the forces on a resting box are its weight; on a sliding one friction is mu times the normal force",
       Need::kContactForces,
       conformance::forces_of_boxes,
       {.of = {kBox}}},
  };
  return list;
}

const char* need_text(Need need) {
  switch (need) {
    case Need::kNothing:
      return "";
    case Need::kTorques:
      return "joint torques";
    case Need::kSprings:
      return "joint springs";
    case Need::kArmature:
      return "joint armature";
    case Need::kArmatureInContact:
      return "joint armature and contact";
    case Need::kJointLimits:
      return "joint limits";
    case Need::kContact:
      return "contact";
    case Need::kRigidContact:
      return "contact without a given stiffness";
    case Need::kContactForces:
      return "contact forces";
    case Need::kCompliance:
      return "a stiffness of contacts";
    case Need::kRestitution:
      return "a coefficient of restitution";
    case Need::kActuators:
      return "actuators of the engine's own";
  }
  return "";
}

// "joint torques, slide joints"
std::string needs_text(const Entry& entry) {
  std::string text = need_text(entry.need);
  for (size_t k = 0; k < entry.features.of.size(); ++k) {
    if (!text.empty()) text += k > 0 && entry.features.any ? " or " : ", ";
    text += feature_name(entry.features.of[k]);
  }
  return text;
}

bool has(const Subject& subject, const Capabilities& can, Need need) {
  switch (need) {
    case Need::kNothing:
      return true;
    case Need::kTorques:
      return can.torques;
    case Need::kSprings:
      return can.springs != SpringKind::kNone;
    case Need::kArmature:
      return can.armature;
    case Need::kArmatureInContact:
      return can.armature && can.contact && !subject.is_compliant();
    case Need::kJointLimits:
      return can.joint_limits;
    case Need::kContact:
      return can.contact;
    case Need::kRigidContact:
      return can.contact && !subject.is_compliant();
    case Need::kContactForces:
      return can.contact && can.contact_forces != ContactForces::kNone;
    case Need::kCompliance:
      return can.contact && subject.with_compliance(1, 1).has_value();
    case Need::kRestitution:
      return can.contact && !subject.is_compliant() && subject.with_restitution(1).has_value();
    case Need::kActuators:
      return can.actuators;
  }
  return false;
}

// Why the features of `entry` are missing; empty when they are there.
std::string missing_feature(const Entry& entry, const Capabilities& can) {
  std::string missing;
  for (const Feature feature : entry.features.of) {
    const FeatureSupport* support = can.support(feature);
    const bool has_it = support != nullptr && (support->fidelity == Fidelity::kExact ||
                                               (support->fidelity == Fidelity::kApproximated && !entry.features.exact));
    if (has_it && entry.features.any) return "";
    if (!has_it && missing.empty()) {
      missing = fmt::format("the contender does not declare {}{}", feature_name(feature),
                            entry.features.exact ? " as exact" : "");
    }
  }
  return missing;
}

// The declaration that covers a figure at a timestep, s; 0: a figure of no single timestep, which only declarations for
// all of them cover.
const Deviation* covering(const Capabilities& can, const std::string& test, double timestep) {
  const auto covers = [&](const Deviation& each) {
    constexpr double kRounding = 1e-9;
    if (each.test != test) return false;
    if (timestep == 0) return each.finest == 0 && !std::isfinite(each.coarsest);
    return timestep >= each.finest * (1 - kRounding) && timestep <= each.coarsest * (1 + kRounding);
  };
  const auto found = std::ranges::find_if(can.deviations, covers);
  return found == can.deviations.end() ? nullptr : &*found;
}

// "4, 1, 1/4 ms" of the timesteps that ended with `status`.
std::string timesteps_text(const std::vector<TimestepResult>& results, ConformanceStatus status) {
  std::vector<std::string> labels;
  for (const TimestepResult& each : results) {
    if (each.status == status) labels.push_back(timestep_label(1e3 * each.timestep));
  }
  return labels.empty() ? "" : join(labels, ", ") + " ms";
}

// Whether figures pass, are declared or fail. Where a test has run at several timesteps, the result is the worst figure
// of those that fail; where none fails, of those that are declared.
void decide(const Capabilities& can, const Verdict& verdict, ConformanceResult& result) {
  std::vector<TimestepVerdict> found = verdict.timesteps;
  if (found.empty()) found.push_back({0, verdict.figure, verdict.tolerance, verdict.note});
  const auto rank = [](ConformanceStatus status) {
    if (status == ConformanceStatus::kFail) return 2;
    return status == ConformanceStatus::kDeviation ? 1 : 0;
  };
  int worst = 0;
  double worst_ratio = 0;
  for (const TimestepVerdict& each : found) {
    const Deviation* declared = covering(can, result.test, each.timestep);
    ConformanceStatus status = ConformanceStatus::kPass;
    std::string note;
    if (each.figure > each.tolerance) {
      status = declared != nullptr && each.figure <= declared->bound ? ConformanceStatus::kDeviation
                                                                     : ConformanceStatus::kFail;
      note = each.note;
      if (status == ConformanceStatus::kDeviation) {
        note = fmt::format("declared: {} ({})", declared->reason, each.note);
      } else if (declared != nullptr) {
        note = fmt::format("beyond the declared bound {}: {}", shortest(declared->bound), each.note);
      }
    }
    if (each.timestep > 0) result.timesteps.push_back({each.timestep, status, each.figure, each.tolerance});
    const double ratio = each.tolerance > 0 ? each.figure / each.tolerance : each.figure;
    if (rank(status) < worst || status == ConformanceStatus::kPass) continue;
    if (rank(status) == worst && ratio <= worst_ratio) continue;
    worst = rank(status);
    worst_ratio = ratio;
    result.status = status;
    result.figure = each.figure;
    result.tolerance = each.tolerance;
    result.note = each.timestep > 0 ? fmt::format("{} at {} ms", note, timestep_label(1e3 * each.timestep)) : note;
  }
  if (worst == 0 || result.timesteps.empty()) return;
  const std::string passes = timesteps_text(result.timesteps, ConformanceStatus::kPass);
  result.note +=
      fmt::format("; {} at {}, {}", worst == 2 ? "fails" : "declared", timesteps_text(result.timesteps, result.status),
                  passes.empty() ? "passes at none" : "passes at " + passes);
}

// Runs one test. An engine's failure is a verdict too.
ConformanceResult judge(const Entry& entry, const Subject& subject) {
  ConformanceResult result;
  result.test = entry.name;
  try {
    const Capabilities can = subject.capabilities();
    if (!has(subject, can, entry.need)) {
      result.status = ConformanceStatus::kNotApplicable;
      result.note = fmt::format("the contender does not declare {}", need_text(entry.need));
      return result;
    }
    if (const std::string missing = missing_feature(entry, can); !missing.empty()) {
      result.status = ConformanceStatus::kNotApplicable;
      result.note = missing;
      return result;
    }
    const Verdict verdict = entry.run(subject);
    result.tolerance = verdict.tolerance;
    result.unit = verdict.unit;
    result.note = verdict.note;
    if (!std::isfinite(verdict.figure) || !std::isfinite(verdict.tolerance)) {
      result.status = ConformanceStatus::kFail;
      result.tolerance = std::isfinite(verdict.tolerance) ? verdict.tolerance : 0;
      result.note = "not a finite number: " + verdict.note;
      return result;
    }
    result.figure = verdict.figure;
    decide(can, verdict, result);
  } catch (const std::exception& error) {
    const std::string lack = machine_lack(error);
    result.status = lack.empty() ? ConformanceStatus::kFail : ConformanceStatus::kNotRun;
    result.note = lack.empty() ? error.what() : lack;
  } catch (...) {
    result.status = ConformanceStatus::kFail;
    result.note = "the adapter threw something that is not a std::exception";
  }
  return result;
}

}  // namespace

std::string_view status_text(ConformanceStatus status) {
  switch (status) {
    case ConformanceStatus::kPass:
      return "pass";
    case ConformanceStatus::kFail:
      return "fail";
    case ConformanceStatus::kDeviation:
      return "deviation";
    case ConformanceStatus::kNotApplicable:
      return "not-applicable";
    case ConformanceStatus::kNotRun:
      return "not-run";
  }
  return "fail";
}

ConformanceStatus parse_conformance_status(std::string_view text) {
  using enum ConformanceStatus;
  for (const ConformanceStatus status : {kPass, kDeviation, kNotApplicable, kNotRun}) {
    if (text == status_text(status)) return status;
  }
  return kFail;
}

const std::vector<ConformanceTest>& conformance_tests() {
  static const std::vector<ConformanceTest> tests = [] {
    std::vector<ConformanceTest> list;
    list.reserve(entries().size());
    for (const Entry& entry : entries()) list.push_back({entry.name, entry.meaning, needs_text(entry)});
    return list;
  }();
  return tests;
}

std::vector<ConformanceResult> run_conformance(const ResolvedContender& contender, const ConformanceOptions& options) {
  std::vector<std::string> names;
  names.reserve(entries().size());
  for (const Entry& entry : entries()) names.emplace_back(entry.name);
  for (const std::string& test : options.tests) {
    if (std::ranges::find(names, test) == names.end()) {
      throw InputError(fmt::format("there is no conformance test '{}'{}", test, did_you_mean(test, names)));
    }
  }
  const Subject subject(contender, options.long_series);
  std::vector<ConformanceResult> results;
  for (const Entry& entry : entries()) {
    if (!options.tests.empty() && std::ranges::find(options.tests, entry.name) == options.tests.end()) continue;
    results.push_back(judge(entry, subject));
    if (options.on_result) options.on_result(results.back());
  }
  return results;
}

bool conforms(const std::vector<ConformanceResult>& results) {
  return std::ranges::none_of(results, [](const auto& result) {
    return result.status == ConformanceStatus::kFail || result.status == ConformanceStatus::kNotRun;
  });
}

}  // namespace assay
