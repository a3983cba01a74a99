// MuJoCo 4.0.1: the limit of a ball joint gives way in proportion to the mean of the inverse inertias about the joint's
// three axes, not to the one about the axis in which the limit acts. A slender bar turns easily about its own length,
// so the mean is large and the limit is soft across it, at every timestep.
//
// A soft constraint holds a load of the moment M with the violation (1 - d) T^2 M A, where T is solref's time constant,
// d the largest impedance of solimp and A the inverse inertia that MuJoCo reckons with (dof_invweight0, of a ball joint
// the mean of three). A hinge has its own inverse inertia.
//
// Ends with status 0 while MuJoCo behaves so, 1 when it does not: then the declaration in engine.cc can go.
#include <cmath>
#include <string>

#include "scene.h"

namespace {

// Where the bar comes to rest beyond its limit of 0.5 rad, rad.
double beyond(const std::string& joint, double radius) {
  const Scene scene(
      "<mujoco><compiler angle=\"radian\"/><worldbody><body pos=\"0 0 1\">" + joint +
      "<geom type=\"capsule\" fromto=\"0 0 0 .3 0 0\" mass=\"1\" contype=\"0\" conaffinity=\"0\" size=\"" +
      std::to_string(radius) + "\"/></body></worldbody></mujoco>");
  if (scene.model->nq == 1) {
    scene.data->qpos[0] = 0.5;
  } else {
    scene.data->qpos[0] = std::cos(0.25);
    scene.data->qpos[2] = std::sin(0.25);
  }
  scene.run(2);
  const double angle =
      scene.model->nq == 1 ? scene.data->qpos[0] : 2 * std::atan2(scene.data->qpos[2], scene.data->qpos[0]);
  return angle - 0.5;
}

}  // namespace

int main() {
  bool so = true;
  for (const double radius : {0.08, 0.04, 0.02}) {
    const double ball = beyond(R"(<joint type="ball" range="0 .5" damping=".02"/>)", radius);
    const double hinge = beyond(R"(<joint axis="0 1 0" limited="true" range="-1 .5" damping=".02"/>)", radius);
    std::printf("a bar of %.2f m and 0.3 m: %.2f mrad on a ball joint, %.2f mrad on a hinge\n", radius, 1e3 * ball,
                1e3 * hinge);
    if (radius < 0.03) so = so && ball > 15 * hinge && ball > 0.03;
  }
  return so ? 0 : 1;
}
