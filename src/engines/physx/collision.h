// Collision set-up of one simulation: which of a model's shapes PhysX gets, which pairs may touch, with what friction.
//
// PhysX asks a filter shader about every pair of shapes and combines the frictions of two materials. A shape's filter
// data is its row in a table of pairs; its material is chosen so that the larger of two coefficients is the pair's own.
// Pairs of which that cannot be said get their coefficient from a callback in every step, or copies of both shapes that
// touch nothing else.
// A scene that is asked for reports hands its contact points and their normal impulses over at the end of each step.
#pragma once

#include <cstdint>
#include <vector>

#include "engines/engine.h"
#include "library.h"
#include "model/model.h"
#include "options.h"
#include "shapes.h"

namespace assay::px {

// A body's frame in PhysX: origin at the centre of mass, axes along principal axes of inertia, so that PhysX's own mass
// frame is the actor's and costs no rounding.
struct BodyFrame {
  Pose X_BI;     // in the body frame
  Vec3 inertia;  // principal moments, kg m^2
};

// By body: whether it is in a tree with joints, which articulations hold as links.
std::vector<bool> bodies_in_trees(const Model& model);

// NOLINTNEXTLINE(misc-multiple-inheritance): two of PhysX's interfaces of callbacks
class Collision final : public physx::PxContactModifyCallback, public physx::PxSimulationEventCallback {
 public:
  Collision(const Model& model, const Options& options);

  const BodyFrame& frame(int body) const { return frames_[body]; }

  // Mean size of the shapes that can touch something, 1 m without any: what PhysX's tolerances in metres scale with.
  double size() const { return size_; }

  // Whether the callback has to set the friction of some pair.
  bool modifies() const { return modifies_; }

  // The pair table for the scene's filter, which is `filter`.
  const std::vector<std::uint8_t>& table() const { return table_; }
  static physx::PxFilterFlags filter(physx::PxFilterObjectAttributes attributes_a, physx::PxFilterData a,
                                     physx::PxFilterObjectAttributes attributes_b, physx::PxFilterData b,
                                     physx::PxPairFlags& flags, const void* table, physx::PxU32 size);

  // Gives `actor` the shapes of `body` (or of the world) that can touch something. True when there are any.
  bool attach(physx::PxRigidActor& actor, int body) const;

  // Called by PhysX within a step for pairs whose friction the materials do not give.
  void onContactModify(physx::PxContactModifyPair* pairs, physx::PxU32 count) override;

  // Makes `scene`, which has not been stepped, report contacts. From then on contacts() has those since clear().
  void report_contacts(physx::PxScene& scene);
  void clear_contacts() { contacts_.clear(); }
  const std::vector<ContactForce>& contacts() const { return contacts_; }

  // Called by PhysX at the end of a step; the others of its interface are of no use here.
  void onContact(const physx::PxContactPairHeader& header, const physx::PxContactPair* pairs,
                 physx::PxU32 count) override;
  void onConstraintBreak(physx::PxConstraintInfo* /*constraints*/, physx::PxU32 /*count*/) override {}
  void onWake(physx::PxActor** /*actors*/, physx::PxU32 /*count*/) override {}
  void onSleep(physx::PxActor** /*actors*/, physx::PxU32 /*count*/) override {}
  void onTrigger(physx::PxTriggerPair* /*pairs*/, physx::PxU32 /*count*/) override {}
  void onAdvance(const physx::PxRigidBody* const* /*bodies*/, const physx::PxTransform* /*poses*/,
                 physx::PxU32 /*count*/) override {}

 private:
  // What may happen between two shapes. kShared: with share_friction() (plugin.h).
  enum Touch : std::uint8_t { kNever = 0, kMaterials = 1, kModified = 2, kReported = 4, kShared = 8 };

  void make_tables(const Model& model, const Options& options);
  int copy(int row, const ContactPair& pair);
  void make_materials(const Model& model, const Options& options);
  size_t index(size_t row_a, size_t row_b) const { return row_a * rows_ + row_b; }

  std::vector<Shape> shapes_;      // of the model
  std::vector<int> row_of_shape_;  // -1: touches nothing
  std::vector<int> shape_of_row_;  // copies come last
  size_t rows_ = 0;
  std::vector<std::uint8_t> table_;  // rows x rows of Touch
  std::vector<float> friction_;      // the same, empty when all comes from materials
  std::vector<double> material_of_row_;
  bool modifies_ = false;
  std::vector<BodyFrame> frames_;
  double size_ = 1;
  float contact_offset_ = 0;
  Geometries geometries_;
  std::vector<Geometry> geometry_of_row_;
  std::vector<Owned<physx::PxMaterial>> materials_;  // by row
  std::vector<ContactForce> contacts_;
};

}  // namespace assay::px
