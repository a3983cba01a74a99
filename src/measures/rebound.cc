#include "measures/rebound.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "model/kinematics.h"
#include "model/shape.h"

namespace assay {
namespace {

constexpr double kSpeed = 1;  // m/s, of the impact

// Half of the least extent along the shape's axes, m.
double half_thickness(const Model& model, const Shape& shape) {
  double least = HUGE_VAL;
  for (const Vec3& axis : {Vec3(Vec3::UnitX()), Vec3(Vec3::UnitY()), Vec3(Vec3::UnitZ())}) {
    least = std::min(least, (reach(model, shape, axis) + reach(model, shape, -axis)) / 2);
  }
  return least;
}

struct Ball {
  double radius = HUGE_VAL, mass = 0;
};

Ball smallest_ball(const Model& system) {
  Ball smallest;
  for (const ContactPair& pair : system.contacts) {
    for (const int number : {pair.shape_a, pair.shape_b}) {
      const Shape& shape = system.shapes[static_cast<size_t>(number)];
      if (shape.body == kWorld || system.bodies[static_cast<size_t>(shape.body)].is_massless()) continue;
      const double radius = half_thickness(system, shape);
      if (radius < smallest.radius) smallest = {radius, system.bodies[static_cast<size_t>(shape.body)].mass};
    }
  }
  return smallest;
}

}  // namespace

double least_half_thickness(const Model& system) { return smallest_ball(system).radius; }

std::optional<Experiment> impact_experiment(const Model& system, double timestep_s) {
  constexpr int kPhases = 16, kRow = 4;
  constexpr double kFirstGap = 1.5;    // of the way of a step, so that no contact is there at the start
  constexpr double kLeaveTime = 0.05;  // s, and at least this many steps:
  constexpr double kLeaveSteps = 8;
  const Ball ball = smallest_ball(system);
  if (!(ball.mass > 0) || !(kSpeed * timestep_s <= ball.radius)) return std::nullopt;
  Experiment probe;
  Model& model = probe.model;
  model.name = "impacts";
  model.gravity.setZero();
  Shape plane;
  plane.name = "plane";
  plane.type = ShapeType::kPlane;
  model.shapes.push_back(plane);
  for (int i = 0; i < kPhases; ++i) {
    const double gap = kSpeed * timestep_s * (kFirstGap + static_cast<double>(i) / kPhases);
    const double apart = 10 * ball.radius;
    Body body;
    body.name = fmt::format("ball_{}", i);
    body.X_PB.p = {apart * (i % kRow), apart * (i / kRow), ball.radius + gap};  // NOLINT(bugprone-integer-division)
    body.mass = ball.mass;
    body.I_BBcm_B = Mat3::Identity() * (0.4 * ball.mass * ball.radius * ball.radius);
    model.bodies.push_back(body);
    Shape sphere;
    sphere.name = body.name + "_shape";
    sphere.body = i;
    sphere.radius = ball.radius;
    model.shapes.push_back(sphere);
    model.contacts.push_back({0, i + 1, 1});
  }
  model.initial = reference_state(model);
  for (BodyState& body : model.initial.bodies) body.v_WBcm = {0, 0, -kSpeed};
  model.hash = model_hash(model);
  probe.steps = std::llround(kFirstGap + 1 + std::max(kLeaveSteps, std::ceil(kLeaveTime / timestep_s)));
  return probe;
}

double rebound(const std::vector<State>& states) {
  double fastest = 0;
  for (const State& state : states) {
    for (const BodyState& body : state.bodies) fastest = std::max(fastest, body.v_WBcm.z());
  }
  return fastest / kSpeed;
}

}  // namespace assay
