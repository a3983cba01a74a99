// Impacts between motions without forces: balls on a line, and a rod whose ends strike a plane with friction.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include <fmt/format.h>

#include "measures/reference/certified_parts.h"
#include "model/shape.h"

namespace assay::reference {
namespace {

constexpr const char* kBallRow = "ball-row";
constexpr const char* kRodStrike = "rod-strike";

// Balls that have met move on together.
struct Cluster {
  std::vector<size_t> balls;  // positions along the line, first to last
  double mass = 0, velocity = 0;
};

// A rod in the plane of its motion: along the ground (t) and away from it (n).
struct Planar {
  double t = 0, n = 0;         // of the centre, m; n is its height
  double vt = 0, vn = 0;       // m/s
  double angle = 0, rate = 0;  // of the rod from t towards n, rad and rad/s
};

class StrikingRod {
 public:
  explicit StrikingRod(const Model& model)
      : model_(model),
        start_(model.initial.bodies.front()),
        ground_(ground_of(model, kRodStrike, 0)),
        time_(model.initial.time) {
    const auto shapes = shapes_of(model, 0);
    if (shapes.size() != 1 || shapes.front()->type != ShapeType::kCapsule) refuse("its body is no capsule");
    const Shape& shape = *shapes.front();
    const Body& body = model.bodies.front();
    if ((shape.X_BS.p - body.p_BBcm).norm() > 1e-9) refuse("the centre of mass is not the capsule's middle");
    half_ = shape.half_length;
    radius_ = shape.radius;
    mass_ = body.mass;
    const Vec3 rod = start_.q_WB * (shape.X_BS.q * Vec3::UnitZ());
    Vec3 along = ground_.tangential(rod);
    if (along.norm() < 1e-6) along = ground_.tangential(start_.v_WBcm);
    if (along.norm() < 1e-6) refuse("the rod stands upright and has no plane of motion");
    t_ = along.normalized();
    axis_ = t_.cross(ground_.normal);
    const bool planar = std::abs(start_.v_WBcm.dot(axis_)) < kParallel && std::abs(rod.dot(axis_)) < kParallel &&
                        start_.w_WB.cross(axis_).norm() < kParallel;
    if (!planar) refuse("the rod moves out of the plane through it and the ground's normal");
    inertia_ = principal_inertia(model, kRodStrike, 0, axis_);
    at_ = {0,
           ground_.height(start_.p_WBcm),
           start_.v_WBcm.dot(t_),
           start_.v_WBcm.dot(ground_.normal),
           std::atan2(rod.dot(ground_.normal), rod.dot(t_)),
           start_.w_WB.dot(axis_)};
    angle0_ = at_.angle;
    if (std::min(gap(0, 1), gap(0, -1)) < -1e-12) refuse("the rod is in the ground at the start");
    find_next();
  }

  const Vec3& normal() const { return ground_.normal; }

  BodyState at(double time, std::vector<SolutionEvent>& events) {
    constexpr size_t kMost = 1000;
    while (next_ && time_ + next_->seconds <= time) {
      at_ = flown(next_->seconds);
      time_ += next_->seconds;
      EventWatch watch = watched(next_->end);
      events.push_back({time_, fmt::format("the rod strikes the ground and {}", strike(next_->end)), std::move(watch)});
      if (events.size() > kMost) refuse("the ends strike the ground without end");
      struck_ = next_->end;
      find_next();
    }
    const Planar now = flown(time - time_);
    BodyState state = start_;
    state.p_WBcm += now.t * t_ + (now.n - ground_.height(start_.p_WBcm)) * ground_.normal;
    state.v_WBcm = now.vt * t_ + now.vn * ground_.normal;
    state.w_WB = now.rate * axis_;
    state.q_WB = turned(start_.q_WB, (now.angle - angle0_) * axis_);
    return state;
  }

 private:
  // The end's speed towards the ground, which falls to zero.
  EventWatch watched(int end) const {
    const Vec3 n = ground_.normal, arm_B = start_.q_WB.conjugate() * rod_at_start() * (end * half_);
    const auto height = [n, arm_B](const State& state) {
      const BodyState& at = state.bodies.front();
      return n.dot(at.p_WBcm + at.q_WB * arm_B);
    };
    const auto speed = [n, arm_B](const State& state) {
      const BodyState& at = state.bodies.front();
      return -n.dot(at.v_WBcm + at.w_WB.cross(at.q_WB * arm_B));
    };
    const double towards = -(at_.vn + at_.rate * end * half_ * std::cos(at_.angle));
    return {speed, towards / 2, time_, [height](const State& state) { return -height(state); }, false, end};
  }

  Vec3 rod_at_start() const { return std::cos(angle0_) * t_ + std::sin(angle0_) * ground_.normal; }

  struct Next {
    double seconds = 0;
    int end = 1;
  };

  [[noreturn]] void refuse(const std::string& why) const { misfit(model_, kRodStrike, why); }

