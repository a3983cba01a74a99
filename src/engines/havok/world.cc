#include "world.h"

#include <cmath>
#include <optional>
#include <utility>

#include "collision.h"
#include "engines/adapter.h"

namespace assay::havok_adapter {
namespace {

using havok::Id;

float f32(double value) { return static_cast<float>(value); }
havok::Vector3 vector3(const Vec3& v) { return {f32(v.x()), f32(v.y()), f32(v.z())}; }
havok::Quaternion quaternion(const Quat& q) { return {f32(q.x()), f32(q.y()), f32(q.z()), f32(q.w())}; }
Vec3 vec3(const havok::Vector3& v) { return {v.x, v.y, v.z}; }
Quat quat(const havok::Quaternion& q) { return Quat(q.w, q.x, q.y, q.z).normalized(); }

struct Velocities {
  havok::Vector3 linear, angular;
};

class HavokSimulation final : public Simulation {
 public:
  HavokSimulation(Model model, const State& state, const Options& options)
      : options_(options),
        clock_{state.time, options.timestep},
        model_(std::move(model)),
        module_(make_module()),
        explicit_springs_(model_.has_springs() && !options_.native_springs) {
    model_.keyframes.clear();
    set_up_world();
    if (!model_.contacts.empty()) create_shapes();
    create_bodies(state);
    create_hinges();
    last_angle_ = state.position;
  }

  // An impulse changes the velocities at once. They are kept until the step, for read_state() and for a second call.
  void set_torques(std::span<const double> torques) override {
    if (explicit_springs_) read_state(scratch_);
    put_back_velocities();
    for (size_t j = 0; j < model_.joints.size(); ++j) {
      const Joint& hinge = model_.joints[j];
      double torque = torques.empty() ? 0.0 : torques[j];
      if (explicit_springs_) torque += spring_torque(hinge, scratch_.position[j], scratch_.velocity[j]);
      if (torque == 0) continue;
      const Vec3 impulse_W = (torque * options_.timestep) * world_axis(hinge);
      push(hinge.body, impulse_W);
      if (const int parent = model_.bodies[hinge.body].parent; parent != kWorld) push(parent, -impulse_W);
    }
  }

  void advance(int count) override {
    any_pushed_ = false;
    module_->step(world_, f32(options_.timestep), count);
    clock_.steps += count;
  }

  void read_state(State& out) const override {
    out.time = clock_.time();
    out.bodies.resize(bodies_.size());
    for (size_t i = 0; i < bodies_.size(); ++i) {
      havok::QTransform pose;
      module_->call(Function::kBody_GetQTransform, {bodies_[i], havok_adapter::out(pose)});
      Velocities v = velocities(i);
      if (any_pushed_ && pushed_[i]) v.angular = before_push_[i];
      out.bodies[i] = {vec3(pose.translation), quat(pose.rotation), vec3(v.linear), vec3(v.angular)};
    }
    out.position = last_angle_;
    joints_from_bodies(model_, out);
    last_angle_ = out.position;
  }

  EngineView view() const override {
    EngineView view;
    std::vector<Pose> poses;
    for (const Id body : bodies_) {
      havok::QTransform pose;
      havok::MassProperties mass;
      module_->call(Function::kBody_GetQTransform, {body, out(pose)});
      module_->call(Function::kBody_GetMassProperties, {body, out(mass)});
      const Pose X_WB{vec3(pose.translation), quat(pose.rotation)};
      const Mat3 R_WI = (X_WB.q * quat(mass.inertia_orientation)).toRotationMatrix();
      const Vec3 diagonal = static_cast<double>(mass.mass) * vec3(mass.inertia_per_mass);
      view.bodies.push_back(
          {mass.mass, X_WB * vec3(mass.center_of_mass), R_WI * diagonal.asDiagonal() * R_WI.transpose()});
      poses.push_back(X_WB);
    }
    // Anchors cannot be asked for: these are the numbers as they were handed over.
    for (size_t j = 0; j < joints_.size(); ++j) {
      const Joint& hinge = model_.joints[j];
      EngineJoint seen;
      seen.p_WJ = poses[hinge.body] * vec3(anchors_[j].pivot);
      seen.axis_W = poses[hinge.body].q * vec3(anchors_[j].axis);
      std::uint32_t mode = 0;
      module_->call(Function::kConstraint_GetAxisMode, {joints_[j], std::uint32_t{havok::kAngularX}, out(mode)});
      seen.limited = mode == havok::kLimited;
      if (seen.limited) {
        float lower = 0, upper = 0;
        module_->call(Function::kConstraint_GetAxisMinLimit, {joints_[j], std::uint32_t{havok::kAngularX}, out(lower)});
        module_->call(Function::kConstraint_GetAxisMaxLimit, {joints_[j], std::uint32_t{havok::kAngularX}, out(upper)});
        seen.lower = zero_angle(hinge, options_) + lower;
        seen.upper = zero_angle(hinge, options_) + upper;
      }
      view.joints.push_back(seen);
    }
    havok::Vector3 gravity;
    module_->call(Function::kWorld_GetGravity, {world_, out(gravity)});
    view.gravity = vec3(gravity);
    return view;
  }

