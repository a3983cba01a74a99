#include "measures/plausible.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "measures/mechanics.h"
#include "measures/violation.h"
#include "model/joint.h"
#include "model/kinematics.h"
#include "model/shape.h"

namespace assay {
namespace {

constexpr double kReachFactor = 1000;
constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kLeast = std::numeric_limits<float>::min();  // of what has to be positive

bool is_finite(const BodyState& body) {
  return body.p_WBcm.allFinite() && body.q_WB.coeffs().allFinite() && body.v_WBcm.allFinite() && body.w_WB.allFinite();
}

// Whether the body, or one that carries it, is free or slides: then no chain holds it back.
bool travels(const Model& model, size_t body) {
  for (int b = static_cast<int>(body); b != kWorld; b = model.bodies[static_cast<size_t>(b)].parent) {
    const Body& each = model.bodies[static_cast<size_t>(b)];
    if (each.is_free() || slides(model, each)) return true;
  }
  return false;
}

// The root mean square distance of the body's mass from its centre, m. 0 for a massless body.
double radius_of_gyration(const Body& body) {
  return body.mass > 0 ? std::sqrt(body.I_BBcm_B.trace() / (2 * body.mass)) : 0;
}

Pose parent_pose(const Model& model, const State& state, int parent) {
  if (parent == kWorld) return {};
  return body_pose(model.bodies[static_cast<size_t>(parent)], state.bodies[static_cast<size_t>(parent)]);
}

// How far the start is off the constraints between bodies and the limits of slides, m.
double start_gap(const Model& model, const State& start) {
  double gap = 0;
  for (const Connect& connect : model.connects) {
    gap = std::max(gap, (parent_pose(model, start, connect.body_a) * connect.p_A -
                         parent_pose(model, start, connect.body_b) * connect.p_B)
                            .norm());
  }
  for (const Weld& weld : model.welds) {
    const Pose wanted = parent_pose(model, start, weld.body_a) * weld.X_AB;
    gap = std::max(gap, (wanted.p - parent_pose(model, start, weld.body_b).p).norm());
  }
  each_joint(model, [&](const auto& joint) {
    if (is_slide(joint)) gap = std::max(gap, beyond_limit(model, start, joint));
  });
  return gap;
}

// The same of angles, and of couplings, rad.
double start_turn(const Model& model, const State& start) {
  double turn = 0;
  for (const Weld& weld : model.welds) {
    const Quat wanted = parent_pose(model, start, weld.body_a).q * weld.X_AB.q;
    turn = std::max(turn, rotation_vector(wanted.conjugate() * parent_pose(model, start, weld.body_b).q).norm());
  }
  for (const Coupling& coupling : model.couplings) {
    const double wanted = coupling.offset + sum_of_terms(coupling.terms, start.position);
    turn = std::max(turn, std::abs(start.position[static_cast<size_t>(coupling.joint)] - wanted));
  }
  each_joint(model, [&](const auto& joint) {
    if (!is_slide(joint)) turn = std::max(turn, beyond_limit(model, start, joint));
  });
  return turn;
}

// Energy of the springs in a state, J.
double spring_energy(const Model& model, const State& state) {
  double energy = 0;
  each_joint(model, [&](const auto& joint) { energy += spring_energy(model, state, joint); });
  for (const Tendon& tendon : model.tendons) {
    const double length = sum_of_terms(tendon.terms, state.position);
    const double stretch = length - std::clamp(length, tendon.rest_lower, tendon.rest_upper);
    energy += 0.5 * tendon.stiffness * stretch * stretch;
  }
  return energy;
}

// Largest distance of a body of a jointed tree from the root's anchor: the length of its stretched chain.
std::vector<double> stretched(const Model& model) {
  std::vector<double> far(model.bodies.size(), 0), at_frame(model.bodies.size(), 0);
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    if (body.is_free()) {
      far[i] = body.p_BBcm.norm();
      continue;
    }
    const Vec3& anchor = anchor_of(model, body);
    if (body.parent != kWorld) {
      const auto parent = static_cast<size_t>(body.parent);
      at_frame[i] = at_frame[parent] + (body.X_PB * anchor).norm();
    }
    far[i] = at_frame[i] + (body.p_BBcm - anchor).norm();
    at_frame[i] += anchor.norm();
  }
  return far;
}

}  // namespace