  Planar flown(double s) const {
    Planar now = at_;
    now.t += at_.vt * s;
    now.n += at_.vn * s;
    now.angle += at_.rate * s;
    return now;
  }

  double gap(double s, int end) const {
    const Planar now = flown(s);
    return now.n + end * half_ * std::sin(now.angle) - radius_;
  }

  // An end cannot come nearer than its speed allows: steps of gap / speed pass no zero.
  std::optional<double> first_touch(int end) const {
    constexpr double kFar = 1e3;  // s
    const double speed = std::abs(at_.vn) + half_ * std::abs(at_.rate);
    double s = 0;
    if (end == struck_) {
      // it lifts off with zero speed and rises until the rod has turned to the ground's direction
      if (at_.rate == 0) return std::nullopt;
      const double turns = at_.angle / M_PI;
      s = (at_.rate > 0 ? std::floor(turns) + 1 - turns : turns - std::ceil(turns) + 1) * M_PI / std::abs(at_.rate);
    }
    if (!(speed > 0)) return std::nullopt;
    while (s < kFar) {
      const double left = gap(s, end);
      if (left < 1e-14) return s;
      s += left / speed;
    }
    return std::nullopt;
  }

  void find_next() {
    next_.reset();
    const auto first = first_touch(1), second = first_touch(-1);
    if (first && second && std::abs(*first - *second) < 1e-9) refuse("both ends strike at once");
    if (first && (!second || *first < *second)) next_ = {*first, 1};
    if (second && (!first || *second < *first)) next_ = {*second, -1};
  }

  // The impulse at the end, and what it does: "sticks" or "slips".
  std::string strike(int end) {
    const double x = end * half_ * std::cos(at_.angle), y = end * half_ * std::sin(at_.angle) - radius_;
    const double un = at_.vn + at_.rate * x, ut = at_.vt - at_.rate * y;
    const double nn = 1 / mass_ + x * x / inertia_, tt = 1 / mass_ + y * y / inertia_, nt = -x * y / inertia_;
    const double mu = ground_.friction;
    // To rest at once: compression is over and nothing slips.
    const double determinant = nn * tt - nt * nt;
    const double rest_n = (-un * tt + ut * nt) / determinant, rest_t = (-ut * nn + un * nt) / determinant;
    const bool can_rest = std::abs(rest_t) <= mu * rest_n;
    // Routh: slipping first, as long as it lasts.
    const double way = ut > 0 ? 1 : -1;
    const double slow = nt - mu * way * tt, press = nn - mu * way * nt;
    const double until_rest = way * slow < 0 ? -ut / slow : std::numeric_limits<double>::infinity();
    const double until_done = press > 0 ? -un / press : std::numeric_limits<double>::infinity();
    double pn = rest_n, pt = rest_t;
    std::string what = "sticks";
    if (ut != 0 && until_done <= until_rest) {
      if (can_rest) refuse("laws of impact differ on whether an end sticks");
      pn = until_done;
      pt = -mu * way * pn;
      what = "slips";
    } else if (std::abs(nt) > mu * tt || !can_rest) {
      refuse("the slip of an end turns round during its impact, where laws of impact differ");
    }
    at_.vn += pn / mass_;
    at_.vt += pt / mass_;
    at_.rate += (x * pn - y * pt) / inertia_;
    return what;
  }

