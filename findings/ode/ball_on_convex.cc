// ODE 0.16: the contact point of a sphere on a convex body is not below the sphere's centre, so a ball at rest on the
// level top of a convex box rolls. On a box (dCreateBox) the point is right.
//
// A lying capsule or cylinder touches such a body at one point, which is beside its axis, so that they roll, too.
//
// Ends with status 0 while ODE behaves so, 1 when it does not: then the deviation in engine.cc can go.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include <ode/ode.h>

namespace {

constexpr double kRadius = 0.1, kWide = 0.5, kThick = 0.1, kX = 0.03, kY = 0.01;  // m

// A box of 2 kWide by 2 kWide by 2 kThick about its centre; ODE keeps the pointers.
const dReal kPlanes[] = {1, 0,  0, kWide, -1, 0, 0, kWide,  0, 1, 0,  kWide,
                         0, -1, 0, kWide, 0,  0, 1, kThick, 0, 0, -1, kThick};
const dReal kPoints[] = {-kWide, -kWide, -kThick, kWide, -kWide, -kThick, -kWide, kWide, -kThick, kWide, kWide, -kThick,
                         -kWide, -kWide, kThick,  kWide, -kWide, kThick,  -kWide, kWide, kThick,  kWide, kWide, kThick};
const unsigned int kFaces[] = {4, 1, 3, 7, 5, 4, 0, 4, 6, 2, 4, 2, 6, 7, 3,
                               4, 0, 1, 5, 4, 4, 4, 5, 7, 6, 4, 0, 2, 3, 1};

// How far a ball's contact point is beside its centre, m; the ball is `depth` deep, beside the middle of the ground.
double beside(bool convex, double depth) {
  const dGeomID ground = convex ? dCreateConvex(nullptr, kPlanes, 6, kPoints, 8, kFaces)
                                : dCreateBox(nullptr, 2 * kWide, 2 * kWide, 2 * kThick);
  const dGeomID ball = dCreateSphere(nullptr, kRadius);
  dGeomSetPosition(ground, 0, 0, -kThick);
  dGeomSetPosition(ball, kX, kY, kRadius - depth);
  dContactGeom contacts[4];
  const int count = dCollide(ball, ground, 4, contacts, sizeof(dContactGeom));
  double largest = -1;
  for (int i = 0; i < count; ++i) {
    largest = std::max(largest, std::hypot(contacts[i].pos[0] - kX, contacts[i].pos[1] - kY));
  }
  dGeomDestroy(ball);
  dGeomDestroy(ground);
  return largest;
}

// How far the contact points of a lying body are beside its axis, the most of them, m; -1 without contact.
double beside_axis(bool cylinder, bool convex, double depth) {
  const dGeomID ground = convex ? dCreateConvex(nullptr, kPlanes, 6, kPoints, 8, kFaces)
                                : dCreateBox(nullptr, 2 * kWide, 2 * kWide, 2 * kThick);
  const dGeomID body = cylinder ? dCreateCylinder(nullptr, kRadius, 0.3) : dCreateCapsule(nullptr, kRadius, 0.3);
  dGeomSetPosition(ground, 0, 0, -kThick);
  dGeomSetPosition(body, kX, kY, kRadius - depth);
  dMatrix3 rotation;
  dRFromZAxis(rotation, std::cos(0.3), std::sin(0.3), 0);
  dGeomSetRotation(body, rotation);
  dContactGeom contacts[8];
  const int count = dCollide(body, ground, 8, contacts, sizeof(dContactGeom));
  double largest = -1;
  for (int i = 0; i < count; ++i) {
    largest = std::max(largest,
                       std::abs((contacts[i].pos[1] - kY) * std::cos(0.3) - (contacts[i].pos[0] - kX) * std::sin(0.3)));
  }
  dGeomDestroy(body);
  dGeomDestroy(ground);
  return largest;
}

}  // namespace

int main() {
  dInitODE2(0);
  bool so = true;
  for (const double depth : {1e-3, 1e-5}) {
    const double box = beside(false, depth), convex = beside(true, depth);
    std::printf(
        "%g mm deep: the contact point is %.2e m beside the centre on a box, %.2e m on the same box as a convex body\n",
        1e3 * depth, box, convex);
    so = so && box >= 0 && box < 1e-9 && convex > 1e-5;
  }
  for (const bool cylinder : {false, true}) {
    const double box = beside_axis(cylinder, false, 1e-4), convex = beside_axis(cylinder, true, 1e-4);
    std::printf("a lying %s touches %.2e m beside its axis on a box, %.2e m on the same box as a convex body\n",
                cylinder ? "cylinder" : "capsule", box, convex);
    so = so && box >= 0 && box < 1e-9 && convex > 1e-5;
  }
  dCloseODE();
  return so ? 0 : 1;
}
