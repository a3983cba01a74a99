// Sliding and rolling on planes. The velocity u of the point that touches obeys u' = a - b u/|u| with a = the
// tangential gravity and b = k mu g_n, k = 1 for a body that does not turn and 1 + m r^2 / I for one that rolls about
// its centre: straight where u is along a, else along a curve with a closed form in w = tan(psi/2), psi the angle from
// a to u.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "measures/reference/certified_parts.h"
#include "model/shape.h"

namespace assay::reference {
namespace {

constexpr const char* kSlideAndRoll = "slide-and-roll";
constexpr double kForever = std::numeric_limits<double>::infinity();

// Integral of x^(k - 1) from low to high, 0 <= low <= high.
double power_integral(double k, double low, double high) {
  if (low == high) return 0;
  if (low == 0) return k > 0 ? std::pow(high, k) / k : kForever;
  const double ratio = std::log(low / high);
  return k == 0 ? -ratio : std::pow(high, k) * -std::expm1(k * ratio) / k;
}

struct Slip {
  Vec3 u = Vec3::Zero(), way = Vec3::Zero();  // m/s, and m since the start
};

class SlipMotion {
 public:
  SlipMotion(const Vec3& start, const Vec3& a, double b) : a_(a), start_(start), pull_(a.norm()), b_(b) {
    const double speed = start.norm();
    if (speed == 0) {
      first_stop_ = 0;
    } else if (start.cross(a).norm() <= kParallel * speed * pull_) {
      along_ = start / speed;
      slope_ = a.dot(along_) - b;
      if (slope_ < 0) first_stop_ = speed / -slope_;
    } else {
      curved_ = true;
      q_ = b / pull_;
      e1_ = a / pull_;
      e2_ = (start - start.dot(e1_) * e1_).normalized();
      w0_ = std::tan(std::atan2(start.dot(e2_), start.dot(e1_)) / 2);
      scale_ = 2 * speed / (std::pow(w0_, q_ - 1) + std::pow(w0_, q_ + 1));
      first_stop_ = time_to(0);
    }
    sticks_ = pull_ <= b_;
  }

  // When it stops to slip; nothing where it does not.
  std::optional<double> end() const {
    if (!sticks_ || !std::isfinite(first_stop_)) return std::nullopt;
    return first_stop_;
  }

  // When its speed has fallen to a part of what it is at the start, of one that stops.
  double falls_to(double part) const {
    const double speed = part * start_.norm();
    return zero_between([&](double time) { return at(time).u.norm() - speed; }, 0, first_stop_);
  }

  // How much faster it gets in a second once it slips from rest; 0 where it stays.
  double gain() const { return start_.norm() > 0 || sticks_ ? 0 : pull_ - b_; }

  Slip at(double time) const {
    Slip slip = before(std::min(time, first_stop_));
    if (time <= first_stop_ || sticks_) {
      if (time >= first_stop_) slip.u.setZero();
      return slip;
    }
    const double late = time - first_stop_;  // away, down the slope
    const Vec3 slope = a_ / pull_ * (pull_ - b_);
    return {slope * late, slip.way + slope * (late * late / 2)};
  }

 private:
  double time_to(double w) const {
    return scale_ / (2 * pull_) * (power_integral(q_ - 1, w, w0_) + power_integral(q_ + 1, w, w0_));
  }

  Slip before(double time) const {
    if (!curved_) {
      if (first_stop_ == 0) return {};
      const double speed = start_.norm();
      return {(speed + slope_ * time) * along_, (speed * time + slope_ * time * time / 2) * along_};
    }
    double w = 0;
    if (time < first_stop_) {
      double low = w0_ / 2;
      while (time_to(low) < time) low /= 2;
      w = zero_between([&](double x) { return time_to(x) - time; }, low, w0_);
    }
    const double c = scale_, first = c * c / (4 * pull_), second = c * c / (2 * pull_);
    Slip slip;
    slip.way = first * (power_integral(2 * q_ - 2, w, w0_) - power_integral(2 * q_ + 2, w, w0_)) * e1_ +
               second * (power_integral(2 * q_ - 1, w, w0_) + power_integral(2 * q_ + 1, w, w0_)) * e2_;
    if (w > 0) {
      slip.u = c / 2 * std::pow(w, q_ - 1) * (1 - w * w) * e1_ + c * std::pow(w, q_) * e2_;
    }
    return slip;
  }

