#include "model/massless.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "model/kinematics.h"

namespace assay {
namespace {

constexpr double kMostLent = 0.5;  // of a body's mass, to all its borrowers

// By body: where a massless one's chain leads to, in a branch to the heaviest body; -1 for bodies with mass.
std::vector<int> find_lenders(const Model& model) {
  std::vector<int> lender(model.bodies.size(), -1);
  for (int i = static_cast<int>(model.bodies.size()) - 1; i >= 0; --i) {  // children come before their parents
    const Body& body = model.bodies[i];
    const int candidate = body.is_massless() ? lender[i] : i;
    if (candidate < 0 || body.parent == kWorld || !model.bodies[body.parent].is_massless()) continue;
    int& best = lender[body.parent];
    if (best < 0 || model.bodies[candidate].mass >= model.bodies[best].mass) best = candidate;
  }
  return lender;
}

// The part of its inertia that a lender gives: more than `share` where armature of the borrower's hinge hides it, so
// that it changes what turns about the hinge by `share` still. Iterative solvers hold a light body between two
// armatures badly.
double inertia_share(const Model& model, const Body& borrower, const Mat3& I_lender, double share) {
  if (borrower.joint < 0) return share;
  const Joint& joint = model.joints[borrower.joint];
  if (joint.is_slide() || joint.armature <= 0) return share;
  const double inertia = joint.axis_B.dot(I_lender * joint.axis_B);
  return std::min(kLargestLentShare, share * (1 + joint.armature / inertia));
}

// Moves each borrower's state between its frame's origin and its centre of mass in the copy: `sign` 1 to the centre.
void shift_centres(const Lent& lent, State& state, double sign) {
  for (size_t i = 0; i < lent.lender.size(); ++i) {
    if (lent.lender[i] < 0) continue;
    BodyState& body = state.bodies[i];
    const Vec3 offset = sign * (body.q_WB * lent.model.bodies[i].p_BBcm);
    body.p_WBcm += offset;
    body.v_WBcm += body.w_WB.cross(offset);
  }
}

}  // namespace

void Lent::to_copy(State& state) const {
  if (any) shift_centres(*this, state, 1);
}

void Lent::to_original(State& state) const {
  if (any) shift_centres(*this, state, -1);
}

Lent lend_mass(Model original, double share) {
  assert(share > 0 && share <= kLargestLentShare);
  Lent lent{.model = std::move(original), .lender = {}, .inertia_kept = {}};
  lent.lender = find_lenders(lent.model);
  const std::vector<Body> bodies = lent.model.bodies;
  std::vector<int> borrowers(bodies.size(), 0);
  for (const int lender : lent.lender) {
    if (lender >= 0) ++borrowers[lender];
  }
  lent.any = std::ranges::any_of(borrowers, [](int count) { return count > 0; });
  lent.inertia_kept.assign(bodies.size(), 1);
  if (!lent.any) return lent;

  const State reference = reference_state(lent.model);
  std::vector<double> inertia_lent(bodies.size(), 0);
  for (size_t i = 0; i < bodies.size(); ++i) {
    if (lent.lender[i] < 0) continue;
    const Body& lender = bodies[lent.lender[i]];
    const double part = std::min(share, kMostLent / borrowers[lent.lender[i]]);
    Body& body = lent.model.bodies[i];
    const BodyState& frame = reference.bodies[i];
    const BodyState& centre = reference.bodies[lent.lender[i]];
    const Mat3 R = (frame.q_WB.conjugate() * centre.q_WB).toRotationMatrix();
    body.mass = part * lender.mass;
    body.p_BBcm = frame.q_WB.conjugate() * (centre.p_WBcm - frame.p_WBcm);
    const Mat3 I_lender = R * lender.I_BBcm_B * R.transpose();
    const double inertia_part =
        std::min(inertia_share(lent.model, body, I_lender, share), kMostLent / borrowers[lent.lender[i]]);
    body.I_BBcm_B = inertia_part * I_lender;
    inertia_lent[lent.lender[i]] += inertia_part;
  }
  for (size_t i = 0; i < bodies.size(); ++i) {
    if (borrowers[i] == 0) continue;
    const double kept = 1 - borrowers[i] * std::min(share, kMostLent / borrowers[i]);
    lent.model.bodies[i].mass *= kept;
    // as before where all shares are alike, to the last bit
    const bool alike = std::abs(inertia_lent[i] - (1 - kept)) < 1e-12;
    lent.inertia_kept[i] = alike ? kept : 1 - inertia_lent[i];
    lent.model.bodies[i].I_BBcm_B *= lent.inertia_kept[i];
  }
  if (!lent.model.initial.bodies.empty()) lent.to_copy(lent.model.initial);
  for (Keyframe& keyframe : lent.model.keyframes) lent.to_copy(keyframe.state);
  lent.model.hash = model_hash(lent.model);
  return lent;
}

}  // namespace assay
