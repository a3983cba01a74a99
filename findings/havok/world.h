// A world of Havok's for the findings, set up with only its exported functions: no gravity unless asked for, no
// damping, no speed limit to speak of, bodies always active, one solver for all timesteps.
#pragma once

#include <array>
#include <vector>

#include "host.h"

namespace finding {

using havok::Id;
using havok::Vector3;
using Double3 = std::array<double, 3>;

class World {
 public:
  explicit World(float gravity_z = 0) {
    const Vector3 gravity{0, 0, gravity_z};
    ok(w2c_havok_HP_World_Create(havok_, havok_.out()), "HP_World_Create");
    world_ = havok_.result<Id>();
    ok(w2c_havok_HP_World_SetGravity(havok_, world_, havok_.in(gravity)), "HP_World_SetGravity");
    ok(w2c_havok_HP_World_SetIdealStepTime(havok_, world_, 0), "HP_World_SetIdealStepTime");
    ok(w2c_havok_HP_World_SetSpeedLimit(havok_, world_, 1e6f, 1e6f), "HP_World_SetSpeedLimit");
  }

  Id add_body(float mass, Vector3 inertia, Vector3 position = {}) {
    const Id body = create(w2c_havok_HP_Body_Create(havok_, havok_.out()), "HP_Body_Create");
    ok(w2c_havok_HP_Body_SetMotionType(havok_, body, havok::kDynamic), "HP_Body_SetMotionType");
    havok::MassProperties properties;
    properties.mass = mass;
    properties.inertia_per_mass = {inertia.x / mass, inertia.y / mass, inertia.z / mass};
    ok(w2c_havok_HP_Body_SetMassProperties(havok_, body, havok_.in(properties)), "HP_Body_SetMassProperties");
    ok(w2c_havok_HP_Body_SetLinearDamping(havok_, body, 0), "HP_Body_SetLinearDamping");
    ok(w2c_havok_HP_Body_SetAngularDamping(havok_, body, 0), "HP_Body_SetAngularDamping");
    ok(w2c_havok_HP_Body_SetActivationControl(havok_, body, havok::kAlwaysActive), "HP_Body_SetActivationControl");
    add(body, position);
    return body;
  }

  Id add_fixed_body() {
    const Id body = create(w2c_havok_HP_Body_Create(havok_, havok_.out()), "HP_Body_Create");
    ok(w2c_havok_HP_Body_SetMotionType(havok_, body, havok::kStatic), "HP_Body_SetMotionType");
    add(body, {});
    return body;
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

  Id create(std::uint32_t result, const char* call) {
    ok(result, call);
    return havok_.result<Id>();
  }

  void add(Id body, Vector3 position) {
    const havok::QTransform pose{position, {}};
    ok(w2c_havok_HP_Body_SetQTransform(havok_, body, havok_.in(pose)), "HP_Body_SetQTransform");
    ok(w2c_havok_HP_World_AddBody(havok_, world_, body, 0), "HP_World_AddBody");
  }

  havok::Instance havok_;
  Id world_ = 0;
};

}  // namespace finding
