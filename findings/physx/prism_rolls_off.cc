// PhysX 5.1.3 and 5.6.1: a prism of 64 sides that is put down at rest rolls away, on a box and on a height field. It
// stands on an edge and has to tip onto a face, 5 mm aside, where it stays on a plane. On the others it gains speed
// from face to face.
//
// Ends with status 0 while PhysX behaves so, 1 when it does not: then the deviation `cylinders-at-rest` in
// src/engines/physx/engine.cc can go.
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <numbers>
#include <vector>

#include <PxPhysicsAPI.h>

namespace {

using physx::PxPhysics;
using physx::PxVec3;

constexpr float kGravity = 9.81F, kRadius = 0.1F, kHalf = 0.15F, kCell = 0.05F, kOffset = 0.004F;  // m
constexpr int kSides = 64, kSamples = 21;

enum class Ground { kPlane, kBox, kField };

// NOLINTBEGIN(performance-unnecessary-value-param): PhysX gives the signature
physx::PxFilterFlags touch(physx::PxFilterObjectAttributes /*a*/, physx::PxFilterData /*data_a*/,
                           physx::PxFilterObjectAttributes /*b*/, physx::PxFilterData /*data_b*/,
                           physx::PxPairFlags& pair, const void* /*constants*/, physx::PxU32 /*size*/) {
  pair = physx::PxPairFlag::eCONTACT_DEFAULT;
  return physx::PxFilterFlag::eDEFAULT;
}
// NOLINTEND(performance-unnecessary-value-param)

physx::PxConvexMesh* make_prism(PxPhysics& physics) {
  // 2 m long and scaled, because PhysX's tolerances for making a hull are lengths
  std::vector<PxVec3> points;
  for (int side = 0; side < kSides; ++side) {
    const double angle = 2 * std::numbers::pi * side / kSides;
    for (const float x : {-1.0F, 1.0F}) {
      points.emplace_back(x, kRadius / kHalf * static_cast<float>(std::cos(angle)),
                          kRadius / kHalf * static_cast<float>(std::sin(angle)));
    }
  }
  physx::PxConvexMeshDesc hull;
  hull.points.count = static_cast<physx::PxU32>(points.size());
  hull.points.stride = sizeof(PxVec3);
  hull.points.data = points.data();
  hull.flags = physx::PxConvexFlag::eCOMPUTE_CONVEX;
  return PxCreateConvexMesh(physx::PxCookingParams(physics.getTolerancesScale()), hull,
                            physics.getPhysicsInsertionCallback());
}

// A flat square metre; x, y and z of the field are y, z and x of the world.
physx::PxHeightField* make_field(PxPhysics& physics) {
  std::vector<physx::PxHeightFieldSample> samples(static_cast<size_t>(kSamples) * kSamples);
  for (physx::PxHeightFieldSample& sample : samples) {
    sample.height = 0;
    sample.materialIndex0 = sample.materialIndex1 = 0;
  }
  physx::PxHeightFieldDesc description;
  description.nbRows = description.nbColumns = kSamples;
  description.samples.data = samples.data();
  description.samples.stride = sizeof(physx::PxHeightFieldSample);
  return PxCreateHeightField(description, physics.getPhysicsInsertionCallback());
}

// The way aside, m.
double way(PxPhysics& physics, physx::PxCpuDispatcher& dispatcher, Ground on, bool tgs, double timestep,
           double duration) {
  physx::PxSceneDesc description(physics.getTolerancesScale());
  description.gravity = PxVec3(0, 0, -kGravity);
  description.cpuDispatcher = &dispatcher;
  description.filterShader = touch;
  description.solverType = tgs ? physx::PxSolverType::eTGS : physx::PxSolverType::ePGS;
  physx::PxScene* scene = physics.createScene(description);
  physx::PxMaterial* material = physics.createMaterial(1, 1, 0);
  physx::PxHeightField* field = nullptr;
  physx::PxTransform pose(PxVec3(0, 0, 0));
  physx::PxGeometryHolder geometry;
  if (on == Ground::kPlane) {
    pose.q = physx::PxShortestRotation(PxVec3(1, 0, 0), PxVec3(0, 0, 1));
    geometry.storeAny(physx::PxPlaneGeometry());
  } else if (on == Ground::kBox) {
    pose.p.z = -0.1F;
    geometry.storeAny(physx::PxBoxGeometry(0.5F, 0.5F, 0.1F));
  } else {
    field = make_field(physics);
    pose.p = PxVec3(-0.5F, -0.5F, 0);
    pose.q = physx::PxQuat(physx::PxMat33(PxVec3(0, 1, 0), PxVec3(0, 0, 1), PxVec3(1, 0, 0)));
    geometry.storeAny(physx::PxHeightFieldGeometry(field, {}, 1, kCell, kCell));
  }
  physx::PxRigidStatic* ground = physics.createRigidStatic(pose);
  physx::PxShape* top = physx::PxRigidActorExt::createExclusiveShape(*ground, geometry.any(), *material);
  top->setContactOffset(kOffset);
  top->setRestOffset(0);
  scene->addActor(*ground);

  const PxVec3 start(0.03F, 0.01F, kRadius), axis(std::cos(0.3F), std::sin(0.3F), 0);
  physx::PxRigidDynamic* body =
      physics.createRigidDynamic(physx::PxTransform(start, physx::PxShortestRotation(PxVec3(1, 0, 0), axis)));
  physx::PxConvexMesh* mesh = make_prism(physics);
  const float across = (3 * kRadius * kRadius + 4 * kHalf * kHalf) / 12;
  physx::PxShape* shape = physx::PxRigidActorExt::createExclusiveShape(
      *body, physx::PxConvexMeshGeometry(mesh, physx::PxMeshScale(kHalf)), *material);
  shape->setContactOffset(kOffset);
  shape->setRestOffset(0);
  body->setMass(1);
  body->setMassSpaceInertiaTensor(PxVec3(kRadius * kRadius / 2, across, across));
  body->setLinearDamping(0);
  body->setAngularDamping(0);
  body->setSleepThreshold(0);
  body->setStabilizationThreshold(0);
  body->setSolverIterationCounts(50, tgs ? 0 : 1);
  scene->addActor(*body);
  const long steps = std::lround(duration / timestep);
  for (long i = 0; i < steps; ++i) {
    scene->simulate(static_cast<float>(timestep));
    scene->fetchResults(true);
  }
  const PxVec3 moved = body->getGlobalPose().p - start;
  body->release();
  ground->release();
  mesh->release();
  if (field != nullptr) field->release();
  material->release();
  scene->release();
  return std::hypot(moved.x, moved.y);
}

}  // namespace

