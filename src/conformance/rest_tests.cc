// Bodies at rest and slow motions: what is wrong by little in each step adds up, the faster the shorter the timestep
// is. Everything is tried at several timesteps, down to the finest one that the contender declares.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "conformance/models.h"
#include "conformance/tests.h"
#include "model/kinematics.h"

namespace assay::conformance {
namespace {

// `timesteps`, s, without those at which the contender declares to lose slow motions.
std::vector<double> those_allowed(const Subject& subject, std::vector<double> timesteps) {
  const double finest = subject.capabilities().finest_timestep;
  std::erase_if(timesteps, [&](double h) { return h < finest * (1 - 1e-9); });
  if (timesteps.empty()) timesteps.push_back(finest);
  return timesteps;
}

// s
std::vector<double> contact_timesteps(const Subject& subject) {
  if (subject.is_long()) return those_allowed(subject, {8e-3, 4e-3, 2e-3, 1e-3, 0.5e-3, 0.25e-3});
  return those_allowed(subject, {4e-3, 2e-3});
}
// From 4 ms on, each half of the one before.
std::vector<double> halved_timesteps(const Subject& subject) {
  return those_allowed(subject, {4e-3, 2e-3, 1e-3, 0.5e-3, 0.25e-3, 0.125e-3, 1e-3 / 16, 1e-3 / 32, 1e-3 / 64});
}
std::vector<double> smooth_timesteps(const Subject& subject) {
  if (subject.is_long()) return halved_timesteps(subject);
  return those_allowed(subject, {4e-3, 1e-3, 0.25e-3, 1e-3 / 16});
}

// What rests, and on what.
enum class Ground { kPlane, kBox, kHull, kField };
struct Resting {
  const char* name;
  ShapeType type;
  Vec3 axis;      // of capsules and cylinders
  double height;  // m, of the centre
  bool rolls;
};
constexpr double kRestRadius = 0.1, kHalf = 0.15;  // m
const Vec3 kHalfBox(0.12, 0.1, 0.08);

// Directions that are none of the frame's axes, where rounding errors cancel.
const Quat kTurned(Eigen::AngleAxisd(0.3, Vec3::UnitZ()));

Quat along(const Vec3& axis) { return Quat::FromTwoVectors(Vec3::UnitZ(), axis); }

std::vector<Resting> resting_bodies(const Subject& subject) {
  std::vector<Resting> list = {
      {"ball", ShapeType::kSphere, Vec3::UnitZ(), kRestRadius, true},
      {"lying capsule", ShapeType::kCapsule, kTurned * Vec3(Vec3::UnitX()), kRestRadius, true}};
  if (subject.accepts(Feature::kBox)) list.push_back({"box", ShapeType::kBox, Vec3::UnitZ(), kHalfBox.z(), false});
  return list;
}

std::vector<Resting> resting_cylinders() {
  return {{"lying cylinder", ShapeType::kCylinder, kTurned * Vec3(Vec3::UnitX()), kRestRadius, true},
          {"upright cylinder", ShapeType::kCylinder, Vec3::UnitZ(), kHalf, false}};
}

const char* ground_name(Ground ground) {
  switch (ground) {
    case Ground::kPlane:
      return "a plane";
    case Ground::kBox:
      return "a box";
    case Ground::kHull:
      return "a hull";
    case Ground::kField:
      return "a height field";
  }
  return "";
}

// A ground of its own for each body, a metre wide, with its top at height 0; of the plane there is one.
constexpr double kWide = 0.5;  // m, half of it
int add_ground(Model& model, Ground ground, const Vec3& place, int plane) {
  constexpr double kThick = 0.1;
  switch (ground) {
    case Ground::kPlane:
      return plane;
    case Ground::kBox: {
      const int shape = add_shape(model, ShapeType::kBox, kWorld, {place - Vec3(0, 0, kThick), Quat::Identity()});
      model.shapes[shape].half_size = {kWide, kWide, kThick};
      return shape;
    }
    case Ground::kHull: {
      const int shape = add_shape(model, ShapeType::kHull, kWorld, {place - Vec3(0, 0, kThick), Quat::Identity()});
      model.shapes[shape].data = static_cast<int>(model.hulls.size());
      model.hulls.push_back(box_hull({kWide, kWide, kThick}));
      model.hulls.back().name = fmt::format("ground_{}", shape);
      return shape;
    }
    case Ground::kField: {
      const int shape = add_shape(model, ShapeType::kHeightField, kWorld, {place, Quat::Identity()});
      model.shapes[shape].data = static_cast<int>(model.height_fields.size());
      model.height_fields.push_back(flat_field(kWide, 0.2, 0));
      model.height_fields.back().name = fmt::format("field_{}", shape);
      return shape;
    }
  }
  return plane;
}

void add_resting(Model& model, const Resting& kind, Ground ground, const Vec3& place, int plane) {
  const int below = add_ground(model, ground, place, plane);
  const int body = static_cast<int>(model.bodies.size());
  const Quat q = kind.type == ShapeType::kBox ? kTurned : along(kind.axis);
  Solid solid = sphere_solid(1, kRestRadius);
  if (kind.type == ShapeType::kCapsule) solid = capsule_solid(1, kRestRadius, kHalf, Vec3::UnitZ());
  if (kind.type == ShapeType::kCylinder) solid = cylinder_solid(1, kRestRadius, kHalf);
  if (kind.type == ShapeType::kBox) solid = box_solid(1, kHalfBox);
  // beside the middle of the ground, off every edge of a field's triangles
  add_free_body(model, fmt::format("{} on {}", kind.name, ground_name(ground)), solid,
                {place + Vec3(0.03, 0.01, kind.height), q});
  const bool round = kind.type == ShapeType::kCapsule || kind.type == ShapeType::kCylinder;
  const int shape =
      add_shape(model, kind.type, body, {}, kind.type == ShapeType::kBox ? 0 : kRestRadius, round ? kHalf : 0);
  if (kind.type == ShapeType::kBox) model.shapes[shape].half_size = kHalfBox;
  add_contact(model, below, shape, 1);
}

// What tells engines apart within a second: what does not roll lies on the plane only.
bool in_short_series(const Resting& kind, Ground ground) { return kind.rolls || ground == Ground::kPlane; }

// A body turned by `angle` about an axis through a point that stays.
void turn(BodyState& state, const Quat& start, const Vec3& axis, double angle) {
  state.q_WB = Quat(Eigen::AngleAxisd(angle, axis)) * start;
}

std::vector<Ground> solid_grounds(const Subject& subject) {
  std::vector<Ground> grounds = {Ground::kPlane};
  if (subject.accepts(Feature::kBox)) grounds.push_back(Ground::kBox);
  if (subject.accepts(Feature::kHull)) grounds.push_back(Ground::kHull);
  return grounds;
}

// Each of `kinds` on each of `grounds`.
Verdict at_rest(const Subject& subject, const std::vector<Resting>& kinds, const std::vector<Ground>& grounds) {
  // Round bodies start at a tenth of a millimetre a second, rolling: what lets them gain speed shows within a second
  // then, and not after the half minute that rounding takes to grow. In the long series they start at rest.
  const double duration = subject.is_long() ? 60 : 1.2, speed = subject.is_long() ? 0 : 1e-4;

  Model model;
  model.name = "conformance-bodies-at-rest";
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  std::vector<const Resting*> kind_of;
  for (size_t g = 0; g < grounds.size(); ++g) {
    for (size_t k = 0; k < kinds.size(); ++k) {
      // an engine may have no collision of two shapes that it has, and say so of the pair
      Model alone;
      alone.name = "conformance-body-at-rest";
      add_resting(alone, kinds[k], grounds[g], Vec3::Zero(), add_shape(alone, ShapeType::kPlane, kWorld));
      if (subject.refuses(finished(std::move(alone)))) continue;
      if (!subject.is_long() && !in_short_series(kinds[k], grounds[g])) continue;
      const Vec3 place(1.5 * static_cast<double>(k) - 3, 1.5 * static_cast<double>(g) - 2, 0);
      add_resting(model, kinds[k], grounds[g], place, plane);
      kind_of.push_back(&kinds[k]);
    }
  }
  model = finished(std::move(model));
  State start = model.initial;
  std::vector<Vec3> velocities(kind_of.size(), Vec3::Zero());
  for (size_t b = 0; b < kind_of.size(); ++b) {
    if (!kind_of[b]->rolls) continue;
    const Vec3 axis = kind_of[b]->type == ShapeType::kSphere ? kTurned * Vec3(Vec3::UnitX()) : kind_of[b]->axis;
    velocities[b] = speed * axis.cross(Vec3::UnitZ());
    start.bodies[b].v_WBcm = velocities[b];
    start.bodies[b].w_WB = speed / kRestRadius * axis;
  }
  Checks checks("m");
  for (const double h : contact_timesteps(subject)) {
    const State end = subject.run(model, start, h, duration);
    // half a millimetre for contacts that settle, and a plane that is level to within four units in the last place
    const double tolerance =
        (subject.is_long() ? 1e-3 : 5e-4) + 4 * subject.epsilon() * kGravity * duration * duration / 2;
    for (size_t b = 0; b < kind_of.size(); ++b) {
      Vec3 way = end.bodies[b].p_WBcm - start.bodies[b].p_WBcm - velocities[b] * duration;
      way.z() = 0;
      // of what has left its ground, where it falls to does not matter
      checks.add_at(h, std::min(way.norm(), 2 * kWide), tolerance,
                    fmt::format("way of '{}' within {:g} s", model.bodies[b].name, duration));
    }
  }
  return checks.worst();
}

}  // namespace

Verdict bodies_at_rest(const Subject& subject) {
  return at_rest(subject, resting_bodies(subject), solid_grounds(subject));
}
Verdict cylinders_at_rest(const Subject& subject) {
  return at_rest(subject, resting_cylinders(), solid_grounds(subject));
}
Verdict bodies_on_field(const Subject& subject) { return at_rest(subject, resting_bodies(subject), {Ground::kField}); }
Verdict cylinders_on_field(const Subject& subject) { return at_rest(subject, resting_cylinders(), {Ground::kField}); }

Verdict stacks_at_rest(const Subject& subject) {
  constexpr double kHalfCube = 0.05, kAside = 1e-3;  // m
  const double duration = subject.is_long() ? 60 : 1.5;
  // what collapses does so at 4 ms; ten boxes are the most expensive model of the suite for a direct solver
  std::vector<int> sizes = {2, 5, 10};
  std::vector<double> timesteps = those_allowed(subject, {4e-3});
  if (subject.is_long()) {
    sizes = {2, 3, 5, 10, 15, 20};
    timesteps = contact_timesteps(subject);
  }
  Model model;
  model.name = "conformance-stacks-at-rest";
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  for (size_t s = 0; s < sizes.size(); ++s) {
    int below = plane;
    for (int i = 0; i < sizes[s]; ++i) {
      // each a millimetre aside and turned, in turns: nothing cancels, and everything stays
      const double sign = i % 2 == 0 ? 1 : -1;
      const Vec3 position(static_cast<double>(s) - 2 + sign * kAside, sign * kAside / 2, kHalfCube * (2 * i + 1));
      const int body = static_cast<int>(model.bodies.size());
      add_free_body(model, fmt::format("box {} of {}", i + 1, sizes[s]), box_solid(1, Vec3::Constant(kHalfCube)),
                    {position, Quat(Eigen::AngleAxisd(0.02 * sign, Vec3::UnitZ()))});
      const int shape = add_shape(model, ShapeType::kBox, body);
      model.shapes[shape].half_size = Vec3::Constant(kHalfCube);
      add_contact(model, below, shape, 1);
      below = shape;
    }
  }
  model = finished(std::move(model));
  Checks checks("m");
  for (const double h : timesteps) {
    const State end = subject.run(model, model.initial, h, duration);
    for (size_t b = 0; b < model.bodies.size(); ++b) {
      Vec3 way = end.bodies[b].p_WBcm - model.initial.bodies[b].p_WBcm;
      way.z() = 0;
      // a collapse goes on; soft contacts let the stack lean by some millimetres
      checks.add_at(h, way.norm(), kHalfCube / 2,
                    fmt::format("way aside of '{}' within {:g} s", model.bodies[b].name, duration));
    }
  }
  return checks.worst();
}

Verdict slow_rotations(const Subject& subject) {
  // Free cubes and a wheel on a hinge turn uniformly, without gravity, about the frame's axes and about others.
  constexpr double kDuration = 0.5;  // s
  const Vec3 oblique = Vec3(0.48, 0.6, 0.64);
  const Quat start_of_oblique(0.5, 0.5, -0.5, 0.5);
  struct Turning {
    const char* name;
    double rate;  // rad/s
    Vec3 axis;
    Quat start;
  };
  const std::vector<Turning> list = {{"cube", 0.01, Vec3::UnitZ(), Quat::Identity()},
                                     {"oblique cube", 0.01, oblique, start_of_oblique},
                                     {"slow cube", 0.9e-3, oblique, start_of_oblique},
                                     {"wheel", 0.01, Vec3::UnitY(), Quat::Identity()}};
  const Solid solid = principal_solid(1, Vec3::Zero(), Vec3::Constant(0.01), Quat::Identity());
  Model model;
  model.name = "conformance-slow-rotations";
  model.gravity = Vec3::Zero();
  for (size_t i = 0; i < list.size(); ++i) {
    const Pose pose{Vec3(static_cast<double>(i) - 1, 0, 0), list[i].start};
    const bool on_hinge = i + 1 == list.size();
    if (on_hinge) add_hinged_body(model, list[i].name, kWorld, pose, solid, list[i].axis);
    if (!on_hinge) add_free_body(model, list[i].name, solid, pose);
  }
  model = finished(std::move(model));
  State start = with_joints(model, {0}, {list.back().rate});
  for (size_t i = 0; i < list.size(); ++i) start.bodies[i].w_WB = list[i].rate * list[i].axis;
  Checks checks("rad");
  for (const double h : smooth_timesteps(subject)) {
    const State end = subject.run(model, start, h, kDuration);
    for (size_t i = 0; i < list.size(); ++i) {
      BodyState right = start.bodies[i];
      turn(right, list[i].start, list[i].axis, list[i].rate * kDuration);
      checks.add_at(h, angle_between(end.bodies[i].q_WB, right.q_WB), 1e-6 + subject.rounding(kDuration / h, 1),
                    fmt::format("turn of '{}', {:g} rad within {:g} s, is wrong by this", list[i].name,
                                list[i].rate * kDuration, kDuration));
    }
  }
  return checks.worst();
}

Verdict near_equilibrium(const Subject& subject) {
  // Rods on hinges at a tenth of a milliradian from upright and from hanging, for which the linear motions are right to
  // 1e-6: an angle grows as cosh(k t), or swings as cos(k t).
  constexpr double kDuration = 0.25, kAngle = 1e-4, kHalfLength = 0.25;  // s, rad, m
  const Vec3 moments = Vec3(kHalfLength * kHalfLength / 3, kHalfLength * kHalfLength / 3, 2e-4);
  const double rate = std::sqrt(kGravity * kHalfLength / (moments.x() + kHalfLength * kHalfLength));  // 1/s
  Model model;
  model.name = "conformance-near-equilibrium";
  for (const double side : {1.0, -1.0}) {
    add_hinged_body(model, side > 0 ? "upright rod" : "hanging rod", kWorld, {Vec3(0, side, 0), Quat::Identity()},
                    principal_solid(1, {0, 0, side * kHalfLength}, moments, Quat::Identity()), Vec3::UnitY());
  }
  model = finished(std::move(model));
  const State start = with_joints(model, {kAngle, kAngle}, {0, 0});
  const double ends[] = {kAngle * std::cosh(rate * kDuration), kAngle * std::cos(rate * kDuration)};
  // by how much an error grows, on average over the time at which it is made
  const double growths[] = {std::sinh(rate * kDuration) / (rate * kDuration), 1};
  Checks checks("rad");
  double before[2] = {};
  bool first = true;
  for (const double h : halved_timesteps(subject)) {
    const State end = subject.run(model, start, h, kDuration);
    for (size_t i = 0; i < 2; ++i) {
      const double error = std::abs(end.position[i] - ends[i]);
      // At first 15 % of the amplitude, which a method of order 1 needs; then no more than at the timestep before, or a
      // five-hundredth. Rounding is a unit in the last place a step, which a sound engine makes now up and now down:
      // what it loses in one direction would hide here below its sum.
      const double scale = i == 0 ? ends[0] : kAngle;
      const double allowed = first ? 0.15 * scale : std::min(0.15 * scale, std::max(before[i], 2e-3 * scale));
      checks.add_at(h, error, allowed + 2 * subject.epsilon() * std::sqrt(kDuration / h) * growths[i],
                    fmt::format("angle of '{}' after {:g} s is wrong by this, {:.3g} rad are right",
                                model.bodies[i].name, kDuration, ends[i]));
      before[i] = error;
    }
    first = false;
  }
  return checks.worst();
}

}  // namespace assay::conformance
