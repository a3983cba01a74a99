// MuJoCo 4.0.1, option cone="pyramidal", its default: friction is up to 29 % weaker between the axes of the pyramid.
//
// A box slides at 3 m/s on a plane, along a tangent of its contacts and at 22.5 and 45 degrees to it. The pyramid lies
// inside Coulomb's cone: |f_1| + |f_2| is at most mu times the normal force, so that friction at 45 degrees is 1 /
// sqrt(2) of it. On a slope of 0.75 times the friction that falls towards 45 degrees the box slides from rest. With
// cone="elliptic" friction is the same in every direction.
//
// Ends with status 0 while MuJoCo behaves so, 1 when it does not: then the deviation in engine.cc can go.
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include "scene.h"

namespace {

constexpr const char* kModel = R"(<mujoco>
  <worldbody>
    <geom type="plane" size="1 1 1" friction="0.5 0 0"/>
    <body pos="0 0 0.1"><freejoint/><geom type="box" size="0.25 0.25 0.1" mass="1" friction="0.5 0 0"/></body>
  </worldbody>
</mujoco>)";
constexpr double kFriction = 0.5, kGravity = 9.81, kPi = 3.14159265358979323846;

// Friction over normal impulse between 0.1 and 0.3 s, over the coefficient, from `speed` towards `degrees` on a slope
// that falls the same way.
double friction(bool elliptic, double degrees, double speed, double slope) {
  const Scene scene(kModel);
  mjModel* model = scene.model;
  mjData* data = scene.data;
  const double x = std::cos(degrees * kPi / 180), y = std::sin(degrees * kPi / 180), angle = std::atan(slope);
  model->opt.timestep = 1e-3;
  model->opt.cone = elliptic ? mjCONE_ELLIPTIC : mjCONE_PYRAMIDAL;
  model->opt.gravity[0] = kGravity * std::sin(angle) * x;
  model->opt.gravity[1] = kGravity * std::sin(angle) * y;
  model->opt.gravity[2] = -kGravity * std::cos(angle);
  data->qvel[0] = speed * x;
  data->qvel[1] = speed * y;
  double before[3] = {0, 0, 0};
  for (int i = 0; i < 300; ++i) {
    if (i == 100) mju_copy3(before, data->qvel);
    mj_step(model, data);
  }
  double impulse[3];
  for (int k = 0; k < 3; ++k) impulse[k] = data->qvel[k] - before[k] - 0.2 * model->opt.gravity[k];
  return std::hypot(impulse[0], impulse[1]) / impulse[2] / kFriction;
}

}  // namespace

int main() {
  bool so = true;
  for (const double degrees : {0.0, 22.5, 45.0}) {
    const double pyramid = friction(false, degrees, 3, 0), cone = friction(true, degrees, 3, 0);
    std::printf("sliding towards %4.1f degrees: %.3f of the friction, %.3f with the elliptic cone\n", degrees, pyramid,
                cone);
    so = so && std::abs(cone - 1) < 0.01 && (degrees < 45 || std::abs(pyramid - std::sqrt(0.5)) < 0.01);
  }
  const double pyramid = friction(false, 45, 0, 0.75 * kFriction), cone = friction(true, 45, 0, 0.75 * kFriction);
  std::printf("at rest on 0.75 of the slope, 45 degrees: friction bears %.3f, %.3f with the elliptic cone\n", pyramid,
              cone);
  so = so && std::abs(pyramid - std::sqrt(0.5)) < 0.01 && std::abs(cone - 0.75) < 0.01;
  return so ? 0 : 1;
}
