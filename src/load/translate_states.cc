// Keyframes, the initial state, and a last look at all numbers.
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "base/text.h"
#include "load/translator.h"
#include "model/couplings.h"
#include "model/kinematics.h"

namespace assay {

void Translator::translate_keyframes() {
  for (int k = 0; k < m_->nkey; ++k) {
    Keyframe key;
    key.name = keyframe_name(k);
    key.state = keyframe_state(k);
    key.control.reserve(actuator_of_.size());
    for (const int i : actuator_of_) key.control.push_back(row(m_->key_ctrl, m_->nu, k)[m_->actuator_ctrladr[i]]);
    model_.keyframes.push_back(std::move(key));
  }
  choose_initial_state();
  note_open_constraints();
}

std::string Translator::keyframe_name(int k) const {
  const std::string own = name(mjOBJ_KEY, k);
  return own.empty() ? fmt::format("key{}", k + 1) : own;
}

std::optional<int> Translator::initial_keyframe() const {
  if (load_.keyframe.empty()) return m_->nkey > 0 ? std::optional(0) : std::nullopt;
  for (int k = 0; k < m_->nkey; ++k) {
    if (keyframe_name(k) == load_.keyframe) return k;
  }
  const auto number = parse_integer(load_.keyframe);
  if (number && *number >= 0 && std::cmp_less(*number, m_->nkey)) return static_cast<int>(*number);
  return std::nullopt;
}

void Translator::choose_initial_state() {
  const auto chosen = static_cast<size_t>(initial_keyframe().value_or(0));
  if (!load_.keyframe.empty() && !initial_keyframe()) {
    std::vector<std::string> names;
    for (int k = 0; k < m_->nkey; ++k) names.push_back(keyframe_name(k));
    refuse(fmt::format("it has no keyframe '{}'{}", load_.keyframe, did_you_mean(load_.keyframe, names)),
           names.empty() ? "it has none, start without --keyframe"
                         : fmt::format("name one of its {}, or its number from 0", names.size()));
  }
  if (model_.keyframes.empty()) {
    model_.initial = reference_state(model_);
    if (has_sprung_free_) {  // their reference has the world's axes
      const std::vector<mjtNum> rest(static_cast<size_t>(m_->nv), 0);
      model_.initial = state_at(m_->qpos0, rest.data());
    }
    if (starts_mimics_) start_mimics();
    model_.control0.assign(model_.actuators.size(), 0.0);
  } else {
    model_.initial = model_.keyframes[chosen].state;
    model_.initial.time = 0;
    model_.control0 = model_.keyframes[chosen].control;
    for (size_t i = 0; i < actuator_of_.size(); ++i) {
      const int activation = m_->actuator_actadr[actuator_of_[i]];
      Actuator& actuator = model_.actuators[i];
      if (actuator.has_activation() && activation >= 0) {
        actuator.activation_start = row(m_->key_act, m_->na, chosen)[activation];
      }
    }
  }
}

// URDF and SDF have no initial positions, and zero does not satisfy a mimic joint with an offset: it starts where the
// joint that it mimics puts it.
void Translator::start_mimics() {
  std::vector<bool> settled(model_.joints.size(), true);
  for (int e = 0; e < m_->neq; ++e) {
    if (m_->eq_type[e] != mjEQ_JOINT) continue;
    const int body = body_of_joint_[m_->eq_obj1id[e]];
    if (body >= 0 && model_.bodies[body].joint >= 0) settled[static_cast<size_t>(model_.bodies[body].joint)] = false;
  }
  follow(model_, settled, model_.initial.position);
  bodies_from_joints(model_, model_.initial);
}

State Translator::keyframe_state(int k) const {
  State state = state_at(row(m_->key_qpos, m_->nq, k), row(m_->key_qvel, m_->nv, k));
  state.time = m_->key_time[k];
  return state;
}

State Translator::state_at(const mjtNum* qpos, const mjtNum* qvel) const {
  State state;
  state.bodies.resize(model_.bodies.size());
  state.position.resize(model_.joints.size());
  state.velocity.resize(model_.joints.size());
  std::vector<size_t> balls;
  for (size_t i = 0; i < model_.bodies.size(); ++i) {
    const Body& body = model_.bodies[i];
    const mjtNum* q = qpos + m_->jnt_qposadr[joint_of_[i]] + coordinate_of_[i];
    const mjtNum* v = qvel + m_->jnt_dofadr[joint_of_[i]] + coordinate_of_[i];
    if (body.joint >= 0) {
      state.position[body.joint] = q[0];
      state.velocity[body.joint] = v[0];
    } else if (body.ball >= 0) {
      balls.push_back(i);
    } else {
      // MuJoCo: velocity of the body frame's origin in world axes, angular velocity in body axes
      BodyState& s = state.bodies[i];
      s.q_WB = quat(q + 3);
      const Vec3 offset_W = s.q_WB * body.p_BBcm;
      s.p_WBcm = vec3(q) + offset_W;
      s.w_WB = s.q_WB * vec3(v + 3);
      s.v_WBcm = vec3(v) + s.w_WB.cross(offset_W);
    }
  }
  // a ball's coordinates are relative to its parent, in child axes; the state's are not. Parents come first.
  for (const size_t i : balls) {
    bodies_from_joints(model_, state);
    const Body& body = model_.bodies[i];
    const BodyState parent = body.parent == kWorld ? BodyState{} : state.bodies[body.parent];
    BodyState& s = state.bodies[i];
    s.q_WB = (parent.q_WB * body.X_PB.q * quat(qpos + m_->jnt_qposadr[joint_of_[i]] + coordinate_of_[i])).normalized();
    s.w_WB = parent.w_WB + s.q_WB * vec3(qvel + m_->jnt_dofadr[joint_of_[i]] + coordinate_of_[i]);
  }
  bodies_from_joints(model_, state);
  return state;
}

// Constraints that the initial state does not satisfy: engines pull them together at the start.
void Translator::note_open_constraints() {
  constexpr double kOpen = 1e-4;  // m or rad
  const State& state = model_.initial;
  std::vector<std::string> open;
  const auto look = [&](double gap, const std::string& element) {
    if (gap > kOpen) open.push_back(fmt::format("{} by {:.2g}", element, gap));
  };
  const auto pose = [&](int body) {
    return body == kWorld ? Pose{} : body_pose(model_.bodies[body], state.bodies[body]);
  };
  for (const Coupling& c : model_.couplings) {
    look(std::abs(state.position[c.joint] - c.offset - sum_of_terms(c.terms, state.position)),
         fmt::format("coupling '{}'", c.name));
  }
  for (const Connect& c : model_.connects) {
    look((pose(c.body_a) * c.p_A - pose(c.body_b) * c.p_B).norm(), fmt::format("connect '{}'", c.name));
  }
  for (const Weld& w : model_.welds) {
    const Pose wanted = pose(w.body_a) * w.X_AB, is = pose(w.body_b);
    look(std::max((wanted.p - is.p).norm(), wanted.q.angularDistance(is.q)), fmt::format("weld '{}'", w.name));
  }
  note_list("constraints are open in the initial state (m or rad), and engines pull them together", open);
}

void Translator::require_finite() {
  const auto demand = [&](bool finite, const std::string& what) {
    if (!finite) refuse(fmt::format("{} has a value that is not a finite number", what), "correct it");
  };
  const auto pose_finite = [](const Pose& X) { return X.p.allFinite() && X.q.coeffs().allFinite(); };
  const auto number_finite = [](double value) { return std::isfinite(value); };
  const auto finite = [&](std::initializer_list<double> values) { return std::ranges::all_of(values, number_finite); };
  const auto terms_finite = [&](const std::vector<JointTerm>& terms) {
    return std::ranges::all_of(terms, number_finite, &JointTerm::coefficient);
  };
  demand(model_.gravity.allFinite(), "gravity");
  for (const Body& b : model_.bodies) {
    demand(pose_finite(b.X_PB) && b.p_BBcm.allFinite() && b.I_BBcm_B.allFinite() && std::isfinite(b.mass),
           fmt::format("body '{}'", b.name));
  }
  for (const Joint& j : model_.joints) {
    demand(j.p_BJ.allFinite() && j.axis_B.allFinite() &&
               finite({j.reference, j.lower, j.upper, j.stiffness, j.spring_reference, j.damping, j.armature,
                       j.dry_friction}),
           fmt::format("joint '{}'", j.name));
  }
  for (const BallJoint& b : model_.balls) {
    demand(b.p_BJ.allFinite() && b.spring_reference.coeffs().allFinite() &&
               finite({b.upper, b.stiffness, b.damping, b.armature, b.dry_friction}),
           fmt::format("joint '{}'", b.name));
  }
  for (const Shape& s : model_.shapes) {
    demand(pose_finite(s.X_BS) && s.half_size.allFinite() && finite({s.radius, s.half_length, s.friction}),
           fmt::format("geom '{}'", s.name));
  }
  for (const Hull& h : model_.hulls) {
    demand(std::ranges::all_of(h.vertices, [](const Vec3& v) { return v.allFinite(); }),
           fmt::format("mesh '{}'", h.name));
  }
  for (const HeightField& h : model_.height_fields) {
    demand(finite({h.half_x, h.half_y, h.base}) && std::ranges::all_of(h.heights, number_finite),
           fmt::format("height field '{}'", h.name));
  }
  for (const Coupling& c : model_.couplings) {
    demand(std::isfinite(c.offset) && terms_finite(c.terms), fmt::format("equality '{}'", c.name));
  }
  for (const Connect& c : model_.connects) {
    demand(c.p_A.allFinite() && c.p_B.allFinite(), fmt::format("equality '{}'", c.name));
  }
  for (const Weld& w : model_.welds) demand(pose_finite(w.X_AB), fmt::format("equality '{}'", w.name));
  for (const Tendon& t : model_.tendons) {
    demand(terms_finite(t.terms) &&
               finite({t.stiffness, t.rest_lower, t.rest_upper, t.damping, t.lower, t.upper, t.dry_friction}),
           fmt::format("tendon '{}'", t.name));
  }
  for (const Actuator& a : model_.actuators) {
    demand(terms_finite(a.terms) && finite({a.gain, a.bias[0], a.bias[1], a.bias[2], a.control_lower, a.control_upper,
                                            a.force_lower, a.force_upper}),
           fmt::format("actuator '{}'", a.name));
  }
  for (const Keyframe& key : model_.keyframes) {
    const auto body_finite = [](const BodyState& s) {
      return s.p_WBcm.allFinite() && s.q_WB.coeffs().allFinite() && s.v_WBcm.allFinite() && s.w_WB.allFinite();
    };
    demand(std::ranges::all_of(key.state.bodies, body_finite) &&
               std::ranges::all_of(key.state.position, number_finite) &&
               std::ranges::all_of(key.state.velocity, number_finite) &&
               std::ranges::all_of(key.control, number_finite) && std::isfinite(key.state.time),
           fmt::format("keyframe '{}'", key.name));
  }
}

}  // namespace assay
