// What holds bodies: welds and connects at any distance, limits under load, rolling friction in pure rolling, the edges
// of height fields, and the engine's own actuators.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "conformance/models.h"
#include "conformance/tests.h"
#include "isolate/machine_lack.h"
#include "measures/reference/smooth.h"
#include "model/actuator_force.h"
#include "model/kinematics.h"

namespace assay::conformance {
namespace {

constexpr double kAttachedRadius = 0.05;  // m, of the bodies that are held

Solid bar_from_joint(double length) {
  Solid bar = capsule_solid(1, kAttachedRadius, length / 2, Vec3::UnitX());
  bar.p_BBcm = {length / 2, 0, 0};
  return bar;
}

// A body off its frame, without symmetry.
Solid lump(double mass) {
  return principal_solid(mass, {0.02, -0.01, 0.03}, mass * Vec3(0.002, 0.003, 0.0025), about_axis(0.7, {1, 2, 3}));
}

// ---- welds and connects ---------------------------------------------------------------------------------------------

// Some bodies that are held to each other or to the world, in the order of the constraint's bodies or the other one.
struct Attachment {
  const char* name;
  Model model;  // finished, in its start
  double size;  // m, of the mechanism
};

Weld weld_of(int a, int b, const Pose& X_AB, bool swapped) {
  if (swapped) return {.name = "weld", .body_a = b, .body_b = a, .X_AB = X_AB.inverse()};
  return {.name = "weld", .body_a = a, .body_b = b, .X_AB = X_AB};
}

Connect connect_of(int a, const Vec3& p_A, int b, const Vec3& p_B, bool swapped) {
  if (swapped) return {.name = "connect", .body_a = b, .body_b = a, .p_A = p_B, .p_B = p_A};
  return {.name = "connect", .body_a = a, .body_b = b, .p_A = p_A, .p_B = p_B};
}

// The mechanisms whose lengths grow with `distance`, m.
std::vector<Attachment> attachments(double distance, bool swapped) {
  const Vec3 place = distance * Vec3(1, 2, 2) / 3;
  const Pose X_WB = {place, about_axis(0.4, {2, -1, 1})};
  const double arm = std::max(distance, 4 * kAttachedRadius);
  const Pose X_PJ = {Vec3(0, 0, 1), Quat::Identity()};
  const auto link = [&](Model& model) -> Joint& {
    return add_hinged_body(model, "link", kWorld, X_PJ, bar_from_joint(0.4), Vec3::UnitY());
  };
  std::vector<Attachment> list;
  const auto add = [&](const char* name, double size, const std::function<void(Model&)>& build,
                       const std::function<void(State&)>& push = {}) {
    Model model;
    model.name = fmt::format("conformance-attachments-{}", name);
    build(model);
    model = finished(std::move(model));
    if (push) push(model.initial);
    list.push_back({name, std::move(model), size});
  };
  add("a free body welded to the world", 1, [&](Model& model) {
    add_free_body(model, "held", lump(1), X_WB);
    model.welds.push_back(weld_of(0, kWorld, X_WB.inverse(), swapped));
  });
  add("a free body connected to the world", 1, [&](Model& model) {
    add_free_body(model, "held", lump(1), X_WB);
    const Vec3 p_B = {0.3, 0.1, 0.2};
    model.connects.push_back(connect_of(0, p_B, kWorld, X_WB * p_B, swapped));
  });
  add("a free body welded to a link", arm, [&](Model& model) {
    link(model);
    const Pose X_LB = {Vec3(arm, 0.1, 0), about_axis(0.5, {0, 1, 1})};
    add_free_body(model, "held", lump(0.5), X_PJ * X_LB);
    model.welds.push_back(weld_of(0, 1, X_LB, swapped));
  });
  add("a free body connected to a link", arm, [&](Model& model) {
    link(model);
    const Pose X_LB = {Vec3(arm + 0.3, 0, 0), Quat::Identity()};
    add_free_body(model, "held", lump(0.5), X_PJ * X_LB);
    model.connects.push_back(connect_of(0, {arm, 0, 0}, 1, {-0.3, 0, 0}, swapped));
  });
  add(
      "two free bodies welded", arm,
      [&](Model& model) {
        const Pose X_AB = {Vec3(arm, 0, 0), about_axis(0.5, {0, 1, 1})};
        add_free_body(model, "first", lump(1), X_WB);
        add_free_body(model, "second", lump(0.5), X_WB * X_AB);
        model.welds.push_back(weld_of(0, 1, X_AB, swapped));
      },
      [&](State& state) {  // both turn as one about the first
        const Vec3 w = {0.3, -0.2, 0.6};
        for (BodyState& body : state.bodies) {
          body.w_WB = w;
          body.v_WBcm = w.cross(body.p_WBcm - state.bodies[0].p_WBcm);
        }
      });
  add(
      "two free bodies connected", arm,
      [&](Model& model) {
        add_free_body(model, "first", lump(1), X_WB);
        add_free_body(model, "second", lump(0.5), X_WB * Pose{Vec3(arm, 0, 0), Quat::Identity()});
        model.connects.push_back(connect_of(0, {arm / 2, 0, 0}, 1, {-arm / 2, 0, 0}, swapped));
      },
      [&](State& state) {  // the point at rest, each about it
        const Vec3 point = X_WB * Vec3(arm / 2, 0, 0);
        for (size_t i = 0; i < 2; ++i) {
          BodyState& body = state.bodies[i];
          body.w_WB = i == 0 ? Vec3(0, 0, 0.6) : Vec3(0.4, -0.3, 0);
          body.v_WBcm = body.w_WB.cross(body.p_WBcm - point);
        }
      });
  add("two links connected", arm, [&](Model& model) {
    link(model);
    add_hinged_body(model, "other", kWorld, {Vec3(arm, 0, 1), Quat::Identity()}, bar_from_joint(0.4), Vec3::UnitY());
    add_hinged_body(model, "rod", 0, {Vec3(0.4, 0, 0), Quat::Identity()}, bar_from_joint(arm), Vec3::UnitY());
    model.connects.push_back(connect_of(2, {arm, 0, 0}, 1, {0.4, 0, 0}, swapped));
  });
  return list;
}

// The end of the motion from the error-controlled solution, of every mechanism at every distance and in both orders.
constexpr double kAttachedFor = 0.3;  // s
constexpr std::array kDistances = {0.1, 1.0, 10.0};

struct Attached {
  Attachment attachment;
  State truth;
};

const std::vector<Attached>& attached() {
  static const std::vector<Attached> all = [] {
    std::vector<Attached> list;
    for (const double distance : kDistances) {
      for (const bool swapped : {false, true}) {
        for (Attachment& each : attachments(distance, swapped)) {
          State truth =
              smooth_solution(each.model, each.model.initial, kAttachedFor, {.tolerance = 1e-8, .torques = {}});
          list.push_back({std::move(each), std::move(truth)});
        }
      }
    }
    return list;
  }();
  return all;
}

// How far the two bodies of a weld or connect are apart, m; of a weld at each body's centre of mass.
double gap_of(const Model& model, const State& state) {
  const auto pose = [&](int body) {
    return body == kWorld ? Pose{} : body_pose(model.bodies[body], state.bodies[body]);
  };
  double gap = 0;
  for (const Connect& connect : model.connects) {
    gap = std::max(gap, (pose(connect.body_a) * connect.p_A - pose(connect.body_b) * connect.p_B).norm());
  }
  for (const Weld& weld : model.welds) {
    for (const int body : {weld.body_a, weld.body_b}) {
      if (body == kWorld) continue;
      const Vec3 p = model.bodies[body].p_BBcm;
      const Vec3 p_A = body == weld.body_a ? p : weld.X_AB * p;
      gap = std::max(gap, (pose(weld.body_a) * p_A - pose(weld.body_b) * (weld.X_AB.inverse() * p_A)).norm());
    }
  }
  return gap;
}

// Worst of the attachments that are welds or connects, relative to their size.
Verdict attached_hold(const Subject& subject, bool welds) {
  Checks checks("");
  for (const auto& [attachment, truth] : attached()) {
    const Model& model = attachment.model;
    if (model.welds.empty() == welds || subject.refuses(model)) continue;
    const std::vector<State> states = subject.record(model, model.initial, kStep, kAttachedFor);
    double gap = 0;
    for (const State& state : states) gap = std::max(gap, gap_of(model, state));
    const bool swapped = (welds ? model.welds[0].body_a : model.connects[0].body_a) != 0;
    const std::string what = fmt::format("{}, bodies {} m across{}", attachment.name, attachment.size,
                                         swapped ? ", in the other order" : "");
    const double allowed_gap = std::max(1e-3, 2e-3 * attachment.size) / attachment.size;
    checks.add(gap / attachment.size, allowed_gap, fmt::format("largest gap over size: {}", what));
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      const BodyState &end = states.back().bodies[i], &right = truth.bodies[i];
      // one per cent of the way, a step's travel and the gap that is allowed
      const double way = (right.p_WBcm - model.initial.bodies[i].p_WBcm).norm();
      const double allowed = 0.01 * way + right.v_WBcm.norm() * kStep;
      checks.add(std::max(0.0, (end.p_WBcm - right.p_WBcm).norm() - allowed) / attachment.size, allowed_gap,
                 fmt::format("place of '{}' at the end over size: {}", model.bodies[i].name, what));
    }
  }
  return checks.worst();
}

}  // namespace

