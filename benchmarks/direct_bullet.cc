// Bullet's rigid bodies as their user would write it: stepSimulation(h, 0).
#include <algorithm>
#include <optional>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "direct.h"
#include "model/kinematics.h"

namespace assay::benchmarks {
namespace {

btVector3 bt(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
btQuaternion bt(const Quat& q) { return {q.x(), q.y(), q.z(), q.w()}; }
btTransform bt(const Pose& X) { return btTransform(bt(X.q), bt(X.p)); }

// The larger coefficient acts, where Bullet's own rule is the product.
btScalar larger_friction(const btCollisionObject* a, const btCollisionObject* b) {
  return std::max(a->getFriction(), b->getFriction());
}

// Where a capsule touches what lies in the direction `towards`, at the height of a point near there.
std::optional<btVector3> round_surface(const btCollisionObject& object, const btVector3& near,
                                       const btVector3& towards) {
  const btCollisionShape* shape = object.getCollisionShape();
  if (shape->getShapeType() != CAPSULE_SHAPE_PROXYTYPE) return std::nullopt;
  const auto& capsule = static_cast<const btCapsuleShape&>(*shape);
  const btTransform& X_WS = object.getWorldTransform();
  const btVector3 direction = towards * X_WS.getBasis();
  const btScalar half = capsule.getHalfHeight();
  return X_WS * (btVector3(0, 0, std::clamp(X_WS.invXform(near).z(), -half, half)) + capsule.getRadius() * direction);
}

// Contact points that turned with a capsule go back to where it touches the ground (findings/bullet/kept_contacts.cc).
bool renew_point(btManifoldPoint& point, void* a, void* b) {
  const auto& object_a = *static_cast<const btCollisionObject*>(a);
  const auto& object_b = *static_cast<const btCollisionObject*>(b);
  const btVector3 normal = point.m_normalWorldOnB;
  const auto on_a = round_surface(object_a, point.m_positionWorldOnA, -normal);
  const auto on_b = round_surface(object_b, point.m_positionWorldOnB, normal);
  if (on_a.has_value() == on_b.has_value()) return true;
  if (on_a) {
    point.m_distance1 = (*on_a - point.m_positionWorldOnB).dot(normal);
    point.m_positionWorldOnA = *on_a;
    point.m_positionWorldOnB = *on_a - point.m_distance1 * normal;
  } else {
    point.m_distance1 = (point.m_positionWorldOnA - *on_b).dot(normal);
    point.m_positionWorldOnB = *on_b;
    point.m_positionWorldOnA = *on_b + point.m_distance1 * normal;
  }
  point.m_localPointA = object_a.getWorldTransform().invXform(point.m_positionWorldOnA);
  point.m_localPointB = object_b.getWorldTransform().invXform(point.m_positionWorldOnB);
  return true;
}

class DirectBullet final : public Direct {
 public:
  DirectBullet(const Scene& scene, const State& start, const Settings& settings)
      : h_(settings.timestep), world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
    const Model& model = scene.model;
    gCalculateCombinedFrictionCallback = larger_friction;
    gContactProcessedCallback = renew_point;
    world_.setGravity(bt(model.gravity));
    btContactSolverInfo& info = world_.getSolverInfo();
    info.m_numIterations = static_cast<int>(settings.get<long long>("iterations"));
    info.m_leastSquaresResidualThreshold = settings.get<double>("residual_threshold");
    info.m_erp = settings.get<double>("erp");
    info.m_erp2 = settings.get<double>("contact_erp");
    info.m_globalCfm = settings.get<double>("cfm");
    info.m_splitImpulse = static_cast<int>(settings.get<bool>("split_impulse"));
    info.m_splitImpulsePenetrationThreshold = -settings.get<double>("split_impulse_depth");
    info.m_linearSlop = settings.get<double>("linear_slop");
    info.m_warmstartingFactor = settings.get<double>("warmstarting");
    info.m_maxGyroscopicForce = SIMD_INFINITY;
    info.m_minimumSolverBatchSize = static_cast<int>(settings.get<long long>("solver_batch"));
    info.m_solverMode |= SOLVER_USE_WARMSTARTING | SOLVER_USE_2_FRICTION_DIRECTIONS;

    std::vector<const Shape*> shape_of(model.bodies.size(), nullptr);
    if (!model.contacts.empty()) {
      for (const Shape& shape : model.shapes) {
        if (shape.body != kWorld) shape_of[shape.body] = &shape;
      }
      make_ground(model);
    }
    for (size_t i = 0; i < model.bodies.size(); ++i) make_body(model.bodies[i], start.bodies[i], shape_of[i]);
    make_hinges(model);
  }

  ~DirectBullet() override {
    for (const auto& hinge : hinges_) world_.removeConstraint(hinge.get());
    for (const auto& body : bodies_) world_.removeRigidBody(body.get());
    if (ground_ != nullptr) world_.removeCollisionObject(ground_.get());
  }
  DirectBullet(const DirectBullet&) = delete;
  DirectBullet& operator=(const DirectBullet&) = delete;

  void run(int count) override {
    for (int i = 0; i < count; ++i) world_.stepSimulation(h_, 0);
  }

  void run_with_torques(std::span<const double> torques, int count) override {
    for (int i = 0; i < count; ++i) {
      world_.clearForces();
      for (size_t j = 0; j < torques.size(); ++j) {
        btRigidBody& child = hinges_[j]->getRigidBodyA();
        btRigidBody& parent = hinges_[j]->getRigidBodyB();
        const btVector3 axis = child.getWorldTransform().getBasis() * hinges_[j]->getAFrame().getBasis().getColumn(2);
        child.applyTorque(axis * torques[j]);
        if (&parent != &fixed_) parent.applyTorque(-(axis * torques[j]));
      }
      world_.stepSimulation(h_, 0);
    }
  }

  std::vector<Vec3> positions() const override {
    std::vector<Vec3> result;
    for (const auto& body : bodies_) {
      const btVector3& p = body->getWorldTransform().getOrigin();
      result.emplace_back(p.x(), p.y(), p.z());
    }
    return result;
  }

 private:
  void make_ground(const Model& model) {
    shapes_.push_back(std::make_unique<btStaticPlaneShape>(btVector3(0, 0, 1), 0));
    ground_ = std::make_unique<btCollisionObject>();
    ground_->setCollisionShape(shapes_.back().get());
    ground_->setFriction(model.contacts.front().friction);
    world_.addCollisionObject(ground_.get(), btBroadphaseProxy::StaticFilter, btBroadphaseProxy::AllFilter);
  }

  // Bodies whose inertia is diagonal in their own axes, and whose capsule lies along z through the centre of mass.
  void make_body(const Body& body, const BodyState& s, const Shape* shape) {
    if (shape != nullptr) {
      shapes_.push_back(std::make_unique<btCapsuleShapeZ>(shape->radius, 2 * shape->half_length));
    } else {
      shapes_.push_back(std::make_unique<btSphereShape>(1e-3));
    }
    const btRigidBody::btRigidBodyConstructionInfo info(body.mass, nullptr, shapes_.back().get(),
                                                        bt(Vec3(body.I_BBcm_B.diagonal())));
    auto made = std::make_unique<btRigidBody>(info);
    made->setWorldTransform(bt(Pose{s.p_WBcm, s.q_WB}));
    made->setInterpolationWorldTransform(made->getWorldTransform());
    made->updateInertiaTensor();
    made->setLinearVelocity(bt(s.v_WBcm));
    made->setAngularVelocity(bt(s.w_WB));
    made->setDamping(0, 0);
    made->setFlags(BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY);
    made->setActivationState(DISABLE_DEACTIVATION);
    if (shape != nullptr) {
      made->setFriction(shape->friction);
      world_.addRigidBody(made.get());
    } else {
      world_.addRigidBody(made.get(), 0, 0);
    }
    bodies_.push_back(std::move(made));
  }

  void make_hinges(const Model& model) {
    for (const Joint& hinge : model.joints) {
      const Body& body = model.bodies[hinge.body];
      const Quat q_axis(Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), hinge.axis_B));
      const Pose X_child{hinge.p_BJ - body.p_BBcm, q_axis};
      Pose X_parent = body.X_PB * Pose{hinge.p_BJ, q_axis};
      btRigidBody* parent = &fixed_;
      if (body.parent != kWorld) {
        X_parent.p -= model.bodies[body.parent].p_BBcm;
        parent = bodies_[body.parent].get();
      }
      hinges_.push_back(
          std::make_unique<btHingeConstraint>(*bodies_[hinge.body], *parent, bt(X_child), bt(X_parent), false));
      world_.addConstraint(hinges_.back().get());
    }
  }

  double h_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_;
  btRigidBody fixed_{0.0, nullptr, nullptr};
  std::unique_ptr<btCollisionObject> ground_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::vector<std::unique_ptr<btHingeConstraint>> hinges_;
};

std::unique_ptr<Direct> make(const Scene& scene, const State& start, const Settings& settings) {
  return std::make_unique<DirectBullet>(scene, start, settings);
}

}  // namespace
}  // namespace assay::benchmarks

ASSAY_DIRECT_LOOP(assay::benchmarks::make, "bullet-si-f64")
