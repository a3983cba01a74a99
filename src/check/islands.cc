#include "check/islands.h"

#include <algorithm>
#include <numeric>

namespace assay {
namespace {

// Bodies that belong together: a forest of parents.
class Union {
 public:
  explicit Union(size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0); }
  int root(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(int a, int b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<int> parent_;
};

void renumber(std::vector<JointTerm>& terms, const std::vector<int>& joint_of) {
  for (JointTerm& term : terms) term.joint = joint_of[term.joint];
}

}  // namespace

std::vector<Model> islands(const Model& model, const State& state) {
  Union together(model.bodies.size());
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    if (model.bodies[b].parent != kWorld) together.join(static_cast<int>(b), model.bodies[b].parent);
  }
  const auto body_of = [&](const JointTerm& term) { return model.joints[term.joint].body; };
  const auto join_terms = [&](const std::vector<JointTerm>& terms) {
    for (const JointTerm& term : terms) together.join(body_of(terms.front()), body_of(term));
  };
  for (const Coupling& coupling : model.couplings) {
    for (const JointTerm& term : coupling.terms) together.join(model.joints[coupling.joint].body, body_of(term));
  }
  for (const Tendon& tendon : model.tendons) join_terms(tendon.terms);
  for (const Actuator& actuator : model.actuators) join_terms(actuator.terms);

  std::vector<int> island_of(model.bodies.size(), -1), new_body(model.bodies.size()), new_joint(model.joints.size());
  std::vector<Model> found;
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    const int root = together.root(static_cast<int>(b));
    if (root == static_cast<int>(b)) {
      island_of[b] = static_cast<int>(found.size());
      found.emplace_back();
      found.back().gravity = model.gravity;
      found.back().initial.time = state.time;
    }
    island_of[b] = island_of[root];
    Model& island = found[island_of[b]];
    new_body[b] = static_cast<int>(island.bodies.size());
    island.bodies.push_back(model.bodies[b]);
    island.initial.bodies.push_back(state.bodies[b]);
    Body& body = island.bodies.back();
    if (body.parent != kWorld) body.parent = new_body[body.parent];
    if (body.joint >= 0) {
      new_joint[body.joint] = static_cast<int>(island.joints.size());
      island.joints.push_back(model.joints[body.joint]);
      island.joints.back().body = new_body[b];
      island.initial.position.push_back(state.position[body.joint]);
      island.initial.velocity.push_back(state.velocity[body.joint]);
      body.joint = new_joint[body.joint];
    }
    if (body.ball >= 0) {
      island.balls.push_back(model.balls[body.ball]);
      island.balls.back().body = new_body[b];
      body.ball = static_cast<int>(island.balls.size()) - 1;
    }
  }
  const auto island_with = [&](int joint) -> Model& { return found[island_of[model.joints[joint].body]]; };
  for (Coupling coupling : model.couplings) {
    Model& island = island_with(coupling.joint);
    coupling.joint = new_joint[coupling.joint];
    renumber(coupling.terms, new_joint);
    island.couplings.push_back(std::move(coupling));
  }
  const auto share_out = [&](const auto& all, auto member) {
    for (auto each : all) {
      if (each.terms.empty()) continue;
      Model& island = island_with(each.terms.front().joint);
      renumber(each.terms, new_joint);
      (island.*member).push_back(std::move(each));
    }
  };
  share_out(model.tendons, &Model::tendons);
  share_out(model.actuators, &Model::actuators);
  return found;
}

}  // namespace assay