  Vec3 a_, start_, along_ = Vec3::Zero(), e1_ = Vec3::Zero(), e2_ = Vec3::Zero();
  double pull_ = 0, b_ = 0, slope_ = 0, first_stop_ = kForever;
  double q_ = 0, w0_ = 0, scale_ = 0;
  bool curved_ = false, sticks_ = false;
};

class SlidingBody {
 public:
  SlidingBody(const Model& model, int number)
      : model_(model),
        number_(number),
        body_(model.bodies[static_cast<size_t>(number)]),
        start_(model.initial.bodies[static_cast<size_t>(number)]),
        ground_(ground_of(model, kSlideAndRoll, number)),
        pull_(ground_.tangential(model.gravity)),
        press_(-model.gravity.dot(ground_.normal)) {
    if (!body_.is_free()) refuse("has a joint");
    if (!(press_ > 0)) refuse("is not pressed onto its plane by gravity");
    const auto shapes = shapes_of(model, number);
    if (shapes.size() != 1) refuse("does not have one shape");
    shape_ = shapes.front();
    if ((shape_->X_BS.p - body_.p_BBcm).norm() > 1e-9) refuse("has its centre of mass beside its shape's centre");
    turn_shape_ = start_.q_WB * shape_->X_BS.q;
    const double gap =
        ground_.height(start_.p_WBcm) - reach(model, *shape_, turn_shape_.conjugate() * Vec3(-ground_.normal));
    if (std::abs(gap) > kTouching) refuse(fmt::format("is {:.3g} m off its plane at the start", gap));
    if (std::abs(start_.v_WBcm.dot(ground_.normal)) > kParallel) refuse("moves off its plane at the start");
    set_turning();
    const Vec3 slip = start_.v_WBcm - radius_ * start_.w_WB.cross(ground_.normal);
    slip_.emplace(slip, pull_, turning_ * ground_.friction * press_);
    if (shape_->type == ShapeType::kBox) check_pressure(slip);
    if (shape_->type == ShapeType::kCapsule || shape_->type == ShapeType::kCylinder) check_line(slip);
  }

  BodyState at(double seconds) const {
    const Slip slip = slip_->at(seconds);
    const Vec3 slip0 = slip_->at(0).u;
    const double rest = 1 - 1 / turning_;
    BodyState state = start_;
    const Vec3 way =
        start_.v_WBcm * seconds + pull_ * (rest * seconds * seconds / 2) + (slip.way - slip0 * seconds) / turning_;
    state.p_WBcm += way;
    state.v_WBcm += pull_ * (rest * seconds) + (slip.u - slip0) / turning_;
    if (turning_ > 1) {
      state.w_WB = spin(seconds);
      state.q_WB = orientation(seconds, way - slip.way);
    }
    if (turning_ == 1) state.v_WBcm = slip.u;  // without leftover rounding where it rests
    if (shape_->type == ShapeType::kBox) check_pressure(slip.u);
    return state;
  }

  std::optional<SolutionEvent> event() const {
    const double start = model_.initial.time, gain = slip_->gain();
    // of the point that touches, by value: events outlive this object
    const auto speed = [ground = ground_, radius = radius_, body = static_cast<size_t>(number_)](const State& state) {
      const BodyState& at = state.bodies[body];
      return ground.tangential(at.v_WBcm - radius * at.w_WB.cross(ground.normal)).norm();
    };
    if (gain > 0) {
      return SolutionEvent{start,
                           fmt::format("body '{}' begins to slip", body_.name),
                           {[speed](const State& state) { return -speed(state); }, -kBegins, start + kBegins / gain}};
    }
    const auto end = slip_->end();
    if (!end || *end == 0) return std::nullopt;
    const double level = kStopped * slip_->at(0).u.norm();
    return SolutionEvent{
        start + *end,
        fmt::format("body '{}' stops slipping", body_.name),
        {.number = speed, .level = level, .falls_at = start + slip_->falls_to(kStopped), .for_good = true}};
  }

  SolutionImpulse impulse(double end) const {
    return impulse_on(model_, {static_cast<size_t>(number_)}, ground_.normal, equal_marks(model_.initial.time, end),
                      fmt::format("of the plane on body '{}'", body_.name));
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    misfit(model_, kSlideAndRoll, fmt::format("body '{}' {}", body_.name, what));
  }

  void set_turning() {
    const Vec3& n = ground_.normal;
    if (shape_->type == ShapeType::kBox) {
      if (start_.w_WB.norm() > kParallel) refuse("turns at the start");
      const Vec3 n_S = turn_shape_.conjugate() * n;
      if (n_S.cwiseAbs().maxCoeff() < 1 - kParallel) refuse("does not lie on a face");
      return;
    }
    if (shape_->type != ShapeType::kSphere && shape_->type != ShapeType::kCapsule &&
        shape_->type != ShapeType::kCylinder) {
      refuse("is no box, sphere, capsule or cylinder");
    }
    radius_ = shape_->radius;
    Vec3 axis = turn_shape_ * Vec3::UnitZ();
    if (shape_->type == ShapeType::kSphere) {
      axis = n;
      const Mat3& inertia = body_.I_BBcm_B;
      if ((inertia - inertia.trace() / 3 * Mat3::Identity()).norm() > 1e-9 * inertia.norm()) {
        refuse("has an inertia that depends on the axis");
      }
    } else if (std::abs(axis.dot(n)) > kParallel) {
      refuse("does not lie on its plane");
    }
    turning_ = 1 + body_.mass * radius_ * radius_ / principal_inertia(model_, kSlideAndRoll, number_, axis);
  }

