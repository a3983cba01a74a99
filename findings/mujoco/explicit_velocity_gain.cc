// MuJoCo 4.0.1: the integrators Euler and RK4 take an actuator's velocity gain explicitly, also where Euler takes the
// damping of joints implicitly, so that a servo is unstable from h = 2 I / kv on (Euler). The implicit integrators have
// no such bound.
//
// Ends with status 0 while MuJoCo behaves so, 1 when it does not: then the deviation in engine.cc can go.
#include <cmath>
#include <string>

#include "scene.h"

namespace {

// The joint's rate after 20 steps of 2 ms with kv 100 times beyond the bound, from 1 rad/s; rad/s.
double rate(const char* integrator) {
  const Scene scene(
      std::string("<mujoco><option timestep=\"0.002\" integrator=\"") + integrator +
      "\"><flag autoreset=\"disable\"/></option><worldbody><body><joint name=\"j\" axis=\"0 1 0\"/>"
      "<geom type=\"sphere\" pos=\".1 0 0\" size=\".02\" mass=\".1\" contype=\"0\" conaffinity=\"0\"/></body>"
      "</worldbody><actuator><position joint=\"j\" kp=\"500\" kv=\"100\"/></actuator></mujoco>");
  scene.data->qvel[0] = 1;
  for (int i = 0; i < 5; ++i) mj_step(scene.model, scene.data);
  const double found = scene.data->qvel[0];
  std::printf("%s: %.3g rad/s\n", integrator, found);
  return std::isfinite(found) ? std::abs(found) : INFINITY;
}

}  // namespace

int main() {
  const bool explicitly = rate("Euler") > 1e6 && rate("RK4") > 1e6;
  return explicitly && rate("implicit") < 1 && rate("implicitfast") < 1 ? 0 : 1;
}
