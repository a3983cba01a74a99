// How far shapes reach.
#pragma once

#include <Eigen/Geometry>

#include "model/model.h"

namespace assay {

// The largest way of a point of the shape from the shape frame's origin along a unit direction of the shape frame, m.
// Not of planes and height fields.
double reach(const Model& model, const Shape& shape, const Vec3& direction_S);

// The axis-aligned box around the shape in the frame F.
using Box = Eigen::AlignedBox3d;
Box box_around(const Model& model, const Shape& shape, const Pose& X_FS);

// Pose of a shape in the world.
Pose shape_pose(const Model& model, const State& state, const Shape& shape);

// A plane or a height field: without a reach.
bool is_ground(const Shape& shape);

}  // namespace assay