Verdict welds_hold(const Subject& subject) { return attached_hold(subject, true); }
Verdict connects_hold(const Subject& subject) { return attached_hold(subject, false); }

Verdict couplings_apart(const Subject& subject) {
  // a hinge and a slide of two trees, and of one tree, at each distance: the slide is the hinge's rack
  Checks checks("");
  for (const double distance : kDistances) {
    for (const bool swapped : {false, true}) {
      constexpr double kPitch = 0.1, kDuration = 0.3;  // m/rad, s
      Model model;
      model.name = "conformance-couplings-apart";
      const Vec3 place = distance * Vec3(1, 2, 2) / 3;
      add_hinged_body(model, "wheel", kWorld, {place, Quat::Identity()}, lump(1), {1, 0, 0}, {0.02, -0.01, 0.03});
      add_sliding_body(model, "rack", kWorld, {-place, Quat::Identity()}, lump(1), {0, 0, 1});
      model.couplings.push_back(swapped ? Coupling{"pinion", 0, {{1, 1 / kPitch}}, 0}
                                        : Coupling{"pinion", 1, {{0, kPitch}}, 0});
      model = finished(std::move(model));
      if (subject.refuses(model)) continue;
      const double inertia = (lump(1).I_BBcm_B)(0, 0) + kPitch * kPitch;
      const double turn = -kGravity * kPitch / inertia * kDuration * kDuration / 2;
      const State end = subject.record(model, model.initial, kStep, kDuration).back();
      const std::string what = fmt::format("{} m from the origin{}", distance, swapped ? ", solved for the wheel" : "");
      checks.add(std::abs(end.position[0] / turn - 1), 0.015, "turn of the wheel, relative: " + what);
      checks.add(std::abs(end.position[1] / (kPitch * turn) - 1), 0.015, "way of the rack, relative: " + what);
    }
  }
  return checks.worst();
}

