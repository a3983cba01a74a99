// PhysX 5.1.3 and 5.6.1: a prism rolls down a slope slower than a rigid one does.
//
// A prism of n sides pivots about one edge after another. At each a rigid prism without rebound keeps the part
// (I + m r^2 cos(2 pi / n)) / (I + m r^2) of its rate; between two it gains what the slope gives. With n it comes to
// 2/3 of g sin(angle) t, the speed of a cylinder. PhysX's prism loses about twice as much, at any timestep; and of 126
// sides, whose hull could have 252 vertices, PhysX keeps 143 and loses as much as with 64.
//
// Ends with status 0 while PhysX behaves so, 1 when it does not: then the deviation `cylinder-rolls` in
// src/engines/physx56/plugin.cc can go.
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "scene.h"

namespace {

using physx::PxVec3;

constexpr float kGravity = 9.81F, kRadius = 0.1F, kHalf = 0.15F, kAlong = 0.005F;  // m, moment of inertia kg m^2
constexpr double kSlope = 0.19739555984988;                                        // rad: a tangent of 0.2
constexpr double kDuration = 0.8;                                                  // s

struct End {
  double slower = 0;  // than a cylinder, relative
  unsigned vertices = 0;
};

End roll(const finding::Engine& engine, int sides, double timestep) {
  physx::PxScene* scene = finding::make_scene(engine, PxVec3(kGravity * static_cast<float>(std::sin(kSlope)), 0,
                                                             -kGravity * static_cast<float>(std::cos(kSlope))));
  physx::PxMaterial* material = engine.physics->createMaterial(1, 1, 0);
  physx::PxRigidStatic* ground = PxCreatePlane(*engine.physics, physx::PxPlane(0, 0, 1, 0), *material);
  scene->addActor(*ground);

  // the hull is made 2 m long and scaled, because PhysX's tolerances for making it are lengths
  std::vector<PxVec3> points;
  for (int side = 0; side < sides; ++side) {
    const double angle = 2 * std::numbers::pi * (side + 0.5) / sides;
    for (const float y : {-1.0F, 1.0F}) {
      points.emplace_back(kRadius / kHalf * static_cast<float>(std::cos(angle)), y,
                          kRadius / kHalf * static_cast<float>(std::sin(angle)));
    }
  }
  physx::PxConvexMesh* mesh = finding::make_hull(engine, points);

  physx::PxRigidDynamic* prism = engine.physics->createRigidDynamic(physx::PxTransform(PxVec3(0, 0, kRadius)));
  physx::PxShape* shape = physx::PxRigidActorExt::createExclusiveShape(
      *prism, physx::PxConvexMeshGeometry(mesh, physx::PxMeshScale(kHalf)), *material);
  shape->setContactOffset(0.005F);
  shape->setRestOffset(0);
  finding::make_free(*prism, 1, PxVec3(0.01F, kAlong, 0.01F));
  prism->setSolverIterationCounts(50, 1);
  scene->addActor(*prism);
  const int steps = static_cast<int>(std::lround(kDuration / timestep));
  finding::run(*scene, timestep, steps);
  const double cylinder = kGravity * std::sin(kSlope) * 2 / 3 * kDuration;
  const End end{1 - prism->getLinearVelocity().x / cylinder, mesh->getNbVertices()};
  prism->release();
  ground->release();
  mesh->release();
  material->release();
  scene->release();
  return end;
}

// The same of a rigid prism: over an angle of s the loss at its edges is that of a rate's factor exp(-k s).
double rigid(int sides) {
  const double swinging = kRadius * kRadius, step = 2 * std::numbers::pi / sides;
  const double k = -std::log((kAlong + swinging * std::cos(step)) / (kAlong + swinging)) / step;
  const double way = kGravity * std::sin(kSlope) / 3 * kDuration * kDuration / kRadius;  // of a cylinder, rad
  return 1 - std::sqrt((1 - std::exp(-2 * k * way)) / (2 * k * way));
}

}  // namespace

int main() {
  const finding::Engine engine;
  bool slow = true;
  for (const int sides : {32, 64, 126}) {
    const End coarse = roll(engine, sides, 1e-3), fine = roll(engine, sides, 2.5e-4);
    std::printf(
        "%d sides, %u of %d vertices: slower than a cylinder by %.1f %% at 1 ms, %.1f %% at 1/4 ms; a rigid prism %.1f "
        "%%\n",
        sides, fine.vertices, 2 * sides, 100 * coarse.slower, 100 * fine.slower, 100 * rigid(sides));
    slow = slow && coarse.slower > 1.4 * rigid(sides) && fine.slower > 1.4 * rigid(sides);
  }
  return slow ? 0 : 1;
}
