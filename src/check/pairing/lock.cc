// A model with some of its joints held.
#include <algorithm>
#include <optional>

#include "check/pairing/match.h"
#include "load/inertia.h"
#include "model/joint.h"
#include "model/kinematics.h"

namespace assay::pairing {
namespace {

constexpr int kGone = -2;

// Drops the terms of joints that are gone; their positions are 0.
void keep_terms(std::vector<JointTerm>& terms, const std::vector<int>& joint_of) {
  std::vector<JointTerm> kept;
  for (JointTerm term : terms) {
    term.joint = joint_of[static_cast<size_t>(term.joint)];
    if (term.joint >= 0) kept.push_back(term);
  }
  terms = std::move(kept);
}

class Fusion {
 public:
  Fusion(const Model& old, const std::set<int>& held) : old_(old), held_(held) {}

  Locked result() {
    bodies();
    joints();
    shapes();
    constraints();
    actuators();
    states();
    out_.model.hash = model_hash(out_.model);
    return std::move(out_);
  }

 private:
  int host(int old_body) const { return old_body == kWorld ? kWorld : out_.index[static_cast<size_t>(old_body)]; }
  Pose pose(int old_body) const { return old_body == kWorld ? Pose() : X_HB_[static_cast<size_t>(old_body)]; }

  bool carries_kept(int body) const {
    for (size_t i = 0; i < old_.bodies.size(); ++i) {
      const auto other = static_cast<int>(i);
      if (other != body && !held_.contains(other) && is_descendant(old_, other, body)) return true;
    }
    return false;
  }

  void bodies() {
    Model& model = out_.model;
    model = old_;
    model.bodies.clear();
    for (size_t i = 0; i < old_.bodies.size(); ++i) {
      Body body = old_.bodies[i];
      const auto old_index = static_cast<int>(i);
      if (host(body.parent) == kGone) {
        out_.index.push_back(kGone);
        X_HB_.emplace_back();
        continue;
      }
      body.X_PB = pose(body.parent) * body.X_PB;
      body.parent = host(body.parent);
      if (!held_.contains(old_index)) {
        out_.index.push_back(static_cast<int>(model.bodies.size()));
        X_HB_.emplace_back();
        model.bodies.push_back(body);
        out_.absorbed.push_back(false);
        continue;
      }
      if (body.is_free() && !carries_kept(old_index)) {
        out_.index.push_back(kGone);
        X_HB_.emplace_back();
        continue;
      }
      out_.index.push_back(body.parent);
      X_HB_.push_back(body.X_PB);
      if (body.parent == kWorld) continue;
      Body& into = model.bodies[static_cast<size_t>(body.parent)];
      const Mat3 R = body.X_PB.q.toRotationMatrix();
      const RigidPart whole = joined({into.mass, into.p_BBcm, into.mass > 0 ? into.I_BBcm_B : Mat3(Mat3::Zero())},
                                     {body.mass, body.X_PB * body.p_BBcm,
                                      body.mass > 0 ? Mat3(R * body.I_BBcm_B * R.transpose()) : Mat3(Mat3::Zero())});
      into.mass = whole.mass, into.p_BBcm = whole.p, into.I_BBcm_B = whole.I;
      out_.absorbed[static_cast<size_t>(body.parent)] = true;
    }
  }

  void joints() {
    Model& model = out_.model;
    model.joints.clear(), model.balls.clear();
    joint_of_.assign(old_.joints.size(), -1);
    for (size_t i = 0; i < old_.bodies.size(); ++i) {
      const auto old_index = static_cast<int>(i);
      if (held_.contains(old_index) || out_.index[i] < 0) continue;
      Body& body = model.bodies[static_cast<size_t>(out_.index[i])];
      if (body.joint >= 0) {
        joint_of_[static_cast<size_t>(body.joint)] = static_cast<int>(model.joints.size());
        model.joints.push_back(old_.joints[static_cast<size_t>(body.joint)]);
        model.joints.back().body = out_.index[i];
        body.joint = static_cast<int>(model.joints.size()) - 1;
      } else if (body.ball >= 0) {
        model.balls.push_back(old_.balls[static_cast<size_t>(body.ball)]);
        model.balls.back().body = out_.index[i];
        body.ball = static_cast<int>(model.balls.size()) - 1;
      }
    }
  }