int main() {
  static physx::PxDefaultAllocator allocator;
  static physx::PxDefaultErrorCallback complaints;
  physx::PxFoundation* foundation = PxCreateFoundation(PX_PHYSICS_VERSION, allocator, complaints);
  PxPhysics* physics = PxCreatePhysics(PX_PHYSICS_VERSION, *foundation, physx::PxTolerancesScale());
  PxInitExtensions(*physics, nullptr);
  physx::PxDefaultCpuDispatcher* dispatcher = physx::PxDefaultCpuDispatcherCreate(0);
  constexpr double kTipped = 1e-2, kDuration = 3;  // m, s
  bool so = true;
  for (const bool tgs : {false, true}) {
    for (const double timestep : {4e-3, 1e-3}) {
      const double plane = way(*physics, *dispatcher, Ground::kPlane, tgs, timestep, kDuration),
                   box = way(*physics, *dispatcher, Ground::kBox, tgs, timestep, kDuration),
                   field = way(*physics, *dispatcher, Ground::kField, tgs, timestep, kDuration);
      std::printf(
          "%s, %g ms: a lying prism moves by %.4f m within %g s on a plane, %.3f m on a box, %.3f m on a field\n",
          tgs ? "TGS" : "PGS", 1e3 * timestep, plane, kDuration, box, field);
      so = so && plane < kTipped && box > 10 * kTipped && field > 10 * kTipped;
    }
  }
  PxCloseExtensions();
  physics->release();
  dispatcher->release();
  foundation->release();
  return so ? 0 : 1;
}
