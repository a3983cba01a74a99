// Boxes, cylinders, ellipsoids, hulls, height fields; torsional and rolling friction.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "conformance/models.h"
#include "conformance/tests.h"
#include "model/kinematics.h"

namespace assay::conformance {
namespace {

// Gravity of a slope that falls towards +x: the plane itself stays level.
Vec3 on_slope(double tangent) {
  const double angle = std::atan(tangent);
  return kGravity * Vec3(std::sin(angle), 0, -std::cos(angle));
}

Solid ellipsoid_solid(double mass, const Vec3& half) {
  const Vec3 square = half.cwiseProduct(half) * mass / 5;
  return principal_solid(mass, Vec3::Zero(), {square[1] + square[2], square[0] + square[2], square[0] + square[1]},
                         Quat::Identity());
}

// A free box, as a box or as a hull, on the plane `plane`; its body.
int add_box(Model& model, ShapeType type, int ground, const Vec3& half, const Vec3& position, double friction) {
  const int body = static_cast<int>(model.bodies.size());
  add_free_body(model, fmt::format("box_{}", body), box_solid(1, half), {position, Quat::Identity()});
  const int shape = add_shape(model, type, body, {}, 0, 0, friction);
  if (type == ShapeType::kHull) {
    model.shapes[shape].data = static_cast<int>(model.hulls.size());
    model.hulls.push_back(box_hull(half));
    model.hulls.back().name = fmt::format("hull_{}", body);
  } else {
    model.shapes[shape].half_size = half;
  }
  add_contact(model, ground, shape, friction);
  return body;
}

// A box on a slope, below and above the angle at which it slides.
Verdict slides(const Subject& subject, ShapeType type) {
  constexpr double kFriction = 0.5, kDuration = 0.6, kFrom = 0.1;
  const Vec3 half(0.1, 0.1, 0.05);
  Checks checks("");
  for (const double tangent : {0.4, 0.7}) {
    Model model;
    model.name = "conformance-box-slides";
    model.gravity = on_slope(tangent);
    const int plane = add_shape(model, ShapeType::kPlane, kWorld, {}, 0, 0, kFriction);
    add_box(model, type, plane, half, {0, 0, half.z()}, kFriction);
    model = finished(std::move(model));
    const std::vector<State> states = subject.record(model, model.initial, kStep, kDuration);
    // contacts take some steps to build up: from 0.1 s on
    const State &from = states.at(static_cast<size_t>(std::llround(kFrom / kStep))), &to = states.back();
    const double time = to.time - from.time;
    const Vec3 gained = to.bodies[0].v_WBcm - from.bodies[0].v_WBcm;
    if (tangent < kFriction) {
      checks.add(std::abs(to.bodies[0].p_WBcm.x()) / (model.gravity.x() * kDuration * kDuration / 2), 0.01,
                 fmt::format("way at a slope of {}, relative to the way without friction", tangent));
    } else {
      // by impulses, as in friction-per-pair; the four corners of a soft contact do not bear alike, hence 2 %
      const double coefficient = (model.gravity.x() * time - gained.x()) / (gained.z() - model.gravity.z() * time);
      checks.add(
          std::abs(coefficient / kFriction - 1), 0.02,
          fmt::format("friction impulse over normal impulse {:.4f} at a slope of {}, relative", coefficient, tangent));
    }
    checks.add(angle_between(to.bodies[0].q_WB, Quat::Identity()), 0.01,
               fmt::format("turn of the box at a slope of {}, rad", tangent));
  }
  return checks.worst();
}

// A box on a slope, below and above the angle at which it tips: width over height.
Verdict tips(const Subject& subject, ShapeType type) {
  constexpr double kFriction = 1, kDuration = 0.5;
  const Vec3 half(0.05, 0.1, 0.125);
  const double ratio = half.x() / half.z();
  Checks checks("rad");
  for (const double tangent : {0.9 * ratio, 1.2 * ratio}) {
    Model model;
    model.name = "conformance-box-tips";
    model.gravity = on_slope(tangent);
    const int plane = add_shape(model, ShapeType::kPlane, kWorld, {}, 0, 0, kFriction);
    add_box(model, type, plane, half, {0, 0, half.z()}, kFriction);
    model = finished(std::move(model));
    const State end = subject.run(model, model.initial, kStep, kDuration);
    const double angle = angle_between(end.bodies[0].q_WB, Quat::Identity());
    if (tangent < ratio) {
      checks.add(angle, 0.01, fmt::format("turn at {:.2f} of the slope at which it tips", tangent / ratio));
      continue;
    }
    // about its lower edge: I q'' = m (g_x z + g_z x) with the centre at (x, z) from the edge
    const double reach = std::hypot(half.x(), half.z());
    const double inertia = (half.x() * half.x() + half.z() * half.z()) / 3 + reach * reach;
    const double first = std::atan2(half.z(), -half.x());  // the centre's direction from the edge
    double q = 0, rate = 0;
    constexpr int kSteps = 5000;
    for (int n = 0; n < kSteps; ++n) {
      const double direction = first - q;
      const double moment = reach * (std::sin(direction) * model.gravity.x() - std::cos(direction) * model.gravity.z());
      rate += moment / inertia * kDuration / kSteps;
      q += rate * kDuration / kSteps;
    }
    // it begins to tip a few steps late where a contact is soft: that shifts the time by up to 10 ms
    checks.add(std::abs(angle - q), 0.01 * rate + 0.01,
               fmt::format("turn {:.3f} rad at {:.2f} of the slope at which it tips, against {:.3f} rad", angle,
                           tangent / ratio, q));
  }
  return checks.worst();
}

}  // namespace

Verdict box_slides(const Subject& subject) { return slides(subject, ShapeType::kBox); }
Verdict box_tips(const Subject& subject) { return tips(subject, ShapeType::kBox); }
Verdict hull_slides(const Subject& subject) { return slides(subject, ShapeType::kHull); }
Verdict hull_tips(const Subject& subject) { return tips(subject, ShapeType::kHull); }

Verdict cylinder_rolls(const Subject& subject) {
  constexpr double kRadius = 0.1, kHalf = 0.15, kTangent = 0.2, kDuration = 0.8;
  Model model;
  model.name = "conformance-cylinder-rolls";
  model.gravity = on_slope(kTangent);
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  const Quat lying(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitX()));
  add_free_body(model, "cylinder", cylinder_solid(1, kRadius, kHalf), {Vec3(0, 0, kRadius), lying});
  add_contact(model, plane, add_shape(model, ShapeType::kCylinder, 0, {}, kRadius, kHalf), 1);
  model = finished(std::move(model));
  const State end = subject.run(model, model.initial, kStep, kDuration);
  const double speed = 2 * model.gravity.x() * kDuration / 3;
  Checks checks("");
  checks.add(std::abs(end.bodies[0].v_WBcm.x() / speed - 1), 0.02, "speed against 2/3 g sin(angle) t, relative");
  checks.add(std::abs(end.bodies[0].w_WB.y() * kRadius / speed - 1), 0.02, "turning against rolling, relative");
  checks.add(std::abs(end.bodies[0].p_WBcm.y()) / end.bodies[0].p_WBcm.x(), 0.02, "way aside, relative");
  return checks.worst();
}

