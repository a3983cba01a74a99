// A world of Havok's for the findings, set up with only its exported functions: no gravity unless asked for, no
// damping, no speed limit to speak of, bodies always active, one solver for all timesteps.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

#include "host.h"

namespace finding {

using havok::Id;
using havok::Vector3;
using Double3 = std::array<double, 3>;

class World {
 public:
  explicit World(float gravity_z = 0) : World(Vector3{0, 0, gravity_z}, 0) {}

  // `ideal_step_time`: the timestep that the solver is tuned for, s; 0 for none.
  World(Vector3 gravity, float ideal_step_time) {
    ok(w2c_havok_HP_World_Create(havok_, havok_.out()), "HP_World_Create");
    world_ = havok_.result<Id>();
    ok(w2c_havok_HP_World_SetGravity(havok_, world_, havok_.in(gravity)), "HP_World_SetGravity");
    ok(w2c_havok_HP_World_SetIdealStepTime(havok_, world_, ideal_step_time), "HP_World_SetIdealStepTime");
    ok(w2c_havok_HP_World_SetSpeedLimit(havok_, world_, 1e6f, 1e6f), "HP_World_SetSpeedLimit");
  }

  Id add_body(float mass, Vector3 inertia, Vector3 position = {}) {
    const Id body = create(w2c_havok_HP_Body_Create(havok_, havok_.out()), "HP_Body_Create");
    ok(w2c_havok_HP_Body_SetMotionType(havok_, body, havok::kDynamic), "HP_Body_SetMotionType");
    make_free(body, mass, inertia);
    add(body, position);
    return body;
  }

  Id add_fixed_body() {
    const Id body = create(w2c_havok_HP_Body_Create(havok_, havok_.out()), "HP_Body_Create");
    ok(w2c_havok_HP_Body_SetMotionType(havok_, body, havok::kStatic), "HP_Body_SetMotionType");
    add(body, {});
    return body;
  }

  // Shapes with the friction that both have. A shape brings mass properties of its own, which add_solid()
  // replaces.
  Id box(Vector3 size, float friction, Vector3 center = {}) {
    const havok::Quaternion upright{};
    return material(create(w2c_havok_HP_Shape_CreateBox(havok_, havok_.in(center, 0), havok_.in(upright, 1),
                                                        havok_.in(size, 2), havok_.out()),
                           "HP_Shape_CreateBox"),
                    friction);
  }
  Id hull(const std::vector<Vector3>& points, float friction) {
    const std::uint32_t address = copy(points);
    const Id made = create(
        w2c_havok_HP_Shape_CreateConvexHull(havok_, address, static_cast<std::uint32_t>(points.size()), havok_.out()),
        "HP_Shape_CreateConvexHull");
    w2c_havok_free(havok_, address);
    return material(made, friction);
  }
  // Corners are numbers of points, three a triangle.
  Id mesh(const std::vector<Vector3>& points, const std::vector<std::uint32_t>& corners, float friction) {
    const std::uint32_t at_points = copy(points), at_corners = copy(corners);
    const Id made =
        create(w2c_havok_HP_Shape_CreateMesh(havok_, at_points, static_cast<std::uint32_t>(points.size()), at_corners,
                                             static_cast<std::uint32_t>(corners.size() / 3), havok_.out()),
               "HP_Shape_CreateMesh");
    w2c_havok_free(havok_, at_points);
    w2c_havok_free(havok_, at_corners);
    return material(made, friction);
  }
  Id cylinder(Vector3 from, Vector3 to, float radius, float friction) {
    return material(
        create(w2c_havok_HP_Shape_CreateCylinder(havok_, havok_.in(from, 0), havok_.in(to, 1), radius, havok_.out(2)),
               "HP_Shape_CreateCylinder", 2),
        friction);
  }
  Id sphere(float radius, float friction) {
    const Vector3 center{};
    return material(create(w2c_havok_HP_Shape_CreateSphere(havok_, havok_.in(center), radius, havok_.out(2)),
                           "HP_Shape_CreateSphere", 2),
                    friction);
  }
  Id capsule(Vector3 from, Vector3 to, float radius, float friction) {
    return material(
        create(w2c_havok_HP_Shape_CreateCapsule(havok_, havok_.in(from, 0), havok_.in(to, 1), radius, havok_.out(2)),
               "HP_Shape_CreateCapsule", 2),
        friction);
  }

  Id add_solid(Id shape, float mass, Vector3 inertia, Vector3 position, havok::Quaternion rotation = {}) {
    const Id body = create(w2c_havok_HP_Body_Create(havok_, havok_.out()), "HP_Body_Create");
    ok(w2c_havok_HP_Body_SetMotionType(havok_, body, havok::kDynamic), "HP_Body_SetMotionType");
    ok(w2c_havok_HP_Body_SetShape(havok_, body, shape), "HP_Body_SetShape");
    make_free(body, mass, inertia);
    add(body, position, rotation);
    return body;
  }
  // The upper side of a fixed box is the plane z = 0.
  void add_ground(float friction) { add_fixed(box({100, 100, 10}, friction, {0, 0, -5})); }
  void add_fixed(Id shape) {
    const Id body = create(w2c_havok_HP_Body_Create(havok_, havok_.out()), "HP_Body_Create");
    ok(w2c_havok_HP_Body_SetMotionType(havok_, body, havok::kStatic), "HP_Body_SetMotionType");
    ok(w2c_havok_HP_Body_SetShape(havok_, body, shape), "HP_Body_SetShape");
    add(body, {});
  }

