// Motions that turn about a line on a plane: a box about its edge, a rimless wheel from foot to foot. One coordinate
// between impacts; its energy is checked.
#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "measures/reference/certified_parts.h"
#include "model/kinematics.h"
#include "model/shape.h"

namespace assay::reference {
namespace {

constexpr const char* kTippingBox = "tipping-box";
constexpr const char* kRimlessWheel = "rimless-wheel";
constexpr double kEnergyError = 1e-9;

// A body that rolls without slip on a cylinder of `radius` (0: an edge) about a line of itself at distance `length`
// from its centre of mass. The angle is that from the plane's normal to the way from the line to the centre, towards t.
struct Pivot {
  double mass = 0, inertia = 0;  // about the centre of mass
  double length = 0, radius = 0;
  double press = 0, pull = 0;  // gravity towards the plane, and along t, m/s^2

  // of the rate squared, at half
  double effective(double angle) const {
    return inertia + mass * (radius * radius + length * length + 2 * radius * length * std::cos(angle));
  }
  double acceleration(double angle, double rate) const {
    const double force = mass * press * length * std::sin(angle) + mass * pull * (radius + length * std::cos(angle)) +
                         mass * radius * length * std::sin(angle) * rate * rate;
    return force / effective(angle);
  }
  double energy(const Turn& turn) const {
    return effective(turn.angle) * turn.rate * turn.rate / 2 + mass * press * length * std::cos(turn.angle) -
           mass * pull * (radius * turn.angle + length * std::sin(turn.angle));
  }
  double scale() const { return mass * std::hypot(press, pull) * (length + radius); }
  // The plane's force along its normal and along t, N.
  Eigen::Vector2d force(const Turn& turn) const {
    const double s = std::sin(turn.angle), c = std::cos(turn.angle), w2 = turn.rate * turn.rate;
    const double a = acceleration(turn.angle, turn.rate);
    return {mass * (-length * (s * a + c * w2) + press), mass * (radius * a + length * (c * a - s * w2) - pull)};
  }
};

// What a turning body of one plane has in common, in the frame of the plane: the axis, its normal and t = axis x
// normal.
struct Turning {
  Ground ground;
  Vec3 t, axis;
  Pivot pivot;

