#include "measures/mechanics.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "model/joint.h"

namespace assay {
namespace {

Mat3 inertia_in_world(const Body& body, const BodyState& state) {
  const Mat3 R_WB = state.q_WB.toRotationMatrix();
  return R_WB * body.I_BBcm_B * R_WB.transpose();
}

// Contact pairs of two moving shapes are internal forces; one with the world is not.
bool touches_world(const Model& model) {
  return std::ranges::any_of(model.contacts, [&](const ContactPair& pair) {
    return model.shapes[static_cast<size_t>(pair.shape_a)].body == kWorld ||
           model.shapes[static_cast<size_t>(pair.shape_b)].body == kWorld;
  });
}

// Whether a connect or a weld holds a body at the world.
bool is_held(const Model& model) {
  const auto at_world = [](const auto& constraint) {
    return constraint.body_a == kWorld || constraint.body_b == kWorld;
  };
  return std::ranges::any_of(model.connects, at_world) || std::ranges::any_of(model.welds, at_world);
}

std::optional<double> ratio(double deviation, double scale) {
  if (!(scale > 0)) return std::nullopt;
  return deviation / scale;
}

}  // namespace

double kinetic_energy(const Model& model, const State& state) {
  assert(state.bodies.size() == model.bodies.size());
  double energy = 0;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const BodyState& body = state.bodies[i];
    energy += 0.5 * model.bodies[i].mass * body.v_WBcm.squaredNorm();
    energy += 0.5 * body.w_WB.dot(inertia_in_world(model.bodies[i], body) * body.w_WB);
  }
  each_joint(model, [&](const auto& joint) { energy += armature_energy(model, state, joint); });
  return energy;
}

double potential_energy(const Model& model, const State& state) {
  assert(state.bodies.size() == model.bodies.size());
  double energy = 0;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    energy -= model.bodies[i].mass * model.gravity.dot(state.bodies[i].p_WBcm);
  }
  each_joint(model, [&](const auto& joint) { energy += spring_energy(model, state, joint); });
  for (const Tendon& tendon : model.tendons) {
    if (tendon.stiffness == 0) continue;
    const double length = sum_of_terms(tendon.terms, state.position);
    const double stretch = length - std::clamp(length, tendon.rest_lower, tendon.rest_upper);
    energy += 0.5 * tendon.stiffness * stretch * stretch;
  }
  return energy;
}

Vec3 linear_momentum(const Model& model, const State& state) {
  Vec3 momentum = Vec3::Zero();
  for (size_t i = 0; i < model.bodies.size(); ++i) momentum += model.bodies[i].mass * state.bodies[i].v_WBcm;
  return momentum;
}

Vec3 angular_momentum(const Model& model, const State& state, const Vec3& p_Wo) {
  Vec3 momentum = Vec3::Zero();
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    const BodyState& body = state.bodies[i];
    momentum += (body.p_WBcm - p_Wo).cross(model.bodies[i].mass * body.v_WBcm);
    momentum += inertia_in_world(model.bodies[i], body) * body.w_WB;
  }
  return momentum;
}

Conserved conserved_quantities(const Model& model, bool driven) {
  Conserved conserved;
  // damping or dry friction
  const auto loses_energy = [](const auto& element) { return element.damping != 0 || element.dry_friction != 0; };
  const auto has_limit = [](const auto& element) { return element.limited; };
  const bool damped = any_joint(model, loses_energy) || std::ranges::any_of(model.tendons, loses_energy);
  const bool limited = any_joint(model, has_limit) || std::ranges::any_of(model.tendons, has_limit);
  conserved.energy = model.contacts.empty() && !damped && !limited && !driven;

  const bool weightless = model.gravity.isZero(0);
  const bool on_ground = touches_world(model) || is_held(model);
  int roots = 0, hinged_root = -1;
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    if (model.bodies[i].parent != kWorld) continue;
    ++roots;
    if (!model.bodies[i].is_free()) hinged_root = static_cast<int>(i);
  }
  if (weightless && !on_ground && hinged_root < 0) {
    conserved.linear_momentum = conserved.angular_momentum = true;
  }
  // The world exerts no moment about the axis of a tree's only hinge, unless that hinge has a spring, a damper, a limit
  // or armature.
  const Joint* root_hinge = hinged_root < 0 ? nullptr : hinge_of(model, model.bodies[static_cast<size_t>(hinged_root)]);
  const bool other_forces = !model.couplings.empty() || !model.tendons.empty();
  if (root_hinge != nullptr && !other_forces && roots == 1 && !on_ground && !driven) {
    const Body& root = model.bodies[static_cast<size_t>(hinged_root)];
    const Joint& hinge = *root_hinge;
    const bool free_turning = !hinge.has_spring() && !hinge.limited && hinge.armature == 0 && hinge.dry_friction == 0;
    Conserved::Axis axis{root.X_PB * hinge.p_BJ, root.X_PB.q * hinge.axis_B};
    const bool gravity_along_axis = model.gravity.cross(axis.axis_W).norm() <= 1e-12 * model.gravity.norm();
    if (free_turning && gravity_along_axis) conserved.angular_momentum_axis = axis;
  }
  return conserved;
}