 private:
  struct Anchor {
    havok::Vector3 pivot, axis;
  };

  Id create(Function function) {
    Id id = 0;
    module_->call(function, {out(id)});
    return id;
  }

  void set_up_world() {
    world_ = create(Function::kWorld_Create);
    module_->call(Function::kWorld_SetGravity, {world_, in(vector3(model_.gravity))});
    module_->call(Function::kWorld_SetIdealStepTime, {world_, f32(options_.ideal_step_time)});
    module_->call(Function::kWorld_SetSpeedLimit, {world_, f32(options_.max_speed), f32(options_.max_angular_speed)});
  }

  // ---- shapes -------------------------------------------------------------------------------------------------------

  // Only shapes that are in a contact pair are made, in their body's frame about its centre of mass.
  void create_shapes() {
    const Filters filters = find_filters(model_);
    const std::optional<Friction> friction = find_friction(model_);
    if (!friction) throw EngineError("no materials give these pairs' friction");  // check() has refused it
    shapes_of_.resize(model_.bodies.size());
    for (size_t s = 0; s < model_.shapes.size(); ++s) {
      if (filters.of[s].membership == 0) continue;
      const Shape& shape = model_.shapes[s];
      const Id id = create_shape(shape);
      module_->call(Function::kShape_SetFilterInfo, {id, in(filters.of[s])});
      const float mu = f32(friction->of[s]);
      const havok::Material material{mu, mu, 0, friction->rule, havok::kMaximum};
      module_->call(Function::kShape_SetMaterial, {id, in(material)});
      if (shape.body == kWorld) {
        create_static(shape.type == ShapeType::kPlane ? shape.X_BS : Pose{}, id);
      } else {
        shapes_of_[shape.body].push_back(id);
      }
    }
  }

  Id create_shape(const Shape& shape) {
    Id id = 0;
    const Vec3 center = shape.body == kWorld ? shape.X_BS.p : Vec3(shape.X_BS.p - model_.bodies[shape.body].p_BBcm);
    switch (shape.type) {
      case ShapeType::kSphere:
        module_->call(Function::kShape_CreateSphere, {in(vector3(center)), f32(shape.radius), out(id)});
        break;
      case ShapeType::kCapsule: {
        const Vec3 half = shape.X_BS.q * Vec3(0, 0, shape.half_length);
        module_->call(Function::kShape_CreateCapsule,
                      {in(vector3(center - half)), in(vector3(center + half)), f32(shape.radius), out(id)});
        break;
      }
      case ShapeType::kPlane: {
        const Vec3 size(options_.ground_size, options_.ground_size, options_.ground_thickness);
        module_->call(Function::kShape_CreateBox, {in(vector3(Vec3(0, 0, -size.z() / 2))),
                                                   in(quaternion(Quat::Identity())), in(vector3(size)), out(id)});
        break;
      }
      case ShapeType::kBox:
      case ShapeType::kCylinder:
      case ShapeType::kEllipsoid:
      case ShapeType::kHull:
      case ShapeType::kHeightField:
        throw UnsupportedError("this shape is refused by check()");
    }
    return id;
  }

  void create_static(const Pose& X_WS, Id shape) {
    const Id body = create(Function::kBody_Create);
    module_->call(Function::kBody_SetMotionType, {body, std::uint32_t{havok::kStatic}});
    if (shape != 0) module_->call(Function::kBody_SetShape, {body, shape});
    module_->call(Function::kBody_SetQTransform, {body, in(havok::QTransform{vector3(X_WS.p), quaternion(X_WS.q)})});
    module_->call(Function::kWorld_AddBody, {world_, body, std::uint32_t{0}});
    last_static_ = body;
  }