  // The angle of the way `arm` from the pivot to the centre.
  double angle_of(const Vec3& arm) const { return std::atan2(arm.dot(t), arm.dot(ground.normal)); }
};

void check_forces(const Model& model, const char* solution, const Turning& turning, const Turn& turn) {
  const Eigen::Vector2d force = turning.pivot.force(turn);
  if (!(force[0] > 0)) misfit(model, solution, fmt::format("it lifts off at an angle of {:.4g} rad", turn.angle));
  if (std::abs(force[1]) > turning.ground.friction * force[0]) {
    misfit(model, solution,
           fmt::format("it slips at an angle of {:.4g} rad: to stick there takes a friction of {:.4g}", turn.angle,
                       std::abs(force[1]) / force[0]));
  }
}

void check_energy(const Model& model, const char* solution, const Pivot& pivot, double before, const Turn& turn) {
  if (std::abs(pivot.energy(turn) - before) <= kEnergyError * pivot.scale()) return;
  misfit(model, solution, "its integration does not keep the energy to 1e-9");
}

void set_frame(const Model& model, const char* solution, Turning& turning, const Vec3& axis) {
  turning.axis = axis;
  turning.t = axis.cross(turning.ground.normal);
  if (std::abs(model.gravity.dot(axis)) > kParallel * model.gravity.norm()) {
    misfit(model, solution, "gravity has a part along the axis about which it turns");
  }
  turning.pivot.press = -model.gravity.dot(turning.ground.normal);
  turning.pivot.pull = model.gravity.dot(turning.t);
  turning.pivot.mass = model.bodies.front().mass;
  turning.pivot.inertia = principal_inertia(model, solution, 0, axis);
}

// The state of the body that has turned by `turned_by` since the start, its contact line at `line` then.
BodyState state_of(const Turning& turning, const BodyState& start, double turned_by, const Vec3& foot,
                   const Turn& turn) {
  const Pivot& pivot = turning.pivot;
  const double s = std::sin(turn.angle), c = std::cos(turn.angle);
  BodyState state = start;
  const Vec3 side = start.p_WBcm.dot(turning.axis) * turning.axis;
  const Vec3 centre = foot - foot.dot(turning.axis) * turning.axis + side;
  state.p_WBcm = centre + pivot.length * (s * turning.t + c * turning.ground.normal);
  state.v_WBcm = turn.rate * (pivot.radius * turning.t + pivot.length * (c * turning.t - s * turning.ground.normal));
  state.w_WB = turn.rate * turning.axis;
  state.q_WB = turned(start.q_WB, turned_by * turning.axis);
  return state;
}

std::vector<Vec3> corners_of(const Shape& box, const BodyState& body, const Vec3& p_BBcm) {
  std::vector<Vec3> found;
  for (int i = 0; i < 8; ++i) {
    const Vec3 sign((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
    found.emplace_back(body.p_WBcm + body.q_WB * (box.X_BS * Vec3(sign.cwiseProduct(box.half_size)) - p_BBcm));
  }
  return found;
}

}  // namespace

CertifiedMotion tipping_box(const Model& model, const std::vector<double>& times) {
  require_plain(model, kTippingBox);
  const auto shapes = model.bodies.size() == 1 ? shapes_of(model, 0) : std::vector<const Shape*>();
  if (shapes.size() != 1 || shapes.front()->type != ShapeType::kBox) misfit(model, kTippingBox, "it is no one box");
  const BodyState& start = model.initial.bodies.front();
  Turning turning{ground_of(model, kTippingBox, 0), Vec3::Zero(), Vec3::Zero(), {}};
  const Ground& ground = turning.ground;
  std::vector<Vec3> corners = corners_of(*shapes.front(), start, model.bodies.front().p_BBcm);
  std::ranges::sort(corners, {}, [&](const Vec3& p) { return ground.height(p); });
  if (std::abs(ground.height(corners[0])) > kTouching || std::abs(ground.height(corners[1])) > kTouching ||
      ground.height(corners[2]) < 1e-4) {
    misfit(model, kTippingBox, "it does not stand on one edge");
  }
  const Vec3 edge = ground.tangential(corners[1] - corners[0]).normalized();
  set_frame(model, kTippingBox, turning, edge);
  // The edge where it is, at its tiny height over the plane.
  const Vec3 foot = (corners[0] + corners[1]) / 2, arm = start.p_WBcm - foot;
  const Vec3 flat = arm - arm.dot(edge) * edge;
  turning.pivot.length = flat.norm();
  const Turn first = {turning.angle_of(flat), start.w_WB.dot(edge)};
  const BodyState expected = state_of(turning, start, 0, foot, first);
  if ((expected.v_WBcm - start.v_WBcm).norm() > 1e-6 || (expected.w_WB - start.w_WB).norm() > kParallel) {
    misfit(model, kTippingBox, "its start does not turn about its edge");
  }
  // It lands when the next corner is as low as the edge.
  const auto height = [&](const Turn& turn) {
    double least = 1e9;
    const Quat by = turned(Quat::Identity(), (turn.angle - first.angle) * edge);
    for (size_t i = 2; i < corners.size(); ++i) least = std::min(least, (by * (corners[i] - foot)).dot(ground.normal));
    return least;
  };
  const Pivot& pivot = turning.pivot;
  TurnMotion run(first, model.initial.time, [&](double angle, double rate) { return pivot.acceleration(angle, rate); });
  CertifiedMotion motion;
  for (const double time : times) {
    if (run.go(time, height)) {
      misfit(model, kTippingBox, fmt::format("it lands at {:.6g} s: let the run end before", run.time()));
    }
    check_energy(model, kTippingBox, pivot, pivot.energy(first), run.turn());
    check_forces(model, kTippingBox, turning, run.turn());
    State state = model.initial;
    state.time = time;
    state.bodies.front() = state_of(turning, start, run.turn().angle - first.angle, foot, run.turn());
    motion.states.push_back(std::move(state));
  }
  if (!times.empty()) {
    motion.impulses = {impulse_on(model, {0}, ground.normal, equal_marks(model.initial.time, times.back()),
                                  "of the plane on the box")};
  }
  return motion;
}

namespace {

class Wheel {
 public:
  explicit Wheel(const Model& model) : model_(model), start_(model.initial.bodies.front()) {
    turning_.ground = ground_of(model, kRimlessWheel, 0);
    const Ground& ground = turning_.ground;
    const auto shapes = shapes_of(model, 0);
    if (shapes.size() < 3) refuse("it has fewer than three feet");
    const Vec3 axis = start_.q_WB * (shapes.front()->X_BS.q * Vec3::UnitZ());
    if (std::abs(axis.dot(ground.normal)) > kParallel) refuse("its axis is not along the plane");
    set_frame(model, kRimlessWheel, turning_, axis);
    if (turning_.pivot.pull < 0) set_frame(model, kRimlessWheel, turning_, -axis);
    for (const Shape* shape : shapes) {
      const bool along = shape->type == ShapeType::kCapsule &&
                         (start_.q_WB * (shape->X_BS.q * Vec3::UnitZ())).cross(axis).norm() < kParallel;
      if (!along) refuse("a foot is no capsule along its axis");
      const Vec3 way = start_.q_WB * (shape->X_BS.p - model.bodies.front().p_BBcm);
      const Vec3 flat = way - way.dot(axis) * axis;
      feet_.push_back(flat);
      if (std::abs(flat.norm() - feet_.front().norm()) > 1e-9 || shape->radius != shapes.front()->radius) {
        refuse("its feet are unlike");
      }
    }
    // In the order in which they come to the ground: the wheel turns from the normal towards t.
    std::ranges::sort(feet_, {}, [&](const Vec3& foot) { return turning_.angle_of(-foot); });
    turning_.pivot.length = feet_.front().norm();
    turning_.pivot.radius = shapes.front()->radius;
    const auto stance = std::ranges::min_element(feet_, {}, [&](const Vec3& foot) { return foot.dot(ground.normal); });
    on_ = static_cast<size_t>(stance - feet_.begin());
    const Vec3 foot = start_.p_WBcm + feet_[on_];
    if (std::abs(ground.height(foot) - turning_.pivot.radius) > kTouching) refuse("no foot touches the plane");
    foot_ = foot;
    turn_ = {turning_.angle_of(-feet_[on_]), start_.w_WB.dot(turning_.axis)};
    const BodyState expected = state_of(turning_, start_, 0, foot_, turn_);
    if ((expected.v_WBcm - start_.v_WBcm).norm() > 1e-6 || (expected.w_WB - start_.w_WB).norm() > kParallel) {
      refuse("it does not roll on its foot at the start");
    }
  }

  CertifiedMotion solve(const std::vector<double>& times) {
    CertifiedMotion motion;
    std::vector<double> impacts;
    TurnMotion run = stance(model_.initial.time);
    double energy = turning_.pivot.energy(turn_), from = turn_.angle;
    for (const double time : times) {
      while (run.go(time, [&](const Turn& turn) { return clearance(turn); })) {
        check_energy(model_, kRimlessWheel, turning_.pivot, energy, run.turn());
        step_over(run.turn(), from);
        motion.events.push_back({run.time(), "the next foot strikes the ground", watched(run.time())});
        impacts.push_back(run.time());
        run = stance(run.time());
        energy = turning_.pivot.energy(turn_);
        from = turn_.angle;
      }
      const Turn now = run.turn();
      check_energy(model_, kRimlessWheel, turning_.pivot, energy, now);
      check_forces(model_, kRimlessWheel, turning_, now);
      State state = model_.initial;
      state.time = time;
      state.bodies.front() = state_of(turning_, start_, turned_ + now.angle - from, rolled(now.angle - from), now);
      motion.states.push_back(std::move(state));
    }
    if (!times.empty()) {
      motion.impulses = {impulse_on(model_, {0}, turning_.ground.normal,
                                    marks_between(model_.initial.time, impacts, times.back()),
                                    "of the ground on the wheel")};
    }
    return motion;
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const { misfit(model_, kRimlessWheel, why); }

  // How far the wheel has to turn yet to where two feet touch.
  EventWatch watched(double time) const {
    const Vec3 axis = turn_.rate > 0 ? turning_.axis : Vec3(-turning_.axis);
    const Quat back = turned(start_.q_WB, turned_ * turning_.axis).conjugate();
    const auto left = [axis, back](const State& state) {
      return -axis.dot(rotation_vector(state.bodies.front().q_WB * back));
    };
    return {.number = left, .falls_at = time, .chain = 0};
  }

  TurnMotion stance(double time) const {
    return {turn_, time, [this](double angle, double rate) { return turning_.pivot.acceleration(angle, rate); }};
  }

  Vec3 rolled(double by) const { return foot_ + turning_.pivot.radius * by * turning_.t; }

  double between(size_t a, size_t b) const {
    const Vec3 &from = feet_[a], &to = feet_[b];
    return std::atan2(std::abs(from.cross(to).dot(turning_.axis)), from.dot(to));
  }

  size_t next(bool ahead) const { return ahead ? (on_ + feet_.size() - 1) % feet_.size() : (on_ + 1) % feet_.size(); }

  // How far the two neighbours are above the plane, the lower one: their angle is that of the stance less the spread.
  double clearance(const Turn& turn) const {
    const double l = turning_.pivot.length, own = l * std::cos(turn.angle);
    const double ahead = own - l * std::cos(turn.angle - between(on_, next(true)));
    const double behind = own - l * std::cos(turn.angle + between(on_, next(false)));
    // one of which it has just left
    if (turn.rate > 0) return ahead;
    return turn.rate < 0 ? behind : std::min(ahead, behind);
  }

  // The angular momentum about the new line of contact stays; the old foot must leave.
  void step_over(const Turn& turn, double from) {
    const bool ahead = turn.rate > 0;
    const Pivot& pivot = turning_.pivot;
    const size_t to = next(ahead);
    const double spread = (ahead ? -1 : 1) * between(on_, to), angle = turn.angle + spread;
    const Vec3 old_line = rolled(turn.angle - from);
    const BodyState before = state_of(turning_, start_, 0, old_line, turn);
    const double s = std::sin(angle), c = std::cos(angle);
    const Vec3 arm =
        pivot.length * (s * turning_.t + c * turning_.ground.normal) + pivot.radius * turning_.ground.normal;
    const double momentum = pivot.inertia * turn.rate + pivot.mass * arm.cross(before.v_WBcm).dot(turning_.axis);
    const double rate = momentum / (pivot.inertia + pivot.mass * arm.squaredNorm());
    if (rate * turn.rate <= 0) refuse("it stops at a foot: the slope or the speed is too small");
    turned_ += turn.angle - from;
    foot_ = old_line + pivot.length * ((std::sin(turn.angle) - s) * turning_.t);
    on_ = to;
    turn_ = {angle, rate};
    check_impulse(before, rate, arm);
  }

  void check_impulse(const BodyState& before, double rate, const Vec3& arm) const {
    const Vec3 after = (rate * turning_.axis).cross(arm);
    const Vec3 impulse = after - before.v_WBcm;
    const double normal = impulse.dot(turning_.ground.normal), along = std::abs(impulse.dot(turning_.t));
    if (normal < 0 || along > turning_.ground.friction * normal) refuse("a foot slips as it strikes");
  }

  const Model& model_;
  BodyState start_;
  Turning turning_;
  std::vector<Vec3> feet_;  // from the centre of mass at the start, in the order in which they come to the ground
  size_t on_ = 0;
  Vec3 foot_;  // the centre of the foot on the ground at the start of its stance
  double turned_ = 0;
  Turn turn_;  // at the start of the stance
};

}  // namespace

CertifiedMotion rimless_wheel(const Model& model, const std::vector<double>& times) {
  require_plain(model, kRimlessWheel);
  if (model.bodies.size() != 1) misfit(model, kRimlessWheel, "it does not have one body");
  return Wheel(model).solve(times);
}

}  // namespace assay::reference