Plausibility::Plausibility(const Model& model, const State& start, double duration_s, double work,
                           const Arithmetic& arithmetic)
    : model_(model), available_energy_(kinetic_energy(model, start) + work) {
  const double g = model.gravity.norm();
  const double fall = 0.5 * g * duration_s * duration_s;
  const std::vector<double> far = stretched(model);

  // Lowest possible height of a body's centre: the ground that a shape collides with, the end of its chain, or the end
  // of a free fall.
  double ground = -std::numeric_limits<double>::infinity();
  const Vec3 up = g > 0 ? Vec3(-model.gravity / g) : Vec3::UnitZ();
  for (const ContactPair& pair : model.contacts) {
    for (const int index : {pair.shape_a, pair.shape_b}) {
      const Shape& shape = model.shapes[static_cast<size_t>(index)];
      if (!is_plane(shape)) continue;
      if ((shape.X_BS.q * Vec3::UnitZ()).dot(up) > 0.999) ground = std::max(ground, shape.X_BS.p.dot(up));
    }
  }

  double extent = 0, fastest = 0, travelling = 0;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const BodyState& state = start.bodies[i];
    extent = std::max(extent, state.p_WBcm.norm() + far[i]);
    fastest = std::max(fastest, state.v_WBcm.norm());
    const double height = state.p_WBcm.dot(up);
    double drop = 2 * far[i];
    if (travels(model, i)) {
      drop = state.v_WBcm.norm() * duration_s + fall;
      travelling += body.mass;
    }
    if (std::isfinite(ground)) drop = std::min(drop, std::max(0.0, height - ground));
    available_energy_ += body.mass * g * drop;
  }
  available_energy_ += spring_energy(model, start);
  find_size(far);
  find_rest(start, far, arithmetic);
  // What travels may be driven.
  if (travelling > 0 && std::isfinite(available_energy_))
    fastest = std::max(fastest, std::sqrt(2 * available_energy_ / travelling));
  reach_ = kReachFactor * (std::max(extent, size_) + fastest * duration_s + fall);
}

void Plausibility::find_size(const std::vector<double>& far) {
  double longest = 0;
  const auto connects = [&](int index, const Vec3& anchor_B) {
    if (index == kWorld) return;
    const Body& body = model_.bodies[static_cast<size_t>(index)];
    size_ = std::max({size_, (body.p_BBcm - anchor_B).norm(), radius_of_gyration(body)});
  };
  for (size_t i = 0; i < model_.bodies.size(); ++i) {
    const Body& body = model_.bodies[i];
    longest = std::max(longest, far[i]);
    if (body.is_free()) continue;
    const Vec3& anchor = anchor_of(model_, body);
    connects(static_cast<int>(i), anchor);
    connects(body.parent, body.X_PB * anchor);
  }
  length_ = longest;
  double travel = 0;
  for (const Joint& joint : model_.joints) {
    if (joint.is_slide() && joint.limited) travel = std::max(travel, joint.upper - joint.lower);
  }
  size_ = std::max(size_, kSizeShare * (longest + travel));
  if (size_ > 0) return;
  // no joint connects bodies with mass
  for (const Body& body : model_.bodies) size_ = std::max(size_, radius_of_gyration(body));
  size_ = std::max(size_, kLeast);
}

