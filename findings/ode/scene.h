// What the programs of this folder share, by ODE's API alone: a world with gravity and the plane z = 0, in which bodies
// touch with a pyramid of friction.
#pragma once

#include <array>
#include <functional>

#include <ode/ode.h>

namespace finding {

struct Scene {
  dWorldID world = dWorldCreate();
  dSpaceID space = dSimpleSpaceCreate(nullptr);
  dJointGroupID contacts = dJointGroupCreate(0);
  double friction = 1;
  std::function<void(dContact&, dBodyID)> prepare;  // a contact of the body, before it is made

  Scene() {
    dWorldSetGravity(world, 0, 0, -9.81);
    dCreatePlane(space, 0, 0, 1, 0);
  }
  ~Scene() {
    dJointGroupDestroy(contacts);
    dSpaceDestroy(space);
    dWorldDestroy(world);
  }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  dBodyID add_body(dGeomID shape, const dMass& mass) const {
    dBodyID body = dBodyCreate(world);
    dBodySetMass(body, &mass);
    dGeomSetBody(shape, body);
    return body;
  }

  // `method`: dWorldQuickStep or dWorldStep.
  void step(double timestep, int (*method)(dWorldID, dReal) = dWorldQuickStep) {
    dSpaceCollide(space, this, touch);
    method(world, timestep);
    dJointGroupEmpty(contacts);
  }

 private:
  static void touch(void* data, dGeomID a, dGeomID b) {
    const auto* scene = static_cast<Scene*>(data);
    std::array<dContactGeom, 8> points{};
    const int count = dCollide(a, b, static_cast<int>(points.size()), points.data(), sizeof(dContactGeom));
    for (int i = 0; i < count; ++i) {
      dContact contact{};
      contact.geom = points[i];
      contact.surface.mode = dContactApprox1;
      contact.surface.mu = scene->friction;
      if (scene->prepare) scene->prepare(contact, dGeomGetBody(a) != nullptr ? dGeomGetBody(a) : dGeomGetBody(b));
      dJointAttach(dJointCreateContact(scene->world, scene->contacts, &contact), dGeomGetBody(a), dGeomGetBody(b));
    }
  }
};

}  // namespace finding
