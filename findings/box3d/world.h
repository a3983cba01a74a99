// What the findings about Box3D share: a world with z upwards and a floor.
#pragma once

#include <initializer_list>

#include <box3d/box3d.h>
#include <box3d/collision.h>

namespace finding {

class World {
 public:
  // Box3D's own defaults, without sleep.
  explicit World(float gravity) {
    b3WorldDef definition = b3DefaultWorldDef();
    definition.gravity = {0, 0, -gravity};
    definition.enableSleep = false;
    id_ = b3CreateWorld(&definition);
    const b3BodyDef fixed = b3DefaultBodyDef();
    const b3ShapeDef surface = b3DefaultShapeDef();
    const b3BoxHull box = b3MakeOffsetBoxHull(10, 10, 5, {0, 0, -5});
    b3CreateHullShape(b3CreateBody(id_, &fixed), &surface, &box.base);
  }
  ~World() { b3DestroyWorld(id_); }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  b3WorldId id() const { return id_; }

  b3BodyId add_ball(float mass, float radius, b3Vec3 position) const {
    b3BodyDef definition = b3DefaultBodyDef();
    definition.type = b3_dynamicBody;
    definition.position = {position.x, position.y, position.z};
    definition.enableSleep = false;
    definition.enableContactRecycling = false;
    const b3BodyId body = b3CreateBody(id_, &definition);
    const b3ShapeDef surface = b3DefaultShapeDef();
    const b3Sphere sphere{{0, 0, 0}, radius};
    b3CreateSphereShape(body, &surface, &sphere);
    const float inertia = 0.4f * mass * radius * radius;
    b3Body_SetMassData(body, {mass, {0, 0, 0}, {{inertia, 0, 0}, {0, inertia, 0}, {0, 0, inertia}}});
    return body;
  }

 private:
  b3WorldId id_{};
};

}  // namespace finding
