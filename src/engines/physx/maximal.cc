// Maximal coordinates: every body is a PxRigidDynamic, every hinge a PxD6Joint or PxRevoluteJoint.
#include "convert.h"
#include "engines/adapter.h"
#include "world.h"

namespace assay::px {

using namespace physx;

namespace {

class MaximalSimulation final : public PhysxSimulation {
 public:
  MaximalSimulation(const Model& model, const State& state, const Options& options)
      : PhysxSimulation(model, state, options) {
    for (size_t b = 0; b < model_.bodies.size(); ++b) make_dynamic(static_cast<int>(b));
    for (size_t j = 0; j < model_.joints.size(); ++j) make_joint(static_cast<int>(j));
    finish_set_up();
  }

 private:
  // PhysX knows a joint's angle within one turn only; a limited one counts it from the middle of its range.
  static double zero(const Joint& hinge) { return middle_of_range(hinge, hinge.reference); }

  PxRigidActor* parent(int hinge) const {
    const int body = model_.bodies[model_.joints[hinge].body].parent;
    return body == kWorld ? nullptr : actors_[body];
  }

  void make_joint(int j) {
    const Joint& hinge = model_.joints[j];
    const Body& body = model_.bodies[hinge.body];
    const Pose X_BJ{hinge.p_BJ, x_to(hinge.axis_B)};
    const Quat turn(Eigen::AngleAxisd(zero(hinge) - hinge.reference, Vec3::UnitX()));
    Pose X_PJ = body.X_PB * X_BJ;
    X_PJ.q = X_PJ.q * turn;
    if (body.parent != kWorld) X_PJ = collision_.frame(body.parent).X_BI.inverse() * X_PJ;
    const PxTransform in_parent = to_px(X_PJ), in_child = to_px(collision_.frame(hinge.body).X_BI.inverse() * X_BJ);
    PxRigidActor* child = actors_[hinge.body];

    const PxJointAngularLimitPair limit(real(hinge.lower - zero(hinge)), real(hinge.upper - zero(hinge)));
    PxJoint* joint = nullptr;
    if (options_.joints == Joints::kRevolute) {
      PxRevoluteJoint* made = PxRevoluteJointCreate(sdk(), parent(j), in_parent, child, in_child);
      joint = made;
      if (made != nullptr && hinge.limited) {
        made->setLimit(limit);
        made->setRevoluteJointFlag(PxRevoluteJointFlag::eLIMIT_ENABLED, true);
      }
    } else {
      PxD6Joint* made = PxD6JointCreate(sdk(), parent(j), in_parent, child, in_child);
      joint = made;
      if (made != nullptr) make_d6(*made, hinge, limit);
    }
    if (joint == nullptr) throw EngineError("PhysX made no joint: " + take_complaint());
    joints_.emplace_back(joint);
    // only the filter decides which pairs touch
    joint->setConstraintFlag(PxConstraintFlag::eCOLLISION_ENABLED, true);
    joint->setConstraintFlag(PxConstraintFlag::eDRIVE_LIMITS_ARE_FORCES, true);
  }

  void make_d6(PxD6Joint& joint, const Joint& hinge, const PxJointAngularLimitPair& limit) const {
    joint.setMotion(PxD6Axis::eTWIST, hinge.limited ? PxD6Motion::eLIMITED : PxD6Motion::eFREE);
    if (hinge.limited) joint.setTwistLimit(limit);
    if (!hinge.has_spring() || !options_.native_pd) return;
    joint.setDrive(PxD6Drive::eTWIST,
                   PxD6JointDrive(real(hinge.stiffness), real(hinge.damping), PX_MAX_F32, /*isAcceleration=*/false));
    joint.setDrivePosition(PxTransform(PxQuat(real(hinge.spring_reference - zero(hinge)), PxVec3(1, 0, 0))));
  }

  void read(State& out) const override {
    for (size_t b = 0; b < actors_.size(); ++b) read_dynamic(static_cast<int>(b), out.bodies[b]);
    joints_from_bodies(model_, out);
  }

  void apply(const std::vector<double>& torques) override {
    // forces add up until a step takes them
    for (PxRigidBody* actor : actors_) actor->clearTorque();
    for (size_t j = 0; j < torques.size(); ++j) {
      if (torques[j] == 0) continue;
      PxRigidBody* child = actors_[model_.joints[j].body];
      const PxVec3 axis =
          child->getGlobalPose().q.rotate(joints_[j]->getLocalPose(PxJointActorIndex::eACTOR1).q.getBasisVector0());
      const PxVec3 torque = axis * real(torques[j]);
      child->addTorque(torque, PxForceMode::eFORCE, false);
      const int parent = model_.bodies[model_.joints[j].body].parent;
      if (parent != kWorld) actors_[parent]->addTorque(-torque, PxForceMode::eFORCE, false);
    }
  }

  void withdraw() override {}  // a step takes all forces

  EngineJoint view_hinge(int j) const override {
    const Joint& hinge = model_.joints[j];
    const PxTransform X_WJ =
        actors_[hinge.body]->getGlobalPose() * joints_[j]->getLocalPose(PxJointActorIndex::eACTOR1);
    EngineJoint seen;
    seen.p_WJ = from_px(X_WJ.p);
    seen.axis_W = from_px(X_WJ.q.getBasisVector0());
    PxJointAngularLimitPair limit(-1, 1);
    if (const auto* d6 = joints_[j]->is<PxD6Joint>()) {
      seen.limited = d6->getMotion(PxD6Axis::eTWIST) == PxD6Motion::eLIMITED;
      limit = d6->getTwistLimit();
    } else if (const auto* revolute = joints_[j]->is<PxRevoluteJoint>()) {
      seen.limited = revolute->getRevoluteJointFlags() & PxRevoluteJointFlag::eLIMIT_ENABLED;
      limit = revolute->getLimit();
    }
    if (seen.limited) {
      seen.lower = limit.lower + zero(hinge);
      seen.upper = limit.upper + zero(hinge);
    }
    return seen;
  }

  std::vector<Owned<PxJoint>> joints_;  // by Model::joints
};

}  // namespace

std::unique_ptr<Simulation> make_maximal(const Model& model, const State& state, const Options& options) {
  return std::make_unique<MaximalSimulation>(model, state, options);
}

}  // namespace assay::px
