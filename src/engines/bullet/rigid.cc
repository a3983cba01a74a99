// Bullet's rigid bodies: six coordinates each, hinges as constraints.
#include <BulletDynamics/ConstraintSolver/btHingeConstraint.h>

#include "convert.h"
#include "world.h"

namespace assay::bullet {
namespace {

class RigidSimulation final : public BulletSimulation {
 public:
  RigidSimulation(const Model& model, const State& state, const Options& options)
      : BulletSimulation(model, state, options) {
    make_bodies();
    make_hinges();
  }

  ~RigidSimulation() override { destroy_world(); }
  RigidSimulation(const RigidSimulation&) = delete;
  RigidSimulation& operator=(const RigidSimulation&) = delete;

 private:
  void make_bodies() {
    bodies_.reserve(model_.bodies.size());
    for (size_t b = 0; b < model_.bodies.size(); ++b) {
      const BodyFrame& frame = collision_.frame(static_cast<int>(b));
      const BodyState& s = start_.bodies[b];
      btCollisionShape* shape = collision_.body_shape(static_cast<int>(b));
      btRigidBody::btRigidBodyConstructionInfo info(real(model_.bodies[b].mass), nullptr,
                                                    shape != nullptr ? shape : &no_shape_, to_bt(frame.inertia));
      info.m_startWorldTransform = to_bt(Pose{s.p_WBcm, s.q_WB * frame.X_BI.q});
      auto body = std::make_unique<btRigidBody>(info);
      body->setLinearVelocity(to_bt(s.v_WBcm));
      body->setAngularVelocity(to_bt(s.w_WB));
      body->setDamping(0, 0);
      body->setFlags(options_.gyroscopic);
      body->setActivationState(DISABLE_DEACTIVATION);
      if (shape != nullptr) {
        collision_.claim(*body, static_cast<int>(b));
        world().addRigidBody(body.get());
      } else {
        world().addRigidBody(body.get(), 0, 0);
      }
      bodies_.push_back(std::move(body));
    }
  }

  void make_hinges() {
    ground_ = std::make_unique<btRigidBody>(real(0), nullptr, nullptr);
    hinges_.reserve(model_.joints.size());
    for (const Joint& hinge : model_.joints) {
      const Body& body = model_.bodies[hinge.body];
      // the hinge's frame has z along the axis and is the same in both bodies at the reference configuration
      const Quat q_axis(Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), hinge.axis_B));
      const Pose X_BJ{hinge.p_BJ, q_axis};
      const Pose X_child = collision_.frame(hinge.body).X_BI.inverse() * X_BJ;
      Pose X_parent = body.X_PB * X_BJ;
      btRigidBody* parent = ground_.get();
      if (body.parent != kWorld) {
        X_parent = collision_.frame(body.parent).X_BI.inverse() * X_parent;
        parent = bodies_[body.parent].get();
      }
      auto constraint =
          std::make_unique<btHingeConstraint>(*bodies_[hinge.body], *parent, to_bt(X_child), to_bt(X_parent), false);
      constraint->setUseFrameOffset(options_.frame_offset);
      if (hinge.limited) {
        // bias 1 and relaxation 0: corrected by ERP like the rest of the joint, and no bouncing off the limit
        constraint->setLimit(real(hinge.lower - hinge.reference), real(hinge.upper - hinge.reference), 1, 1, 0);
      }
      world().addConstraint(constraint.get());
      hinges_.push_back(std::move(constraint));
    }
  }

  void read(State& out) const override {
    for (size_t b = 0; b < bodies_.size(); ++b) {
      const btRigidBody& body = *bodies_[b];
      const Pose X_WI = from_bt(body.getWorldTransform());
      out.bodies[b] = {X_WI.p, (X_WI.q * collision_.frame(static_cast<int>(b)).X_BI.q.conjugate()).normalized(),
                       from_bt(body.getLinearVelocity()), from_bt(body.getAngularVelocity())};
    }
    joints_from_bodies(model_, out);
  }

  void apply(const std::vector<double>& torques, const std::vector<Vec3>& /*ball_torques*/) override {
    // forces hold nothing else between steps: Bullet adds gravity when it steps
    world().clearForces();
    for (size_t j = 0; j < torques.size(); ++j) {
      if (torques[j] == 0) continue;
      btRigidBody& child = hinges_[j]->getRigidBodyA();
      btRigidBody& parent = hinges_[j]->getRigidBodyB();
      const btVector3 axis = child.getWorldTransform().getBasis() * hinges_[j]->getAFrame().getBasis().getColumn(2);
      const btVector3 torque = axis * real(torques[j]);
      child.applyTorque(torque);
      if (&parent != ground_.get()) parent.applyTorque(-torque);
    }
  }

  void view_parts(EngineView& out) const override {
    for (size_t b = 0; b < bodies_.size(); ++b) {
      const btRigidBody& body = *bodies_[b];
      const Mat3 R = from_bt(body.getWorldTransform().getBasis());
      out.bodies[b].mass = 1 / body.getInvMass();
      out.bodies[b].p_WBcm = from_bt(body.getWorldTransform().getOrigin());
      out.bodies[b].I_BBcm_W = R * from_bt(body.getLocalInertia()).asDiagonal() * R.transpose();
    }
    for (size_t j = 0; j < hinges_.size(); ++j) {
      const btHingeConstraint& constraint = *hinges_[j];
      const Joint& hinge = model_.joints[j];
      const btTransform X_WJ = constraint.getRigidBodyA().getWorldTransform() * constraint.getAFrame();
      EngineJoint& seen = out.joints[j];
      seen.p_WJ = from_bt(X_WJ.getOrigin());
      seen.axis_W = from_bt(X_WJ.getBasis().getColumn(2));
      seen.limited = constraint.hasLimit();
      if (seen.limited) {
        seen.lower = nearest_turn(constraint.getLowerLimit() + hinge.reference, hinge.lower);
        seen.upper = nearest_turn(constraint.getUpperLimit() + hinge.reference, hinge.upper);
      }
    }
  }

  btSphereShape no_shape_{real(1e-3)};  // Bullet wants a shape of every body; this one touches nothing
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::unique_ptr<btRigidBody> ground_;  // the fixed world as the hinges of roots see it
  std::vector<std::unique_ptr<btHingeConstraint>> hinges_;
};

}  // namespace

std::unique_ptr<Simulation> make_rigid(const Model& model, const State& state, const Options& options) {
  return std::make_unique<RigidSimulation>(model, state, options);
}

}  // namespace assay::bullet
