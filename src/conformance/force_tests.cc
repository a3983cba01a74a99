// Contact forces that an engine gives, against what they do to momenta.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "conformance/models.h"
#include "conformance/tests.h"

namespace assay::conformance {
namespace {

constexpr double kMass = 2, kForceFriction = 0.4, kForceTimestep = 1e-3;
constexpr double kSize = 0.1;  // m, radius of balls and half of a box's edge

// What the contacts on one body add up to, in the world: N s, and Nm s about its centre of mass.
struct Sum {
  Vec3 push = Vec3::Zero(), turn = Vec3::Zero();
};

// A run whose contacts are read in every step.
class Reading {
 public:
  Reading(const Subject& subject, const Model& model, const State& start)
      : model_(model),
        simulation_(subject.create(model, start, kForceTimestep)),
        kept_(simulation_->keep_contacts()),
        start_(start),
        state_(start) {}

  bool kept() const { return kept_; }
  const State& state() const { return state_; }

  // Takes steps, adds what contacts do in them to `sums`, by body, and looks at each contact.
  void advance(int steps, std::vector<Sum>& sums) {
    sums.resize(model_.bodies.size());
    std::vector<ContactForce> contacts;
    for (int step = 0; step < steps; ++step) {
      simulation_->advance(1);
      simulation_->read_contacts(contacts);
      for (const ContactForce& contact : contacts) {
        look_at(contact);
        for (const auto& [shape, sign] : {std::pair(contact.shape_a, -1.0), std::pair(contact.shape_b, 1.0)}) {
          const int body = model_.shapes[shape].body;
          if (body == kWorld) continue;
          sums[body].push += sign * contact.impulse_W;
          sums[body].turn += sign * (contact.p_W - state_.bodies[body].p_WBcm).cross(contact.impulse_W);
        }
      }
      simulation_->read_state(state_);
      ordered_ = ordered_ && std::ranges::all_of(contacts, [](const ContactForce& c) { return c.shape_a < c.shape_b; });
    }
  }

  // What no contact may have, as parts of the momentum of 1 m/s.
  void check(Checks& checks, bool with_friction) const {
    checks.add(ordered_ ? 0 : 1, 0.5, "contacts whose shapes are not in order");
    checks.add(pull_ / kMass, 1e-3, "largest pull along a normal, or deviation of its length from 1");
    checks.add(gap_ / kSize, 0.005, "gap of a ball or box to the plane against its height, relative to its size");
    if (!with_friction) checks.add(across_ / kMass, 1e-6, "largest impulse across a normal, which is declared as none");
  }

  // Numbers that reading contacts has changed.
  double changed(const Subject& subject, double duration) const {
    return differing_bits(state_, subject.run(model_, start_, kForceTimestep, duration));
  }

 private:
  void look_at(const ContactForce& contact) {
    const double normal = contact.n_W.dot(contact.impulse_W);
    pull_ = std::max({pull_, -normal, std::abs(contact.n_W.norm() - 1)});
    across_ = std::max(across_, (contact.impulse_W - normal * contact.n_W).norm());
    // all bodies stand on the plane, which is the first shape, upright or round
    const int body = model_.shapes[contact.shape_b].body;
    if (model_.shapes[contact.shape_a].body != kWorld || body == kWorld) return;
    if (normal > 0.1 * kMass * kGravity * kForceTimestep && is_level(contact, body)) {
      gap_ = std::max(gap_, std::abs(contact.gap - (state_.bodies[body].p_WBcm.z() - kSize)));
    }
  }
  // A box that rocks has corners at other heights than its centre says.
  bool is_level(const ContactForce& contact, int body) const {
    return model_.shapes[contact.shape_b].type == ShapeType::kSphere ||
           (state_.bodies[body].q_WB * Vec3::UnitZ()).z() > 1 - 1e-6;
  }

