// Stands in for DART's dart/collision/fcl/FCLCollisionDetector.hpp: a World makes a collision detector before it is
// given one, and DART's choice is FCL's. Here it is ODE's, so that FCL is neither needed nor linked. assay gives every
// World its detector.
#pragma once

#include "dart/collision/ode/OdeCollisionDetector.hpp"

namespace dart::collision {

class FCLCollisionDetector : public OdeCollisionDetector {
 public:
  enum PrimitiveShape { PRIMITIVE, MESH };
  static std::shared_ptr<FCLCollisionDetector> create() {
    return std::shared_ptr<FCLCollisionDetector>(new FCLCollisionDetector);
  }
  void setPrimitiveShapeType(PrimitiveShape /*type*/) {}
};

}  // namespace dart::collision