  void shapes() {
    Model& model = out_.model;
    model.shapes.clear(), model.contacts.clear();
    std::vector<int> shape_of;
    for (Shape shape : old_.shapes) {
      const int body = host(shape.body);
      shape_of.push_back(body == kGone ? -1 : static_cast<int>(model.shapes.size()));
      if (body == kGone) continue;
      shape.X_BS = pose(shape.body) * shape.X_BS;
      shape.body = body;
      model.shapes.push_back(shape);
    }
    for (ContactPair pair : old_.contacts) {
      pair.shape_a = shape_of[static_cast<size_t>(pair.shape_a)];
      pair.shape_b = shape_of[static_cast<size_t>(pair.shape_b)];
      if (pair.shape_a < 0 || pair.shape_b < 0) continue;
      if (model.shapes[static_cast<size_t>(pair.shape_a)].body ==
          model.shapes[static_cast<size_t>(pair.shape_b)].body) {
        continue;
      }
      model.contacts.push_back(pair);
    }
  }

  // False where the two are one body now.
  bool move(int& body, Vec3& point) const {
    const int old_body = body;
    body = host(old_body);
    if (body == kGone) return false;
    point = pose(old_body) * point;
    return true;
  }

  void constraints() {
    Model& model = out_.model;
    std::erase_if(model.couplings, [&](Coupling& coupling) {
      coupling.joint = joint_of_[static_cast<size_t>(coupling.joint)];
      keep_terms(coupling.terms, joint_of_);
      return coupling.joint < 0;
    });
    std::erase_if(model.tendons,
                  [&](Tendon& tendon) { return keep_terms(tendon.terms, joint_of_), tendon.terms.empty(); });
    std::erase_if(model.connects,
                  [&](Connect& c) { return !move(c.body_a, c.p_A) || !move(c.body_b, c.p_B) || c.body_a == c.body_b; });
    std::erase_if(model.welds, [&](Weld& weld) {
      const Pose X_HA = pose(weld.body_a), X_HB = pose(weld.body_b);
      weld.body_a = host(weld.body_a), weld.body_b = host(weld.body_b);
      weld.X_AB = X_HA * weld.X_AB * X_HB.inverse();
      return weld.body_a == kGone || weld.body_b == kGone || weld.body_a == weld.body_b;
    });
  }

  void actuators() {
    Model& model = out_.model;
    model.actuators.clear(), model.control0.clear();
    for (size_t i = 0; i < old_.actuators.size(); ++i) {
      Actuator actuator = old_.actuators[i];
      keep_terms(actuator.terms, joint_of_);
      if (actuator.terms.empty()) continue;
      model.actuators.push_back(actuator);
      model.control0.push_back(i < old_.control0.size() ? old_.control0[i] : 0);
    }
  }

  void states() {
    Model& model = out_.model;
    model.keyframes.clear();
    State& state = model.initial;
    state = reference_state(model);
    state.time = old_.initial.time;
    for (size_t j = 0; j < joint_of_.size(); ++j) {
      if (joint_of_[j] < 0) continue;
      state.position[static_cast<size_t>(joint_of_[j])] = old_.initial.position[j];
      state.velocity[static_cast<size_t>(joint_of_[j])] = old_.initial.velocity[j];
    }
    for (size_t i = 0; i < old_.bodies.size(); ++i) {
      if (!held_.contains(static_cast<int>(i)) && out_.index[i] >= 0) {
        const auto now = static_cast<size_t>(out_.index[i]);
        const BodyState& before = old_.initial.bodies[i];
        const Vec3 p_WB = body_pose(old_.bodies[i], before).p;
        state.bodies[now] = before;
        state.bodies[now].p_WBcm = p_WB + before.q_WB * model.bodies[now].p_BBcm;
      }
    }
    bodies_from_joints(model, state);
  }

  const Model& old_;
  const std::set<int>& held_;
  Locked out_;
  std::vector<Pose> X_HB_;     // by old body: its pose in the body that it is part of now
  std::vector<int> joint_of_;  // by old joint; -1 where it is gone
};

}  // namespace

bool is_descendant(const Model& model, int body, int of) {
  while (body != of && body != kWorld) body = model.bodies[static_cast<size_t>(body)].parent;
  return body == of;
}

Locked locked(const Model& model, const std::set<int>& bodies) { return Fusion(model, bodies).result(); }

}  // namespace assay::pairing
