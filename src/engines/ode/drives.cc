#include "drives.h"

#include "convert.h"
#include "engines/adapter.h"
#include "model/kinematics.h"

namespace assay::ode {
namespace {

// Rotational motors about `axes` (in world coordinates now, fixed in the child) between a child and its parent.
dxJoint* angular_motor(dxWorld* world, dxBody* child, dxBody* parent, const Mat3& axes, int count) {
  dxJoint* motor = dJointCreateAMotor(world, nullptr);
  dJointAttach(motor, child, parent);
  dJointSetAMotorNumAxes(motor, count);
  for (int k = 0; k < count; ++k) dJointSetAMotorAxis(motor, k, 1, axes(0, k), axes(1, k), axes(2, k));
  return motor;
}

dxJoint* linear_motor(dxWorld* world, dxBody* child, dxBody* parent, const Vec3& axis) {
  dxJoint* motor = dJointCreateLMotor(world, nullptr);
  dJointAttach(motor, child, parent);
  dJointSetLMotorNumAxes(motor, 1);
  dJointSetLMotorAxis(motor, 0, 1, axis.x(), axis.y(), axis.z());
  return motor;
}

void set_param(dxJoint* motor, int parameter, double value) {
  if (dJointGetType(motor) == dJointTypeLMotor) {
    dJointSetLMotorParam(motor, parameter, value);
  } else {
    dJointSetAMotorParam(motor, parameter, value);
  }
}

constexpr int kGroups[] = {0, dParamGroup2, dParamGroup3};

void set_friction(dxJoint* motor, int rows, double largest, double cfm) {
  for (int k = 0; k < rows; ++k) {
    set_param(motor, kGroups[k] + dParamVel, 0);
    set_param(motor, kGroups[k] + dParamFMax, largest);
    set_param(motor, kGroups[k] + dParamCFM, cfm);
  }
}

void set_rotor(dxJoint* motor, int rows, double armature, double timestep) {
  for (int k = 0; k < rows; ++k) {
    set_param(motor, kGroups[k] + dParamFMax, dInfinity);
    set_param(motor, kGroups[k] + dParamCFM, timestep / armature);
  }
}

Quat orientation(dxBody* body) {
  if (body == nullptr) return Quat::Identity();
  const dReal* q = dBodyGetQuaternion(body);
  return {q[0], q[1], q[2], q[3]};
}

Vec3 angular_velocity(dxBody* body) { return body == nullptr ? Vec3(Vec3::Zero()) : vec3(dBodyGetAngularVel(body)); }

// The rate that a slide would have after a step without forces, as the motor's row will measure it: along the axis of
// the step's start, while the bodies turn. ODE's own dJointGetSliderPositionRate leaves out that they turn.
double coasting_rate(dxJoint* slider, double timestep) {
  dVector3 axis;
  dJointGetSliderAxis(slider, axis);
  dxBody* child = dJointGetBody(slider, 0);
  dxBody* parent = dJointGetBody(slider, 1);
  Vec3 v = vec3(dBodyGetLinearVel(child));
  if (parent != nullptr) {
    const Vec3 arm = vec3(dBodyGetPosition(child)) - vec3(dBodyGetPosition(parent));
    const Vec3 w = (angular_velocity(child) + angular_velocity(parent)) / 2;
    v -= vec3(dBodyGetLinearVel(parent)) + w.cross(arm - timestep * w.cross(arm));
  }
  return v.dot(vec3(axis));
}

}  // namespace

void Drives::create(dxWorld* world, const Model& model, const std::vector<dxBody*>& bodies,
                    const std::vector<dxJoint*>& joints, const Options& options) {
  timestep_ = options.timestep;
  const auto ode_body = [&](int body) { return body == kWorld ? nullptr : bodies[body]; };
  for (size_t j = 0; j < model.joints.size(); ++j) {
    const Joint& joint = model.joints[j];
    dxBody* child = bodies[joint.body];
    dxBody* parent = ode_body(model.bodies[joint.body].parent);
    const Vec3 axis = orientation(child) * joint.axis_B;
    const auto motor = [&] {
      return joint.is_slide() ? linear_motor(world, child, parent, axis)
                              : angular_motor(world, child, parent, axis.replicate<1, 3>(), 1);
    };
    if (joint.dry_friction > 0) set_friction(motor(), 1, joint.dry_friction, options.cfm);
    if (options.native_springs && joint.has_spring() && joint.limited && !joint.is_slide()) {
      const double yielding = timestep_ * joint.stiffness + joint.damping;
      const double middle = middle_of_range(joint, 0);  // where ODE's angle is zero
      springs_.push_back({joints[j], motor(), joint.spring_reference - middle, joint.stiffness / yielding});
      set_param(springs_.back().motor, dParamFMax, dInfinity);
      set_param(springs_.back().motor, dParamCFM, 1 / yielding);
    }
    if (joint.armature > 0) {
      rotors_.push_back({joints[j], motor()});
      set_rotor(rotors_.back().motor, 1, joint.armature, timestep_);
    }
  }
  for (size_t b = 0; b < model.balls.size(); ++b) {
    const BallJoint& joint = model.balls[b];
    const Body& body = model.bodies[joint.body];
    Ball ball{static_cast<int>(b), bodies[joint.body], ode_body(body.parent), body.X_PB.q};
    const Mat3 axes = orientation(ball.child).toRotationMatrix();
    if (joint.dry_friction > 0) {
      set_friction(angular_motor(world, ball.child, ball.parent, axes, 3), 3, joint.dry_friction, options.cfm);
    }
    if (joint.armature > 0) {
      ball.rotor = angular_motor(world, ball.child, ball.parent, axes, 3);
      set_rotor(ball.rotor, 3, joint.armature, timestep_);
    }
    if (joint.limited) {
      ball.limit = angular_motor(world, ball.child, ball.parent, axes, 1);
      dJointSetAMotorParam(ball.limit, dParamLoStop, -dInfinity);
      dJointSetAMotorParam(ball.limit, dParamHiStop, joint.upper);
      dJointSetAMotorParam(ball.limit, dParamStopERP, options.limit_erp);
      dJointSetAMotorParam(ball.limit, dParamStopCFM, options.limit_cfm);
      dJointSetAMotorParam(ball.limit, dParamBounce, 0);
    }
    if (ball.rotor != nullptr || ball.limit != nullptr) balls_.push_back(ball);
  }
}

void Drives::update() {
  for (const Spring& spring : springs_) {
    set_param(spring.motor, dParamVel, spring.pull * (spring.rest - dJointGetHingeAngle(spring.joint)));
  }
  for (const Rotor& rotor : rotors_) {
    const bool slide = dJointGetType(rotor.joint) == dJointTypeSlider;
    set_param(rotor.motor, dParamVel,
              slide ? coasting_rate(rotor.joint, timestep_) : dJointGetHingeAngleRate(rotor.joint));
  }
  for (const Ball& ball : balls_) {
    const Quat q_WB = orientation(ball.child);
    if (ball.rotor != nullptr) {
      // the armature belongs to the velocity in child axes, which turn during the step
      const Vec3 w = angular_velocity(ball.child), relative = w - angular_velocity(ball.parent);
      const Vec3 target = q_WB.conjugate() * (relative + timestep_ * w.cross(relative));
      for (int k = 0; k < 3; ++k) set_param(ball.rotor, kGroups[k] + dParamVel, target[k]);
    }
    if (ball.limit != nullptr) {
      const Vec3 deflection = rotation_vector((orientation(ball.parent) * ball.q_PB).conjugate() * q_WB);
      const double angle = deflection.norm();
      const Vec3 axis = q_WB * (angle > 0 ? Vec3(deflection / angle) : Vec3(Vec3::UnitX()));
      dJointSetAMotorAxis(ball.limit, 0, 1, axis.x(), axis.y(), axis.z());
      dJointSetAMotorAngle(ball.limit, 0, angle);
    }
  }
}

}  // namespace assay::ode