// ---- limits under load ----------------------------------------------------------------------------------------------

Verdict limits_under_load(const Subject& subject) {
  // bars of four widths and a block lie on their limits, which carry their weight; a ball joint's inertias differ most
  constexpr double kLength = 0.3, kUpper = 0.5, kDuration = 0.5;
  Model model;
  model.name = "conformance-limits-under-load";
  struct Held {
    std::string what;
    int joint = -1, ball = -1;
  };
  std::vector<Held> held;
  const std::array<double, 4> radii = {0.08, 0.04, 0.02, 0.01};
  for (size_t i = 0; i < radii.size(); ++i) {
    Solid bar = capsule_solid(1, radii[i], kLength / 2, Vec3::UnitX());
    bar.p_BBcm = {kLength / 2, 0, 0};
    const Pose X_WB = {Vec3(0, static_cast<double>(i), 1), Quat::Identity()};
    Joint& hinge = add_hinged_body(model, fmt::format("hinged {}", i), kWorld, X_WB, bar, Vec3::UnitY());
    hinge.limited = true;
    hinge.lower = -1;
    hinge.upper = kUpper;
    held.push_back({fmt::format("hinge of a bar of {} m", radii[i]), static_cast<int>(model.joints.size()) - 1, -1});
    if (!subject.accepts(Feature::kBallLimit)) continue;
    BallJoint& ball = add_ball_body(model, fmt::format("ball {}", i), kWorld,
                                    {Vec3(2, static_cast<double>(i), 1), Quat::Identity()}, bar);
    ball.limited = true;
    ball.upper = kUpper;
    held.push_back(
        {fmt::format("ball joint of a bar of {} m", radii[i]), -1, static_cast<int>(model.balls.size()) - 1});
  }
  if (subject.accepts(Feature::kSlide)) {
    Joint& slide = add_sliding_body(model, "block", kWorld, {Vec3(4, 0, 1), Quat::Identity()}, lump(1), {0, 0, -1});
    slide.limited = true;
    slide.lower = -1;
    slide.upper = kUpper;
    held.push_back({"slide of a block", static_cast<int>(model.joints.size()) - 1, -1});
  }
  model = finished(std::move(model));
  std::vector<double> at_limit(model.joints.size(), kUpper);
  State start = with_joints(model, at_limit, std::vector<double>(model.joints.size(), 0.0));
  for (size_t b = 0; b < model.balls.size(); ++b) {
    set_ball(model, start, static_cast<int>(b), about_axis(kUpper, Vec3::UnitY()), Vec3::Zero());
  }
  bodies_from_joints(model, start);
  const std::vector<State> states = subject.record(model, start, kStep, kDuration);
  Checks checks("rad");
  for (const Held& each : held) {
    double beyond = 0;
    for (const State& state : states) {
      const double at =
          each.joint >= 0 ? state.position[each.joint] : rotation_vector(ball_rotation(model, state, each.ball)).norm();
      beyond = std::max(beyond, at - kUpper);
    }
    checks.add(beyond, 0.01,
               fmt::format("furthest beyond the limit that carries its weight (rad, or m): {}", each.what));
  }
  return checks.worst();
}

