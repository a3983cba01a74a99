// What code outside the engines asks about shapes, whatever their type: their words, how far they reach, what stands
// for them in pictures. A type of shape is added to model.h and here; beyond the engines and the loader also to
// features.h, if engines may lack it, and to report/render/renderer.cc, which draws it.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include <Eigen/Geometry>

#include "model/model.h"

namespace assay {

// ---- words ----------------------------------------------------------------------------------------------------------

// "height_field": in stored scenes.
std::string_view shape_name(ShapeType type);
// Nothing for another word.
std::optional<ShapeType> shape_named(std::string_view name);
// "height fields"
std::string_view shapes_text(ShapeType type);

// ---- what describes a type ------------------------------------------------------------------------------------------

bool has_half_size(ShapeType type);  // Shape::half_size
bool has_data(ShapeType type);       // Shape::data

bool is_plane(const Shape& shape);
// A plane or a height field: without a reach.
bool is_ground(const Shape& shape);
// Half of the segment that a sphere or capsule surrounds at its radius, m; nothing of other shapes.
std::optional<double> half_segment(const Shape& shape);

// ---- extent ---------------------------------------------------------------------------------------------------------

// What Shape::data names.
struct ShapeData {
  std::span<const Vec3> corners = {};  // of a hull
  const HeightField* field = nullptr;  // of a height field
};
ShapeData data_of(const Model& model, const Shape& shape);

// The largest way of a point of the shape from the shape frame's origin along a unit direction of the shape frame, m.
// Not of planes and height fields.
double reach(const Shape& shape, const ShapeData& data, const Vec3& direction_S);
double reach(const Model& model, const Shape& shape, const Vec3& direction_S);

// The largest distance of its points from the origin of its frame, m; 0 for a plane.
double largest_reach(const Shape& shape, const ShapeData& data);

// The capsule along a shape's longest axis that stands for it in small pictures: its ends in the shape frame and its
// radius, m.
struct Rod {
  Vec3 a = Vec3::Zero(), b = Vec3::Zero();
  double radius = 0;
};
Rod rod_of(const Shape& shape, const ShapeData& data);

// An axis-aligned box in the frame F.
using Box = Eigen::AlignedBox3d;
Box box_around(const Model& model, const Shape& shape, const Pose& X_FS);

// Pose of a shape in the world.
Pose shape_pose(const Model& model, const State& state, const Shape& shape);

}  // namespace assay
