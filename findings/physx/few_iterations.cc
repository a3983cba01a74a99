// PhysX 5.1.3 and 5.6.1, PxSolverType::ePGS: its own 4 position iterations leave the joints of a light body between
// heavy ones far from solved.
//
// Two rods of 1 kg hang on each other, with a body of 10 g between them; three D6 joints, whose twist is free. They
// fall from the horizontal for half a second. With 50 iterations the end is near that of a run with 255, PhysX's most.
// With 4 it is 17 times farther away, 5 cm at 4 ms, and only falls with the square of the timestep.
//
// Ends with status 0 while PhysX behaves so, 1 when it does not: then the bound in engine.cc can be as with 50
// iterations.
#include <array>
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include "scene.h"

namespace {

using physx::PxRigidDynamic;
using physx::PxTransform;
using physx::PxVec3;

constexpr float kHalf = 0.25F;  // of a rod, m

// The end of the second rod after half a second.
PxVec3 end(const finding::Engine& engine, float h, int iterations) {
  physx::PxScene* scene = finding::make_scene(engine, PxVec3(0, 0, -9.81F));
  const auto body = [&](float mass, float x) {
    PxRigidDynamic* made = engine.physics->createRigidDynamic(PxTransform(PxVec3(x, 0, 0)));
    finding::make_free(*made, mass, PxVec3(0.02F * mass));
    made->setMaxAngularVelocity(1e6F);
    made->setSolverIterationCounts(static_cast<physx::PxU32>(iterations), 1);
    scene->addActor(*made);
    return made;
  };
  // the light body turns about y on the first rod, the second rod about x on the light body's side
  const std::array<PxRigidDynamic*, 3> bodies = {body(1, kHalf), body(0.01F, 2 * kHalf), body(1, 3 * kHalf)};
  const physx::PxQuat about_y(physx::PxHalfPi, PxVec3(0, 0, 1)), about_z(-physx::PxHalfPi, PxVec3(0, 1, 0));
  std::array<physx::PxD6Joint*, 3> joints = {
      physx::PxD6JointCreate(*engine.physics, nullptr, PxTransform(about_y), bodies[0],
                             PxTransform(PxVec3(-kHalf, 0, 0), about_y)),
      physx::PxD6JointCreate(*engine.physics, bodies[0], PxTransform(PxVec3(kHalf, 0, 0), about_z), bodies[1],
                             PxTransform(about_z)),
      physx::PxD6JointCreate(*engine.physics, bodies[1], PxTransform(about_y), bodies[2],
                             PxTransform(PxVec3(-kHalf, 0, 0), about_y))};
  for (physx::PxD6Joint* joint : joints) joint->setMotion(physx::PxD6Axis::eTWIST, physx::PxD6Motion::eFREE);
  // the second rod turns about the vertical at first
  bodies[2]->setAngularVelocity(PxVec3(0, 0, 3));
  bodies[2]->setLinearVelocity(PxVec3(0, 3 * kHalf, 0));
  bodies[1]->setAngularVelocity(PxVec3(0, 0, 3));
  const long steps = std::lround(0.5F / h);
  finding::run(*scene, h, steps);
  const PxVec3 result = bodies[2]->getGlobalPose().transform(PxVec3(kHalf, 0, 0));
  for (physx::PxD6Joint* joint : joints) joint->release();
  for (PxRigidDynamic* each : bodies) each->release();
  scene->release();
  return result;
}

}  // namespace

int main() {
  const finding::Engine engine;
  bool as_found = true;
  for (const float milliseconds : {4.0F, 2.0F, 1.0F, 0.5F}) {
    const float h = milliseconds / 1000;
    const PxVec3 solved = end(engine, h, 255);
    const float few = (end(engine, h, 4) - solved).magnitude();
    const float many = (end(engine, h, 50) - solved).magnitude();
    std::printf("%g ms: the end is %.5f m from that with 255 iterations with 4, %.5f m with 50\n",
                static_cast<double>(milliseconds), static_cast<double>(few), static_cast<double>(many));
    as_found = as_found && few > 8 * many && few > 4e-4F;
  }
  return as_found ? 0 : 1;
}
