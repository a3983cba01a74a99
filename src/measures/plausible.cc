#include "measures/plausible.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "measures/mechanics.h"
#include "measures/violation.h"
#include "model/extent.h"
#include "model/kinematics.h"

namespace assay {
namespace {

constexpr double kReachFactor = 1000;
constexpr double kTurn = 2 * std::numbers::pi;

bool is_finite(const BodyState& body) {
  return body.p_WBcm.allFinite() && body.q_WB.coeffs().allFinite() && body.v_WBcm.allFinite() && body.w_WB.allFinite();
}

// The anchor of a body's joint in its own frame.
const Vec3& anchor_of(const Model& model, const Body& body) {
  return body.ball >= 0 ? model.balls[static_cast<size_t>(body.ball)].p_BJ
                        : model.joints[static_cast<size_t>(body.joint)].p_BJ;
}

// Whether the body, or one that carries it, is free or slides: then no chain holds it back.
bool travels(const Model& model, size_t body) {
  for (int b = static_cast<int>(body); b != kWorld; b = model.bodies[static_cast<size_t>(b)].parent) {
    const Body& each = model.bodies[static_cast<size_t>(b)];
    if (each.is_free() || (each.joint >= 0 && model.joints[static_cast<size_t>(each.joint)].is_slide())) return true;
  }
  return false;
}

// Energy of the springs in a state, J.
double spring_energy(const Model& model, const State& state) {
  double energy = 0;
  const auto add = [&](double stiffness, double stretch) { energy += 0.5 * stiffness * stretch * stretch; };
  for (size_t j = 0; j < model.joints.size(); ++j) {
    add(model.joints[j].stiffness, state.position[j] - model.joints[j].spring_reference);
  }
  for (const BallJoint& ball : model.balls) {
    const Body& body = model.bodies[static_cast<size_t>(ball.body)];
    const Quat q_WP =
        body.parent == kWorld ? Quat(Quat::Identity()) : state.bodies[static_cast<size_t>(body.parent)].q_WB;
    const Quat rotation = (q_WP * body.X_PB.q).conjugate() * state.bodies[static_cast<size_t>(ball.body)].q_WB;
    add(ball.stiffness, rotation_vector(ball.spring_reference.conjugate() * rotation).norm());
  }
  for (const Tendon& tendon : model.tendons) {
    const double length = sum_of_terms(tendon.terms, state.position);
    add(tendon.stiffness, length - std::clamp(length, tendon.rest_lower, tendon.rest_upper));
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

Plausibility::Plausibility(const Model& model, const State& start, double duration_s, double work)
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
      if (shape.type != ShapeType::kPlane) continue;
      if ((shape.X_BS.q * Vec3::UnitZ()).dot(up) > 0.999) ground = std::max(ground, shape.X_BS.p.dot(up));
    }
  }

  double extent = 0, fastest = 0;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    const BodyState& state = start.bodies[i];
    extent = std::max(extent, state.p_WBcm.norm() + far[i]);
    fastest = std::max(fastest, state.v_WBcm.norm());
    const double height = state.p_WBcm.dot(up);
    double drop = travels(model, i) ? state.v_WBcm.norm() * duration_s + fall : 2 * far[i];
    if (std::isfinite(ground)) drop = std::min(drop, std::max(0.0, height - ground));
    available_energy_ += body.mass * g * drop;
  }
  available_energy_ += spring_energy(model, start);
  for (size_t j = 0; j < model.joints.size(); ++j) {
    const Joint& hinge = model.joints[j];
    const auto child = static_cast<size_t>(hinge.body);
    size_ = std::max(size_, (model.bodies[child].p_BBcm - hinge.p_BJ).norm());
    if (const int parent = model.bodies[child].parent; parent != kWorld) {
      const Vec3 anchor = anchor_in_parent(model, static_cast<int>(j));
      size_ = std::max(size_, (model.bodies[static_cast<size_t>(parent)].p_BBcm - anchor).norm());
    }
  }
  reach_ = kReachFactor * (std::max(extent, 1e-3) + fastest * duration_s + fall);
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
  if (energy > kEnergyFactor * available_energy_) {
    return fmt::format("kinetic energy {:.3g} J where at most {:.3g} J are available", energy, available_energy_);
  }
  for (size_t j = 0; j < model_.joints.size(); ++j) {
    const JointFrames frames = joint_frames(model_, state, static_cast<int>(j));
    Vec3 apart = frames.p_WJ_child - frames.p_WJ_parent;
    const bool is_slide = model_.joints[j].is_slide();
    if (is_slide) apart -= apart.dot(frames.axis_W_parent) * frames.axis_W_parent;
    if (const double gap = apart.norm(); gap > size_) {
      return fmt::format("{} '{}' is {:.3g} m apart", is_slide ? "slide" : "hinge", model_.joints[j].name, gap);
    }
    if (is_slide || !model_.joints[j].limited) continue;
    const double q = state.position[j];
    if (const double beyond = std::max(model_.joints[j].lower - q, q - model_.joints[j].upper); beyond > kTurn) {
      return fmt::format("hinge '{}' is {:.3g} rad beyond its limit", model_.joints[j].name, beyond);
    }
  }
  for (const ContactPair& pair : model_.contacts) {
    const Shape& a = model_.shapes[static_cast<size_t>(pair.shape_a)];
    const Shape& b = model_.shapes[static_cast<size_t>(pair.shape_b)];
    if (a.type != ShapeType::kPlane && b.type != ShapeType::kPlane) continue;
    const Shape& plane = a.type == ShapeType::kPlane ? a : b;
    const Shape& other = &plane == &a ? b : a;
    if (other.body == kWorld) continue;
    const auto body = static_cast<size_t>(other.body);
    const Vec3 normal = plane.X_BS.q * Vec3::UnitZ();
    const Pose X_WS = body_pose(model_.bodies[body], state.bodies[body]) * other.X_BS;
    const double top = normal.dot(X_WS.p - plane.X_BS.p) + assay::reach(model_, other, X_WS.q.conjugate() * normal);
    if (std::isfinite(top) && top < 0) {
      return fmt::format("a shape of body '{}' lies wholly below the ground, by {:.3g} m", model_.bodies[body].name,
                         -top);
    }
  }
  return "";
}

}  // namespace assay