// ---- rolling friction in pure rolling -------------------------------------------------------------------------------

Verdict rolling_slows(const Subject& subject) {
  // balls that roll without slip lose length m g R / (I + m R^2) a second, along the axes and between them
  constexpr double kBall = 0.1, kDuration = 0.3;
  struct Roll {
    double sliding, length, speed;  // -, m, m/s
    double direction;               // rad from x
  };
  const std::array<Roll, 5> rolls = {{{1, 0.002, 0.5, 0},
                                      {1, 0.002, 2, 0},
                                      {0.5, 0.01, 0.5, 0},
                                      {2, 0.005, 1, std::numbers::pi / 2},
                                      {1, 0.005, 1, std::numbers::pi / 4}}};
  Model model;
  model.name = "conformance-rolling-slows";
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  const Solid ball = sphere_solid(1, kBall);
  for (size_t i = 0; i < rolls.size(); ++i) {
    add_free_body(model, fmt::format("ball {}", i), ball,
                  {Vec3(0, 3.0 * static_cast<double>(i), kBall), Quat::Identity()});
    add_contact(model, plane, add_shape(model, ShapeType::kSphere, static_cast<int>(i), {}, kBall, 0, rolls[i].sliding),
                rolls[i].sliding);
    model.contacts.back().rolling = rolls[i].length;
  }
  model = finished(std::move(model));
  State start = model.initial;
  for (size_t i = 0; i < rolls.size(); ++i) {
    const Vec3 along = {std::cos(rolls[i].direction), std::sin(rolls[i].direction), 0};
    start.bodies[i].v_WBcm = rolls[i].speed * along;
    start.bodies[i].w_WB = rolls[i].speed / kBall * Vec3::UnitZ().cross(along);
  }
  const State end = subject.run(model, start, kStep, kDuration);
  Checks checks("");
  for (size_t i = 0; i < rolls.size(); ++i) {
    const double deceleration = rolls[i].length * kGravity * kBall / (ball.I_BBcm_B(1, 1) + ball.mass * kBall * kBall);
    const double lost = rolls[i].speed - end.bodies[i].v_WBcm.norm();
    checks.add(
        std::abs(lost / (deceleration * kDuration) - 1), 0.05,
        fmt::format(
            "speed that a ball loses at {} m/s, {:.0f} degrees from x, with friction {} and rolling friction {} m, "
            "relative",
            rolls[i].speed, rolls[i].direction * 180 / std::numbers::pi, rolls[i].sliding, rolls[i].length));
  }
  return checks.worst();
}

// ---- edges of height fields -----------------------------------------------------------------------------------------

