// Bullet's shapes for those of a model.
#pragma once

#include <memory>
#include <vector>

#include <btBulletCollisionCommon.h>

#include "model/model.h"

namespace assay::bullet {

// A shape and what it points to. Its frame is the model's shape frame moved by `X_SB`.
struct MadeShape {
  std::unique_ptr<btCollisionShape> shape;
  Pose X_SB;
  std::vector<btScalar> heights;  // of a height field, which does not copy them
};

MadeShape make_shape(const Model& model, const Shape& shape);

}  // namespace assay::bullet
