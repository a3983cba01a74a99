// A hinge or slide with dry friction F, spring, damper and limits: M x'' = G - k (x - x0) - c x' - F sign(x'), in
// closed form between the moments at which it turns, rests or meets a limit. A limit stops it without rebound.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "measures/reference/certified_parts.h"
#include "measures/reference/closed_form.h"
#include "model/kinematics.h"

namespace assay::reference {
namespace {

constexpr const char* kDryJoints = "dry-joints";
constexpr double kNever = std::numeric_limits<double>::infinity();

class DryJoint {
 public:
  DryJoint(const Model& model, int number)
      : joint_(model.joints[static_cast<size_t>(number)]),
        number_(static_cast<size_t>(number)),
        time_(model.initial.time) {
    const Body& body = model.bodies[static_cast<size_t>(joint_.body)];
    const BodyState& state = model.initial.bodies[static_cast<size_t>(joint_.body)];
    const Vec3 axis = state.q_WB * joint_.axis_B;
    if (body.parent != kWorld) {
      misfit(model, kDryJoints, fmt::format("joint '{}' is not between its body and the world", joint_.name));
    }
    if (joint_.is_slide()) {
      mass_ = body.mass + joint_.armature;
      gravity_ = body.mass * model.gravity.dot(axis);
    } else {
      const Vec3 arm_B = body.p_BBcm - joint_.p_BJ;
      mass_ = joint_.axis_B.dot(body.I_BBcm_B * joint_.axis_B) + body.mass * joint_.axis_B.cross(arm_B).squaredNorm() +
              joint_.armature;
      const bool beside = joint_.axis_B.cross(arm_B).norm() > 1e-9 * arm_B.norm();
      const Vec3 across = model.gravity - model.gravity.dot(axis) * axis;
      if (beside && across.norm() > kParallel * model.gravity.norm()) {
        misfit(model, kDryJoints,
               fmt::format("gravity's torque on joint '{}' depends on its position: put the axis along gravity or "
                           "through the centre of mass",
                           joint_.name));
      }
    }
    motion_ = {model.initial.position[static_cast<size_t>(number)],
               model.initial.velocity[static_cast<size_t>(number)]};
    if (joint_.limited && (motion_.position < joint_.lower || motion_.position > joint_.upper)) {
      misfit(model, kDryJoints, fmt::format("joint '{}' starts beyond its limit", joint_.name));
    }
  }

  // Its motion at `time`, not before that of the last call.
  Motion at(double time, std::vector<SolutionEvent>& events) {
    while (true) {
      if (!phase_) begin_phase();
      if (time_ + phase_->length > time) break;
      const Phase ended = *phase_;
      const Motion end = within(ended.length);
      const EventWatch rest = ended.stop ? EventWatch() : standstill();
      EventWatch watch = slowing(ended.way, ended.stop ? std::abs(end.velocity) / 2 : 0);
      time_ += ended.length;
      motion_ = {ended.stop ? *ended.stop : end.position, 0};
      begin_phase();
      const char* what = "turns";
      if (ended.stop) {
        what = "meets its limit";
        watch.place = [way = ended.way, joint = number_](const State& state) { return way * state.position[joint]; };
        arrivals_.push_back(time_);
      } else if (phase_->rests) {
        what = "comes to rest";
        watch = rest;
      }
      events.push_back({time_, fmt::format("joint '{}' {}", joint_.name, what), std::move(watch)});
    }
    return within(time - time_);
  }

  // What its limits or its dry friction give it: the first is normal, the second tangential. Nothing where it has both,
  // which the balance of momentum cannot tell apart, or neither.
  std::optional<SolutionImpulse> impulse(double start, double end) const {
    const bool dry = joint_.dry_friction > 0;
    if (dry == joint_.limited) return std::nullopt;
    const Vec3 along = dry ? Vec3::UnitY() : Vec3::UnitX();
    const auto momentum = [along, mass = mass_, joint = number_](const State& state) {
      return Vec3(mass * state.velocity[joint] * along);
    };
    const auto force = [along, gravity = gravity_, joint = joint_, number = number_](const State& state) {
      return Vec3((gravity + spring_torque(joint, state.position[number], state.velocity[number])) * along);
    };
    return SolutionImpulse{fmt::format("of the {} of joint '{}'", dry ? "friction" : "limits", joint_.name), momentum,
                           force, Vec3::UnitX(), dry ? equal_marks(start, end) : marks_between(start, arrivals_, end)};
  }

 private:
  struct Phase {
    double way = 0;              // 1 or -1, the sign of its velocity
    double force = 0;            // constant part, friction included
    double length = kNever;      // s
    std::optional<double> stop;  // the limit at its end
    bool rests = false;
  };

  // The velocity along `way` falls to the level at the end of the phase.
  EventWatch slowing(double way, double level) const {
    return {.number = [way, joint = number_](const State& state) { return way * state.velocity[joint]; },
            .level = level,
            .falls_at = time_ + phase_->length,
            .chain = static_cast<int>(number_)};
  }