  // A hinge about y: `at_parent` of the parent and `at_child` of the child coincide.
  void add_hinge(Id parent, Vector3 at_parent, Id child, Vector3 at_child) {
    const Vector3 axis{0, 1, 0}, side{1, 0, 0};
    const Id hinge = create(w2c_havok_HP_Constraint_Create(havok_, havok_.out()), "HP_Constraint_Create");
    ok(w2c_havok_HP_Constraint_SetParentBody(havok_, hinge, parent), "HP_Constraint_SetParentBody");
    ok(w2c_havok_HP_Constraint_SetChildBody(havok_, hinge, child), "HP_Constraint_SetChildBody");
    ok(w2c_havok_HP_Constraint_SetAnchorInParent(havok_, hinge, havok_.in(at_parent, 0), havok_.in(axis, 1),
                                                 havok_.in(side, 2)),
       "HP_Constraint_SetAnchorInParent");
    ok(w2c_havok_HP_Constraint_SetAnchorInChild(havok_, hinge, havok_.in(at_child, 0), havok_.in(axis, 1),
                                                havok_.in(side, 2)),
       "HP_Constraint_SetAnchorInChild");
    for (const havok::Axis locked :
         {havok::kLinearX, havok::kLinearY, havok::kLinearZ, havok::kAngularY, havok::kAngularZ}) {
      ok(w2c_havok_HP_Constraint_SetAxisMode(havok_, hinge, locked, havok::kLocked), "HP_Constraint_SetAxisMode");
    }
    ok(w2c_havok_HP_Constraint_SetEnabled(havok_, hinge, 1), "HP_Constraint_SetEnabled");
  }

  void set_velocity(Id body, Vector3 v) {
    ok(w2c_havok_HP_Body_SetLinearVelocity(havok_, body, havok_.in(v)), "HP_Body_SetLinearVelocity");
  }
  void set_angular_velocity(Id body, Vector3 w) {
    ok(w2c_havok_HP_Body_SetAngularVelocity(havok_, body, havok_.in(w)), "HP_Body_SetAngularVelocity");
  }
  void apply_angular_impulse(Id body, Vector3 impulse) {
    ok(w2c_havok_HP_Body_ApplyAngularImpulse(havok_, body, havok_.in(impulse)), "HP_Body_ApplyAngularImpulse");
  }
  void apply_impulse(Id body, Vector3 place, Vector3 impulse) {
    ok(w2c_havok_HP_Body_ApplyImpulse(havok_, body, havok_.in(place, 0), havok_.in(impulse, 1)),
       "HP_Body_ApplyImpulse");
  }
  Vector3 velocity(Id body) {
    ok(w2c_havok_HP_Body_GetLinearVelocity(havok_, body, havok_.out()), "HP_Body_GetLinearVelocity");
    return havok_.result<Vector3>();
  }
  Vector3 angular_velocity(Id body) {
    ok(w2c_havok_HP_Body_GetAngularVelocity(havok_, body, havok_.out()), "HP_Body_GetAngularVelocity");
    return havok_.result<Vector3>();
  }
  havok::QTransform transform(Id body) {
    ok(w2c_havok_HP_Body_GetQTransform(havok_, body, havok_.out()), "HP_Body_GetQTransform");
    return havok_.result<havok::QTransform>();
  }

  void step(float timestep, long count = 1) {
    for (long i = 0; i < count; ++i) ok(w2c_havok_HP_World_Step(havok_, world_, timestep), "HP_World_Step");
  }

 private:
  static void ok(std::uint32_t result, const char* call) { havok::check(result, call); }

  template <typename T>
  std::uint32_t copy(const std::vector<T>& numbers) {
    const auto size = static_cast<std::uint32_t>(numbers.size() * sizeof(T));
    const std::uint32_t address = w2c_havok_malloc(havok_, size);
    w2c_havok* const module = havok_;
    std::memcpy(module->w2c_memory.data + address, numbers.data(), size);
    return address;
  }

  Id create(std::uint32_t result, const char* call, int slot = 0) {
    ok(result, call);
    return havok_.result<Id>(slot);
  }

  Id material(Id shape, float friction) {
    const havok::Material made{friction, friction, 0, havok::kMaximum, havok::kMaximum};
    ok(w2c_havok_HP_Shape_SetMaterial(havok_, shape, havok_.in(made)), "HP_Shape_SetMaterial");
    return shape;
  }

  void make_free(Id body, float mass, Vector3 inertia) {
    havok::MassProperties properties;
    properties.mass = mass;
    properties.inertia_per_mass = {inertia.x / mass, inertia.y / mass, inertia.z / mass};
    ok(w2c_havok_HP_Body_SetMassProperties(havok_, body, havok_.in(properties)), "HP_Body_SetMassProperties");
    ok(w2c_havok_HP_Body_SetLinearDamping(havok_, body, 0), "HP_Body_SetLinearDamping");
    ok(w2c_havok_HP_Body_SetAngularDamping(havok_, body, 0), "HP_Body_SetAngularDamping");
    ok(w2c_havok_HP_Body_SetActivationControl(havok_, body, havok::kAlwaysActive), "HP_Body_SetActivationControl");
  }

  void add(Id body, Vector3 position, havok::Quaternion rotation = {}) {
    const havok::QTransform pose{position, rotation};
    ok(w2c_havok_HP_Body_SetQTransform(havok_, body, havok_.in(pose)), "HP_Body_SetQTransform");
    ok(w2c_havok_HP_World_AddBody(havok_, world_, body, 0), "HP_World_AddBody");
  }

  havok::Instance havok_;
  Id world_ = 0;
};

}  // namespace finding
