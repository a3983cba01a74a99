// What the findings about Box3D share: a world with z upwards, and bodies.
#pragma once

#include <cmath>
#include <initializer_list>

#include <box3d/box3d.h>
#include <box3d/collision.h>

namespace finding {

class World {
 public:
  // Box3D's own defaults (30 Hz among them), without sleep.
  explicit World(double gravity, bool floor = true, float contact_hertz = 30) {
    b3WorldDef definition = b3DefaultWorldDef();
    definition.gravity = {0, 0, -static_cast<float>(gravity)};
    definition.enableSleep = false;
    definition.contactHertz = contact_hertz;
    id_ = b3CreateWorld(&definition);
    if (!floor) return;
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
    const b3BodyId body = add_body(position);
    const b3ShapeDef surface = b3DefaultShapeDef();
    const b3Sphere sphere{{0, 0, 0}, radius};
    b3CreateSphereShape(body, &surface, &sphere);
    set_mass(body, mass, 0.4f * mass * radius * radius);
    return body;
  }

  // A capsule between two points, with the inertia of a thick rod about every axis.
  b3BodyId add_bar(float mass, float radius, b3Vec3 from, b3Vec3 to) const {
    const b3BodyId body = add_body(b3Lerp(from, to, 0.5f));
    const b3Vec3 half = b3MulSV(0.5f, b3Sub(to, from));
    b3ShapeDef surface = b3DefaultShapeDef();
    surface.baseMaterial.friction = 1;
    const b3Capsule capsule{b3Neg(half), half, radius};
    b3CreateCapsuleShape(body, &surface, &capsule);
    set_mass(body, mass, mass * (b3Dot(half, half) / 3 + radius * radius / 2));
    return body;
  }

  b3BodyId add_box(float mass, b3Vec3 half, b3Vec3 position) const {
    const b3BodyId body = add_body(position);
    b3ShapeDef surface = b3DefaultShapeDef();
    surface.baseMaterial.friction = 2;
    const b3BoxHull box = b3MakeBoxHull(half.x, half.y, half.z);
    b3CreateHullShape(body, &surface, &box.base);
    const float x = half.x * half.x, y = half.y * half.y, z = half.z * half.z;
    b3Body_SetMassData(
        body, {mass, {0, 0, 0}, {{mass * (y + z) / 3, 0, 0}, {0, mass * (x + z) / 3, 0}, {0, 0, mass * (x + y) / 3}}});
    return body;
  }

  // 1 kg on a hinge along y at the origin, `arm` away from it and `angle` away from hanging.
  b3BodyId add_pendulum(float hertz, double arm, double inertia, float angle) const {
    const float r = static_cast<float>(arm), s = std::sin(angle / 2), c = std::cos(angle / 2);
    b3BodyDef definition = moving_body({r * std::sin(angle), 0, -r * std::cos(angle)});
    definition.rotation = {{0, -s, 0}, c};
    const b3BodyId body = b3CreateBody(id_, &definition);
    set_mass(body, 1, static_cast<float>(inertia));
    const b3BodyDef fixed = b3DefaultBodyDef();
    b3RevoluteJointDef hinge = b3DefaultRevoluteJointDef();
    hinge.base.bodyIdA = b3CreateBody(id_, &fixed);
    hinge.base.bodyIdB = body;
    hinge.base.constraintHertz = hertz;
    hinge.base.localFrameA.q = hinge.base.localFrameB.q = {{-std::sqrt(0.5f), 0, 0}, std::sqrt(0.5f)};  // z to y
    hinge.base.localFrameB.p = {0, 0, r};
    b3CreateRevoluteJoint(id_, &hinge);
    return body;
  }

 private:
  static b3BodyDef moving_body(b3Vec3 position) {
    b3BodyDef definition = b3DefaultBodyDef();
    definition.type = b3_dynamicBody;
    definition.position = {position.x, position.y, position.z};
    definition.enableSleep = false;
    definition.enableContactRecycling = false;
    return definition;
  }
  b3BodyId add_body(b3Vec3 position) const {
    const b3BodyDef definition = moving_body(position);
    return b3CreateBody(id_, &definition);
  }
  static void set_mass(b3BodyId body, float mass, float inertia) {
    b3Body_SetMassData(body, {mass, {0, 0, 0}, {{inertia, 0, 0}, {0, inertia, 0}, {0, 0, inertia}}});
  }

  b3WorldId id_{};
};

}  // namespace finding
