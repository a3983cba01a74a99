// What models may use beside hinges, free bodies, spheres, capsules and planes: the words of the table feature x engine
// (`assay list engines --features`). Adapters declare each in Capabilities::features.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"

namespace assay {

enum class Feature {
  kSlide,            // slide joints, with limits, springs, dampers and armature as far as hinges have them
  kBall,             // ball joints
  kBallLimit,        // a largest deflection of a ball joint
  kBallSpring,       // spring and damper of a ball joint
  kBallArmature,     // armature of a ball joint
  kMassless,         // massless bodies: several joints between two bodies with mass
  kDryFriction,      // Coulomb friction in hinges and slides
  kBallDryFriction,  // Coulomb friction in ball joints
  kBox,              // shapes, each against every other that the contender accepts
  kCylinder,
  kEllipsoid,
  kHull,
  kHeightField,
  kTorsionalFriction,  // of contact pairs
  kRollingFriction,
  kCoupling,        // of two joints, position = offset + ratio times the other's
  kCouplingOfMany,  // of a joint to a sum of joints, or held at a position
  kConnect,
  kWeld,
  kTendonSpring,
  kTendonLimit,
  kTendonDryFriction,
};

// All of them, in the order above.
const std::vector<Feature>& all_features();

// "slide joints": as in "Jolt has no slide joints".
std::string feature_name(Feature feature);
// "slide": the key in JSON and on the command line.
std::string feature_key(Feature feature);

// One use of a feature in a model: the element as limitations name it, "joint 'knee'", "geom 'foot' (box)".
struct FeatureUse {
  Feature feature = Feature::kSlide;
  std::string element;
};

// Every use, in the order of the model's elements, sorted by feature. Shapes count where they are in a contact pair.
std::vector<FeatureUse> features_of(const Model& model);

}  // namespace assay