void Plausibility::find_rest(const State& start, const std::vector<double>& far, const Arithmetic& arithmetic) {
  // Iterative solvers leave more than the rounding of doubles.
  constexpr double kDouble = 1e-9;
  constexpr double kRoundings = 4;  // of a step
  // Engines correct what the start violates within this time, and at once what is as small as a file's last digit.
  constexpr double kCorrection = 0.01;  // s
  constexpr double kDigit = 1e-4;       // of the size, rad
  unit_ = arithmetic.single_precision ? std::numeric_limits<float>::epsilon() : kDouble;
  const double step = std::max(arithmetic.timestep_s, kLeast);
  const double gap = start_gap(model_, start), off = start_turn(model_, start);
  const double turn = (kRoundings * unit_ + std::min(off, kDigit)) / step + off / kCorrection;  // rad/s
  const double correction = std::min(gap, kDigit * size_) / step + gap / kCorrection;           // m/s
  for (size_t i = 0; i < model_.bodies.size(); ++i) {
    const Body& body = model_.bodies[i];
    const double extent = start.bodies[i].p_WBcm.norm() + far[i] + size_;
    const double speed = kRoundings * unit_ * extent / step + correction + turn * (far[i] + size_);
    rest_energy_ += 0.5 * body.mass * speed * speed + 0.5 * body.I_BBcm_B.trace() * turn * turn;
    rest_energy_ += 0.5 * armature_of(model_, body) * (slides(model_, body) ? speed * speed : 3 * turn * turn);
  }
}

std::string Plausibility::divergence(const State& state) const {
  for (size_t i = 0; i < state.bodies.size(); ++i) {
    if (!is_finite(state.bodies[i])) return fmt::format("body '{}' has a non-finite state", model_.bodies[i].name);
    if (state.bodies[i].p_WBcm.norm() > reach_) {
      return fmt::format("body '{}' is {:.3g} m away", model_.bodies[i].name, state.bodies[i].p_WBcm.norm());
    }
  }
  return "";
}

std::string Plausibility::impossibility(const State& state) const {
  const double energy = kinetic_energy(model_, state);
  const double most = available_energy_ + rest_energy_;
  if (energy > kEnergyFactor * most) {
    return fmt::format("kinetic energy {:.3g} J where at most {:.3g} J are available", energy, most);
  }
  if (std::string why = torn(state); !why.empty()) return why;
  return below_ground(state);
}

std::string Plausibility::torn(const State& state) const {
  std::string why;
  each_joint(model_, [&](const auto& joint) {
    if (!why.empty()) return;
    const JointError error = joint_error(model_, state, joint);
    if (const double gap = error.apart_W.norm(); gap > size_ + rounding(error.p_WJ_child)) {
      why = fmt::format("{} '{}' is {:.3g} m apart", type_name(joint), joint.name, gap);
    } else if (const double beyond = beyond_limit(model_, state, joint); !is_slide(joint) && beyond > kTurn) {
      why = fmt::format("{} '{}' is {:.3g} rad beyond its limit", type_name(joint), joint.name, beyond);
    }
  });
  return why;
}

std::string Plausibility::below_ground(const State& state) const {
  for (const ContactPair& pair : model_.contacts) {
    const Shape& a = model_.shapes[static_cast<size_t>(pair.shape_a)];
    const Shape& b = model_.shapes[static_cast<size_t>(pair.shape_b)];
    if (!is_plane(a) && !is_plane(b)) continue;
    const Shape& plane = is_plane(a) ? a : b;
    const Shape& other = &plane == &a ? b : a;
    if (other.body == kWorld) continue;
    const Body& body = model_.bodies[static_cast<size_t>(other.body)];
    const Vec3 normal = plane.X_BS.q * Vec3::UnitZ();
    const Pose X_WS = body_pose(body, state.bodies[static_cast<size_t>(other.body)]) * other.X_BS;
    const double top = normal.dot(X_WS.p - plane.X_BS.p) + assay::reach(model_, other, X_WS.q.conjugate() * normal);
    const double allowed = kGroundShare * std::max(size_, length_) + rounding(X_WS.p);
    if (std::isfinite(top) && top < -allowed) {
      return fmt::format("a shape of body '{}' {}, by {:.3g} m", body.name, kBelowGround, -top);
    }
  }
  return "";
}

}  // namespace assay
