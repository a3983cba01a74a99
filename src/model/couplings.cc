#include "model/couplings.h"

#include <algorithm>
#include <optional>

namespace assay {
namespace {

template <typename Visit>
void for_each_joint(const Coupling& coupling, Visit&& visit) {
  visit(coupling.joint);
  for (const JointTerm& term : coupling.terms) visit(term.joint);
}

// The only one that is not settled; nothing where there are none or several.
std::optional<int> only_open_joint(const Coupling& coupling, const std::vector<bool>& settled) {
  std::optional<int> open;
  int count = 0;
  for_each_joint(coupling, [&](int joint) {
    if (settled[static_cast<size_t>(joint)]) return;
    open = joint;
    ++count;
  });
  return count == 1 ? open : std::nullopt;
}

// set(coupling, joint) for each joint that settled ones determine.
template <typename Set>
void settle(const Model& model, std::vector<bool>& settled, Set&& set) {
  for (bool found = true; found;) {
    found = false;
    for (const Coupling& coupling : model.couplings) {
      const std::optional<int> joint = only_open_joint(coupling, settled);
      if (!joint) continue;
      set(coupling, *joint);
      settled[static_cast<size_t>(*joint)] = true;
      found = true;
    }
  }
}

// 0 = offset + sum of the terms - value of its joint, solved for `joint`.
double solved_for(const Coupling& coupling, int joint, double offset, const std::vector<double>& values) {
  double rest = offset;
  double own = 0;
  const auto add = [&](int of, double coefficient) {
    if (of == joint) {
      own += coefficient;
    } else {
      rest += coefficient * values[static_cast<size_t>(of)];
    }
  };
  add(coupling.joint, -1);
  for (const JointTerm& term : coupling.terms) add(term.joint, term.coefficient);
  return -rest / own;
}

void settle_values(const Model& model, bool offsets, std::vector<bool>& settled, std::vector<double>& values) {
  settle(model, settled, [&](const Coupling& coupling, int joint) {
    values[static_cast<size_t>(joint)] = solved_for(coupling, joint, offsets ? coupling.offset : 0, values);
  });
}

}  // namespace

std::vector<bool> leaders(const Model& model) {
  std::vector<bool> solved(model.joints.size()), settled(model.joints.size()), leads(model.joints.size());
  for (const Coupling& coupling : model.couplings) solved[static_cast<size_t>(coupling.joint)] = true;
  const auto settle_all = [&] { settle(model, settled, [](const Coupling&, int) {}); };
  settle_all();  // those that are held at a position
  for (const bool any : {false, true}) {
    for (const Coupling& coupling : model.couplings) {
      for (const JointTerm& term : coupling.terms) {
        const auto joint = static_cast<size_t>(term.joint);
        if (settled[joint] || (solved[joint] && !any)) continue;
        settled[joint] = leads[joint] = true;
        settle_all();
      }
    }
  }
  return leads;
}

void follow(const Model& model, std::vector<bool>& settled, std::vector<double>& positions) {
  settle_values(model, true, settled, positions);
}

void follow_leaders(const Model& model, std::vector<double>& positions) {
  std::vector<bool> settled = leaders(model);
  settle_values(model, true, settled, positions);
}

void velocities_follow_leaders(const Model& model, std::vector<double>& velocities) {
  std::vector<bool> settled = leaders(model);
  settle_values(model, false, settled, velocities);
}

}  // namespace assay
