// Collision set-up of one simulation: which of a model's shapes Bullet gets, which pairs may touch, with what friction.
//
// Bullet filters and combines friction by collision object; the model does so by shape. Where that differs (several
// shapes on a body), child shapes are told apart by their index in the compound.
#pragma once

#include <memory>
#include <vector>

#include <btBulletCollisionCommon.h>

#include "engines/adapter.h"
#include "model/kinematics.h"
#include "model/model.h"
#include "shapes.h"

namespace assay::bullet {

// A body's frame in Bullet: origin at the centre of mass, axes along principal axes of inertia.
struct BodyFrame {
  Pose X_BI;     // in the body frame
  Vec3 inertia;  // principal moments, kg m^2
};

class Collision : public btOverlapFilterCallback {
 public:
  // `turning_friction`: whether pairs have their torsional and rolling friction, else they have none. `compliance` in
  // the unit of mass of the simulation.
  Collision(const Model& model, bool turning_friction, const ContactCompliance& compliance,
            const Restitution& restitution);

  const BodyFrame& frame(int body) const { return frames_[body]; }

  // The shape of a moving body in its Bullet frame; null when nothing can touch it.
  btCollisionShape* body_shape(int body) const { return body_shapes_[body]; }

  // Marks a collision object as that of `body`, which has a shape. From then on the pair table applies to it.
  void claim(btCollisionObject& object, int body) const { mark(object, object_of_body_[body]); }

  // The fixed world's collision objects, marked and placed.
  const std::vector<std::unique_ptr<btCollisionObject>>& world_objects() const { return world_objects_; }

  // Which of Model::shapes an object's child is; -1 for one that touches nothing.
  int shape_of(const btCollisionObject& object, int child) const { return shape_of_row_[shape_row(object, child)]; }

  // Points Bullet's global hooks at functions of this file, which read the simulation off the objects they are given.
  static void install_hooks();

  bool needBroadphaseCollision(btBroadphaseProxy* proxy_a, btBroadphaseProxy* proxy_b) const override;

 private:
  // Coulomb coefficient; torsional and rolling friction in m.
  struct PairFriction {
    btScalar slide = 0, spin = 0, roll = 0;

    bool operator==(const PairFriction&) const = default;
  };

  struct ShapeTag {
    const Collision* owner;
    int shape;  // row of the shape table
  };

  void choose_frames(const Model& model);
  void make_shapes(const Model& model);
  void make_tables(const Model& model);
  btCollisionShape* add_shape(const Model& model, int shape);
  void mark(btCollisionObject& object, int number) const;

  // Of the callbacks; `child` is the compound's child index, for an object of one shape any number.
  bool shapes_touch(int row_a, int row_b) const { return touch_[index(row_a, row_b)] != 0; }
  int shape_row(const btCollisionObject& object, int child) const;
  size_t index(int row_a, int row_b) const { return static_cast<size_t>(row_a) * rows_ + row_b; }
  static bool children_touch(const btCollisionShape* a, const btCollisionShape* b);
  static const PairFriction& friction_of_objects(const btCollisionObject* a, const btCollisionObject* b);
  static btScalar sliding_friction(const btCollisionObject* a, const btCollisionObject* b);
  static btScalar spinning_friction(const btCollisionObject* a, const btCollisionObject* b);
  static btScalar rolling_friction(const btCollisionObject* a, const btCollisionObject* b);
  static bool shape_friction(btManifoldPoint& point, const btCollisionObjectWrapper* a, int part_a, int child_a,
                             const btCollisionObjectWrapper* b, int part_b, int child_b);

  static bool renew_point(btManifoldPoint& point, void* a, void* b);

  bool turning_friction_;
  ContactCompliance compliance_;
  Restitution restitution_;
  std::vector<BodyFrame> frames_;
  std::vector<int> row_of_shape_;  // by Model::shapes; -1: touches nothing
  std::vector<int> shape_of_row_;  // back from it
  int rows_ = 0;
  std::vector<std::vector<int>> object_rows_;  // by object: rows of its shapes, in the compound's order
  std::vector<int> object_of_body_;            // -1: the body has no shape
  std::vector<char> touch_;                    // rows x rows
  std::vector<PairFriction> friction_;         // rows x rows; empty when all pairs have the same
  PairFriction uniform_friction_{1, 0, 0};
  std::vector<char> object_touch_;  // objects x objects
  std::vector<char> by_shape_;      // by object: friction has to be looked up by shape

  std::vector<std::unique_ptr<ShapeTag>> tags_;
  std::vector<MadeShape> shapes_;
  std::vector<btCollisionShape*> body_shapes_;
  std::vector<std::unique_ptr<btCollisionObject>> world_objects_;
};

}  // namespace assay::bullet
