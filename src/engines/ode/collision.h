// Collision set-up of one simulation: which of a model's shapes ODE gets, which pairs may touch, with what friction.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include <ode/ode.h>

#include "engines/engine.h"
#include "library.h"
#include "model/model.h"
#include "options.h"

namespace assay::ode {

class Collision {
 public:
  // `failed` is the simulation's: whether an error came out of ODE's inside.
  Collision(dxWorld* world, const bool* failed)
      : world_(world), space_(nullptr, {failed}), contacts_(nullptr, {failed}) {}
  ~Collision() = default;
  Collision(const Collision&) = delete;
  Collision& operator=(const Collision&) = delete;

  // Makes the geoms of a model that has contact pairs. `bodies` are ODE's, in the model's order.
  void create_shapes(const Model& model, const std::vector<dxBody*>& bodies, const Options& options);

  // Turns what touches now into joints of the next step, and takes these joints away after it.
  void detect() {
    kept_.clear();
    if (space_) dSpaceCollide(space_.get(), this, &Collision::on_near);
  }
  void clear() {
    if (space_) dJointGroupEmpty(contacts_.get());
  }

  // Whether the forces of contact joints are kept, and those of the last step as impulses over `timestep` seconds.
  void keep_forces() { keeps_forces_ = true; }
  void read_forces(double timestep, std::vector<ContactForce>& out) const;

 private:
  static constexpr std::uint16_t kNoContact = 0xffff;

  // The coefficients of a pair, as ContactPair has them.
  struct Friction {
    double sliding = 1, torsional = 0, rolling = 0;
    bool operator==(const Friction&) const = default;
  };
  // A polyhedron as ODE wants it, which does not copy it: centred, because ODE takes its origin for an inner point.
  struct Polyhedron {
    Vec3 centre = Vec3::Zero();  // in the shape frame
    std::vector<dReal> points, planes;
    std::vector<unsigned> faces;  // the number of corners and the corners, for each
  };

  std::uint16_t friction_index(const Friction& friction);
  void create_shape(const Model& model, size_t index, const std::vector<dxBody*>& bodies);
  dxGeom* create_polyhedron(const Hull& hull, Pose& X_BS);
  dxGeom* create_height_field(const HeightField& field, Pose& X_BS);
  // The space found two shapes near each other: if they may touch, their contact points become joints of this step.
  static void on_near(void* data, dxGeom* a, dxGeom* b) { static_cast<Collision*>(data)->collide(a, b); }
  void collide(dxGeom* a, dxGeom* b);
  static void set_friction(dSurfaceParameters& surface, const Friction& friction);
  size_t shape_index(dxGeom* geom) const { return static_cast<const char*>(dGeomGetData(geom)) - tags_.data(); }

  // A contact joint's force. ODE writes to it during the step.
  struct Kept {
    ContactForce contact;
    bool on_b = true;  // whether ODE's first body of the joint is that of shape b
    dJointFeedback feedback{};
  };

  dxWorld* world_;
  bool keeps_forces_ = false;
  std::deque<Kept> kept_;  // of the last step; does not move its entries
  std::vector<std::unique_ptr<Polyhedron>> polyhedra_;
  std::vector<std::vector<double>> heights_;
  std::vector<HeightData> height_data_;
  Space space_;  // null when nothing can touch
  Group contacts_;
  int max_contacts_ = 0;
  std::vector<bool> has_faces_;      // by shape: whether its contacts with another may be many
  std::vector<bool> shares_load_;    // the same and those of bodies with several
  std::vector<double> cfm_of_face_;  // by shape
  double contact_cfm_ = 0;
  bool along_slip_ = false;
  std::vector<Friction> frictions_;           // the different coefficients
  std::vector<std::uint16_t> pair_friction_;  // shapes x shapes, into frictions_; small, so that it stays in the cache
  std::vector<char> tags_;                    // a geom's data is the address of its shape's tag
  std::array<dContact, kMaxContacts> points_{};
  std::array<dContactGeom, kFoundContacts> found_{};  // of a pair with faces, before it is thinned out
};

}  // namespace assay::ode