  // The speed falls to a part of the phase's largest.
  EventWatch standstill() const {
    constexpr int kMoments = 256;
    double largest = 0, at = 0;
    for (int i = 0; i < kMoments; ++i) {
      const double moment = phase_->length * i / kMoments, speed = std::abs(within(moment).velocity);
      if (speed > largest) largest = speed, at = moment;
    }
    const double level = kStopped * largest;
    if (level == 0) return {};
    const auto above = [&](double moment) { return std::abs(within(moment).velocity) - level; };
    return {.number = [joint = number_](const State& state) { return std::abs(state.velocity[joint]); },
            .level = level,
            .falls_at = time_ + zero_between(above, at, phase_->length),
            .for_good = true};
  }

  void begin_phase() {
    const double net = gravity_ - joint_.stiffness * (motion_.position - joint_.spring_reference);
    const bool moves = motion_.velocity != 0;
    double way = moves ? motion_.velocity : net;
    const bool held = joint_.limited &&
                      ((way > 0 && motion_.position >= joint_.upper) || (way < 0 && motion_.position <= joint_.lower));
    if (held && moves) {
      motion_.velocity = 0;
      return begin_phase();
    }
    Phase phase;
    if (held || (!moves && std::abs(net) <= joint_.dry_friction)) {
      phase.rests = true;
      phase_ = phase;
      return;
    }
    way = way > 0 ? 1 : -1;
    phase.way = way;
    phase.force = gravity_ - way * joint_.dry_friction;
    phase_ = phase;
    phase_->length = turning_time(way);
    if (!joint_.limited) return;
    const double limit = way > 0 ? joint_.upper : joint_.lower;
    const auto left = [&](double t) { return way * (limit - within(t).position); };
    double far = phase_->length;
    if (!std::isfinite(far)) {
      // the way goes on without end, or to a place where it would rest
      far = 1e-3;
      while (left(far) > 0 && far < 1e6) far *= 2;
    }
    if (left(far) > 0) return;
    phase_->length = zero_between(left, 0, far);
    phase_->stop = limit;
  }

  // The first moment at which the velocity is zero after the start of the phase.
  double turning_time(double way) const {
    const double k = joint_.stiffness, c = joint_.damping, v = motion_.velocity;
    if (k == 0 && c == 0) return v == 0 || phase_->force * way >= 0 ? kNever : -v * mass_ / phase_->force;
    if (k == 0) {
      const double last = phase_->force / c;
      return v == 0 || last * way >= 0 ? kNever : mass_ / c * std::log((v - last) / -last);
    }
    const double decay = c / (2 * mass_), natural2 = k / mass_, y = motion_.position - middle();
    const double gap = natural2 - decay * decay, slope = decay * v + natural2 * y;
    if (gap > 0) {
      const double w = std::sqrt(gap);
      double angle = std::atan2(v * w, slope);
      if (angle <= 0) angle += M_PI;
      return (v == 0 ? M_PI : angle) / w;
    }
    if (v == 0) return kNever;
    if (gap < 0) {
      const double w = std::sqrt(-gap), ratio = v * w / slope;
      return ratio > 0 && ratio < 1 ? std::atanh(ratio) / w : kNever;
    }
    const double time = v / slope;
    return time > 0 ? time : kNever;
  }

  double middle() const { return joint_.spring_reference + phase_->force / joint_.stiffness; }

  Motion within(double t) const {
    if (phase_->rests || t == 0) return motion_;
    if (joint_.stiffness == 0 && joint_.damping == 0) return uniform_acceleration(motion_, phase_->force / mass_, t);
    if (joint_.stiffness == 0) {
      const double last = phase_->force / joint_.damping, rate = joint_.damping / mass_;
      const double off = motion_.velocity - last;
      return {motion_.position + last * t - off / rate * std::expm1(-rate * t), last + off * std::exp(-rate * t)};
    }
    Motion motion =
        damped_oscillator(mass_, joint_.stiffness, joint_.damping, {motion_.position - middle(), motion_.velocity}, t);
    motion.position += middle();
    return motion;
  }

  const Joint& joint_;
  size_t number_;
  std::vector<double> arrivals_;  // at limits
  double time_, mass_ = 0, gravity_ = 0;
  Motion motion_;  // at time_
  std::optional<Phase> phase_;
};

}  // namespace

CertifiedMotion dry_joints(const Model& model, const std::vector<double>& times) {
  require_plain(model, kDryJoints, true);
  if (!model.contacts.empty()) misfit(model, kDryJoints, "it has contact pairs: exclude them");
  if (model.joints.size() != model.bodies.size()) misfit(model, kDryJoints, "a body has no hinge or slide");
  std::vector<DryJoint> joints;
  for (size_t i = 0; i < model.joints.size(); ++i) joints.emplace_back(model, static_cast<int>(i));
  CertifiedMotion motion;
  for (const double time : times) {
    State state = model.initial;
    state.time = time;
    for (size_t i = 0; i < joints.size(); ++i) {
      const Motion found = joints[i].at(time, motion.events);
      state.position[i] = found.position;
      state.velocity[i] = found.velocity;
    }
    bodies_from_joints(model, state);
    motion.states.push_back(std::move(state));
  }
  std::ranges::stable_sort(motion.events, {}, &SolutionEvent::time);
  if (times.empty()) return motion;
  for (const DryJoint& joint : joints) {
    if (auto impulse = joint.impulse(model.initial.time, times.back())) motion.impulses.push_back(*std::move(impulse));
  }
  return motion;
}

}  // namespace assay::reference
