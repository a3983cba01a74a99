#include "model/features.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "model/pair_groups.h"

namespace assay {
namespace {

struct Row {
  Feature feature;
  const char* key;
  const char* name;
};

constexpr auto kRows = std::to_array<Row>({
    {Feature::kSlide, "slide", "slide joints"},
    {Feature::kBall, "ball", "ball joints"},
    {Feature::kBallLimit, "ball-limit", "limits of ball joints"},
    {Feature::kBallSpring, "ball-spring", "springs and dampers of ball joints"},
    {Feature::kBallArmature, "ball-armature", "armature of ball joints"},
    {Feature::kMassless, "massless", "massless bodies (several joints in one body)"},
    {Feature::kDryFriction, "dry-friction", "dry friction in joints"},
    {Feature::kBallDryFriction, "ball-dry-friction", "dry friction in ball joints"},
    {Feature::kBox, "box", "boxes"},
    {Feature::kCylinder, "cylinder", "cylinders"},
    {Feature::kEllipsoid, "ellipsoid", "ellipsoids"},
    {Feature::kHull, "hull", "convex hulls (meshes)"},
    {Feature::kHeightField, "height-field", "height fields"},
    {Feature::kTorsionalFriction, "torsional-friction", "torsional friction of contacts"},
    {Feature::kRollingFriction, "rolling-friction", "rolling friction of contacts"},
    {Feature::kCoupling, "coupling", "coupling of two joints"},
    {Feature::kCouplingOfMany, "coupling-of-many", "coupling of a joint to several or to none"},
    {Feature::kConnect, "connect", "connect constraints"},
    {Feature::kWeld, "weld", "weld constraints"},
    {Feature::kTendonSpring, "tendon-spring", "springs and dampers of tendons"},
    {Feature::kTendonLimit, "tendon-limit", "limits of tendons"},
    {Feature::kTendonDryFriction, "tendon-dry-friction", "dry friction of tendons"},
});

const Row& row(Feature feature) { return *std::ranges::find(kRows, feature, &Row::feature); }

std::optional<std::pair<Feature, const char*>> shape_feature(ShapeType type) {
  switch (type) {
    case ShapeType::kBox:
      return std::pair{Feature::kBox, "box"};
    case ShapeType::kCylinder:
      return std::pair{Feature::kCylinder, "cylinder"};
    case ShapeType::kEllipsoid:
      return std::pair{Feature::kEllipsoid, "ellipsoid"};
    case ShapeType::kHull:
      return std::pair{Feature::kHull, "mesh"};
    case ShapeType::kHeightField:
      return std::pair{Feature::kHeightField, "height field"};
    case ShapeType::kSphere:
    case ShapeType::kCapsule:
    case ShapeType::kPlane:
      break;
  }
  return std::nullopt;
}

}  // namespace

const std::vector<Feature>& all_features() {
  static const std::vector<Feature> features = [] {
    std::vector<Feature> all;
    all.reserve(kRows.size());
    for (const Row& each : kRows) all.push_back(each.feature);
    return all;
  }();
  return features;
}

std::string feature_name(Feature feature) { return row(feature).name; }
std::string feature_key(Feature feature) { return row(feature).key; }

std::vector<FeatureUse> features_of(const Model& model) {
  std::vector<FeatureUse> uses;
  const auto use = [&uses](bool used, Feature feature, std::string element) {
    if (used) uses.push_back({feature, std::move(element)});
  };
  for (const Body& body : model.bodies) {
    use(body.is_massless(), Feature::kMassless, fmt::format("body '{}'", body.name));
  }
  for (const Joint& joint : model.joints) {
    const std::string element = fmt::format("joint '{}'", joint.name);
    use(joint.is_slide(), Feature::kSlide, element);
    use(joint.dry_friction != 0, Feature::kDryFriction, element);
  }
  for (const BallJoint& ball : model.balls) {
    const std::string element = fmt::format("joint '{}'", ball.name);
    use(true, Feature::kBall, element);
    use(ball.limited, Feature::kBallLimit, element);
    use(ball.has_spring(), Feature::kBallSpring, element);
    use(ball.armature != 0, Feature::kBallArmature, element);
    use(ball.dry_friction != 0, Feature::kBallDryFriction, element);
  }
  std::vector<bool> touches(model.shapes.size(), false);
  PairGroups torsional(model), rolling(model);
  for (const ContactPair& pair : model.contacts) {
    touches[pair.shape_a] = touches[pair.shape_b] = true;
    if (pair.torsional != 0) torsional.add(pair);
    if (pair.rolling != 0) rolling.add(pair);
  }
  for (std::string& element : torsional.elements()) use(true, Feature::kTorsionalFriction, std::move(element));
  for (std::string& element : rolling.elements()) use(true, Feature::kRollingFriction, std::move(element));
  for (size_t s = 0; s < model.shapes.size(); ++s) {
    if (const auto found = shape_feature(model.shapes[s].type); found && touches[s]) {
      use(true, found->first, fmt::format("geom '{}' ({})", model.shapes[s].name, found->second));
    }
  }
  for (const Coupling& coupling : model.couplings) {
    use(true, coupling.terms.size() == 1 ? Feature::kCoupling : Feature::kCouplingOfMany,
        fmt::format("coupling '{}'", coupling.name));
  }
  for (const Connect& connect : model.connects) {
    use(true, Feature::kConnect, fmt::format("connect '{}'", connect.name));
  }
  for (const Weld& weld : model.welds) use(true, Feature::kWeld, fmt::format("weld '{}'", weld.name));
  for (const Tendon& tendon : model.tendons) {
    const std::string element = fmt::format("tendon '{}'", tendon.name);
    use(tendon.has_spring(), Feature::kTendonSpring, element);
    use(tendon.limited, Feature::kTendonLimit, element);
    use(tendon.dry_friction != 0, Feature::kTendonDryFriction, element);
  }
  std::ranges::stable_sort(uses, {}, &FeatureUse::feature);
  return uses;
}

}  // namespace assay
