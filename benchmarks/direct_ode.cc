// ODE as its user would write it: dSpaceCollide, dWorldQuickStep, dJointGroupEmpty.
#include <array>
#include <cmath>
#include <cstdint>

#include <ode/ode.h>

#include "direct.h"
#include "model/kinematics.h"

namespace assay::benchmarks {
namespace {

class DirectOde final : public Direct {
 public:
  DirectOde(const Scene& scene, const State& start, const Settings& settings)
      : h_(settings.timestep),
        seed_(static_cast<std::uint32_t>(settings.get<long long>("reorder_seed"))),
        world_(make_world()) {
    const Model& model = scene.model;
    dWorldSetGravity(world_, model.gravity.x(), model.gravity.y(), model.gravity.z());
    dWorldSetERP(world_, settings.get<double>("erp"));
    dWorldSetCFM(world_, settings.get<double>("cfm"));
    dWorldSetQuickStepNumIterations(world_, static_cast<int>(settings.get<long long>("iterations")));
    dWorldSetQuickStepW(world_, settings.get<double>("over_relaxation"));
    const double cap = settings.get<double>("contact_max_correcting_velocity");
    dWorldSetContactMaxCorrectingVel(world_, cap > 0 ? cap : dInfinity);
    dWorldSetContactSurfaceLayer(world_, settings.get<double>("contact_surface_layer"));
    dWorldSetAutoDisableFlag(world_, 0);
    dWorldSetStepIslandsProcessingMaxThreadCount(world_, 1);
    max_contacts_ = static_cast<int>(settings.get<long long>("max_contacts"));

    make_bodies(model);
    place(reference_state(model));
    make_hinges(model);
    if (!model.contacts.empty()) make_shapes(model, settings);
    place(start);
    step_ = std::llround(start.time / h_);
  }

  ~DirectOde() override {
    if (space_ != nullptr) dSpaceDestroy(space_);
    if (contacts_ != nullptr) dJointGroupDestroy(contacts_);
    dWorldDestroy(world_);
  }
  DirectOde(const DirectOde&) = delete;
  DirectOde& operator=(const DirectOde&) = delete;

  void run(int count) override {
    for (int i = 0; i < count; ++i) step();
  }

  void run_with_torques(std::span<const double> torques, int count) override {
    for (int i = 0; i < count; ++i) {
      for (size_t j = 0; j < torques.size(); ++j) dJointAddHingeTorque(hinges_[j], torques[j]);
      step();
    }
  }

  std::vector<Vec3> positions() const override {
    std::vector<Vec3> result;
    for (dxBody* body : bodies_) {
      const dReal* p = dBodyGetPosition(body);
      result.emplace_back(p[0], p[1], p[2]);
    }
    return result;
  }

 private:
  static dWorldID make_world() {
    dInitODE2(0);
    dAllocateODEDataForThread(dAllocateMaskAll);
    return dWorldCreate();
  }

  void step() {
    if (space_ != nullptr) dSpaceCollide(space_, this, near);
    // the adapter's seeds, because the solver's random order decides the bits
    dRandSetSeed(seed_ + 0x9e3779b9U * static_cast<std::uint32_t>(step_));
    dWorldQuickStep(world_, h_);
    if (space_ != nullptr) dJointGroupEmpty(contacts_);
    ++step_;
  }

  static void near(void* data, dGeomID a, dGeomID b) {
    auto* self = static_cast<DirectOde*>(data);
    const int count = dCollide(a, b, self->max_contacts_, &self->points_[0].geom, sizeof(dContact));
    for (int i = 0; i < count; ++i) {
      dxJoint* joint = dJointCreateContact(self->world_, self->contacts_, &self->points_[i]);
      dJointAttach(joint, dGeomGetBody(a), dGeomGetBody(b));
    }
  }

  void make_bodies(const Model& model) {
    for (const Body& body : model.bodies) {
      const Mat3& I = body.I_BBcm_B;
      dMass mass;
      dMassSetParameters(&mass, body.mass, 0, 0, 0, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
      bodies_.push_back(dBodyCreate(world_));
      dBodySetMass(bodies_.back(), &mass);
    }
  }

  void make_hinges(const Model& model) {
    const State reference = reference_state(model);
    for (size_t j = 0; j < model.joints.size(); ++j) {
      const JointFrames frames = joint_frames(model, reference, static_cast<int>(j));
      const int body = model.joints[j].body;
      const int parent = model.bodies[body].parent;
      dxJoint* joint = dJointCreateHinge(world_, nullptr);
      dJointAttach(joint, bodies_[body], parent == kWorld ? nullptr : bodies_[parent]);
      dJointSetHingeAnchor(joint, frames.p_WJ_child.x(), frames.p_WJ_child.y(), frames.p_WJ_child.z());
      dJointSetHingeAxis(joint, frames.axis_W_child.x(), frames.axis_W_child.y(), frames.axis_W_child.z());
      hinges_.push_back(joint);
    }
  }

  void make_shapes(const Model& model, const Settings& settings) {
    space_ = dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ);
    contacts_ = dJointGroupCreate(0);
    for (const Shape& shape : model.shapes) {
      if (shape.type == ShapeType::kPlane) {
        dCreatePlane(space_, 0, 0, 1, 0);
      } else {
        dGeomSetBody(dCreateCapsule(space_, shape.radius, 2 * shape.half_length), bodies_[shape.body]);
      }
    }
    for (dContact& contact : points_) {
      contact = {};
      contact.surface.mode = dContactApprox1 | dContactSoftERP | dContactSoftCFM;
      contact.surface.mu = model.contacts.front().friction;
      contact.surface.soft_erp = settings.get<double>("contact_erp");
      contact.surface.soft_cfm = settings.get<double>("contact_cfm");
    }
  }

  void place(const State& state) {
    for (size_t i = 0; i < bodies_.size(); ++i) {
      const BodyState& s = state.bodies[i];
      const std::array<dReal, 4> q = {s.q_WB.w(), s.q_WB.x(), s.q_WB.y(), s.q_WB.z()};
      dBodySetPosition(bodies_[i], s.p_WBcm.x(), s.p_WBcm.y(), s.p_WBcm.z());
      dBodySetQuaternion(bodies_[i], q.data());
      dBodySetLinearVel(bodies_[i], s.v_WBcm.x(), s.v_WBcm.y(), s.v_WBcm.z());
      dBodySetAngularVel(bodies_[i], s.w_WB.x(), s.w_WB.y(), s.w_WB.z());
    }
  }

  double h_;
  std::uint32_t seed_;
  long long step_ = 0;
  int max_contacts_ = 0;
  dWorldID world_;
  dSpaceID space_ = nullptr;
  dJointGroupID contacts_ = nullptr;
  std::vector<dBodyID> bodies_;
  std::vector<dJointID> hinges_;
  std::array<dContact, 8> points_{};
};

std::unique_ptr<Direct> make(const Scene& scene, const State& start, const Settings& settings) {
  return std::make_unique<DirectOde>(scene, start, settings);
}

}  // namespace
}  // namespace assay::benchmarks

ASSAY_DIRECT_LOOP(assay::benchmarks::make, "ode-quick")
