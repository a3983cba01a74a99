// B with A's values.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "check/pairing/drafts.h"
#include "check/pairing/match_trees.h"
#include "model/kinematics.h"

namespace assay::pairing {
namespace {

// What of an actuator is a law and not a name.
void take_law(const Actuator& from, bool reversed, Actuator& to) {
  const std::string name = to.name;
  std::vector<JointTerm> terms = to.terms;
  for (JointTerm& term : terms) {
    if (from.terms.size() == 1 && terms.size() == 1) term.coefficient = from.terms[0].coefficient;
  }
  to = from;
  to.name = name, to.terms = terms;
  if (!reversed) return;
  to.bias[0] = -from.bias[0];
  to.force_lower = -from.force_upper, to.force_upper = -from.force_lower;
  to.control_lower = -from.control_upper, to.control_upper = -from.control_lower;
}

template <typename SomeJoint>
void take_numbers(const SomeJoint& from, SomeJoint& to) {
  to.damping = from.damping, to.dry_friction = from.dry_friction, to.armature = from.armature;
  to.stiffness = from.stiffness, to.limited = from.limited;
}

}  // namespace

Model agreed(const Side& side_a, const Side& side_b, const Options& options) {
  Comparison unused;
  const Trees trees = match_trees(side_a, side_b, options, unused);
  const Model& a = trees.a.model;
  Model b = trees.whole_b;
  std::map<int, int> a_of_joint;  // by B's joint
  const auto place_of = [&](int locked_a) {
    return locked_a == kWorld ? trees.placement.X_world : trees.placement.X_AB[static_cast<size_t>(locked_a)];
  };
  for (const BodyMatch& match : trees.matches) {
    const int i = trees.a.index[static_cast<size_t>(match.a)], j = trees.b.index[static_cast<size_t>(match.b)];
    const Body& from = a.bodies[static_cast<size_t>(i)];
    Body& to = b.bodies[static_cast<size_t>(match.b)];
    const Pose X_BA = place_of(i).inverse();
    const bool reversed = trees.placement.reversed[static_cast<size_t>(i)];
    // a body that stands for others as well, which are locked here, keeps its own mass
    if (!trees.a.absorbed[static_cast<size_t>(i)] && !trees.b.absorbed[static_cast<size_t>(j)] && to.mass > 0 &&
        from.mass > 0) {
      const Mat3 R = X_BA.q.toRotationMatrix();
      to.mass = from.mass;
      to.p_BBcm = X_BA * from.p_BBcm;
      to.I_BBcm_B = R * from.I_BBcm_B * R.transpose();
    }
    const Body& locked_b = trees.b.model.bodies[static_cast<size_t>(j)];
    const bool same_parent =
        to.parent == kWorld
            ? locked_b.parent == kWorld
            : trees.b.index[static_cast<size_t>(to.parent)] == locked_b.parent &&
                  std::ranges::any_of(trees.matches, [&](const BodyMatch& m) { return m.b == to.parent; });
    if (same_parent && !from.is_free()) to.X_PB = place_of(from.parent).inverse() * from.X_PB * place_of(i);
    if (from.joint >= 0) {
      const Joint& joint_a = a.joints[static_cast<size_t>(from.joint)];
      Joint& joint_b = b.joints[static_cast<size_t>(to.joint)];
      take_numbers(joint_a, joint_b);
      joint_b.p_BJ = X_BA * joint_a.p_BJ;
      joint_b.axis_B = (reversed ? -1.0 : 1.0) * (X_BA.q * joint_a.axis_B);
      joint_b.lower = reversed ? -joint_a.upper : joint_a.lower,
      joint_b.upper = reversed ? -joint_a.lower : joint_a.upper;
      joint_b.spring_reference = (reversed ? -1 : 1) * joint_a.spring_reference;
      a_of_joint[to.joint] = from.joint;
    } else if (from.ball >= 0) {
      const BallJoint& ball_a = a.balls[static_cast<size_t>(from.ball)];
      BallJoint& ball_b = b.balls[static_cast<size_t>(to.ball)];
      take_numbers(ball_a, ball_b);
      ball_b.upper = ball_a.upper;
      ball_b.p_BJ = X_BA * ball_a.p_BJ;
    }
  }
  if (side_a.format.drives && side_b.format.drives) {
    // matched under A's joints, put into B's own
    Model renamed = b;
    for (Actuator& actuator : renamed.actuators) {
      for (JointTerm& term : actuator.terms)
        term.joint = a_of_joint.contains(term.joint) ? a_of_joint.at(term.joint) : -1 - term.joint;
    }
    const std::vector<int> b_of = match_actuators(a, renamed, options.map);
    for (size_t k = 0; k < b_of.size(); ++k) {
      if (b_of[k] < 0) continue;
      Actuator& to = b.actuators[static_cast<size_t>(b_of[k])];
      bool reversed = false;
      for (const BodyMatch& match : trees.matches) {
        const Body& body = trees.whole_b.bodies[static_cast<size_t>(match.b)];
        if (to.terms.size() == 1 && body.joint == to.terms[0].joint) {
          reversed = trees.placement.reversed[static_cast<size_t>(trees.a.index[static_cast<size_t>(match.a)])];
        }
      }
      take_law(a.actuators[k], reversed, to);
    }
  }
  // friction of pairs of bodies that have one coefficient in A
  if (side_a.format.contact_friction) {
    std::map<std::pair<int, int>, std::set<double>> of_a;
    for (const ContactPair& pair : a.contacts) {
      of_a[std::minmax(a.shapes[static_cast<size_t>(pair.shape_a)].body,
                       a.shapes[static_cast<size_t>(pair.shape_b)].body)]
          .insert(pair.friction);
    }
    std::map<int, int> a_of_body = {{kWorld, kWorld}};
    for (const BodyMatch& match : trees.matches) a_of_body[match.b] = trees.a.index[static_cast<size_t>(match.a)];
    for (ContactPair& pair : b.contacts) {
      const auto first = a_of_body.find(b.shapes[static_cast<size_t>(pair.shape_a)].body),
                 second = a_of_body.find(b.shapes[static_cast<size_t>(pair.shape_b)].body);
      if (first == a_of_body.end() || second == a_of_body.end()) continue;
      const auto found = of_a.find(std::minmax(first->second, second->second));
      if (found != of_a.end() && found->second.size() == 1) pair.friction = *found->second.begin();
    }
  }
  State state = b.initial;
  bodies_from_joints(b, state);
  b.initial = state;
  b.keyframes.clear();
  b.hash = model_hash(b);
  return b;
}

}  // namespace assay::pairing