  // ---- bodies -------------------------------------------------------------------------------------------------------

  // Havok's body frame: origin in the centre of mass, axes of the MJCF frame. The shape first, which brings mass
  // properties of its own.
  void create_bodies(const State& state) {
    for (size_t i = 0; i < model_.bodies.size(); ++i) {
      const BodyState& s = state.bodies[i];
      const Id body = create(Function::kBody_Create);
      bodies_.push_back(body);
      module_->call(Function::kBody_SetMotionType, {body, std::uint32_t{havok::kDynamic}});
      if (!shapes_of_.empty() && !shapes_of_[i].empty()) {
        module_->call(Function::kBody_SetShape, {body, body_shape(shapes_of_[i])});
      }
      set_mass(body, model_.bodies[i]);
      module_->call(Function::kBody_SetLinearDamping, {body, 0.0f});
      module_->call(Function::kBody_SetAngularDamping, {body, 0.0f});
      module_->call(Function::kBody_SetActivationControl, {body, std::uint32_t{havok::kAlwaysActive}});
      module_->call(Function::kBody_SetQTransform,
                    {body, in(havok::QTransform{vector3(s.p_WBcm), quaternion(s.q_WB)})});
      module_->call(Function::kWorld_AddBody, {world_, body, std::uint32_t{0}});
      module_->call(Function::kBody_SetLinearVelocity, {body, in(vector3(s.v_WBcm))});
      module_->call(Function::kBody_SetAngularVelocity, {body, in(vector3(s.w_WB))});
    }
    pushed_.assign(bodies_.size(), false);
    before_push_.resize(bodies_.size());
  }

  Id body_shape(const std::vector<Id>& shapes) {
    if (shapes.size() == 1) return shapes.front();
    const Id container = create(Function::kShape_CreateContainer);
    for (const Id shape : shapes) {
      module_->call(Function::kShape_AddChild, {container, shape, in(havok::QSTransform{})});
    }
    return container;
  }

  void set_mass(Id id, const Body& body) {
    const PrincipalInertia inertia = principal_inertia(body.I_BBcm_B);
    havok::MassProperties mass;
    mass.mass = f32(body.mass);
    mass.inertia_per_mass = vector3(inertia.diagonal / body.mass);
    mass.inertia_orientation = quaternion(inertia.q_BI);
    module_->call(Function::kBody_SetMassProperties, {id, in(mass)});
  }

  // ---- hinges -------------------------------------------------------------------------------------------------------

  void create_hinges() {
    for (size_t j = 0; j < model_.joints.size(); ++j) {
      const Joint& hinge = model_.joints[j];
      const Body& child = model_.bodies[hinge.body];
      const double zero = zero_angle(hinge, options_);
      const Vec3 p_child = hinge.p_BJ - child.p_BBcm;
      Vec3 p_parent = anchor_in_parent(model_, static_cast<int>(j));
      Id parent = world_anchor_;
      if (child.parent != kWorld) {
        p_parent -= model_.bodies[child.parent].p_BBcm;
        parent = bodies_[child.parent];
      } else if (parent == 0) {
        create_static({}, 0);
        parent = world_anchor_ = last_static_;
      }
      // The two frames coincide at the zero angle.
      const Quat q_PB(child.X_PB.q * Eigen::AngleAxisd(zero - hinge.reference, hinge.axis_B));
      const Vec3 side = hinge.axis_B.unitOrthogonal();
      const Anchor anchor{vector3(p_child), vector3(hinge.axis_B)};
      anchors_.push_back(anchor);

      const Id joint = create(Function::kConstraint_Create);
      joints_.push_back(joint);
      module_->call(Function::kConstraint_SetParentBody, {joint, parent});
      module_->call(Function::kConstraint_SetChildBody, {joint, bodies_[hinge.body]});
      module_->call(Function::kConstraint_SetAnchorInParent,
                    {joint, in(vector3(p_parent)), in(vector3(q_PB * hinge.axis_B)), in(vector3(q_PB * side))});
      module_->call(Function::kConstraint_SetAnchorInChild,
                    {joint, in(anchor.pivot), in(anchor.axis), in(vector3(side))});
      for (const havok::Axis axis :
           {havok::kLinearX, havok::kLinearY, havok::kLinearZ, havok::kAngularY, havok::kAngularZ}) {
        module_->call(Function::kConstraint_SetAxisMode, {joint, std::uint32_t{axis}, std::uint32_t{havok::kLocked}});
      }
      if (hinge.limited) set_limits(joint, hinge.lower - zero, hinge.upper - zero);
      if (hinge.has_spring() && options_.native_springs) set_spring(joint, hinge);
      const bool contact = hinge_has_contact(model_, static_cast<int>(j));
      module_->call(Function::kConstraint_SetCollisionsEnabled, {joint, std::uint32_t{contact}});
      module_->call(Function::kConstraint_SetEnabled, {joint, std::uint32_t{1}});
    }
  }