  // Lines touch: they slide and roll across themselves, or slide along themselves.
  void check_line(const Vec3& slip) {
    const Vec3 axis = turn_shape_ * Vec3::UnitZ();
    const double most = 1e-9;
    const bool across = std::abs(slip.dot(axis)) < most && std::abs(pull_.dot(axis)) < most &&
                        std::abs(start_.v_WBcm.dot(axis)) < most && start_.w_WB.cross(axis).norm() < most;
    const auto off = [&](const Vec3& v) { return (v - v.dot(axis) * axis).norm(); };
    const bool along = off(slip) < most && off(pull_) < most && start_.w_WB.norm() < most;
    if (across) return;
    if (!along) refuse("rolls and slides along its axis at once");
    turning_ = 1;
    slip_.emplace(slip, pull_, ground_.friction * press_);
  }

  Vec3 spin(double seconds) const {
    const Slip slip = slip_->at(seconds);
    const Vec3 v = start_.v_WBcm + pull_ * ((1 - 1 / turning_) * seconds) + (slip.u - slip_->at(0).u) / turning_;
    return ground_.normal.cross(v - slip.u) / radius_ + start_.w_WB.dot(ground_.normal) * ground_.normal;
  }

  // About one axis the rotation is the integral of the rate; else by Magnus' series of fourth order in short steps.
  Quat orientation(double seconds, const Vec3& rolled) const {
    const Vec3 whole =
        ground_.normal.cross(rolled) / radius_ + start_.w_WB.dot(ground_.normal) * seconds * ground_.normal;
    const Vec3 axis = turn_shape_ * Vec3::UnitZ();
    const bool line = shape_->type != ShapeType::kSphere;
    if (line && whole.cross(axis).norm() <= 1e-9) return turned(start_.q_WB, whole);
    constexpr double kStep = 1e-3;
    const double node = std::sqrt(3.0) / 6;
    Quat q = start_.q_WB;
    const auto turn = [&](double from, double to) {
      const int steps = std::max(1, static_cast<int>(std::ceil((to - from) / kStep)));
      const double h = (to - from) / steps;
      for (int i = 0; i < steps; ++i) {
        const Vec3 first = spin(from + h * (i + 0.5 - node)), second = spin(from + h * (i + 0.5 + node));
        q = turned(q, h / 2 * (first + second) - std::sqrt(3.0) / 12 * h * h * first.cross(second));
      }
    };
    const double stop = std::min(seconds, slip_->end().value_or(seconds));  // where the rate has a kink
    if (stop > 0) turn(0, stop);
    if (seconds > stop) turn(stop, seconds);
    return q;
  }

  // The face stays flat where the pressure's centre lies within it: ahead of the middle by height times the slope of
  // the force.
  void check_pressure(const Vec3& slip) const {
    const double height = ground_.height(start_.p_WBcm);
    const Vec3 force = slip.norm() > 0 ? Vec3(ground_.friction * slip.normalized()) : Vec3(pull_ / press_);
    const Vec3 centre = (turn_shape_.conjugate() * Vec3(height * force)).cwiseAbs();
    const Vec3 n = (turn_shape_.conjugate() * ground_.normal).cwiseAbs();
    for (int i = 0; i < 3; ++i) {
      if (n[i] < 0.5 && centre[i] > shape_->half_size[i]) refuse("tips over");
    }
  }

  const Model& model_;
  int number_;
  const Body& body_;
  BodyState start_;
  Ground ground_;
  Vec3 pull_;
  double press_;
  const Shape* shape_ = nullptr;
  Quat turn_shape_;
  double radius_ = 0, turning_ = 1;
  std::optional<SlipMotion> slip_;
};

}  // namespace

CertifiedMotion slide_and_roll(const Model& model, const std::vector<double>& times) {
  require_plain(model, kSlideAndRoll);
  std::vector<SlidingBody> bodies;
  for (size_t i = 0; i < model.bodies.size(); ++i) bodies.emplace_back(model, static_cast<int>(i));
  CertifiedMotion motion;
  for (const double time : times) {
    State state = model.initial;
    state.time = time;
    for (size_t i = 0; i < bodies.size(); ++i) state.bodies[i] = bodies[i].at(time - model.initial.time);
    motion.states.push_back(std::move(state));
  }
  if (times.empty()) return motion;
  for (const SlidingBody& body : bodies) {
    auto event = body.event();
    if (event && std::max(event->time, event->watch.falls_at) <= times.back())
      motion.events.push_back(*std::move(event));
    motion.impulses.push_back(body.impulse(times.back()));
  }
  std::ranges::stable_sort(motion.events, {}, &SolutionEvent::time);
  return motion;
}

}  // namespace assay::reference
