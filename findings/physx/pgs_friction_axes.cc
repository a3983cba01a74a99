// PhysX 5.1.3 and 5.6.1, PxSolverType::ePGS: the friction of a body at rest holds up to 1.41 times the material's.
//
// A box lies on slopes of 1.1 to 1.5 times its friction of 0.5. Each friction anchor is bounded along two tangents, one
// at a time, so that both together give up to 1.41 times the friction between them. The tangents follow the slip from
// 1 cm/s on, and are fixed by the normal below that, so that a box that holds stays. With TGS the sum is bounded, and
// the box slides.
//
// Ends with status 0 while PhysX behaves so, 1 when it does not: then the deviation in engine.cc can go.
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include "scene.h"

namespace {

using physx::PxVec3;

constexpr float kFriction = 0.5F, kGravity = 9.81F, kTimestep = 1e-3F, kPi = 3.14159265F;
constexpr int kSteps = 500;

// Speed of a box after half a second on a slope of `share` times the friction, that falls towards `degrees`; m/s.
double speed(const finding::Engine& engine, bool tgs, float share, float degrees) {
  const float angle = std::atan(share * kFriction), towards = degrees * kPi / 180;
  physx::PxScene* scene = finding::make_scene(
      engine,
      PxVec3(std::sin(angle) * std::cos(towards), std::sin(angle) * std::sin(towards), -std::cos(angle)) * kGravity,
      tgs);
  physx::PxMaterial* material = engine.physics->createMaterial(kFriction, kFriction, 0);
#if PX_PHYSICS_VERSION_MAJOR == 5 && PX_PHYSICS_VERSION_MINOR < 6  // later ones always have it
  material->setFlag(physx::PxMaterialFlag::eIMPROVED_PATCH_FRICTION, true);
#endif
  physx::PxRigidStatic* ground = engine.physics->createRigidStatic(physx::PxTransform(PxVec3(0, 0, -1)));
  physx::PxRigidActorExt::createExclusiveShape(*ground, physx::PxBoxGeometry(5, 5, 1), *material);
  scene->addActor(*ground);
  physx::PxRigidDynamic* box = engine.physics->createRigidDynamic(physx::PxTransform(PxVec3(0, 0, 0.05F)));
  physx::PxRigidActorExt::createExclusiveShape(*box, physx::PxBoxGeometry(0.1F, 0.1F, 0.05F), *material);
  finding::make_free(*box, 1, PxVec3(0.0042F, 0.0042F, 0.0067F));
  box->setSolverIterationCounts(50, tgs ? 0 : 1);
  scene->addActor(*box);
  finding::run(*scene, kTimestep, kSteps);
  const PxVec3 velocity = box->getLinearVelocity();
  box->release();
  ground->release();
  material->release();
  scene->release();
  return std::hypot(static_cast<double>(velocity.x), static_cast<double>(velocity.y));
}

}  // namespace

int main() {
  const finding::Engine engine;
  bool still = true;
  for (const float share : {1.1F, 1.2F, 1.3F, 1.5F}) {
    const double along = speed(engine, false, share, 0);
    const double between = speed(engine, false, share, 45);
    const double tgs = speed(engine, true, share, 45);
    const float angle = std::atan(share * kFriction);
    const double rigid = static_cast<double>(kGravity * (std::sin(angle) - kFriction * std::cos(angle)) *
                                             static_cast<float>(kSteps) * kTimestep);
    std::printf(
        "slope of %.1f times the friction: %.4f m/s along an axis, %.4f at 45 degrees, %.4f with TGS; rigid %.4f\n",
        static_cast<double>(share), along, between, tgs, rigid);
    const bool holds = share < 1.41F;
    still = still && std::abs(along / rigid - 1) < 0.1 && std::abs(tgs / rigid - 1) < 0.1 &&
            (holds ? between < 0.01 : between > 0.5 * rigid);
  }
  return still ? 0 : 1;
}