  void set_limits(Id joint, double lower, double upper) {
    const std::uint32_t axis = havok::kAngularX;
    module_->call(Function::kConstraint_SetAxisMode, {joint, axis, std::uint32_t{havok::kLimited}});
    module_->call(Function::kConstraint_SetAxisMinLimit, {joint, axis, f32(lower)});
    module_->call(Function::kConstraint_SetAxisMaxLimit, {joint, axis, f32(upper)});
  }

  void set_spring(Id joint, const Joint& hinge) {
    const std::uint32_t axis = havok::kAngularX;
    // Its target stays 0, where the constraint's angle counts from: with this kind of motor another target cannot be
    // set, and one that was set before acts doubled.
    module_->call(Function::kConstraint_SetAxisMotorType, {joint, axis, std::uint32_t{havok::kSpringForce}});
    module_->call(Function::kConstraint_SetAxisMotorVelocityTarget, {joint, axis, 0.0f});
    module_->call(Function::kConstraint_SetAxisMotorStiffness, {joint, axis, f32(hinge.stiffness)});
    module_->call(Function::kConstraint_SetAxisMotorDamping, {joint, axis, f32(hinge.damping)});
    module_->call(Function::kConstraint_SetAxisMotorMaxForce, {joint, axis, 1e9f});
  }

  // ---- torques ------------------------------------------------------------------------------------------------------

  Velocities velocities(size_t body) const {
    Velocities v;
    module_->call(Function::kBody_GetLinearVelocity, {bodies_[body], out(v.linear)});
    module_->call(Function::kBody_GetAngularVelocity, {bodies_[body], out(v.angular)});
    return v;
  }

  Vec3 world_axis(const Joint& hinge) const {
    havok::QTransform pose;
    module_->call(Function::kBody_GetQTransform, {bodies_[hinge.body], out(pose)});
    return quat(pose.rotation) * hinge.axis_B;
  }

  void push(int body, const Vec3& impulse_W) {
    if (!any_pushed_) pushed_.assign(bodies_.size(), false);
    any_pushed_ = true;
    if (!pushed_[body]) {
      module_->call(Function::kBody_GetAngularVelocity, {bodies_[body], out(before_push_[body])});
      pushed_[body] = true;
    }
    module_->call(Function::kBody_ApplyAngularImpulse, {bodies_[body], in(vector3(impulse_W))});
  }

  void put_back_velocities() {
    if (!any_pushed_) return;
    for (size_t i = 0; i < bodies_.size(); ++i) {
      if (!pushed_[i]) continue;
      module_->call(Function::kBody_SetAngularVelocity, {bodies_[i], in(before_push_[i])});
    }
    any_pushed_ = false;
  }

  Options options_;
  Clock clock_;
  Model model_;  // our own copy: the caller's need not live on
  std::unique_ptr<Module> module_;
  Id world_ = 0, world_anchor_ = 0, last_static_ = 0;
  std::vector<Id> bodies_, joints_;
  std::vector<std::vector<Id>> shapes_of_;  // per body
  std::vector<Anchor> anchors_;             // in the child
  bool explicit_springs_;
  State scratch_;
  bool any_pushed_ = false;  // since the last step
  std::vector<bool> pushed_;
  std::vector<havok::Vector3> before_push_;  // angular velocities: a push changes no other
  mutable std::vector<double> last_angle_;   // what the next read unwraps against
};

}  // namespace

double zero_angle(const Joint& hinge, const Options& options) {
  if (options.native_springs && hinge.stiffness != 0) return hinge.spring_reference;
  return middle_of_range(hinge, hinge.reference);
}

std::unique_ptr<Simulation> make_simulation(const Model& model, const State& state, const Options& options) {
  return std::make_unique<HavokSimulation>(model, state, options);
}

}  // namespace assay::havok_adapter
