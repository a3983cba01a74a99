// Bullet's rigid bodies: six coordinates each, joints as constraints. Massless bodies borrow mass.
#include <algorithm>
#include <cmath>

#include <BulletDynamics/ConstraintSolver/btHingeConstraint.h>
#include <BulletDynamics/ConstraintSolver/btPoint2PointConstraint.h>
#include <BulletDynamics/ConstraintSolver/btSliderConstraint.h>

#include "convert.h"
#include "world.h"

namespace assay::bullet {
namespace {

// btMatrix3x3::solve33, which solves for the implicit gyroscopic torque, gives 0 where the determinant is not above
// SIMD_EPSILON: bodies with a product of principal moments near it get no torque.
constexpr btScalar kLeastDeterminant = 8 * SIMD_EPSILON;

// The torque's change of the angular velocity does not depend on the scale of the inertia. So Bullet computes it for a
// twin of the light body, as heavy as its solution needs, and the body gets it as a torque.
class LightBody {
 public:
  explicit LightBody(btRigidBody& body)
      : body_(body),
        inertia_(body.getLocalInertia()),
        twin_(1, nullptr, nullptr, inertia_ / inertia_[inertia_.maxAxis()]) {}

  static bool is_light(const btVector3& inertia) { return inertia.x() * inertia.y() * inertia.z() < kLeastDeterminant; }

  void apply_gyroscopic_torque(btScalar timestep, int mode) {
    const btTransform& X_WI = body_.getWorldTransform();
    twin_.setWorldTransform(X_WI);
    twin_.setAngularVelocity(body_.getAngularVelocity());
    const btVector3 gained = mode == BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD
                                 ? twin_.computeGyroscopicImpulseImplicit_World(timestep)
                                 : twin_.computeGyroscopicImpulseImplicit_Body(timestep);
    const btVector3 gained_I = X_WI.getBasis().transpose() * gained;
    body_.applyTorque(X_WI.getBasis() * (gained_I * inertia_) / timestep);
  }

 private:
  btRigidBody& body_;
  btVector3 inertia_;
  btRigidBody twin_;
};

// Bullet's LCP leaves out rows whose effective mass is not above SIMD_EPSILON (btMLCPSolver::createMLCPFast). Counted
// in a smaller unit, no mass is so small; a power of two changes no digit of any result.
double mass_unit(const Model& model, const Options& options) {
  if (options.solver != Solver::kDantzig) return 1;
  constexpr double kLeast = 64 * SIMD_EPSILON, kLargest = 0.25 / SIMD_EPSILON;
  double least = kLeast, largest = 0;
  for (const Body& body : model.bodies) {
    const Vec3 moments = principal_inertia(body.I_BBcm_B).diagonal;
    least = std::min({least, body.mass, moments.minCoeff()});
    largest = std::max({largest, body.mass, moments.maxCoeff()});
  }
  if (least >= kLeast || least <= 0) return 1;
  // rows between heavy bodies have a least inverse mass too
  return std::max(1.0,
                  std::exp2(std::min(std::ceil(std::log2(kLeast / least)), std::floor(std::log2(kLargest / largest)))));
}

Model in_unit(Model model, double unit) {
  for (Body& body : model.bodies) {
    body.mass *= unit;
    body.I_BBcm_B *= unit;
  }
  const auto scale = [unit](auto& list) {
    for (auto& each : list) {
      each.stiffness *= unit;
      each.damping *= unit;
      each.dry_friction *= unit;
    }
  };
  scale(model.joints);
  scale(model.balls);
  scale(model.tendons);
  return model;
}

class RigidSimulation final : public BulletSimulation {
 public:
  // `state` is one of `lent.model`.
  RigidSimulation(Lent lent, const State& state, const Options& options)
      : BulletSimulation(lent.model, state, options), lent_(std::move(lent)) {
    make_bodies();
    make_light_bodies();
    ground_ = std::make_unique<btRigidBody>(real(0), nullptr, nullptr);
    constraints_.reserve(model_.joints.size() + model_.balls.size());
    for (const Joint& joint : model_.joints) {
      constraints_.push_back(joint.is_slide() ? make_slide(joint) : make_hinge(joint));
      world().addConstraint(constraints_.back().get());
    }
    for (const BallJoint& ball : model_.balls) {
      constraints_.push_back(make_ball(ball));
      world().addConstraint(constraints_.back().get());
    }
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

  void make_light_bodies() {
    if (options_.gyroscopic != BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY &&
        options_.gyroscopic != BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD) {
      return;
    }
    for (const auto& body : bodies_) {
      if (!LightBody::is_light(body->getLocalInertia())) continue;
      body->setFlags(0);
      light_.push_back(std::make_unique<LightBody>(*body));
    }
    if (light_.empty()) return;
    const auto at_start_of_step = [](btDynamicsWorld* world, btScalar timestep) {
      const auto* self = static_cast<RigidSimulation*>(world->getWorldUserInfo());
      for (const auto& body : self->light_) body->apply_gyroscopic_torque(timestep, self->options_.gyroscopic);
    };
    world().setInternalTickCallback(at_start_of_step, this, true);
  }

  // A joint's two bodies and its frame in each; both frames are the same at the reference configuration.
  struct Ends {
    btRigidBody& child;
    btRigidBody& parent;
    Pose X_child, X_parent;
  };
  Ends ends(int b, const Vec3& p_BJ, const Quat& q_BJ) {
    const Body& body = model_.bodies[b];
    const Pose X_BJ{p_BJ, q_BJ};
    const Pose X_child = collision_.frame(b).X_BI.inverse() * X_BJ;
    const Pose X_parent = body.X_PB * X_BJ;
    if (body.parent == kWorld) return {*bodies_[b], *ground_, X_child, X_parent};
    return {*bodies_[b], *bodies_[body.parent], X_child, collision_.frame(body.parent).X_BI.inverse() * X_parent};
  }

  std::unique_ptr<btTypedConstraint> make_hinge(const Joint& hinge) {
    const Quat q_axis(Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), hinge.axis_B));
    const Ends e = ends(hinge.body, hinge.p_BJ, q_axis);
    auto made = std::make_unique<btHingeConstraint>(e.child, e.parent, to_bt(e.X_child), to_bt(e.X_parent), false);
    made->setUseFrameOffset(options_.frame_offset);
    if (hinge.limited) {
      // bias 1 and relaxation 0: corrected by ERP like the rest of the joint, and no bouncing off the limit
      made->setLimit(real(hinge.lower - hinge.reference), real(hinge.upper - hinge.reference), 1, 1, 0);
    }
    if (hinge.dry_friction != 0) made->enableAngularMotor(true, 0, real(hinge.dry_friction * options_.timestep));
    return made;
  }

