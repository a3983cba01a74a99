#include "measures/violation.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "measures/run_measures.h"
#include "measures/statistics.h"
#include "model/extent.h"
#include "model/kinematics.h"

namespace assay {
namespace {

// A sphere is a capsule of length zero. A plane has its point in `from` and its normal in `to`. Other shapes keep
// their pose: their distance is known from planes alone.
struct PlacedShape {
  Vec3 from, to;
  double radius = 0;
  bool is_plane = false;
  const Shape* solid = nullptr;  // box, cylinder, ellipsoid, hull or height field
  const Model* model = nullptr;
  Quat q_WS = Quat::Identity();
};

PlacedShape place(const Model& model, const Shape& shape, const std::vector<Pose>& bodies) {
  const Pose X_WS = shape.body == kWorld ? shape.X_BS : bodies[static_cast<size_t>(shape.body)] * shape.X_BS;
  const Vec3 axis = X_WS.q * Vec3::UnitZ();
  if (shape.type == ShapeType::kPlane) return {X_WS.p, axis, 0, true};
  if (shape.type != ShapeType::kSphere && shape.type != ShapeType::kCapsule) {
    return {X_WS.p, X_WS.p, 0, false, &shape, &model, X_WS.q};
  }
  const double half = shape.type == ShapeType::kCapsule ? shape.half_length : 0;
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

// Infinite for pairs of a solid and anything but a plane.
double distance(const PlacedShape& a, const PlacedShape& b) {
  if (a.solid != nullptr || b.solid != nullptr) {
    const PlacedShape &solid = a.solid != nullptr ? a : b, &plane = a.solid != nullptr ? b : a;
    if (!plane.is_plane) return std::numeric_limits<double>::infinity();
    const Vec3 down_S = solid.q_WS.conjugate() * -plane.to;
    return (solid.from - plane.from).dot(plane.to) - shape_reach(*solid.model, *solid.solid, down_S);
  }
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

std::vector<Pose> body_poses(const Model& model, const State& state) {
  assert(state.bodies.size() == model.bodies.size());
  std::vector<Pose> poses;
  poses.reserve(model.bodies.size());
  for (size_t i = 0; i < model.bodies.size(); ++i) poses.push_back(body_pose(model.bodies[i], state.bodies[i]));
  return poses;
}

double deepest_penetration(const Model& model, const State& state) {
  if (model.contacts.empty()) return 0;
  const std::vector<Pose> bodies = body_poses(model, state);
  std::vector<PlacedShape> shapes;
  shapes.reserve(model.shapes.size());
  for (const Shape& shape : model.shapes) shapes.push_back(place(model, shape, bodies));
  double deepest = 0;
  for (const ContactPair& pair : model.contacts) {
    const PlacedShape& a = shapes[static_cast<size_t>(pair.shape_a)];
    const PlacedShape& b = shapes[static_cast<size_t>(pair.shape_b)];
    if (a.solid == nullptr && b.solid == nullptr && !a.is_plane && !b.is_plane && distance_bound(a, b) >= -deepest)
      continue;
    deepest = std::max(deepest, -distance(a, b));
  }
  return deepest;
}

Pose parent_pose(const Model& model, const State& state, const Body& body) {
  if (body.parent == kWorld) return {};
  const auto parent = static_cast<size_t>(body.parent);
  return body_pose(model.bodies[parent], state.bodies[parent]);
}

// The angle by which the child of a slide has turned from the pose X_PB, rad.
double slide_rotation(const Model& model, const State& state, const Joint& slide) {
  const Body& body = model.bodies[static_cast<size_t>(slide.body)];
  const Quat expected = parent_pose(model, state, body).q * body.X_PB.q;
  return rotation_vector(expected.conjugate() * state.bodies[static_cast<size_t>(slide.body)].q_WB).norm();
}

}  // namespace

double shape_reach(const Model& model, const Shape& shape, const Vec3& n) {
  switch (shape.type) {
    case ShapeType::kSphere:
      return shape.radius;
    case ShapeType::kCapsule:
      return shape.radius + shape.half_length * std::abs(n.z());
    case ShapeType::kBox:
      return n.cwiseAbs().dot(shape.half_size);
    case ShapeType::kEllipsoid:
      return n.cwiseProduct(shape.half_size).norm();
    case ShapeType::kCylinder:
      return shape.radius * std::hypot(n.x(), n.y()) + shape.half_length * std::abs(n.z());
    case ShapeType::kHull: {
      double most = -std::numeric_limits<double>::infinity();
      for (const Vec3& v : model.hulls[static_cast<size_t>(shape.data)].vertices) most = std::max(most, n.dot(v));
      return most;
    }
    case ShapeType::kPlane:
    case ShapeType::kHeightField:
      break;
  }
  return -std::numeric_limits<double>::infinity();
}

double separation(const Model& model, const State& state, const ContactPair& pair) {
  const std::vector<Pose> bodies = body_poses(model, state);
  return distance(place(model, model.shapes[static_cast<size_t>(pair.shape_a)], bodies),
                  place(model, model.shapes[static_cast<size_t>(pair.shape_b)], bodies));
}

Violation violation(const Model& model, const State& state) {
  assert(state.position.size() == model.joints.size());
  Violation worst;
  for (size_t j = 0; j < model.joints.size(); ++j) {
    const Joint& hinge = model.joints[j];
    const JointFrames frames = joint_frames(model, state, static_cast<int>(j));
    if (hinge.is_slide()) {
      // off the axis, and the whole relative rotation, which a slide does not allow
      const Vec3 way = frames.p_WJ_child - frames.p_WJ_parent;
      worst.dislocation = std::max(worst.dislocation, frames.axis_W_parent.cross(way).norm());
      worst.misalignment = std::max(worst.misalignment, slide_rotation(model, state, hinge));
      continue;
    }
    worst.dislocation = std::max(worst.dislocation, (frames.p_WJ_child - frames.p_WJ_parent).norm());
    // exact for small angles, where the arc cosine loses all digits
    const double angle = std::atan2(frames.axis_W_parent.cross(frames.axis_W_child).norm(),
                                    frames.axis_W_parent.dot(frames.axis_W_child));
    worst.misalignment = std::max(worst.misalignment, angle);
    if (hinge.limited)
      worst.limit = std::max({worst.limit, hinge.lower - state.position[j], state.position[j] - hinge.upper});
  }
  for (size_t b = 0; b < model.balls.size(); ++b) {
    const BallJoint& ball = model.balls[b];
    const Body& body = model.bodies[static_cast<size_t>(ball.body)];
    const Vec3 child = body_pose(body, state.bodies[static_cast<size_t>(ball.body)]) * ball.p_BJ;
    const Vec3 parent = parent_pose(model, state, body) * (body.X_PB * ball.p_BJ);
    worst.dislocation = std::max(worst.dislocation, (child - parent).norm());
    if (ball.limited) {
      const double angle = rotation_vector(ball_rotation(model, state, static_cast<int>(b))).norm();
      worst.limit = std::max(worst.limit, angle - ball.upper);
    }
  }
  worst.penetration = deepest_penetration(model, state);
  return worst;
}

ViolationSummary violation_summary(const Model& model, const std::vector<State>& states, std::uint64_t seed) {
  assert(!states.empty());
  std::vector<Violation> worst;
  worst.reserve(states.size());
  for (const State& state : states) worst.push_back(violation(model, state));
  ViolationSummary summary;
  std::vector<double> series(worst.size());
  for (double Violation::* const kind :
       {&Violation::dislocation, &Violation::misalignment, &Violation::limit, &Violation::penetration}) {
    std::ranges::transform(worst, series.begin(), [&](const Violation& at) { return at.*kind; });
    summary.largest.*kind = std::ranges::max(series);
    const Interval rms = bootstrap_rms_of_series(series, seed);
    summary.rms.*kind = rms.value;
    summary.rms_low.*kind = rms.low;
    summary.rms_high.*kind = rms.high;
  }
  return summary;
}

namespace {

std::string violation_obstacle(const Model& model, bool /*passive*/) {
  return model.joints.empty() && model.balls.empty() && model.contacts.empty()
             ? "has neither joints nor contacts to violate"
             : "";
}

// What the model has: joints, limits, contacts.
std::vector<RunValue> violation_values(const MeasuredRun& run) {
  const ViolationSummary summary = violation_summary(run.model, run.states, run.seed);
  std::vector<RunValue> values;
  const auto add = [&](const std::string& name, const std::string& unit, double Violation::* kind) {
    values.push_back({name + "_max", unit, summary.largest.*kind, {}, {}});
    values.push_back({name + "_rms", unit, summary.rms.*kind, summary.rms_low.*kind, summary.rms_high.*kind});
  };
  if (!run.model.joints.empty() || !run.model.balls.empty()) {
    add("joint_dislocation", "m", &Violation::dislocation);
    add("joint_misalignment", "rad", &Violation::misalignment);
  }
  const bool limits =
      std::ranges::any_of(run.model.joints, [](const Joint& joint) { return joint.limited && !joint.is_slide(); }) ||
      std::ranges::any_of(run.model.balls, &BallJoint::limited);
  if (limits) add("limit_violation", "rad", &Violation::limit);
  if (!run.model.contacts.empty()) add("penetration", "m", &Violation::penetration);
  return values;
}

}  // namespace

RunMeasure violation_measure() { return {"violation", violation_obstacle, violation_values}; }

}  // namespace assay
