// PhysX 5.1.3, PxSolverType::eTGS: far from the origin bodies that touch something lag behind or stand still.
//
// A ball glides at 1 m/s along x on a plane without friction, at 0, 1000 and 10,000 m from the origin, in steps of 1
// ms. Each position iteration of this solver adds a substep's way to the position, which is rounded to a float:
// multiples of 6e-5 m at 1000 m, where a substep of 50 goes 2e-5 m. With PGS a step adds its way once.
//
// Ends with status 0 while PhysX behaves so, 1 when it does not: then the deviation in engine.cc can go.
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include <PxPhysicsAPI.h>

namespace {

using physx::PxPhysics;
using physx::PxVec3;

constexpr float kTimestep = 1e-3F, kSpeed = 1;
constexpr int kSteps = 500;

// NOLINTBEGIN(performance-unnecessary-value-param): PhysX gives the signature
physx::PxFilterFlags touch(physx::PxFilterObjectAttributes /*a*/, physx::PxFilterData /*data_a*/,
                           physx::PxFilterObjectAttributes /*b*/, physx::PxFilterData /*data_b*/,
                           physx::PxPairFlags& pair, const void* /*constants*/, physx::PxU32 /*size*/) {
  pair = physx::PxPairFlag::eCONTACT_DEFAULT;
  return physx::PxFilterFlag::eDEFAULT;
}
// NOLINTEND(performance-unnecessary-value-param)

// Way over speed times time.
double way(PxPhysics& physics, physx::PxCpuDispatcher& dispatcher, bool tgs, physx::PxU32 iterations, float far) {
  physx::PxSceneDesc description(physics.getTolerancesScale());
  description.gravity = PxVec3(0, 0, -9.81F);
  description.cpuDispatcher = &dispatcher;
  description.filterShader = touch;
  description.solverType = tgs ? physx::PxSolverType::eTGS : physx::PxSolverType::ePGS;
  physx::PxScene* scene = physics.createScene(description);
  physx::PxMaterial* material = physics.createMaterial(0, 0, 0);
  physx::PxRigidStatic* ground = PxCreatePlane(physics, physx::PxPlane(0, 0, 1, 0), *material);
  scene->addActor(*ground);
  physx::PxRigidDynamic* ball = physics.createRigidDynamic(physx::PxTransform(PxVec3(far, 0, 0.1F)));
  physx::PxRigidActorExt::createExclusiveShape(*ball, physx::PxSphereGeometry(0.1F), *material);
  ball->setMass(1);
  ball->setMassSpaceInertiaTensor(PxVec3(0.004F, 0.004F, 0.004F));
  ball->setLinearDamping(0);
  ball->setAngularDamping(0);
  ball->setSleepThreshold(0);
  ball->setSolverIterationCounts(iterations, tgs ? 0 : 1);
  scene->addActor(*ball);
  ball->setLinearVelocity(PxVec3(kSpeed, 0, 0));
  for (int i = 0; i < kSteps; ++i) {
    scene->simulate(kTimestep);
    scene->fetchResults(true);
  }
  const float went = ball->getGlobalPose().p.x - far;
  ball->release();
  ground->release();
  material->release();
  scene->release();
  return static_cast<double>(went / (kSpeed * kTimestep * kSteps));
}

}  // namespace

int main() {
  physx::PxDefaultAllocator allocator;
  physx::PxDefaultErrorCallback errors;
  physx::PxFoundation* foundation = PxCreateFoundation(PX_PHYSICS_VERSION, allocator, errors);
  PxPhysics* physics = PxCreatePhysics(PX_PHYSICS_VERSION, *foundation, physx::PxTolerancesScale());
  PxInitExtensions(*physics, nullptr);
  physx::PxDefaultCpuDispatcher* dispatcher = physx::PxDefaultCpuDispatcherCreate(0);
  bool still = true;
  for (const float far : {0.0F, 1e3F, 1e4F}) {
    const double pgs = way(*physics, *dispatcher, false, 50, far), tgs = way(*physics, *dispatcher, true, 50, far),
                 few = way(*physics, *dispatcher, true, 4, far);
    std::printf("at %g m: %.3f of the way with PGS, %.3f with TGS and 50 iterations, %.3f with 4\n",
                static_cast<double>(far), pgs, tgs, few);
    still = still && pgs > 0.9 && (far > 0 ? tgs < 0.1 : tgs > 0.99) && (far > 5e3F ? few < 0.1 : few > 0.9);
  }
  dispatcher->release();
  PxCloseExtensions();
  physics->release();
  foundation->release();
  return still ? 0 : 1;
}