Verdict ellipsoid_rocks(const Subject& subject) {
  // Rocks about its flat side without slipping. With h(q) the height of the centre and r(q) its distance from the
  // contact, (I + m r^2) q'^2 / 2 + m g h = m g h(amplitude): the quarter period by quadrature over q = A sin(s).
  constexpr double kLong = 0.2, kFlat = 0.12, kAmplitude = 0.15;
  const Vec3 half(kLong, 0.15, kFlat);
  const Solid solid = ellipsoid_solid(1, half);
  const auto height = [&](double q) { return std::hypot(kFlat * std::cos(q), kLong * std::sin(q)); };
  double quarter = 0;
  constexpr int kPoints = 400;
  for (int n = 0; n < kPoints; ++n) {
    const double s = (n + 0.5) / kPoints * std::numbers::pi / 2, q = kAmplitude * std::sin(s);
    const double aside = (kLong * kLong - kFlat * kFlat) * std::sin(q) * std::cos(q) / height(q);
    const double inertia = solid.I_BBcm_B(1, 1) + height(q) * height(q) + aside * aside;
    const double rate = std::sqrt(2 * kGravity * (height(kAmplitude) - height(q)) / inertia);
    quarter += kAmplitude * std::cos(s) / rate * (std::numbers::pi / 2 / kPoints);
  }
  Model model;
  model.name = "conformance-ellipsoid-rocks";
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  add_free_body(model, "egg", solid,
                {Vec3(0, 0, height(kAmplitude)), Quat(Eigen::AngleAxisd(kAmplitude, Vec3::UnitY()))});
  const int shape = add_shape(model, ShapeType::kEllipsoid, 0);
  model.shapes[shape].half_size = half;
  add_contact(model, plane, shape, 1);
  model = finished(std::move(model));
  const std::vector<State> states = subject.record(model, model.initial, kStep, std::ceil(500 * quarter) / 100);
  // two passages through level, half a period apart
  const auto tilt = [](const State& state) { return (state.bodies[0].q_WB * Vec3(Vec3::UnitX())).z(); };
  std::vector<double> passages;
  for (size_t i = 1; i < states.size(); ++i) {
    const double a = tilt(states[i - 1]), b = tilt(states[i]);
    if ((a > 0) != (b > 0)) passages.push_back(states[i - 1].time + kStep * a / (a - b));
  }
  if (passages.size() < 2) throw EngineError("the ellipsoid did not rock through level twice within 1.25 periods");
  Checks checks("");
  checks.add(std::abs((passages[1] - passages[0]) / (2 * quarter) - 1), 0.02,
             fmt::format("half a period against {:.4f} s, relative", 2 * quarter));
  return checks.worst();
}

