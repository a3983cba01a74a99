// What the programs of this folder share, with PhysX's API alone: PhysX itself, a scene, a body that nothing slows
// down, a convex hull. No body sleeps. With PhysX 5.6.1 only what src/engines/physx56/api has.
#pragma once

#include <vector>

#include <PxPhysicsAPI.h>

namespace finding {

// PhysX on this thread alone.
struct Engine {
  physx::PxDefaultAllocator allocator;
  physx::PxDefaultErrorCallback errors;
  physx::PxFoundation* foundation = PxCreateFoundation(PX_PHYSICS_VERSION, allocator, errors);
  physx::PxPhysics* physics = PxCreatePhysics(PX_PHYSICS_VERSION, *foundation, physx::PxTolerancesScale());
  physx::PxDefaultCpuDispatcher* dispatcher = physx::PxDefaultCpuDispatcherCreate(0);

  Engine() { PxInitExtensions(*physics, nullptr); }
  ~Engine() {
    PxCloseExtensions();
    physics->release();
    dispatcher->release();
    foundation->release();
  }
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;
};

// NOLINTBEGIN(performance-unnecessary-value-param): PhysX gives the signature
inline physx::PxFilterFlags touch(physx::PxFilterObjectAttributes /*a*/, physx::PxFilterData /*data_a*/,
                                  physx::PxFilterObjectAttributes /*b*/, physx::PxFilterData /*data_b*/,
                                  physx::PxPairFlags& pair, const void* /*constants*/, physx::PxU32 /*size*/) {
  pair = physx::PxPairFlag::eCONTACT_DEFAULT;
  return physx::PxFilterFlag::eDEFAULT;
}
// NOLINTEND(performance-unnecessary-value-param)

// All bodies touch each other; else as PhysX makes it.
inline physx::PxScene* make_scene(const Engine& engine, const physx::PxVec3& gravity, bool tgs = false) {
  physx::PxSceneDesc description(engine.physics->getTolerancesScale());
  description.gravity = gravity;
  description.cpuDispatcher = engine.dispatcher;
  description.filterShader = touch;
  description.solverType = tgs ? physx::PxSolverType::eTGS : physx::PxSolverType::ePGS;
  return engine.physics->createScene(description);
}

inline void make_free(physx::PxRigidDynamic& body, float mass, const physx::PxVec3& moments) {
  body.setMass(mass);
  body.setMassSpaceInertiaTensor(moments);
  body.setLinearDamping(0);
  body.setAngularDamping(0);
  body.setSleepThreshold(0);
  body.setStabilizationThreshold(0);
}

inline void run(physx::PxScene& scene, double timestep, long steps) {
  for (long i = 0; i < steps; ++i) {
    scene.simulate(static_cast<float>(timestep));
    scene.fetchResults(true);
  }
}

inline physx::PxConvexMesh* make_hull(const Engine& engine, const std::vector<physx::PxVec3>& points) {
  physx::PxConvexMeshDesc hull;
  hull.points.count = static_cast<physx::PxU32>(points.size());
  hull.points.stride = sizeof(physx::PxVec3);
  hull.points.data = points.data();
  hull.flags = physx::PxConvexFlag::eCOMPUTE_CONVEX;
  return PxCreateConvexMesh(physx::PxCookingParams(engine.physics->getTolerancesScale()), hull,
                            engine.physics->getPhysicsInsertionCallback());
}

}  // namespace finding