namespace {

// The component of each vector along the direction of their least-squares slope over time.
std::vector<double> along_slope(const std::vector<State>& states, const std::vector<Vec3>& vectors) {
  double mean_time = 0;
  for (const State& state : states) mean_time += state.time / static_cast<double>(states.size());
  Vec3 slope = Vec3::Zero();
  for (size_t i = 0; i < states.size(); ++i) slope += (states[i].time - mean_time) * vectors[i];
  const double length = slope.norm();
  const Vec3 direction = length > 0 ? Vec3(slope / length) : Vec3::UnitX();
  std::vector<double> along;
  along.reserve(vectors.size());
  for (const Vec3& each : vectors) along.push_back(each.dot(direction));
  return along;
}

double largest_size(const std::vector<double>& deviations) {
  double largest = 0;
  for (const double each : deviations) largest = std::max(largest, std::abs(each));
  return largest;
}

double largest_length(const std::vector<Vec3>& vectors) {
  double largest = 0;
  for (const Vec3& each : vectors) largest = std::max(largest, each.norm());
  return largest;
}

}  // namespace

Drift drift(const Model& model, const Conserved& conserved, const std::vector<State>& states) {
  assert(!states.empty());
  Drift result;
  const State& start = states.front();
  const auto vectors = [&](const auto& quantity) {
    const Vec3 first = quantity(start);
    std::vector<Vec3> changes;
    changes.reserve(states.size());
    for (const State& state : states) changes.push_back(quantity(state) - first);
    return changes;
  };
  if (conserved.energy) {
    const double energy0 = kinetic_energy(model, start) + potential_energy(model, start);
    std::vector<double> changes;
    changes.reserve(states.size());
    for (const State& state : states) {
      changes.push_back(kinetic_energy(model, state) + potential_energy(model, state) - energy0);
    }
    const double largest = largest_size(changes);
    result.quantities.push_back(
        {"energy", "J", largest, ratio(largest, kinetic_energy(model, start)), std::move(changes)});
  }
  if (conserved.linear_momentum) {
    const std::vector<Vec3> changes = vectors([&](const State& state) { return linear_momentum(model, state); });
    double scale = 0;
    for (size_t i = 0; i < model.bodies.size(); ++i) scale += model.bodies[i].mass * start.bodies[i].v_WBcm.norm();
    const double largest = largest_length(changes);
    result.quantities.push_back(
        {"linear_momentum", "kg m/s", largest, ratio(largest, scale), along_slope(states, changes)});
  }
  if (conserved.angular_momentum || conserved.angular_momentum_axis) {
    const Vec3 about = conserved.angular_momentum_axis ? conserved.angular_momentum_axis->p_Wo : Vec3::Zero();
    const std::vector<Vec3> changes =
        vectors([&](const State& state) { return angular_momentum(model, state, about); });
    double scale = 0;
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      const BodyState& body = start.bodies[i];
      scale += model.bodies[i].mass * (body.p_WBcm - about).norm() * body.v_WBcm.norm() +
               (inertia_in_world(model.bodies[i], body) * body.w_WB).norm();
    }
    std::vector<double> along;
    double largest = 0;
    if (conserved.angular_momentum_axis) {
      for (const Vec3& each : changes) along.push_back(each.dot(conserved.angular_momentum_axis->axis_W));
      largest = largest_size(along);
    } else {
      along = along_slope(states, changes);
      largest = largest_length(changes);
    }
    result.quantities.push_back({"angular_momentum", "kg m^2/s", largest, ratio(largest, scale), std::move(along)});
  }
  return result;
}

}  // namespace assay
