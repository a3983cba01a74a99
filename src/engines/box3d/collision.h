// Which shapes Box3D gets, which pairs of them may touch, with what friction; and the forces of contacts.
#pragma once

#include <cstdint>
#include <vector>

#include "engines/adapter.h"
#include "library.h"
#include "shapes.h"

namespace assay::box3d {

class Collision {
 public:
  // `model` outlives it; its bodies start in `start`.
  Collision(const Model& model, const State& start, const Options& options);
  Collision(const Collision&) = delete;
  Collision& operator=(const Collision&) = delete;

  // Sets filter and friction of a world that is about to be made.
  void prepare(b3WorldDef& definition) const;
  // Makes the shapes of a model that has contact pairs. `bodies` are Box3D's, in the model's order, with their frames
  // at their centres of mass.
  void create_shapes(b3WorldId world, const std::vector<b3BodyId>& bodies);
  // Whether two bodies have a contact pair, so that a joint between them has to let them touch.
  bool can_touch(int body_a, int body_b) const;

  // The contact points of the last step, whose bodies were at `centres` when it began.
  void read_forces(const std::vector<b3BodyId>& bodies, const std::vector<Vec3>& centres,
                   std::vector<ContactForce>& out) const;

 private:
  // What Box3D passes back of a shape: it gives friction callbacks no context.
  struct Tag {
    const Collision* owner = nullptr;
    int shape = 0;  // index into Model::shapes
    int row = 0;    // of the tables below
  };
  static const Tag& tag_of(b3ShapeId shape) { return *static_cast<const Tag*>(b3Shape_GetUserData(shape)); }
  static bool may_touch(b3ShapeId a, b3ShapeId b, void* context);
  static float larger_friction(float a, uint64_t, float b, uint64_t);
  static float pair_friction(float, uint64_t a, float, uint64_t b);
  bool is_filtered(size_t shape) const;
  size_t at(int row_a, int row_b) const { return (static_cast<size_t>(row_a) * shapes_.count) + row_b; }

  const Model& model_;
  const State& start_;  // read in create_shapes() only
  ContactShapes shapes_;
  ShapeFriction friction_;
  bool by_shape_;                     // whether friction_ gives every pair its own
  std::vector<bool> touch_;           // rows x rows
  std::vector<float> pair_friction_;  // the same; empty when by_shape_
  std::vector<Tag> tags_;             // by Model::shapes
  ShapeMaker maker_;
  Restitution restitution_;
};

}  // namespace assay::box3d