Verdict resting_shapes(const Subject& subject) {
  // each shape that the contender has, upright or lying, dropped 1 cm onto the plane, and onto a fixed box
  constexpr double kRadius = 0.1, kHalf = 0.15, kDrop = 0.01, kTop = 0.2;
  const Vec3 half(0.1, 0.12, 0.08);
  struct Kind {
    ShapeType type;
    Feature feature;
    bool lying;
    double height;
  };
  std::vector<Kind> kinds = {{ShapeType::kBox, Feature::kBox, false, half.z()},
                             {ShapeType::kHull, Feature::kHull, false, half.z()},
                             {ShapeType::kCylinder, Feature::kCylinder, false, kHalf},
                             {ShapeType::kCylinder, Feature::kCylinder, true, kRadius},
                             {ShapeType::kEllipsoid, Feature::kEllipsoid, false, half.z()}};
  std::erase_if(kinds, [&](const Kind& kind) { return !subject.accepts(kind.feature); });
  // Adds a shape above the plane, or above a box of its own; gives the height that it will rest at.
  const auto add = [&](Model& model, int plane, size_t k, bool on_box) {
    const Kind& kind = kinds[k];
    const Vec3 place(static_cast<double>(k), on_box ? 2 : 0, 0);
    int ground = plane;
    if (on_box) {
      ground = add_shape(model, ShapeType::kBox, kWorld, {place + Vec3(0, 0, kTop / 2), Quat::Identity()});
      model.shapes[ground].half_size = {0.3, 0.3, kTop / 2};
    }
    const double height = kind.height + (on_box ? kTop : 0);
    const Vec3 position = place + Vec3(0, 0, height + kDrop);
    if (kind.type == ShapeType::kBox || kind.type == ShapeType::kHull) {
      add_box(model, kind.type, ground, half, position, 1);
      return height;
    }
    const int body = static_cast<int>(model.bodies.size());
    const bool cylinder = kind.type == ShapeType::kCylinder;
    const Quat q = kind.lying ? Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitX())) : Quat(Quat::Identity());
    add_free_body(model, fmt::format("{}{}", kind.lying ? "lying " : "", cylinder ? "cylinder" : "ellipsoid"),
                  cylinder ? cylinder_solid(1, kRadius, kHalf) : ellipsoid_solid(1, half), {position, q});
    const int shape = add_shape(model, kind.type, body, {}, cylinder ? kRadius : 0, cylinder ? kHalf : 0);
    if (!cylinder) model.shapes[shape].half_size = half;
    add_contact(model, ground, shape, 1);
    return height;
  };
  // An engine may have no collision of two shapes that it has, and say so of the pair. Every shape lies on the plane.
  const auto refused_on_box = [&](size_t k) {
    Model alone;
    alone.name = "conformance-resting-on-box";
    add(alone, kWorld, k, true);
    return subject.refuses(finished(std::move(alone)));
  };
  Model model;
  model.name = "conformance-resting-shapes";
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  std::vector<double> heights;
  for (const bool on_box : {false, true}) {
    if (on_box && !subject.accepts(Feature::kBox)) continue;
    for (size_t k = 0; k < kinds.size(); ++k) {
      if (!on_box || !refused_on_box(k)) heights.push_back(add(model, plane, k, on_box));
    }
  }
  model = finished(std::move(model));
  const State end = subject.run(model, model.initial, kStep, 1);
  Checks checks("m");
  for (size_t i = 0; i < heights.size(); ++i) {
    checks.add(std::abs(end.bodies[i].p_WBcm.z() - heights[i]), 0.02 * kRadius,
               fmt::format("height of '{}' against {:.4f} m", model.bodies[i].name, heights[i]));
  }
  return checks.worst();
}

