// Bullet 3.2.7, constraint force mixing of a joint's row (BT_CONSTRAINT_CFM): sequential impulse diverges above 1.
//
// A hinge's motor at target rate 0 with the CFM of a damper B brakes a wheel of inertia I to w / (1 + h B / I) in a
// step, for CFM = I / (h B): Bullet counts a joint's CFM in units of the row's own inverse mass. With a B that makes
// CFM 0.4 that is what one step gives; with one that makes it 2 the rate is of order 1e14. So a soft spring or damper
// (0.005 Nms/rad on a finger link of 2e-5 kg m^2 at 1 ms: CFM 4) cannot be a motor row, and it gets worse with smaller
// timesteps.
//
// Cause: the row's step is divided by its inverse mass without the CFM (m_jacDiagABInv), so each sweep multiplies the
// impulse's error by -CFM. Contact rows have CFM in the divisor and converge.
//
// Ends with status 0 while Bullet behaves so, 1 when it does not: then the adapter can have pd=native.
#include <cmath>
#include <cstdio>

#include "world.h"

namespace {

using finding::real;

constexpr double kInertia = 2e-5, kTimestep = 1e-3;

// Rate after one step from 1 rad/s.
double braked(double damping) {
  finding::World world(0);
  world.getSolverInfo().m_numIterations = 50;

  btSphereShape shape(real(0.01));
  btRigidBody& wheel = world.add_body(0.05, shape, btVector3(1, 1, 1) * real(kInertia), btTransform::getIdentity());
  wheel.setAngularVelocity(btVector3(0, 0, 1));
  btHingeConstraint hinge(wheel, btVector3(0, 0, 0), btVector3(0, 0, 1));
  hinge.enableAngularMotor(true, 0, BT_LARGE_FLOAT);
  hinge.setParam(BT_CONSTRAINT_CFM, real(kInertia / (kTimestep * damping)), 5);
  world.addConstraint(&hinge);

  world.stepSimulation(real(kTimestep), 0);
  const double rate = wheel.getAngularVelocity().z();
  world.removeConstraint(&hinge);
  return rate;
}

}  // namespace

int main() {
  for (const double damping : {0.05, 0.021, 0.019, 0.01, 0.005}) {
    std::printf("damper %.3f Nms/rad, CFM %.2f: rate %.3g after a step, %.3g by the damper's law\n", damping,
                kInertia / (kTimestep * damping), braked(damping), 1 / (1 + (kTimestep * damping / kInertia)));
  }
  const bool hard_is_right = std::abs(braked(0.05) * (1 + (kTimestep * 0.05 / kInertia)) - 1) < 1e-9;
  const bool soft_diverges = std::abs(braked(0.01)) > 1e10;
  return hard_is_right && soft_diverges ? 0 : 1;
}
