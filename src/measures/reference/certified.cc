#include "measures/reference/certified.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <boost/math/tools/toms748_solve.hpp>
#include <boost/numeric/odeint.hpp>
#include <fmt/format.h>

#include "base/errors.h"
#include "measures/reference/certified_parts.h"
#include "model/kinematics.h"
#include "model/shape.h"

namespace assay {

const std::vector<CertifiedSolution>& certified_solutions() {
  static const std::vector<CertifiedSolution> list = {
      {"slide-and-roll",
       "free boxes, spheres, lying cylinders and capsules, each on a plane of its own, level or not: they slide, stop, "
       "or begin to roll",
       reference::slide_and_roll},
      {"dry-joints",
       "bodies with one hinge or slide each to the world, with dry friction, springs, dampers, limits, and a gravity "
       "that does not depend on the position",
       reference::dry_joints},
      {"ball-row", "free spheres on a line, without gravity, that meet one after the other", reference::ball_row},
      {"rod-strike", "a free capsule without gravity whose ends strike a plane, sticking or slipping",
       reference::rod_strike},
      {"tipping-box", "a free box that turns about one of its edges on a plane, until it lands",
       reference::tipping_box},
      {"rimless-wheel", "a free body with feet around it, capsules along its axis, that rolls over them down a plane",
       reference::rimless_wheel},
      {"box-stack", "free boxes that lie on one another and on a level plane, at rest", reference::box_stack},
      {"two-finger-grip",
       "a free box between two boxes on slides, which springs press against it: it is held, or slips",
       reference::two_finger_grip}};
  return list;
}

const CertifiedSolution* find_certified_solution(std::string_view name) {
  const auto& list = certified_solutions();
  const auto found = std::ranges::find(list, name, &CertifiedSolution::name);
  return found == list.end() ? nullptr : &*found;
}

namespace reference {

void misfit(const Model& model, std::string_view solution, const std::string& why) {
  throw InputError(fmt::format("model '{}' has no solution '{}': {}", model.name, solution, why));
}

void require_plain(const Model& model, std::string_view solution, bool joints) {
  if (!model.tendons.empty()) misfit(model, solution, "it has tendons");
  if (!model.couplings.empty() || !model.connects.empty() || !model.welds.empty()) {
    misfit(model, solution, "it has equality constraints");
  }
  if (!model.balls.empty()) misfit(model, solution, "it has ball joints");
  for (const Joint& joint : model.joints) {
    if (joints) continue;
    misfit(model, solution, fmt::format("joint '{}' is no free joint", joint.name));
  }
  for (const ContactPair& pair : model.contacts) {
    if (pair.torsional > 0 || pair.rolling > 0) {
      misfit(model, solution, "contacts have torsional or rolling friction (condim 4 or 6): give condim 3");
    }
  }
}

std::vector<const Shape*> shapes_of(const Model& model, int body) {
  std::vector<const Shape*> found;
  for (const Shape& shape : model.shapes) {
    if (shape.body == body && shape.collides) found.push_back(&shape);
  }
  return found;
}

Ground ground_of(const Model& model, std::string_view solution, int body) {
  const std::string& name = model.bodies[static_cast<size_t>(body)].name;
  const Shape* plane = nullptr;
  double friction = -1;
  for (const ContactPair& pair : model.contacts) {
    const Shape* a = &model.shapes[static_cast<size_t>(pair.shape_a)];
    const Shape* b = &model.shapes[static_cast<size_t>(pair.shape_b)];
    if (b->body != body) std::swap(a, b);
    if (b->body != body) continue;
    if (!is_plane(*a)) misfit(model, solution, fmt::format("body '{}' may touch something else than a plane", name));
    if (plane != nullptr && (plane != a || friction != pair.friction)) {
      misfit(model, solution, fmt::format("body '{}' may touch two planes, or has two coefficients of friction", name));
    }
    plane = a;
    friction = pair.friction;
  }
  if (plane == nullptr) misfit(model, solution, fmt::format("body '{}' has no contact pair with a plane", name));
  return {plane->X_BS.q * Vec3::UnitZ(), plane->X_BS.p, friction};
}

double principal_inertia(const Model& model, std::string_view solution, int number, const Vec3& axis_W) {
  const Body& body = model.bodies[static_cast<size_t>(number)];
  const Vec3 axis = model.initial.bodies[static_cast<size_t>(number)].q_WB.conjugate() * axis_W;
  const Vec3 momentum = body.I_BBcm_B * axis;
  const double inertia = axis.dot(momentum);
  if ((momentum - inertia * axis).norm() > 1e-6 * body.I_BBcm_B.norm()) {
    misfit(model, solution, fmt::format("the axis about which body '{}' turns is no principal axis of it", body.name));
  }
  return inertia;
}

Quat turned(const Quat& q, const Vec3& turn_W) {
  const double angle = turn_W.norm();
  if (angle == 0) return q;
  return (Quat(Eigen::AngleAxisd(angle, turn_W / angle)) * q).normalized();
}

State completed(const Model& model, State state) {
  joints_from_bodies(model, state);
  return state;
}

double zero_between(const std::function<double(double)>& f, double a, double b) {
  const double at_a = f(a), at_b = f(b);
  if (at_a == 0) return a;
  if (at_b == 0) return b;
  std::uintmax_t most = 200;
  const auto found = boost::math::tools::toms748_solve(
      f, a, b, at_a, at_b, boost::math::tools::eps_tolerance<double>(std::numeric_limits<double>::digits - 1), most);
  return (found.first + found.second) / 2;
}

std::vector<double> equal_marks(double start, double end) {
  constexpr int kParts = 10;
  std::vector<double> marks;
  for (int i = 0; i <= kParts; ++i) marks.push_back(start + (end - start) * i / kParts);
  return marks;
}

std::vector<double> marks_between(double start, const std::vector<double>& impacts, double end) {
  std::vector<double> marks = {start};
  for (size_t i = 0; i + 1 < impacts.size(); ++i) marks.push_back((impacts[i] + impacts[i + 1]) / 2);
  marks.push_back(end);
  return marks;
}

SolutionImpulse impulse_on(const Model& model, std::vector<size_t> bodies, const Vec3& normal,
                           std::vector<double> marks, std::string what) {
  std::vector<double> masses;
  double mass = 0;
  for (const size_t body : bodies) {
    masses.push_back(model.bodies[body].mass);
    mass += masses.back();
  }
  const auto momentum = [bodies = std::move(bodies), masses](const State& state) {
    Vec3 sum = Vec3::Zero();
    for (size_t i = 0; i < bodies.size(); ++i) sum += masses[i] * state.bodies[bodies[i]].v_WBcm;
    return sum;
  };
  const auto weight = [force = Vec3(mass * model.gravity)](const State& /*state*/) { return force; };
  return {std::move(what), momentum, weight, normal, std::move(marks)};
}

TurnMotion::TurnMotion(Turn start, double time, std::function<double(double, double)> acceleration)
    : turn_(start), time_(time), acceleration_(std::move(acceleration)) {}

Turn TurnMotion::after(double seconds) const {
  namespace odeint = boost::numeric::odeint;
  using Pair = std::array<double, 2>;
  constexpr double kTolerance = 1e-14;
  Pair y = {turn_.angle, turn_.rate};
  if (seconds <= 0) return turn_;
  odeint::integrate_adaptive(
      odeint::bulirsch_stoer<Pair>(kTolerance, kTolerance),
      [this](const Pair& at, Pair& slope, double) { slope = {at[1], acceleration_(at[0], at[1])}; }, y, 0.0, seconds,
      std::min(seconds, 1e-3));
  return {y[0], y[1]};
}

bool TurnMotion::go(double time, const std::function<double(const Turn&)>& event) {
  // Small enough that an event is not passed and met again within one.
  constexpr double kStep = 2e-3;
  while (time_ < time) {
    const double step = std::min(kStep, time - time_);
    const Turn next = after(step);
    if (event(next) <= 0) {
      const double seconds = event(turn_) <= 0 ? 0 : zero_between([&](double s) { return event(after(s)); }, 0, step);
      turn_ = after(seconds);
      time_ += seconds;
      return true;
    }
    turn_ = next;
    time_ = step < kStep ? time : time_ + step;
  }
  return false;
}

}  // namespace reference
}  // namespace assay
