// PhysX 5.1.3, PxFrictionType::ePATCH: without PxMaterialFlag::eIMPROVED_PATCH_FRICTION, its default, a body on two
// anchors slides with twice the friction of its material.
//
// A sled of two capsules, and a box, slide at 3 m/s on a plane, in the origin and at (-5, 5) m. Friction over normal
// impulse should be the material's 0.4. Each of a patch's two anchors may bear the friction of the whole normal force.
// With the flag the two share it, and friction is the material's; away from the origin it is 1 % more at 1 ms, for the
// digits that a position has there.
//
// Ends with status 0 while PhysX behaves so, 1 when it does not: then the adapter need not set the flag.
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include "scene.h"

namespace {

using physx::PxRigidDynamic;
using physx::PxTransform;
using physx::PxVec3;

constexpr float kFriction = 0.4F, kGravity = 9.81F, kTimestep = 1e-3F, kSpeed = 3;

// Friction over normal impulse between 0.1 and 0.2 s.
double coefficient(const finding::Engine& engine, bool improved, bool box, PxVec3 place) {
  physx::PxScene* scene = finding::make_scene(engine, PxVec3(0, 0, -kGravity));
  physx::PxMaterial* material = engine.physics->createMaterial(kFriction, kFriction, 0);
  material->setFlag(physx::PxMaterialFlag::eIMPROVED_PATCH_FRICTION, improved);

  physx::PxRigidStatic* ground = PxCreatePlane(*engine.physics, physx::PxPlane(0, 0, 1, 0), *material);
  scene->addActor(*ground);
  const float height = box ? 0.05F : 0.1F;
  place.z = height;
  PxRigidDynamic* sled = engine.physics->createRigidDynamic(PxTransform(place));
  if (box) {
    physx::PxRigidActorExt::createExclusiveShape(*sled, physx::PxBoxGeometry(0.2F, 0.2F, 0.05F), *material);
  } else {
    for (const float side : {-0.25F, 0.25F}) {
      physx::PxRigidActorExt::createExclusiveShape(*sled, physx::PxCapsuleGeometry(0.1F, 0.3F), *material)
          ->setLocalPose(PxTransform(PxVec3(0, side, 0)));
    }
  }
  finding::make_free(*sled, 1, PxVec3(0.03F, 0.05F, 0.06F));
  sled->setSolverIterationCounts(50, 1);
  scene->addActor(*sled);
  sled->setLinearVelocity(PxVec3(kSpeed, 0, 0));
  finding::run(*scene, kTimestep, 100);
  const PxVec3 from = sled->getLinearVelocity();
  finding::run(*scene, kTimestep, 100);
  const PxVec3 gained = sled->getLinearVelocity() - from;
  sled->release();
  ground->release();
  material->release();
  scene->release();
  return static_cast<double>(-gained.x / (100 * kTimestep * kGravity + gained.z));
}

}  // namespace

int main() {
  const finding::Engine engine;
  double least = 2;
  bool right = true;
  for (const bool box : {false, true}) {
    for (const PxVec3& place : {PxVec3(0, 0, 0), PxVec3(-5, 5, 0)}) {
      const double given = coefficient(engine, false, box, place);
      const double improved = coefficient(engine, true, box, place);
      std::printf("%s at (%g, %g) m: friction %.4f by default, %.4f with improved patches; the material's is %g\n",
                  box ? "box" : "sled", static_cast<double>(place.x), static_cast<double>(place.y), given, improved,
                  static_cast<double>(kFriction));
      least = std::fmin(least, given / static_cast<double>(kFriction));
      right = right && std::abs(improved / static_cast<double>(kFriction) - 1) < 0.015;
    }
  }
  return right && least > 1.9 ? 0 : 1;
}