  std::unique_ptr<btTypedConstraint> make_slide(const Joint& slide) {
    const Quat q_axis(Eigen::Quaterniond::FromTwoVectors(Vec3::UnitX(), slide.axis_B));
    const Ends e = ends(slide.body, slide.p_BJ, q_axis);
    auto made = std::make_unique<btSliderConstraint>(e.parent, e.child, to_bt(e.X_parent), to_bt(e.X_child), true);
    made->setUseFrameOffset(options_.frame_offset);
    made->setLowerAngLimit(0);
    made->setUpperAngLimit(0);
    made->setLowerLinLimit(real(slide.limited ? slide.lower - slide.reference : 1));  // lower above upper: none
    made->setUpperLinLimit(real(slide.limited ? slide.upper - slide.reference : -1));
    if (slide.dry_friction != 0) {
      made->setPoweredLinMotor(true);
      made->setTargetLinMotorVelocity(0);
      made->setMaxLinMotorForce(real(slide.dry_friction));
    }
    return made;
  }

  std::unique_ptr<btTypedConstraint> make_ball(const BallJoint& ball) {
    const Ends e = ends(ball.body, ball.p_BJ, Quat::Identity());
    return std::make_unique<btPoint2PointConstraint>(e.child, e.parent, to_bt(e.X_child.p), to_bt(e.X_parent.p));
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

  void finish(State& out) const override { lent_.to_original(out); }

  void apply(const std::vector<double>& torques, const std::vector<Vec3>& ball_torques) override {
    // forces hold nothing else between steps: Bullet adds gravity when it steps
    world().clearForces();
    for (size_t j = 0; j < torques.size(); ++j) {
      if (torques[j] == 0) continue;
      const btTypedConstraint& constraint = *constraints_[j];
      if (model_.joints[j].is_slide()) {
        const auto& slide = static_cast<const btSliderConstraint&>(constraint);
        const btTransform& X_WI = slide.getRigidBodyB().getWorldTransform();
        push(model_.joints[j].body,
             X_WI.getBasis() * slide.getFrameOffsetB().getBasis().getColumn(0) * real(torques[j]));
        continue;
      }
      const auto& hinge = static_cast<const btHingeConstraint&>(constraint);
      const btMatrix3x3& R = hinge.getRigidBodyA().getWorldTransform().getBasis();
      turn(model_.joints[j].body, R * hinge.getAFrame().getBasis().getColumn(2) * real(torques[j]));
    }
    for (size_t i = 0; i < ball_torques.size(); ++i) {
      if (ball_torques[i].isZero(0)) continue;
      const int b = model_.balls[i].body;
      const Vec3 torque_I = collision_.frame(b).X_BI.q.conjugate() * ball_torques[i];
      turn(b, bodies_[b]->getWorldTransform().getBasis() * to_bt(torque_I));
    }
  }

  // A torque or a force (in the world) on a body, and its opposite on the parent; a force along the same line.
  void turn(int b, const btVector3& torque) {
    bodies_[b]->applyTorque(torque);
    if (const int parent = model_.bodies[b].parent; parent != kWorld) bodies_[parent]->applyTorque(-torque);
  }
  void push(int b, const btVector3& force) {
    bodies_[b]->applyCentralForce(force);
    const int parent = model_.bodies[b].parent;
    if (parent == kWorld) return;
    const btVector3& point = bodies_[b]->getWorldTransform().getOrigin();
    bodies_[parent]->applyForce(-force, point - bodies_[parent]->getWorldTransform().getOrigin());
  }

  void view_parts(EngineView& out) const override {
    for (size_t b = 0; b < bodies_.size(); ++b) {
      const btRigidBody& body = *bodies_[b];
      const Mat3 R = from_bt(body.getWorldTransform().getBasis());
      out.bodies[b].mass = 1 / body.getInvMass() / options_.mass_unit;
      out.bodies[b].p_WBcm = from_bt(body.getWorldTransform().getOrigin());
      out.bodies[b].I_BBcm_W = R * (from_bt(body.getLocalInertia()) / options_.mass_unit).asDiagonal() * R.transpose();
    }
    for (size_t j = 0; j < model_.joints.size(); ++j) {
      if (model_.joints[j].is_slide()) {
        view_slide(model_.joints[j], static_cast<btSliderConstraint&>(*constraints_[j]), out.joints[j]);
      } else {
        view_hinge(model_.joints[j], static_cast<const btHingeConstraint&>(*constraints_[j]), out.joints[j]);
      }
    }
    return_lent_mass(lent_, out);
  }

  static void view_hinge(const Joint& hinge, const btHingeConstraint& constraint, EngineJoint& seen) {
    const btTransform X_WJ = constraint.getRigidBodyA().getWorldTransform() * constraint.getAFrame();
    seen.p_WJ = from_bt(X_WJ.getOrigin());
    seen.axis_W = from_bt(X_WJ.getBasis().getColumn(2));
    seen.limited = constraint.hasLimit();
    if (seen.limited) {
      seen.lower = nearest_turn(constraint.getLowerLimit() + hinge.reference, hinge.lower);
      seen.upper = nearest_turn(constraint.getUpperLimit() + hinge.reference, hinge.upper);
    }
  }

  static void view_slide(const Joint& slide, btSliderConstraint& constraint, EngineJoint& seen) {
    const btTransform X_WJ = constraint.getRigidBodyB().getWorldTransform() * constraint.getFrameOffsetB();
    seen.p_WJ = from_bt(X_WJ.getOrigin());
    seen.axis_W = from_bt(X_WJ.getBasis().getColumn(0));
    seen.limited = constraint.getLowerLinLimit() <= constraint.getUpperLinLimit();
    if (seen.limited) {
      seen.lower = constraint.getLowerLinLimit() + slide.reference;
      seen.upper = constraint.getUpperLinLimit() + slide.reference;
    }
  }

  btSphereShape no_shape_{real(1e-3)};  // Bullet wants a shape of every body; this one touches nothing
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::vector<std::unique_ptr<LightBody>> light_;  // bodies whose gyroscopic torque Bullet itself leaves out
  std::unique_ptr<btRigidBody> ground_;            // the fixed world as the joints of roots see it
  std::vector<std::unique_ptr<btTypedConstraint>> constraints_;  // of Model::joints, then of Model::balls
  Lent lent_;
};

}  // namespace

std::unique_ptr<Simulation> make_rigid(const Model& model, const State& state, const Options& options) {
  Lent lent = lend_mass(model, options.lent_share);
  State start = with_joint_coordinates(model, state);
  lent.to_copy(start);
  Options own = options;
  own.mass_unit = mass_unit(lent.model, options);
  own.cfm /= real(own.mass_unit);
  if (own.mass_unit != 1) lent.model = in_unit(std::move(lent.model), own.mass_unit);
  return std::make_unique<RigidSimulation>(std::move(lent), start, own);
}

}  // namespace assay::bullet