  const Model& model_;
  BodyState start_;
  Ground ground_;
  double time_, half_ = 0, radius_ = 0, mass_ = 0, inertia_ = 0, angle0_ = 0;
  Vec3 t_, axis_;
  Planar at_;  // at time_
  int struck_ = 0;
  std::optional<Next> next_;
};

}  // namespace

CertifiedMotion rod_strike(const Model& model, const std::vector<double>& times) {
  require_plain(model, kRodStrike);
  if (model.bodies.size() != 1) misfit(model, kRodStrike, "it does not have one body");
  if (model.gravity.norm() > 0) misfit(model, kRodStrike, "it has gravity");
  StrikingRod rod(model);
  CertifiedMotion motion;
  for (const double time : times) {
    State state = model.initial;
    state.time = time;
    state.bodies.front() = rod.at(time, motion.events);
    motion.states.push_back(std::move(state));
  }
  if (times.empty()) return motion;
  std::vector<double> impacts;
  for (const SolutionEvent& event : motion.events) impacts.push_back(event.time);
  motion.impulses = {impulse_on(model, {0}, rod.normal(), marks_between(model.initial.time, impacts, times.back()),
                                "of the ground on the rod")};
  return motion;
}

CertifiedMotion ball_row(const Model& model, const std::vector<double>& times) {
  require_plain(model, kBallRow);
  if (model.gravity.norm() > 0) misfit(model, kBallRow, "it has gravity");
  if (model.bodies.size() < 2) misfit(model, kBallRow, "it has fewer than two balls");
  const std::vector<BodyState>& start = model.initial.bodies;
  size_t far = 0;
  for (size_t i = 1; i < start.size(); ++i) {
    if ((start[i].p_WBcm - start[0].p_WBcm).norm() > (start[far].p_WBcm - start[0].p_WBcm).norm()) far = i;
  }
  const Vec3 line = (start[far].p_WBcm - start[0].p_WBcm).normalized();
  const auto off = [&](const Vec3& v) { return (v - v.dot(line) * line).norm(); };
  std::vector<double> place, radius;
  for (size_t i = 0; i < start.size(); ++i) {
    const std::string& name = model.bodies[i].name;
    const auto shapes = shapes_of(model, static_cast<int>(i));
    const bool ball = shapes.size() == 1 && shapes.front()->type == ShapeType::kSphere &&
                      (shapes.front()->X_BS.p - model.bodies[i].p_BBcm).norm() < 1e-9;
    if (!ball) misfit(model, kBallRow, fmt::format("body '{}' is no ball", name));
    if (off(start[i].p_WBcm - start[0].p_WBcm) > kParallel || off(start[i].v_WBcm) > kParallel ||
        start[i].w_WB.norm() > kParallel) {
      misfit(model, kBallRow, fmt::format("body '{}' does not stay on the line of the others, or turns", name));
    }
    place.push_back((start[i].p_WBcm - start[0].p_WBcm).dot(line));
    radius.push_back(shapes.front()->radius);
  }
  std::vector<size_t> order(start.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::sort(order, {}, [&](size_t i) { return place[i]; });
  std::vector<Cluster> clusters;
  for (const size_t i : order) clusters.push_back({{i}, model.bodies[i].mass, start[i].v_WBcm.dot(line)});
  const auto distance = [&](const Cluster& a, const Cluster& b) {
    return place[b.balls.front()] - place[a.balls.back()] - radius[a.balls.back()] - radius[b.balls.front()];
  };
  for (size_t i = 0; i + 1 < clusters.size(); ++i) {
    if (distance(clusters[i], clusters[i + 1]) < 0) misfit(model, kBallRow, "two balls overlap at the start");
  }
  CertifiedMotion motion;
  double now = model.initial.time;
  const auto move_to = [&](double time) {
    for (const Cluster& cluster : clusters) {
      for (const size_t i : cluster.balls) place[i] += cluster.velocity * (time - now);
    }
    now = time;
  };
  for (const double time : times) {
    while (true) {
      double first = std::numeric_limits<double>::infinity();
      size_t pair = 0;
      for (size_t i = 0; i + 1 < clusters.size(); ++i) {
        const double closing = clusters[i].velocity - clusters[i + 1].velocity;
        if (closing <= 0) continue;
        const double meets = now + std::max(0.0, distance(clusters[i], clusters[i + 1])) / closing;
        if (meets < first) first = meets, pair = i;
      }
      if (first > time) break;
      move_to(first);
      Cluster& a = clusters[pair];
      const Cluster& b = clusters[pair + 1];
      // how fast the two come nearer, which falls to zero
      const size_t behind = a.balls.back(), ahead = b.balls.front();
      const auto closing = [line, behind, ahead](const State& state) {
        return line.dot(state.bodies[behind].v_WBcm - state.bodies[ahead].v_WBcm);
      };
      const auto nearness = [line, behind, ahead](const State& state) {
        return line.dot(state.bodies[behind].p_WBcm - state.bodies[ahead].p_WBcm);
      };
      motion.events.push_back({now,
                               fmt::format("'{}' meets '{}'", model.bodies[behind].name, model.bodies[ahead].name),
                               {closing, (a.velocity - b.velocity) / 2, now, nearness}});
      a.velocity = (a.mass * a.velocity + b.mass * b.velocity) / (a.mass + b.mass);
      a.mass += b.mass;
      a.balls.insert(a.balls.end(), b.balls.begin(), b.balls.end());
      clusters.erase(clusters.begin() + static_cast<std::ptrdiff_t>(pair) + 1);
    }
    move_to(time);
    State state = model.initial;
    state.time = time;
    for (const Cluster& cluster : clusters) {
      for (const size_t i : cluster.balls) {
        state.bodies[i].p_WBcm = start[0].p_WBcm + place[i] * line;
        state.bodies[i].v_WBcm = cluster.velocity * line;
      }
    }
    motion.states.push_back(std::move(state));
  }
  if (times.empty()) return motion;
  // Between neighbours: what those beyond take up.
  std::vector<double> impacts;
  for (const SolutionEvent& event : motion.events) impacts.push_back(event.time);
  std::vector<size_t> beyond = {order.back()};
  for (size_t i = order.size() - 1; i > 0; --i) {
    motion.impulses.push_back(impulse_on(
        model, beyond, line, marks_between(model.initial.time, impacts, times.back()),
        fmt::format("of ball '{}' on ball '{}'", model.bodies[order[i - 1]].name, model.bodies[order[i]].name)));
    beyond.push_back(order[i - 1]);
  }
  return motion;
}

}  // namespace assay::reference
