#include "measures/violation.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "base/errors.h"
#include "measures/measure.h"
#include "measures/rebound.h"
#include "measures/statistics.h"
#include "measures/watch.h"
#include "model/joint.h"
#include "model/shape.h"

namespace assay {
namespace {

// A sphere is a capsule of length zero. A plane has its point in `from` and its normal in `to`.
struct PlacedShape {
  Vec3 from, to;
  double radius = 0;
  bool is_plane = false;
};

bool is_round(const Shape& shape) { return half_segment(shape).has_value(); }

// Whether the distance has a closed form.
bool is_simple(const Model& model, const ContactPair& pair) {
  const Shape &a = model.shapes[static_cast<size_t>(pair.shape_a)],
              &b = model.shapes[static_cast<size_t>(pair.shape_b)];
  return (is_round(a) && (is_round(b) || is_plane(b))) || (is_round(b) && is_plane(a));
}

PlacedShape place(const Shape& shape, const Pose& X_WS) {
  const Vec3 axis = X_WS.q * Vec3::UnitZ();
  if (is_plane(shape)) return {X_WS.p, axis, 0, true};
  const double half = half_segment(shape).value_or(0);
  return {X_WS.p - half * axis, X_WS.p + half * axis, shape.radius, false};
}

double point_segment(const Vec3& point, const Vec3& from, const Vec3& to) {
  const Vec3 along = to - from;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0 ? std::clamp((point - from).dot(along) / length2, 0.0, 1.0) : 0;
  return (from + t * along - point).norm();
}

// The smallest distance of two segments lies at an end of one of them, or where their common normal meets both.
double segment_segment(const PlacedShape& a, const PlacedShape& b) {
  double least = std::min({point_segment(a.from, b.from, b.to), point_segment(a.to, b.from, b.to),
                           point_segment(b.from, a.from, a.to), point_segment(b.to, a.from, a.to)});
  const Vec3 u = a.to - a.from, v = b.to - b.from, w = b.from - a.from;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
  const double determinant = uu * vv - uv * uv;
  if (determinant <= 1e-14 * uu * vv) return least;  // parallel, or a point: the ends decide
  const double s = (w.dot(u) * vv - w.dot(v) * uv) / determinant;
  const double t = (w.dot(u) * uv - w.dot(v) * uu) / determinant;
  if (0 <= s && s <= 1 && 0 <= t && t <= 1) least = std::min(least, (w + t * v - s * u).norm());
  return least;
}

double distance(const PlacedShape& a, const PlacedShape& b) {
  if (a.is_plane) {
    return std::min((b.from - a.from).dot(a.to), (b.to - a.from).dot(a.to)) - b.radius;
  }
  if (b.is_plane) return distance(b, a);
  return segment_segment(a, b) - a.radius - b.radius;
}

// A cheap lower bound of the distance.
double distance_bound(const PlacedShape& a, const PlacedShape& b) {
  return 0.5 * ((a.from + a.to - b.from - b.to).norm() - (a.to - a.from).norm() - (b.to - b.from).norm()) - a.radius -
         b.radius;
}

}  // namespace

Separations::Separations(const Model& model) : model_(model) {
  std::vector<int> others;
  for (size_t i = 0; i < model.contacts.size(); ++i) {
    if (!is_simple(model, model.contacts[i])) others.push_back(static_cast<int>(i));
  }
  if (others.empty()) return;
  try {
    others_ = std::make_unique<PairDistances>(model, others);
  } catch (const InputError&) {
    has_all_ = false;
  }
}

std::vector<Pose> Separations::place_shapes(const State& state) const {
  assert(state.bodies.size() == model_.bodies.size());
  std::vector<Pose> X_WS;
  X_WS.reserve(model_.shapes.size());
  for (const Shape& shape : model_.shapes) X_WS.push_back(shape_pose(model_, state, shape));
  return X_WS;
}

double Separations::of(int pair, const std::vector<Pose>& X_WS) const {
  const ContactPair& of = model_.contacts[static_cast<size_t>(pair)];
  if (!is_simple(model_, of)) {
    return others_ == nullptr ? std::numeric_limits<double>::infinity() : others_->distance(pair, X_WS);
  }
  const auto a = static_cast<size_t>(of.shape_a), b = static_cast<size_t>(of.shape_b);
  return distance(place(model_.shapes[a], X_WS[a]), place(model_.shapes[b], X_WS[b]));
}

double Separations::of(int pair, const State& state) const { return of(pair, place_shapes(state)); }

Separations::Depth Separations::deepest(const State& state, const std::vector<double>& before) const {
  if (model_.contacts.empty()) return {};
  const std::vector<Pose> X_WS = place_shapes(state);
  std::vector<PlacedShape> placed(model_.shapes.size());
  std::vector<Box> boxes(others_ == nullptr ? 0 : model_.shapes.size());
  for (size_t s = 0; s < model_.shapes.size(); ++s) {
    const Shape& shape = model_.shapes[s];
    if (is_round(shape) || is_plane(shape)) placed[s] = place(shape, X_WS[s]);
    if (others_ != nullptr && !is_ground(shape)) boxes[s] = box_around(model_, shape, X_WS[s]);
  }
  Depth deepest;
  const auto count = [&](size_t pair, double depth) {
    deepest.whole = std::max(deepest.whole, depth);
    deepest.added = std::max(deepest.added, depth - (before.empty() ? 0 : before[pair]));
  };
  for (size_t i = 0; i < model_.contacts.size(); ++i) {
    const auto a = static_cast<size_t>(model_.contacts[i].shape_a), b = static_cast<size_t>(model_.contacts[i].shape_b);
    if (!is_simple(model_, model_.contacts[i])) {
      if (others_ == nullptr) continue;
      const bool ground = is_ground(model_.shapes[a]) || is_ground(model_.shapes[b]);
      if (!ground && !boxes[a].intersects(boxes[b])) continue;
      count(i, -others_->distance(static_cast<int>(i), X_WS));
      continue;
    }
    const double shown = std::min(deepest.whole, deepest.added + (before.empty() ? 0 : before[i]));
    if (!placed[a].is_plane && !placed[b].is_plane && distance_bound(placed[a], placed[b]) >= -shown) continue;
    count(i, -distance(placed[a], placed[b]));
  }
  return deepest;
}

std::vector<double> Separations::depths(const State& state) const {
  const std::vector<Pose> X_WS = place_shapes(state);
  std::vector<double> all;
  all.reserve(model_.contacts.size());
  for (int i = 0; std::cmp_less(i, model_.contacts.size()); ++i) all.push_back(std::max(0.0, -of(i, X_WS)));
  return all;
}

namespace {

Violation violation(const Model& model, const State& state, const Separations& separations,
                    const std::vector<double>& before = {}) {
  assert(state.position.size() == model.joints.size());
  Violation worst;
  each_joint(model, [&](const auto& joint) {
    const JointError error = joint_error(model, state, joint);
    worst.dislocation = std::max(worst.dislocation, error.dislocation);
    worst.misalignment = std::max(worst.misalignment, error.misalignment);
    if (!is_slide(joint)) worst.limit = std::max(worst.limit, beyond_limit(model, state, joint));
  });
  const Separations::Depth depth = separations.deepest(state, before);
  worst.penetration = depth.whole;
  worst.added = depth.added;
  return worst;
}

}  // namespace

Violation violation(const Model& model, const State& state) { return violation(model, state, Separations(model)); }

ViolationSeries::ViolationSeries(const Model& model, const State& start)
    : model_(model), separations_(model), before_(separations_.depths(start)) {}

void ViolationSeries::add(const State& state) { of_states_.push_back(violation(model_, state, separations_, before_)); }

ViolationSummary ViolationSeries::summary(std::uint64_t seed) const {
  assert(!of_states_.empty());
  ViolationSummary summary;
  summary.has_penetration = separations_.has_all();
  std::vector<double> series(of_states_.size());
  for (const auto kind : kViolationKinds) {
    std::ranges::transform(of_states_, series.begin(), [&](const Violation& at) { return at.*kind; });
    summary.largest.*kind = std::ranges::max(series);
    const Interval rms = bootstrap_rms_of_series(series, seed);
    summary.rms.*kind = rms.value;
    summary.rms_low.*kind = rms.low;
    summary.rms_high.*kind = rms.high;
  }
  return summary;
}

std::optional<double> usual_penetration_limit(const Model& model) {
  constexpr double kShare = 0.05, kLeast = 1e-3, kMost = 5e-3;
  const double thinnest = 2 * least_half_thickness(model);
  if (!std::isfinite(thinnest)) return std::nullopt;
  return std::clamp(kShare * thinnest, kLeast, kMost);
}

namespace {

std::string violation_obstacle(const MeasuredSystem& system) {
  return joint_count(system.model) == 0 && system.model.contacts.empty()
             ? "has neither joints nor contacts to violate: leave 'violation' out of its measures"
             : "";
}

// What the model has: joints, limits, contacts; and what the engine gives of contact forces.
Measured violation_values(const MeasuredRun& run) {
  const ViolationSummary& summary = run.watched->violation;
  std::vector<Value> values;
  const auto add = [&](const std::string& name, const std::string& unit, double Violation::* kind) {
    values.push_back({name + "_max", unit, summary.largest.*kind});
    values.push_back({name + "_rms", unit, summary.rms.*kind, summary.rms_low.*kind, summary.rms_high.*kind});
  };
  if (joint_count(run.model) > 0) {
    add("joint_dislocation", "m", &Violation::dislocation);
    add("joint_misalignment", "rad", &Violation::misalignment);
  }
  const bool limits = any_joint(run.model, [](const auto& joint) { return joint.limited && !is_slide(joint); });
  if (limits) add("limit_violation", "rad", &Violation::limit);
  if (!run.model.contacts.empty() && summary.has_penetration) {
    add("penetration", "m", &Violation::penetration);
    values.push_back({"penetration_added_max", "m", summary.largest.added});
    if (const auto limit = usual_penetration_limit(run.model)) values.push_back({"penetration_limit", "m", *limit});
  }
  if (run.contacts != nullptr) {
    const ContactResiduals& of = *run.contacts;
    values.push_back({"contact_depth", "m", of.depth});
    values.push_back({"signorini_residual", "m/s", of.signorini});
    if (of.cone) values.push_back({"cone_violation", "1", of.cone});
    if (of.dissipation) values.push_back({"dissipation_residual", "m/s", of.dissipation});
  }
  return {std::move(values)};
}

// The rebound at the system's scale, beside how far its contacts give way.
Value rebound_value(const std::vector<State>& states) { return {"rebound", "1", rebound(states)}; }

}  // namespace

Measure violation_measure() {
  using namespace rows;
  return {
      .name = "violation",
      .reads = Reads::kRun,
      .version = 1,
      .values =
          {{"joint_dislocation_max", "m", "Joint position error", "joint position error", kLow, kPlot, kLimit,
            "largest distance between the two anchors of a hinge over the run", 3},
           {"joint_dislocation_rms", "m", "Joint position error, RMS", "joint position error (RMS)", kLow, kNo, kLimit,
            "largest distance between the two anchors of a hinge at each instant, root mean square over the run", 3},
           {"joint_misalignment_max", "rad", "Joint axis error", "joint axis error", kLow, kPlot, kLimit,
            "largest angle between the two axes of a hinge over the run", 3},
           {"joint_misalignment_rms", "rad", "Joint axis error, RMS", "joint axis error (RMS)", kLow, kNo, kLimit,
            "largest angle between the two axes of a hinge at each instant, root mean square over the run", 3},
           {"limit_violation_max", "rad", "Joint limit violation", "joint limit violation", kLow, kPlot, kLimit,
            "largest angle of a joint beyond its limit over the run", 3},
           {"limit_violation_rms", "rad", "Joint limit violation, RMS", "joint limit violation (RMS)", kLow, kNo,
            kLimit, "largest angle of a joint beyond its limit at each instant, root mean square over the run", 3},
           {"penetration_max", "m", "Penetration", "penetration", kLow, kPlot, kLimit,
            "largest depth of two colliding shapes in each other over the run", 3},
           {"penetration_rms", "m", "Penetration, RMS", "penetration (RMS)", kLow, kNo, kLimit,
            "largest depth of two colliding shapes in each other at each instant, root mean square over the run", 3},
           {"penetration_added_max", "m", "Penetration beyond the start's", "added penetration", kLow, kPlot, kLimit,
            "largest depth of two colliding shapes in each other over the run, less what they overlap by at its start",
            3},
           {"penetration_limit", "m", "Penetration that is asked for", "penetration limit", kNone, kNo, kNo,
            "what questions allow beyond the start's overlap unless they say otherwise: 5 mm and 5 % of the smallest "
            "colliding shape, but at least 1 mm",
            13},
           {"rebound", "1", "Rebound", "rebound", kLow, kNo, kLimit,
            "part of its speed with which a ball of the size of the system's smallest shape leaves a plane at 1 m/s; "
            "no model has restitution, so 0 is right",
            3},
           {"contact_depth", "m", "Depth of pressed contacts", "depth of contacts", kLow, kNo, kNo,
            "overlap at the contact points, in the mean by their normal forces; rigid contact has none", 3},
           {"signorini_residual", "m/s", "Signorini residual", "Signorini residual", kNone, kNo, kNo,
            "speed along the normal of shapes that contact forces press together, in the mean by these forces; rigid "
            "contact has none, and neither has a soft one at rest: look at the depth, too",
            3},
           {"cone_violation", "1", "Friction beyond the cone", "friction beyond the cone", kLow, kNo, kNo,
            "friction above the coefficient times the normal force, over the normal force, in the mean by these forces",
            3},
           {"dissipation_residual", "m/s", "Maximum dissipation residual", "dissipation residual", kNone, kNo, kNo,
            "speed of slip times the part of the largest friction that does not act against it, in the mean by forces; "
            "where nothing slips there is none",
            3}},
      .obstacle = violation_obstacle,
      .timesteps_key = "violation_ms",
      .of_run = violation_values,
      .reads_between = true,
      .reads_contacts = true,
      .experiment = impact_experiment,
      .of_experiment = rebound_value};
}

}  // namespace assay