Verdict height_field_edges(const Subject& subject) {
  // a flat field without friction stops nothing that slides over the edges of its triangles
  constexpr double kHalf = 3, kDuration = 1;
  const Vec3 half = {0.1, 0.1, 0.05}, velocity = {1, 0.3, 0};
  struct Kind {
    const char* name;
    ShapeType type;
    Feature feature;
    bool lying;
    double height;
  };
  const std::array<Kind, 6> kinds = {{{"box", ShapeType::kBox, Feature::kBox, false, half.z()},
                                      {"hull", ShapeType::kHull, Feature::kHull, false, half.z()},
                                      {"standing cylinder", ShapeType::kCylinder, Feature::kCylinder, false, 0.05},
                                      {"lying cylinder", ShapeType::kCylinder, Feature::kCylinder, true, 0.05},
                                      {"capsule", ShapeType::kCapsule, Feature::kHeightField, true, 0.05},
                                      {"ball", ShapeType::kSphere, Feature::kHeightField, false, 0.05}}};
  Checks checks("");
  for (const Kind& kind : kinds) {
    if (!subject.accepts(kind.feature)) continue;
    Model model;
    model.name = "conformance-height-field-edges";
    const int field = add_shape(model, ShapeType::kHeightField, kWorld, {}, 0, 0, 0);
    model.shapes[field].data = 0;
    model.height_fields.push_back(flat_field(kHalf, 0.2, 0));
    const Quat q = kind.lying ? about_axis(std::numbers::pi / 2, Vec3::UnitY()) : Quat(Quat::Identity());
    const bool flat = kind.type == ShapeType::kBox || kind.type == ShapeType::kHull;
    Solid solid = sphere_solid(1, 0.05);
    if (flat) {
      const Vec3 s = half.cwiseProduct(half) / 3;
      solid = principal_solid(1, Vec3::Zero(), {s.y() + s.z(), s.x() + s.z(), s.x() + s.y()}, Quat::Identity());
    } else if (kind.type != ShapeType::kSphere) {
      solid = capsule_solid(1, 0.05, 0.05, Vec3::UnitZ());
    }
    add_free_body(model, kind.name, solid, {Vec3(-1.2, 0.07, kind.height), q});
    const int shape = add_shape(model, kind.type, 0, {}, flat ? 0 : 0.05, flat ? 0 : 0.05, 0);
    if (flat) model.shapes[shape].half_size = half;
    if (kind.type == ShapeType::kHull) {
      model.shapes[shape].data = 0;
      model.hulls.push_back(box_hull(half));
    }
    add_contact(model, field, shape, 0);
    model = finished(std::move(model));
    if (subject.refuses(model)) continue;
    State start = model.initial;
    start.bodies[0].v_WBcm = velocity;
    const State end = subject.run(model, start, kStep, kDuration);
    const BodyState& body = end.bodies[0];
    checks.add((body.v_WBcm - velocity).norm() / velocity.norm(), 0.02,
               fmt::format("change of a {}'s velocity in {} s, relative", kind.name, kDuration));
    checks.add(std::abs(body.p_WBcm.z() - kind.height) / kind.height, 0.04,
               fmt::format("height of a {}, relative", kind.name));
  }
  return checks.worst();
}

// ---- the engine's own actuators -------------------------------------------------------------------------------------

namespace {

// Two wheels that turn about their centres of mass, without gravity.
Model two_wheels(const char* name, double inertia) {
  Model model;
  model.name = name;
  model.gravity.setZero();
  for (int i = 0; i < 2; ++i) {
    add_hinged_body(model, fmt::format("wheel_{}", i), kWorld, {Vec3(i, 0, 0), Quat::Identity()},
                    principal_solid(1, Vec3::Zero(), {inertia, inertia, inertia}, Quat::Identity()), {1, 2, 2});
  }
  model.joints[1].reference = 0.2;
  return model;
}

}  // namespace

