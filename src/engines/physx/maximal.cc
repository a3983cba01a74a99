// Maximal coordinates: every body is a PxRigidDynamic, every hinge a PxD6Joint or PxRevoluteJoint, every slide and ball
// joint a PxD6Joint.
#include <algorithm>

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
    for (const BallJoint& ball : model_.balls) make_ball(ball);
    make_constraints();
    finish_set_up();
  }

 private:
  // PhysX knows a joint's angle within one turn only; a limited one counts it from the middle of its range.
  static double zero(const Joint& joint) {
    return joint.is_slide() ? joint.reference : middle_of_range(joint, joint.reference);
  }

  PxRigidActor* parent_of(int body) const {
    const int parent = model_.bodies[body].parent;
    return parent == kWorld ? nullptr : actors_[parent];
  }

  // A frame of the body at its reference pose, then turned about its own axes, in the parent's actor.
  PxTransform in_parent(int body, const Pose& X_BJ, const Quat& turn = Quat::Identity()) const {
    const int parent = model_.bodies[body].parent;
    Pose X_PJ = model_.bodies[body].X_PB * X_BJ;
    X_PJ.q = X_PJ.q * turn;
    if (parent != kWorld) X_PJ = collision_.frame(parent).X_BI.inverse() * X_PJ;
    return to_px(X_PJ);
  }
  PxTransform in_child(int body, const Pose& X_BJ) const { return to_px(collision_.frame(body).X_BI.inverse() * X_BJ); }

  void make_joint(int j) {
    const Joint& of = model_.joints[j];
    const Pose X_BJ{of.p_BJ, x_to(of.axis_B)};
    const Quat turn(Eigen::AngleAxisd(of.is_slide() ? 0 : zero(of) - of.reference, Vec3::UnitX()));
    const PxTransform in_parent = this->in_parent(of.body, X_BJ, turn), in_child = this->in_child(of.body, X_BJ);
    PxRigidActor* child = actors_[of.body];

    PxJoint* joint = nullptr;
    if (options_.joints == Joints::kRevolute && !of.is_slide()) {
      PxRevoluteJoint* made = PxRevoluteJointCreate(sdk(), parent_of(of.body), in_parent, child, in_child);
      joint = made;
      if (made != nullptr && of.limited) {
        made->setLimit(angles(of));
        made->setRevoluteJointFlag(PxRevoluteJointFlag::eLIMIT_ENABLED, true);
      }
    } else {
      PxD6Joint* made = PxD6JointCreate(sdk(), parent_of(of.body), in_parent, child, in_child);
      joint = made;
      if (made != nullptr) make_d6(*made, of);
    }
    joints_.push_back(finished(joint));
  }

  // Its drives act about the axes of its first actor, which are the child's therefore.
  void make_ball(const BallJoint& ball) {
    const Pose X_BJ{ball.p_BJ, Quat::Identity()};
    PxD6Joint* made = PxD6JointCreate(sdk(), actors_[ball.body], in_child(ball.body, X_BJ), parent_of(ball.body),
                                      in_parent(ball.body, X_BJ));
    if (made != nullptr) {
      for (const PxD6Axis::Enum axis : {PxD6Axis::eTWIST, PxD6Axis::eSWING1, PxD6Axis::eSWING2}) {
        made->setMotion(axis, PxD6Motion::eFREE);
      }
      if (ball.dry_friction != 0) {
        made->setDrive(PxD6Drive::eTWIST, brake(ball.dry_friction));
        made->setDrive(PxD6Drive::eSWING, brake(ball.dry_friction));
      }
    }
    others_.push_back(finished(made));
  }

  static Owned<PxJoint> finished(PxJoint* joint) {
    if (joint == nullptr) throw EngineError("PhysX made no joint: " + take_complaint());
    // only the filter decides which pairs touch
    joint->setConstraintFlag(PxConstraintFlag::eCOLLISION_ENABLED, true);
    joint->setConstraintFlag(PxConstraintFlag::eDRIVE_LIMITS_ARE_FORCES, true);
    return Owned<PxJoint>(joint);
  }

  static PxJointAngularLimitPair angles(const Joint& of) {
    return {real(of.lower - zero(of)), real(of.upper - zero(of))};
  }

  void make_d6(PxD6Joint& joint, const Joint& of) const {
    const PxD6Axis::Enum axis = axis_of(of);
    joint.setMotion(axis, of.limited ? PxD6Motion::eLIMITED : PxD6Motion::eFREE);
    if (of.limited && of.is_slide()) {
      joint.setLinearLimit(axis, PxJointLinearLimitPair(sdk().getTolerancesScale(), real(of.lower - zero(of)),
                                                        real(of.upper - zero(of))));
    } else if (of.limited) {
      joint.setTwistLimit(angles(of));
    }
    const PxD6Drive::Enum drive = of.is_slide() ? PxD6Drive::eX : PxD6Drive::eTWIST;
    if (of.has_spring() && options_.native_pd) {
      joint.setDrive(drive, PxD6JointDrive(real(of.stiffness), real(of.damping), PX_MAX_F32, /*isAcceleration=*/false));
      const float target = real(of.spring_reference - zero(of));
      joint.setDrivePosition(of.is_slide() ? PxTransform(PxVec3(target, 0, 0))
                                           : PxTransform(PxQuat(target, PxVec3(1, 0, 0))));
    } else if (of.dry_friction != 0) {
      joint.setDrive(drive, brake(of.dry_friction));
    }
  }

  // Dry friction: a damper so stiff that it stops the joint within a step, with no more than that force.
  static PxD6JointDrive brake(double force) {
    constexpr float kDamping = 1e15F;  // N s/m, Nm s/rad; its square still is a float
    return {0, kDamping, real(force), /*isAcceleration=*/false};
  }

  static PxD6Axis::Enum axis_of(const Joint& joint) { return joint.is_slide() ? PxD6Axis::eX : PxD6Axis::eTWIST; }

  void read(State& out) const override {
    for (size_t b = 0; b < actors_.size(); ++b) read_dynamic(static_cast<int>(b), out.bodies[b]);
    joints_from_bodies(model_, out);
  }

  void apply(const std::vector<double>& torques, const std::vector<Vec3>& balls) override {
    // forces add up until a step takes them
    for (PxRigidBody* actor : actors_) actor->clearTorque();
    if (has_slides_) {
      for (PxRigidBody* actor : actors_) actor->clearForce();
    }
    for (size_t j = 0; j < torques.size(); ++j) {
      if (torques[j] == 0) continue;
      if (model_.joints[j].is_slide()) {
        push(static_cast<int>(j), torques[j]);
        continue;
      }
      const PxRigidBody* const child = actors_[model_.joints[j].body];
      const PxVec3 axis =
          child->getGlobalPose().q.rotate(joints_[j]->getLocalPose(PxJointActorIndex::eACTOR1).q.getBasisVector0());
      turn(model_.joints[j].body, axis * real(torques[j]));
    }
    for (size_t i = 0; i < balls.size(); ++i) {
      const int body = model_.balls[i].body;
      turn(body, to_px(body_frame(body).q * (collision_.frame(body).X_BI.q.conjugate() * balls[i])));
    }
  }

  void turn(int body, const PxVec3& torque) {
    actors_[body]->addTorque(torque, PxForceMode::eFORCE, false);
    if (const int parent = model_.bodies[body].parent; parent != kWorld) {
      actors_[parent]->addTorque(-torque, PxForceMode::eFORCE, false);
    }
  }

  // Both forces act on one line, through the joint's frame on the child.
  void push(int j, double size) {
    const int child = model_.joints[j].body, parent = model_.bodies[child].parent;
    const PxTransform X_WJ = actors_[child]->getGlobalPose() * joints_[j]->getLocalPose(PxJointActorIndex::eACTOR1);
    const PxVec3 force = X_WJ.q.getBasisVector0() * real(size);
    push_at(*actors_[child], force, X_WJ.p);
    if (parent != kWorld) push_at(*actors_[parent], -force, X_WJ.p);
  }

  static void push_at(PxRigidBody& actor, const PxVec3& force, const PxVec3& at) {
    actor.addForce(force, PxForceMode::eFORCE, false);
    actor.addTorque((at - actor.getGlobalPose().p).cross(force), PxForceMode::eFORCE, false);
  }

  void withdraw() override {}  // a step takes all forces

  EngineJoint view_joint(int j) const override {
    const Joint& of = model_.joints[j];
    const PxTransform X_WJ = actors_[of.body]->getGlobalPose() * joints_[j]->getLocalPose(PxJointActorIndex::eACTOR1);
    EngineJoint seen;
    seen.p_WJ = from_px(X_WJ.p);
    seen.axis_W = from_px(X_WJ.q.getBasisVector0());
    PxJointAngularLimitPair limit(-1, 1);
    if (const auto* d6 = joints_[j]->is<PxD6Joint>()) {
      seen.limited = d6->getMotion(axis_of(of)) == PxD6Motion::eLIMITED;
      limit = d6->getTwistLimit();
      if (of.is_slide()) {
        const PxJointLinearLimitPair way = d6->getLinearLimit(PxD6Axis::eX);
        limit = {way.lower, way.upper};
      }
    } else if (const auto* revolute = joints_[j]->is<PxRevoluteJoint>()) {
      seen.limited = revolute->getRevoluteJointFlags() & PxRevoluteJointFlag::eLIMIT_ENABLED;
      limit = revolute->getLimit();
    }
    if (seen.limited) {
      seen.lower = limit.lower + zero(of);
      seen.upper = limit.upper + zero(of);
    }
    return seen;
  }

  const bool has_slides_ = std::ranges::any_of(model_.joints, &Joint::is_slide);
  std::vector<Owned<PxJoint>> joints_;  // by Model::joints
  std::vector<Owned<PxJoint>> others_;  // of ball joints
};

}  // namespace

std::unique_ptr<Simulation> make_maximal(const Model& model, const State& state, const Options& options) {
  return std::make_unique<MaximalSimulation>(model, state, options);
}

}  // namespace assay::px
