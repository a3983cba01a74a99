// Every word of model/features.h: what a contender does not declare it refuses, and what it declares it can run.
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "conformance/models.h"
#include "conformance/tests.h"
#include "isolate/machine_lack.h"
#include "model/kinematics.h"

namespace assay::conformance {
namespace {

// The smallest model that uses `feature`, in its initial state.
Model model_with(Feature feature) {
  Model model;
  model.name = "conformance-feature-" + feature_key(feature);
  const Solid solid = sphere_solid(1, 0.1);
  const Pose above = {Vec3(0, 0, 1), Quat::Identity()};
  const auto hinges = [&] {
    add_hinged_body(model, "first", kWorld, above, solid, Vec3::UnitY(), {0, 0, 0.2});
    add_hinged_body(model, "second", kWorld, {Vec3(1, 0, 1), Quat::Identity()}, solid, Vec3::UnitY(), {0, 0, 0.2});
  };
  const auto tendon = [&]() -> Tendon& {
    hinges();
    model.tendons.push_back({.name = "tendon", .terms = {{0, 1.0}, {1, -1.0}}});
    return model.tendons.back();
  };
  const auto ball = [&]() -> BallJoint& { return add_ball_body(model, "ball", kWorld, above, solid, {0, 0, 0.2}); };
  // the shape that touches a sphere, or the plane
  const auto touching = [&](ShapeType type) -> Shape& {
    add_free_body(model, "body", solid, above);
    const int shape = add_shape(model, type, type == ShapeType::kHeightField ? kWorld : 0, {}, 0.1, 0.1);
    model.shapes[shape].half_size = {0.1, 0.1, 0.1};
    const bool field = type == ShapeType::kHeightField;
    const int other =
        field ? add_shape(model, ShapeType::kSphere, 0, {}, 0.1) : add_shape(model, ShapeType::kPlane, kWorld);
    add_contact(model, shape, other, 0.5);
    return model.shapes[shape];
  };
  switch (feature) {
    case Feature::kSlide:
      add_sliding_body(model, "slide", kWorld, above, solid, Vec3::UnitZ());
      break;
    case Feature::kBall:
      ball();
      break;
    case Feature::kBallLimit:
      ball().limited = true;
      model.balls[0].upper = 0.8;
      break;
    case Feature::kBallSpring:
      ball().stiffness = 1;
      break;
    case Feature::kBallArmature:
      ball().armature = 0.01;
      break;
    case Feature::kMassless:
      add_hinged_body(model, "first", kWorld, above, massless(), Vec3::UnitX(), {0, 0, 0.2});
      add_hinged_body(model, "second", 0, {}, solid, Vec3::UnitY(), {0, 0, 0.2});
      break;
    case Feature::kDryFriction:
      hinges();
      model.joints[0].dry_friction = 0.1;
      break;
    case Feature::kBallDryFriction:
      ball().dry_friction = 0.1;
      break;
    case Feature::kBox:
      touching(ShapeType::kBox);
      break;
    case Feature::kCylinder:
      touching(ShapeType::kCylinder);
      break;
    case Feature::kEllipsoid:
      touching(ShapeType::kEllipsoid);
      break;
    case Feature::kHull:
      touching(ShapeType::kHull).data = 0;
      model.hulls.push_back(box_hull({0.1, 0.1, 0.1}));
      break;
    case Feature::kHeightField:
      touching(ShapeType::kHeightField).data = 0;
      model.height_fields.push_back(flat_field(2, 0.1, 0));
      break;
    case Feature::kTorsionalFriction:
    case Feature::kRollingFriction:
      touching(ShapeType::kSphere);
      (feature == Feature::kRollingFriction ? model.contacts[0].rolling : model.contacts[0].torsional) = 0.01;
      break;
    case Feature::kCoupling:
      hinges();
      model.couplings.push_back({"coupling", 1, {{0, -2.0}}, 0});
      break;
    case Feature::kCouplingOfMany:
      hinges();
      model.couplings.push_back({"held", 1, {}, 0});
      break;
    case Feature::kConnect:
      hinges();
      model.connects.push_back({"connect", 0, 1, {0.5, 0, 0}, {-0.5, 0, 0}});
      break;
    case Feature::kWeld:
      add_free_body(model, "body", solid, above);
      model.welds.push_back({"weld", 0, kWorld, above.inverse()});
      break;
    case Feature::kTendonSpring:
      tendon().stiffness = 1;
      break;
    case Feature::kTendonLimit:
      tendon().limited = true;
      model.tendons[0].lower = -0.5;
      model.tendons[0].upper = 0.5;
      break;
    case Feature::kTendonDryFriction:
      tendon().dry_friction = 0.1;
      break;
  }
  return finished(std::move(model));
}

bool is_finite(const State& state) {
  return std::ranges::all_of(all_numbers(state), [](double number) { return std::isfinite(number); });
}

}  // namespace

Verdict declared_features(const Subject& subject) {
  constexpr double kTimestep = 1e-3, kDuration = 0.01;
  Verdict verdict;
  verdict.note = "features that are refused although they are declared, or run although they are not";
  std::string wrong;
  for (const Feature feature : all_features()) {
    const Model model = model_with(feature);
    if (!model.contacts.empty() && !subject.capabilities().contact) continue;
    const bool declared =
        std::ranges::all_of(features_of(model), [&](const FeatureUse& use) { return subject.accepts(use.feature); });
    std::string problem;
    try {
      const State end = subject.run(model, model.initial, kTimestep, kDuration);
      if (!declared) {
        problem = "runs, undeclared";
      } else if (!is_finite(end)) {
        problem = "gives no finite numbers";
      }
    } catch (const UnsupportedError& error) {
      if (declared) problem = error.what();
    } catch (const EngineError& error) {
      if (!machine_lack(error).empty()) throw;  // no verdict
      problem = error.what();
    }
    if (problem.empty()) continue;
    ++verdict.figure;
    wrong += fmt::format("{}{}: {}", wrong.empty() ? "" : "; ", feature_key(feature), problem);
  }
  if (!wrong.empty()) verdict.note += " (" + wrong + ")";
  return verdict;
}

}  // namespace assay::conformance