Verdict actuator_laws(const Subject& subject) {
  // every part of the law at once, from a time on that is not zero: gear, gains, the clamps of control and force, a
  // control that follows a sine, both activations, and a transmission to two joints
  constexpr double kInertia = 0.02, kStart = 0.7, kDuration = 0.4;
  Model model = two_wheels("conformance-actuator-laws", kInertia);
  const auto add = [&](const char* name, std::vector<JointTerm> terms, double control) -> Actuator& {
    Actuator& actuator = model.actuators.emplace_back();
    actuator.name = name;
    actuator.terms = std::move(terms);
    model.control0.push_back(control);
    return actuator;
  };
  Actuator& servo = add("servo", {{0, 2.0}}, 0.4);
  servo.gain = 0.5;
  servo.bias = {0.01, -0.5, -0.03};
  Actuator& motor = add("motor", {{1, -1.5}}, 5);
  motor.control_limited = true;
  motor.control_lower = -0.1;
  motor.control_upper = 0.02;
  Actuator& clamped = add("clamped", {{0, 1.0}}, -3);
  clamped.force_limited = true;
  clamped.force_lower = -0.015;
  clamped.force_upper = 0.5;
  add("sine", {{0, 1.0}}, 0).sine = {0.05, 1.3, 0.4};
  Actuator& filter = add("filter", {{1, 1.0}}, 0.1);
  filter.activation = ActivationType::kFilter;
  filter.time_constant = 0.5;
  filter.sine = {0.03, 0.8, 0};
  Actuator& integrator = add("integrator", {{1, 1.0}}, 0.05);
  integrator.activation = ActivationType::kIntegrator;
  integrator.activation_start = -0.02;
  Actuator& both = add("both", {{0, 1.0}, {1, -0.5}}, 0.2);
  both.gain = 0.3;
  both.bias = {0, -0.3, -0.02};
  model = finished(std::move(model));
  State start = with_joints(model, {0.3, -0.1}, {0.5, -0.4});
  start.time = kStart;
  static const State truth = [&] {
    const auto torques = [&](double time, std::span<const double> position, std::span<const double> velocity,
                             std::span<double> torque) {
      std::ranges::fill(torque, 0.0);
      for (size_t i = 0; i < model.actuators.size(); ++i) {
        const Actuator& actuator = model.actuators[i];
        double length = 0, speed = 0;
        for (const JointTerm& term : actuator.terms) {
          length += term.coefficient * position[term.joint];
          speed += term.coefficient * velocity[term.joint];
        }
        const double force = actuator_force(actuator, actuator_input(actuator, model.control0[i], time), length, speed);
        for (const JointTerm& term : actuator.terms) torque[term.joint] += term.coefficient * force;
      }
    };
    return smooth_solution(model, start, kStart + kDuration, {.tolerance = 1e-12, .torques = torques});
  }();
  const std::vector<double> none(model.joints.size(), 0.0);  // acts beside the actuators, and lets time pass for them
  const auto measure = [&](double timestep) { return subject.run(model, start, timestep, kDuration, none).position; };
  return converges(subject, measure, truth.position, {.duration = kDuration, .unit = "rad", .order = 1, .floor = 1e-9});
}

Verdict velocity_gain(const Subject& subject) {
  // a servo whose velocity gain is 20 times what an explicit step of this length stands: after a moment the wheel
  // creeps to its set point at the rate kp / kv
  constexpr double kInertia = 1e-3, kGain = 200, kDuration = 0.2, kTarget = 0.5;
  constexpr double kVelocityGain = 20 * 2 * kInertia / kStep;
  Model model = two_wheels("conformance-velocity-gain", kInertia);
  for (int j = 0; j < 2; ++j) {  // a position and a velocity servo
    Actuator servo;
    servo.name = fmt::format("servo_{}", j);
    servo.terms = {{j, 1.0}};
    servo.gain = j == 0 ? kGain : kVelocityGain;
    servo.bias = {0, j == 0 ? -kGain : 0, -kVelocityGain};
    model.actuators.push_back(servo);
    model.control0.push_back(kTarget);
  }
  model = finished(std::move(model));
  const State start = with_joints(model, {0, 0.2}, {0, 0});
  // roots of I s^2 + kv s + kp: the slow one rules
  const double sum = kVelocityGain / kInertia;
  const double fast = (sum + std::sqrt(sum * sum - 4 * kGain / kInertia)) / 2, slow = kGain / kInertia / fast;
  const double servo =
      kTarget * (1 - (fast * std::exp(-slow * kDuration) - slow * std::exp(-fast * kDuration)) / (fast - slow));
  const double turned = kTarget * (kDuration - (1 - std::exp(-sum * kDuration)) / sum);
  const std::vector<double> none(model.joints.size(), 0.0);
  std::vector<double> end(2);
  try {
    end = subject.run(model, start, kStep, kDuration, none).position;
  } catch (const EngineError& error) {  // it grew beyond what the engine goes on with
    if (!machine_lack(error).empty()) throw;
    end.assign(2, std::numeric_limits<double>::infinity());
  }
  Checks checks("");
  // from 1 on it only matters that it is wrong
  const auto off = [](double found, double right) {
    return std::isfinite(found) ? std::min(1.0, std::abs(found / right - 1)) : 1.0;
  };
  checks.add(off(end[0], servo), 0.02, "turn of the position servo after 0.2 s, relative");
  checks.add(off(end[1] - 0.2, turned), 0.02, "turn of the velocity servo after 0.2 s, relative");
  return checks.worst();
}

}  // namespace assay::conformance
