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

#include "scene.h"

namespace {

using physx::PxVec3;

constexpr float kGravity = 9.81F, kRadius = 0.1F, kHalf = 0.15F, kCell = 0.05F, kOffset = 0.004F;  // m
constexpr int kSides = 64, kSamples = 21;

enum class Ground { kPlane, kBox, kField };

physx::PxConvexMesh* make_prism(const finding::Engine& engine) {
  // 2 m long and scaled, because PhysX's tolerances for making a hull are lengths
  std::vector<PxVec3> points;
  for (int side = 0; side < kSides; ++side) {
    const double angle = 2 * std::numbers::pi * side / kSides;
    for (const float x : {-1.0F, 1.0F}) {
      points.emplace_back(x, kRadius / kHalf * static_cast<float>(std::cos(angle)),
                          kRadius / kHalf * static_cast<float>(std::sin(angle)));
    }
  }
  return finding::make_hull(engine, points);
}

// A flat square metre; x, y and z of the field are y, z and x of the world.
physx::PxHeightField* make_field(const finding::Engine& engine) {
  std::vector<physx::PxHeightFieldSample> samples(static_cast<size_t>(kSamples) * kSamples);
  for (physx::PxHeightFieldSample& sample : samples) {
    sample.height = 0;
    sample.materialIndex0 = sample.materialIndex1 = 0;
  }
  physx::PxHeightFieldDesc description;
  description.nbRows = description.nbColumns = kSamples;
  description.samples.data = samples.data();
  description.samples.stride = sizeof(physx::PxHeightFieldSample);
  return PxCreateHeightField(description, engine.physics->getPhysicsInsertionCallback());
}

// The way aside, m.
double way(const finding::Engine& engine, Ground on, bool tgs, double timestep, double duration) {
  physx::PxScene* scene = finding::make_scene(engine, PxVec3(0, 0, -kGravity), tgs);
  physx::PxMaterial* material = engine.physics->createMaterial(1, 1, 0);
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
    field = make_field(engine);
    pose.p = PxVec3(-0.5F, -0.5F, 0);
    pose.q = physx::PxQuat(physx::PxMat33(PxVec3(0, 1, 0), PxVec3(0, 0, 1), PxVec3(1, 0, 0)));
    geometry.storeAny(physx::PxHeightFieldGeometry(field, {}, 1, kCell, kCell));
  }
  physx::PxRigidStatic* ground = engine.physics->createRigidStatic(pose);
  physx::PxShape* top = physx::PxRigidActorExt::createExclusiveShape(*ground, geometry.any(), *material);
  top->setContactOffset(kOffset);
  top->setRestOffset(0);
  scene->addActor(*ground);

  const PxVec3 start(0.03F, 0.01F, kRadius), axis(std::cos(0.3F), std::sin(0.3F), 0);
  physx::PxRigidDynamic* body =
      engine.physics->createRigidDynamic(physx::PxTransform(start, physx::PxShortestRotation(PxVec3(1, 0, 0), axis)));
  physx::PxConvexMesh* mesh = make_prism(engine);
  const float across = (3 * kRadius * kRadius + 4 * kHalf * kHalf) / 12;
  physx::PxShape* shape = physx::PxRigidActorExt::createExclusiveShape(
      *body, physx::PxConvexMeshGeometry(mesh, physx::PxMeshScale(kHalf)), *material);
  shape->setContactOffset(kOffset);
  shape->setRestOffset(0);
  finding::make_free(*body, 1, PxVec3(kRadius * kRadius / 2, across, across));
  body->setSolverIterationCounts(50, tgs ? 0 : 1);
  scene->addActor(*body);
  const long steps = std::lround(duration / timestep);
  finding::run(*scene, timestep, steps);
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
  const finding::Engine engine;
  constexpr double kTipped = 1e-2, kDuration = 3;  // m, s
  bool so = true;
  for (const bool tgs : {false, true}) {
    for (const double timestep : {4e-3, 1e-3}) {
      const double plane = way(engine, Ground::kPlane, tgs, timestep, kDuration),
                   box = way(engine, Ground::kBox, tgs, timestep, kDuration),
                   field = way(engine, Ground::kField, tgs, timestep, kDuration);
      std::printf(
          "%s, %g ms: a lying prism moves by %.4f m within %g s on a plane, %.3f m on a box, %.3f m on a field\n",
          tgs ? "TGS" : "PGS", 1e3 * timestep, plane, kDuration, box, field);
      so = so && plane < kTipped && box > 10 * kTipped && field > 10 * kTipped;
    }
  }
  return so ? 0 : 1;
}
