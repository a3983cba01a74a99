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

#include "scene.h"

namespace {

using physx::PxVec3;

constexpr float kTimestep = 1e-3F, kSpeed = 1;
constexpr int kSteps = 500;

// Way over speed times time.
double way(const finding::Engine& engine, bool tgs, physx::PxU32 iterations, float far) {
  physx::PxScene* scene = finding::make_scene(engine, PxVec3(0, 0, -9.81F), tgs);
  physx::PxMaterial* material = engine.physics->createMaterial(0, 0, 0);
  physx::PxRigidStatic* ground = PxCreatePlane(*engine.physics, physx::PxPlane(0, 0, 1, 0), *material);
  scene->addActor(*ground);
  physx::PxRigidDynamic* ball = engine.physics->createRigidDynamic(physx::PxTransform(PxVec3(far, 0, 0.1F)));
  physx::PxRigidActorExt::createExclusiveShape(*ball, physx::PxSphereGeometry(0.1F), *material);
  finding::make_free(*ball, 1, PxVec3(0.004F, 0.004F, 0.004F));
  ball->setSolverIterationCounts(iterations, tgs ? 0 : 1);
  scene->addActor(*ball);
  ball->setLinearVelocity(PxVec3(kSpeed, 0, 0));
  finding::run(*scene, kTimestep, kSteps);
  const float went = ball->getGlobalPose().p.x - far;
  ball->release();
  ground->release();
  material->release();
  scene->release();
  return static_cast<double>(went / (kSpeed * kTimestep * kSteps));
}

}  // namespace

int main() {
  const finding::Engine engine;
  bool still = true;
  for (const float far : {0.0F, 1e3F, 1e4F}) {
    const double pgs = way(engine, false, 50, far), tgs = way(engine, true, 50, far), few = way(engine, true, 4, far);
    std::printf("at %g m: %.3f of the way with PGS, %.3f with TGS and 50 iterations, %.3f with 4\n",
                static_cast<double>(far), pgs, tgs, few);
    still = still && pgs > 0.9 && (far > 0 ? tgs < 0.1 : tgs > 0.99) && (far > 5e3F ? few < 0.1 : few > 0.9);
  }
  return still ? 0 : 1;
}