Verdict height_field(const Subject& subject) {
  // a flat field is a plane; a field with a slope is a tilted one
  constexpr double kRadius = 0.1, kHalf = 2, kSlope = 0.2, kDuration = 0.8, kDrop = 0.01;
  Checks checks("");
  for (const double slope : {0.0, kSlope}) {
    Model model;
    model.name = "conformance-height-field";
    const int field = add_shape(model, ShapeType::kHeightField, kWorld);
    model.shapes[field].data = 0;
    model.height_fields.push_back(flat_field(kHalf, 0.2, slope));
    const double angle = std::atan(slope);
    // heights begin with 0 at x = -half; the ball starts one metre from the upper end
    const double x = slope > 0 ? kHalf - 1 : 0.13, ground = slope * (x + kHalf);
    const double drop = slope > 0 ? 0 : kDrop;
    add_free_body(model, "ball", sphere_solid(1, kRadius),
                  {Vec3(x, 0.07, ground + kRadius / std::cos(angle) + drop), Quat::Identity()});
    add_contact(model, field, add_shape(model, ShapeType::kSphere, 0, {}, kRadius), 1);
    model = finished(std::move(model));
    const State end = subject.run(model, model.initial, kStep, kDuration);
    const Vec3 p = end.bodies[0].p_WBcm;
    const double above = (p.z() - slope * (p.x() + kHalf)) * std::cos(angle);
    checks.add(std::abs(above / kRadius - 1), 0.02,
               fmt::format("height above the field with slope {} against the radius, relative", slope));
    if (slope > 0) {
      const double speed = 5 * kGravity * std::sin(angle) * kDuration / 7;
      checks.add(std::abs(end.bodies[0].v_WBcm.norm() / speed - 1), 0.05,
                 "speed of a ball that rolls down against 5/7 g sin(angle) t, relative");
    }
  }
  return checks.worst();
}

Verdict torsional_friction(const Subject& subject) {
  // a ball that spins about the vertical stops after I w / (length m g)
  constexpr double kRadius = 0.1, kLength = 0.004, kRate = 6;
  Model model;
  model.name = "conformance-torsional-friction";
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  const Solid ball = sphere_solid(1, kRadius);
  add_free_body(model, "ball", ball, {Vec3(0, 0, kRadius), Quat::Identity()});
  add_contact(model, plane, add_shape(model, ShapeType::kSphere, 0, {}, kRadius), 1);
  model.contacts[0].torsional = kLength;
  model = finished(std::move(model));
  State start = model.initial;
  start.bodies[0].w_WB = {0, 0, kRate};
  const double deceleration = kLength * kGravity / ball.I_BBcm_B(2, 2), stop = kRate / deceleration;
  const double half = std::round(stop / 2 / kStep) * kStep;
  Checks checks("");
  const State middle = subject.run(model, start, kStep, half);
  checks.add(std::abs(middle.bodies[0].w_WB.z() / (kRate - deceleration * half) - 1), 0.02,
             fmt::format("spin half-way to its stop at {:.3f} s, relative", stop));
  const State end = subject.run(model, start, kStep, 4 * half);
  checks.add(end.bodies[0].w_WB.norm() / kRate, 0.02, "spin after the stop, relative to the first");
  return checks.worst();
}

Verdict rolling_friction(const Subject& subject) {
  // a ball that rolls slows down by length m g R / (I + m R^2)
  constexpr double kRadius = 0.1, kLength = 0.004, kSpeed = 0.5;
  Model model;
  model.name = "conformance-rolling-friction";
  const int plane = add_shape(model, ShapeType::kPlane, kWorld);
  const Solid ball = sphere_solid(1, kRadius);
  add_free_body(model, "ball", ball, {Vec3(0, 0, kRadius), Quat::Identity()});
  add_contact(model, plane, add_shape(model, ShapeType::kSphere, 0, {}, kRadius), 1);
  model.contacts[0].rolling = kLength;
  model = finished(std::move(model));
  State start = model.initial;
  start.bodies[0].v_WBcm = {kSpeed, 0, 0};
  start.bodies[0].w_WB = {0, kSpeed / kRadius, 0};
  const double deceleration = kLength * kGravity * kRadius / (ball.I_BBcm_B(1, 1) + kRadius * kRadius),
               stop = kSpeed / deceleration;
  const double half = std::round(stop / 2 / kStep) * kStep;
  Checks checks("");
  const State middle = subject.run(model, start, kStep, half);
  checks.add(std::abs(middle.bodies[0].v_WBcm.x() / (kSpeed - deceleration * half) - 1), 0.02,
             fmt::format("speed half-way to its stop at {:.3f} s, relative", stop));
  const State end = subject.run(model, start, kStep, 4 * half);
  checks.add(end.bodies[0].v_WBcm.norm() / kSpeed, 0.02, "speed after the stop, relative to the first");
  return checks.worst();
}

}  // namespace assay::conformance
