// MuJoCo 4.0.1: rolling friction of a slow ball is viscous, so that it is far below the length times the normal force.
//
// The softness of a contact's friction is one number for all its directions, made for sliding: it is scaled by the
// squares of the coefficients, so that the rate at which rolling friction reaches its bound is g (1 - d) / (d b) mu^2 /
// (length impratio), about 5 rad/s for mu = 1 and 2 mm with the elliptic cone, and some three times that with the
// pyramid. A ball that rolls slower is braked in proportion to its rate.
//
// Ends with status 0 while MuJoCo behaves so, 1 when it does not: then the deviation in engine.cc can go.
#include <string>

#include "scene.h"

namespace {

// The deceleration of a ball that rolls at 0.5 m/s, relative to that of a rigid one.
double braked(const char* cone, double friction, double impratio) {
  constexpr double kSpeed = 0.5, kTime = 0.3, kLength = 0.002;
  const std::string own = std::to_string(friction) + " 0 0.002\" condim=\"6\"";
  const Scene scene(std::string("<mujoco><option timestep=\"0.001\" cone=\"") + cone + "\" impratio=\"" +
                    std::to_string(impratio) + "\"/><worldbody><geom type=\"plane\" size=\"9 9 1\" friction=\"" + own +
                    "/><body pos=\"0 0 .1\"><freejoint/><geom type=\"sphere\" size=\".1\" mass=\"1\" friction=\"" +
                    own + "/></body></worldbody></mujoco>");
  scene.data->qvel[0] = kSpeed;
  scene.data->qvel[4] = kSpeed / 0.1;
  scene.run(kTime);
  return (kSpeed - scene.data->qvel[0]) / kTime / (kLength / 0.1 * 9.81 / 1.4);
}

}  // namespace

int main() {
  const double pyramid = braked("pyramidal", 1, 1), elliptic = braked("elliptic", 1, 1);
  const double rough = braked("elliptic", 3, 1), stiff = braked("elliptic", 3, 10);
  std::printf("pyramid: %.2f of the rolling friction; elliptic cone: %.2f; with mu = 3: %.2f, and impratio 10: %.2f\n",
              pyramid, elliptic, rough, stiff);
  return pyramid < 0.5 && elliptic > 0.9 && rough < 0.5 && stiff > 0.9 ? 0 : 1;
}
