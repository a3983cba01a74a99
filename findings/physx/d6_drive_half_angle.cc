// PhysX 5.1.3 and 5.6.1, PxD6Drive::eTWIST: the drive is not a linear spring. Its torque is 2 k sin(d / 2) for a
// deflection d.
//
// A wheel on a PxD6Joint whose twist is free stands still, d from the drive's target, with a drive of stiffness k and
// no damping. One small step gives it the rate h T / I, from which the torque T follows. A spring of stiffness k, in
// Nm/rad, would have T = k d; at 2 rad the drive has 16 % less, at half a turn 36 %. An articulation's drive is linear.
//
// Cause: D6JointSolverPrep hands the solver twice the x component of the relative quaternion as the error, which is
// 2 sin(d / 2).
//
// Ends with status 0 while PhysX behaves so, 1 when it does not: then the deviation in engine.cc can go.
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include "scene.h"

namespace {

using physx::PxQuat;
using physx::PxTransform;
using physx::PxVec3;

constexpr float kStiffness = 3, kInertia = 0.02F, kTimestep = 1e-4F;

// Torque of the drive at a deflection, over the stiffness.
double arm(const finding::Engine& engine, double deflection) {
  physx::PxScene* scene = finding::make_scene(engine, PxVec3(0, 0, 0));
  physx::PxRigidDynamic* wheel =
      engine.physics->createRigidDynamic(PxTransform(PxQuat(static_cast<float>(deflection), PxVec3(1, 0, 0))));
  finding::make_free(*wheel, 1, PxVec3(kInertia));
  const PxTransform here(physx::PxIdentity);
  physx::PxD6Joint* joint = physx::PxD6JointCreate(*engine.physics, nullptr, here, wheel, here);
  joint->setMotion(physx::PxD6Axis::eTWIST, physx::PxD6Motion::eFREE);
  joint->setDrive(physx::PxD6Drive::eTWIST, physx::PxD6JointDrive(kStiffness, 0, PX_MAX_F32));
  joint->setDrivePosition(here);
  scene->addActor(*wheel);
  finding::run(*scene, kTimestep, 1);
  const double torque = -wheel->getAngularVelocity().x * kInertia / kTimestep;
  joint->release();
  wheel->release();
  scene->release();
  return torque / kStiffness;
}

}  // namespace

int main() {
  const finding::Engine engine;
  bool as_found = true;
  for (const double deflection : {0.5, 1.0, 2.0, 3.0}) {
    const double measured = arm(engine, deflection), sine = 2 * std::sin(deflection / 2);
    std::printf("deflection %g rad: torque %.4f k, 2 sin(d / 2) = %.4f\n", deflection, measured, sine);
    as_found = as_found && std::abs(measured / sine - 1) < 1e-3;
  }
  return as_found ? 0 : 1;
}
