// Coulomb friction where it is easily wrong: on links of articulated bodies, with one contact point and with several,
// between the sides of a friction pyramid, and far from the origin.
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include <fmt/format.h>

#include "base/text.h"
#include "conformance/models.h"
#include "conformance/tests.h"
#include "model/kinematics.h"

namespace assay::conformance {
namespace {

constexpr double kFriction = 0.5;
constexpr double kRunnerRadius = 0.1, kReach = 0.25;  // m; of a sled to its sides
constexpr double kFrom = 0.1, kTo = 0.3;              // s, between which impulses are compared
constexpr double kTolerance = 0.04;                   // of friction; mistakes of its law are tens of percent
const Quat kLyingAlongX(std::sqrt(0.5), 0, std::sqrt(0.5), 0);

// Bodies that slide as one, with their centre of mass above the middle of their contacts.
struct Sled {
  std::string name;
  std::vector<int> bodies;
  Vec3 along = Vec3::UnitX();
  double load = 1;  // kg that weigh on the ground: slides bear those before them
};

struct Track {
  Model model;
  std::vector<Sled> sleds;
};

enum class Skates {
  kRunners,  // two capsules: four contact points in two pairs
  kRunner,   // a capsule: two in one pair
  kBox,      // four in one pair
};

Solid sled_solid() { return principal_solid(1, Vec3::Zero(), {0.03, 0.03, 0.05}, Quat::Identity()); }

Vec3 heading(double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  return {std::cos(angle), std::sin(angle), 0};
}

Track track(const std::string& name) {
  Track made;
  made.model.name = "conformance-" + name;
  add_shape(made.model, ShapeType::kPlane, kWorld, {}, 0, 0, kFriction);
  return made;
}

Vec3 next_place(const Track& track) {
  constexpr double kApart = 3;  // m
  return {0, kApart * (static_cast<double>(track.sleds.size()) - 2), kRunnerRadius};
}

void add_skates(Model& model, int body, Skates skates) {
  const auto touch = [&](int shape) { add_contact(model, 0, shape, kFriction); };
  if (skates == Skates::kBox) {
    const int shape = add_shape(model, ShapeType::kBox, body, {}, 0, 0, kFriction);
    model.shapes[shape].half_size = {kReach, kReach, kRunnerRadius};
    touch(shape);
    return;
  }
  for (const double side : {-kReach, kReach}) {
    const Vec3 place(0, skates == Skates::kRunner ? 0 : side, 0);
    touch(add_shape(model, ShapeType::kCapsule, body, {place, kLyingAlongX}, kRunnerRadius, kReach, kFriction));
    if (skates == Skates::kRunner) return;
  }
}

void add_free_sled(Track& track, const std::string& name, Skates skates, const Vec3& along) {
  const int body = static_cast<int>(track.model.bodies.size());
  add_free_body(track.model, fmt::format("sled_{}", body), sled_solid(), {next_place(track), Quat::Identity()});
  add_skates(track.model, body, skates);
  track.sleds.push_back({name, {body}, along, 1});
}

// A free root and a link on an upright hinge, of which one has the skates: the other is a balanced wheel, or a load.
void add_jointed_sled(Track& track, const std::string& name, Skates skates, bool on_link, const Vec3& along) {
  const int root = static_cast<int>(track.model.bodies.size());
  add_free_body(track.model, fmt::format("root_{}", root), sled_solid(), {next_place(track), Quat::Identity()});
  add_hinged_body(track.model, fmt::format("link_{}", root), root, {}, sled_solid(), Vec3::UnitZ());
  add_skates(track.model, on_link ? root + 1 : root, skates);
  track.sleds.push_back({name, {root, root + 1}, along, 2});
}

// A ball behind slides along x, y and z, which cannot turn: one contact point.
void add_ball_on_slides(Track& track, const Vec3& along) {
  const int first = static_cast<int>(track.model.bodies.size());
  int parent = kWorld;
  for (const Vec3& axis : {Vec3(Vec3::UnitX()), Vec3(Vec3::UnitY()), Vec3(Vec3::UnitZ())}) {
    const Pose place{parent == kWorld ? next_place(track) : Vec3::Zero(), Quat::Identity()};
    const int body = static_cast<int>(track.model.bodies.size());
    add_sliding_body(track.model, fmt::format("carriage_{}", body), parent, place, sphere_solid(1, kRunnerRadius),
                     axis);
    parent = body;
  }
  const int shape = add_shape(track.model, ShapeType::kSphere, parent, {}, kRunnerRadius, 0, kFriction);
  add_contact(track.model, 0, shape, kFriction);
  track.sleds.push_back({"ball behind slides", {first, first + 1, first + 2}, along, 1});
}

// The state at the start with each sled at `speed` along its way.
State moving(const Track& track, double speed) {
  State state = track.model.initial;
  for (const Sled& sled : track.sleds) {
    for (const int body : sled.bodies) {
      if (track.model.bodies[body].is_free()) {
        state.bodies[body].v_WBcm = speed * sled.along;
      } else if (const Joint& joint = track.model.joints[track.model.bodies[body].joint]; joint.is_slide()) {
        state.velocity[track.model.bodies[body].joint] = speed * sled.along.dot(joint.axis_B);
      }
    }
  }
  bodies_from_joints(track.model, state);
  return state;
}

// Impulse of friction over that of the normal force between two states, so that a hop of a soft contact does not
// matter.
double friction_of(const Model& model, const Sled& sled, const State& from, const State& to) {
  const double time = to.time - from.time;
  Vec3 impulse = Vec3::Zero();  // of contacts and slides
  for (const int body : sled.bodies) {
    const Vec3 gained = to.bodies[body].v_WBcm - from.bodies[body].v_WBcm;
    impulse += model.bodies[body].mass * (gained - time * model.gravity);
  }
  double mass = 0;
  for (const int body : sled.bodies) mass += model.bodies[body].mass;
  const double normal = impulse.z() + (mass - sled.load) * time * model.gravity.z();
  return std::hypot(impulse.x(), impulse.y()) / normal;
}

// Runs the sleds from `speed` along their ways, on the model's slope: where they move, friction is mu times the normal
// force; where `holds`, they stay.
void judge(const Subject& subject, const Track& track, double speed, bool holds, const std::string& how,
           Checks& checks) {
  const Model& model = track.model;
  const State start = moving(track, speed);
  const std::unique_ptr<Simulation> simulation = subject.create(model, start, kStep);
  State from, to;
  simulation->advance(static_cast<int>(std::lround(kFrom / kStep)));
  Subject::read(*simulation, model, 0, from);
  simulation->advance(static_cast<int>(std::lround((kTo - kFrom) / kStep)));
  Subject::read(*simulation, model, from.time, to);
  const double free_way = std::hypot(model.gravity.x(), model.gravity.y()) * kTo * kTo / 2;
  for (const Sled& sled : track.sleds) {
    if (holds) {
      if (!model.bodies[sled.bodies.front()].is_free()) continue;  // the carriages pull, and weigh on no ground
      const int body = sled.bodies.back();
      const Vec3 way = to.bodies[body].p_WBcm - start.bodies[body].p_WBcm;
      checks.add(std::hypot(way.x(), way.y()) / free_way, kTolerance,
                 fmt::format("{} {}: way relative to the way without friction", sled.name, how));
      continue;
    }
    const double measured = friction_of(model, sled, from, to);
    checks.add(std::abs(measured / kFriction - 1), kTolerance,
               fmt::format("{} {}: friction impulse over normal impulse {:.4f} against {}, relative", sled.name, how,
                           measured, kFriction));
  }
}

// On slopes on which they hold and on which they slide, with `share` of the friction's slope.
void judge_on_slopes(const Subject& subject, Track track, const Vec3& downhill, Checks& checks) {
  for (const double share : {0.9, 1.2}) {
    const double angle = std::atan(share * kFriction);
    track.model.gravity = kGravity * (std::sin(angle) * downhill - std::cos(angle) * Vec3::UnitZ());
    track.model.hash = model_hash(track.model);
    judge(subject, track, 0, share < 1, fmt::format("at rest on {} of the slope at which it slides", shortest(share)),
          checks);
  }
}

}  // namespace

Verdict friction_of_links(const Subject& subject) {
  // along the first tangents of friction pyramids, whose corners friction-directions tests
  constexpr double kSpeed = 3;
  Track links = track("friction-of-links");
  const Vec3 x = heading(0), y = heading(90);
  add_jointed_sled(links, "root on two runners", Skates::kRunners, false, x);
  add_jointed_sled(links, "link on two runners", Skates::kRunners, true, y);
  if (subject.is_exact(Feature::kBox)) {
    add_jointed_sled(links, "root that is a box", Skates::kBox, false, y);
    add_jointed_sled(links, "link that is a box", Skates::kBox, true, x);
  }
  if (subject.accepts(Feature::kSlide)) {
    for (const Vec3& along : {x, y}) add_ball_on_slides(links, along);
  }
  add_jointed_sled(links, "link on one runner", Skates::kRunner, true, x);
  links.model = finished(std::move(links.model));
  Checks checks("");
  judge(subject, links, kSpeed, false, fmt::format("at {} m/s", kSpeed), checks);
  judge_on_slopes(subject, links, x, checks);
  return checks.worst();
}

Verdict friction_directions(const Subject& subject) {
  // a pyramid of friction is up to 1.41 times too strong between its sides
  constexpr double kSpeed = 3;
  Checks checks("");
  for (const double degrees : {22.5, 45.0}) {
    Track sleds = track("friction-directions");
    add_free_sled(sleds, fmt::format("sled towards {} degrees", degrees), Skates::kRunners, heading(degrees));
    if (subject.is_exact(Feature::kBox)) {
      add_free_sled(sleds, fmt::format("box towards {} degrees", degrees), Skates::kBox, heading(degrees));
    }
    add_jointed_sled(sleds, fmt::format("link towards {} degrees", degrees), Skates::kRunners, true, heading(degrees));
    sleds.model = finished(std::move(sleds.model));
    judge(subject, sleds, kSpeed, false, fmt::format("at {} m/s", kSpeed), checks);
    judge_on_slopes(subject, sleds, heading(degrees), checks);
  }
  return checks.worst();
}

Verdict distances(const Subject& subject) {
  // the way of sleds to their stop, from 1 m to 10 km away from the origin
  constexpr double kSpeed = 2, kDuration = 0.5;
  const double way = kSpeed * kSpeed / (2 * kFriction * kGravity);
  Checks checks("");
  for (const double far : {1.0, 100.0, 1e3, 1e4}) {
    Track sleds = track("distances");
    add_free_sled(sleds, "sled", Skates::kRunners, heading(0));
    if (subject.is_exact(Feature::kBox)) add_free_sled(sleds, "box", Skates::kBox, heading(0));
    add_jointed_sled(sleds, "link", Skates::kRunners, true, heading(0));
    for (Body& body : sleds.model.bodies) {
      if (body.is_free()) body.X_PB.p += Vec3(far, far, 0);
    }
    sleds.model = finished(std::move(sleds.model));
    const State start = moving(sleds, kSpeed);
    const State end = subject.run(sleds.model, start, kStep, kDuration);
    // a position may be rounded the same way in every step
    const double rounding = kDuration / kStep * subject.epsilon() * far / 2;
    for (const Sled& sled : sleds.sleds) {
      const int body = sled.bodies.front();
      const Vec3 went = end.bodies[body].p_WBcm - start.bodies[body].p_WBcm;
      checks.add((went - way * sled.along).norm() / way, 0.01 + rounding / way,
                 fmt::format("{} at {} m: slides {:.4f} m, against v^2/(2 mu g) = {:.4f} m, relative", sled.name, far,
                             went.norm(), way));
    }
  }
  return checks.worst();
}

}  // namespace assay::conformance
