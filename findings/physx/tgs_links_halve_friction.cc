// PhysX 5.1.3, PxSolverType::eTGS: with PxMaterialFlag::eIMPROVED_PATCH_FRICTION a link of an articulation slides with
// half the friction of its material, unless it touches in one point.
//
// A body with a wheel on a hinge, an articulation of two links, slides at 3 m/s on a plane, on two runners, on a box
// and on one ball. Friction over normal impulse should be the material's 0.4. The flag shares a patch's friction
// between its two anchors. For contacts of links the preparation of this solver (setupFinalizeExtSolverContactsStep())
// does so twice: in the coefficient and in the scale of each anchor. PGS, rigid bodies and patches of one anchor are
// right. NVIDIA removed one of the two in PhysX 5.3.
//
// Ends with status 0 while PhysX behaves so, 1 when it does not: then share_friction() of the adapter has to go.
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <utility>

#include "scene.h"

namespace {

using physx::PxArticulationLink;
using physx::PxArticulationReducedCoordinate;
using physx::PxTransform;
using physx::PxVec3;

constexpr float kFriction = 0.4F, kGravity = 9.81F, kTimestep = 1e-3F, kSpeed = 3;

enum class Shape { kRunners, kBox, kBall };

void prepare(PxArticulationLink& link, float inertia) {
  link.setMass(1);
  link.setMassSpaceInertiaTensor(PxVec3(inertia));
  link.setLinearDamping(0);
  link.setAngularDamping(0);
  link.setCfmScale(0);
}

void add_shape(PxArticulationLink& link, Shape shape, const physx::PxMaterial& material) {
  using physx::PxRigidActorExt;
  if (shape == Shape::kBox) {
    PxRigidActorExt::createExclusiveShape(link, physx::PxBoxGeometry(0.25F, 0.25F, 0.1F), material);
  } else if (shape == Shape::kBall) {
    PxRigidActorExt::createExclusiveShape(link, physx::PxSphereGeometry(0.1F), material);
  } else {
    for (const float side : {-0.25F, 0.25F}) {
      PxRigidActorExt::createExclusiveShape(link, physx::PxCapsuleGeometry(0.1F, 0.25F), material)
          ->setLocalPose(PxTransform(PxVec3(0, side, 0)));
    }
  }
}

// Friction over normal impulse between 0.1 and 0.2 s.
double coefficient(const finding::Engine& engine, bool tgs, Shape shape) {
  physx::PxScene* scene = finding::make_scene(engine, PxVec3(0, 0, -kGravity), tgs);
  physx::PxMaterial* material = engine.physics->createMaterial(kFriction, kFriction, 0);
  material->setFlag(physx::PxMaterialFlag::eIMPROVED_PATCH_FRICTION, true);
  physx::PxRigidStatic* ground = PxCreatePlane(*engine.physics, physx::PxPlane(0, 0, 1, 0), *material);
  scene->addActor(*ground);

  PxArticulationReducedCoordinate* sled = engine.physics->createArticulationReducedCoordinate();
  sled->setSolverIterationCounts(50, tgs ? 0 : 1);
  sled->setSleepThreshold(0);
  const PxTransform place(PxVec3(0, 0, 0.1F));
  PxArticulationLink* root = sled->createLink(nullptr, place);
  prepare(*root, shape == Shape::kBall ? 1e4F : 0.05F);  // a ball of such an inertia slides and does not roll
  add_shape(*root, shape, *material);
  PxArticulationLink* wheel = sled->createLink(root, place);
  prepare(*wheel, 0.01F);
  physx::PxArticulationJointReducedCoordinate* hinge = wheel->getInboundJoint();
  const PxTransform upright(physx::PxQuat(-physx::PxPi / 2, PxVec3(0, 1, 0)));
  hinge->setParentPose(upright);
  hinge->setChildPose(upright);
  hinge->setJointType(physx::PxArticulationJointType::eREVOLUTE);
  hinge->setMotion(physx::PxArticulationAxis::eTWIST, physx::PxArticulationMotion::eFREE);
  hinge->setFrictionCoefficient(0);
  scene->addArticulation(*sled);
  sled->setRootLinearVelocity(PxVec3(kSpeed, 0, 0));

  finding::run(*scene, kTimestep, 100);
  const PxVec3 from = root->getLinearVelocity();
  finding::run(*scene, kTimestep, 100);
  const PxVec3 gained = root->getLinearVelocity() - from;
  scene->removeArticulation(*sled);
  sled->release();
  ground->release();
  material->release();
  scene->release();
  return static_cast<double>(-gained.x / (100 * kTimestep * kGravity + gained.z));
}

}  // namespace

int main() {
  const finding::Engine engine;
  bool still = true;
  for (const auto& [shape, name] :
       {std::pair(Shape::kRunners, "two runners"), {Shape::kBox, "a box"}, {Shape::kBall, "a ball"}}) {
    const double pgs = coefficient(engine, false, shape);
    const double tgs = coefficient(engine, true, shape);
    std::printf("link on %s: friction %.4f with PGS, %.4f with TGS; the material's is %g\n", name, pgs, tgs,
                static_cast<double>(kFriction));
    const double part = shape == Shape::kBall ? 1 : 0.5;
    still = still && std::abs(pgs / static_cast<double>(kFriction) - 1) < 0.015 &&
            std::abs(tgs / static_cast<double>(kFriction) - part) < 0.015;
  }
  return still ? 0 : 1;
}