  const Model& model_;
  std::unique_ptr<Simulation> simulation_;
  bool kept_;
  State start_, state_;
  bool ordered_ = true;
  double pull_ = 0, across_ = 0, gap_ = 0;
};

int add_force_ball(Model& model, const Vec3& place) {
  const int body = static_cast<int>(model.bodies.size());
  add_free_body(model, fmt::format("ball_{}", body), sphere_solid(kMass, kSize), {place, Quat::Identity()});
  return add_shape(model, ShapeType::kSphere, body, {}, kSize, 0, kForceFriction);
}

int add_force_box(Model& model, const std::string& name, const Vec3& place) {
  const int body = static_cast<int>(model.bodies.size());
  const double moment = 2 * kMass * kSize * kSize / 3;
  add_free_body(model, name, principal_solid(kMass, Vec3::Zero(), Vec3::Constant(moment), Quat::Identity()),
                {place, Quat::Identity()});
  const int shape = add_shape(model, ShapeType::kBox, body, {}, 0, 0, kForceFriction);
  model.shapes[static_cast<size_t>(shape)].half_size = Vec3::Constant(kSize);
  return shape;
}

const char* const kNotKept = "contact forces are declared and not given";

}  // namespace

Verdict contact_forces(const Subject& subject) {
  // One ball slides and begins to roll, two roll towards each other on the plane, and one falls onto it. What contacts
  // do to a body's momenta, beside gravity, are the impulses that the engine gives, at the places that it gives.
  constexpr int kSteps = 200;
  constexpr double kDuration = kSteps * kForceTimestep;
  Model model;
  model.name = "conformance-contact-forces";
  const int plane = add_shape(model, ShapeType::kPlane, kWorld, {}, 0, 0, kForceFriction);
  std::vector<int> balls;
  for (const Vec3& place : {Vec3(0, 0, kSize), Vec3(0, 1, kSize), Vec3(0.3, 1, kSize), Vec3(0, 2, 1.2 * kSize)}) {
    balls.push_back(add_force_ball(model, place));
    add_contact(model, plane, balls.back(), kForceFriction);
  }
  add_contact(model, balls[1], balls[2], kForceFriction);
  model = finished(std::move(model));
  State start = model.initial;
  start.bodies[0].v_WBcm = {2, 0.5, 0};
  start.bodies[1].v_WBcm = {1, 0, 0};
  start.bodies[2].v_WBcm = {-1, 0, 0};
  start.bodies[3].v_WBcm = {0, 1, -1};

  const bool friction = subject.capabilities().contact_forces == ContactForces::kAll;
  Reading run(subject, model, start);
  if (!run.kept()) return {1, 0, "", kNotKept};
  std::vector<Sum> sums;
  run.advance(kSteps, sums);
  Checks checks("");
  const double weight = kMass * kGravity * kDuration, inertia = 2 * kMass * kSize * kSize / 5;
  for (size_t i = 0; i < sums.size(); ++i) {
    const BodyState& end = run.state().bodies[i];
    const std::string& name = model.bodies[i].name;
    const Vec3 missing = sums[i].push - (kMass * (end.v_WBcm - start.bodies[i].v_WBcm) + Vec3(0, 0, weight));
    if (!friction) {  // the plane's normals are upright; two balls rub each other's sides, too
      if (i == 1 || i == 2) continue;
      checks.add(
          std::abs(missing.z()) / weight, 0.01,
          fmt::format("normal impulses against the gain of upward momentum of '{}', relative to its weight's", name));
      continue;
    }
    checks.add(
        missing.norm() / weight, 0.01,
        fmt::format("impulses of contacts against the gain of momentum of '{}', relative to its weight's", name));
    checks.add((sums[i].turn - inertia * end.w_WB).norm() / (weight * kSize), 0.01,
               fmt::format("their moments against the gain of angular momentum of '{}', relative", name));
  }
  run.check(checks, friction);
  checks.add(run.changed(subject, kDuration), 0.5, "numbers that keeping contacts changes");
  return checks.worst();
}

Verdict forces_of_boxes(const Subject& subject) {
  // One box rests, one slides: the forces on the first are its weight, those on the second its weight and mu times that
  // against the motion.
  constexpr int kSettle = 100, kSteps = 200;
  constexpr double kDuration = kSteps * kForceTimestep, kSpeed = 2;
  Model model;
  model.name = "conformance-forces-of-boxes";
  const int plane = add_shape(model, ShapeType::kPlane, kWorld, {}, 0, 0, kForceFriction);
  add_contact(model, plane, add_force_box(model, "resting", {0, 0, kSize}), kForceFriction);
  add_contact(model, plane, add_force_box(model, "sliding", {0, 1, kSize}), kForceFriction);
  model = finished(std::move(model));
  State start = model.initial;
  start.bodies[1].v_WBcm = {kSpeed, 0, 0};

  const bool friction = subject.capabilities().contact_forces == ContactForces::kAll;
  Reading run(subject, model, start);
  if (!run.kept()) return {1, 0, "", kNotKept};
  std::vector<Sum> settling, sums;
  run.advance(kSettle, settling);
  const State from = run.state();
  run.advance(kSteps, sums);
  Checks checks("");
  const double weight = kMass * kGravity * kDuration;
  const auto gained = [&](size_t i) {
    return Vec3(kMass * (run.state().bodies[i].v_WBcm - from.bodies[i].v_WBcm) + Vec3(0, 0, weight));
  };
  checks.add((sums[0].push - Vec3(0, 0, weight)).norm() / weight, 0.01,
             "sum of the forces on a resting box against its weight");
  checks.add(sums[0].turn.norm() / (weight * kSize), 0.01,
             "their moment about its centre, over weight and half its width");
  checks.add(std::abs(sums[1].push.z() - gained(1).z()) / weight, 0.01,
             "normal forces on a sliding box against its weight and gain of upward momentum");
  if (friction) {
    const double ratio = -sums[1].push.x() / sums[1].push.z();
    checks.add(std::abs(ratio / kForceFriction - 1), 0.02,  // as box-slides asks of the motion itself
               fmt::format("friction against the motion over normal force {:.4f} against mu = {:g}, relative", ratio,
                           kForceFriction));
    checks.add((sums[1].push - gained(1)).norm() / weight, 0.01,
               "forces on a sliding box against its gain of momentum, relative to its weight's");
  }
  run.check(checks, friction);
  return checks.worst();
}

}  // namespace assay::conformance
