// What the programs of this folder share, by Bullet's API alone: a world with what it consists of, its ground and its
// bodies; a flat height field.
#pragma once

#include <memory>
#include <vector>

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

namespace finding {

inline btScalar real(double x) { return static_cast<btScalar>(x); }

template <typename Solver>
struct Parts {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  Solver own_solver;
  btCollisionObject ground;
  std::vector<std::unique_ptr<btRigidBody>> bodies;
};

// One of Bullet's worlds, whose gravity is along z.
template <typename Dynamics, typename Solver>
// NOLINTNEXTLINE(misc-multiple-inheritance): the parts are made before the world and end after it
class BasicWorld : private Parts<Solver>, public Dynamics {
 public:
  using Parts<Solver>::configuration;

  explicit BasicWorld(double gravity, Solver* solver = nullptr)
      : Dynamics(&this->dispatcher, &this->broadphase, solver != nullptr ? solver : &this->own_solver,
                 &this->configuration) {
    this->setGravity(btVector3(0, 0, real(gravity)));
  }

  void add_ground(btCollisionShape& shape, double friction, double height = 0) {
    this->ground.setCollisionShape(&shape);
    this->ground.setFriction(real(friction));
    this->ground.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, 0, real(height))));
    this->addCollisionObject(&this->ground, btBroadphaseProxy::StaticFilter, btBroadphaseProxy::AllFilter);
  }

  // Without damping; it never sleeps.
  btRigidBody& add_body(double mass, btCollisionShape& shape, const btVector3& inertia, const btTransform& place) {
    this->bodies.push_back(std::make_unique<btRigidBody>(real(mass), nullptr, &shape, inertia));
    btRigidBody& body = *this->bodies.back();
    body.setWorldTransform(place);
    body.setDamping(0, 0);
    body.setActivationState(DISABLE_DEACTIVATION);
    this->addRigidBody(&body);
    return body;
  }
};

using World = BasicWorld<btDiscreteDynamicsWorld, btSequentialImpulseConstraintSolver>;
using MultiBodyWorld = BasicWorld<btMultiBodyDynamicsWorld, btMultiBodyConstraintSolver>;

inline btTransform at(double x, double y, double z) {
  return btTransform(btQuaternion::getIdentity(), btVector3(real(x), real(y), real(z)));
}

// 21 by 21 samples of height 0.
class FlatField {
 public:
  explicit FlatField(double spacing)
      : heights_(static_cast<size_t>(kSamples) * kSamples, 0),
        shape(kSamples, kSamples, heights_.data(), 1, 0, 0, 2,
              sizeof(btScalar) == sizeof(double) ? PHY_DOUBLE : PHY_FLOAT, false) {
    shape.setLocalScaling(btVector3(real(spacing), real(spacing), 1));
    shape.setMargin(real(0.001));
  }

 private:
  static constexpr int kSamples = 21;
  std::vector<btScalar> heights_;

 public:
  btHeightfieldTerrainShape shape;
};

}  // namespace finding
