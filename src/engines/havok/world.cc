#include "world.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <utility>

#include "collision.h"
#include "engines/adapter.h"
#include "model/ellipsoid.h"
#include "model/weld_frames.h"

namespace assay::havok_adapter {
namespace {

using havok::Id;

constexpr int kEllipsoidSubdivisions = 2;

float f32(double value) { return static_cast<float>(value); }
havok::Vector3 vector3(const Vec3& v) { return {f32(v.x()), f32(v.y()), f32(v.z())}; }
havok::Quaternion quaternion(const Quat& q) { return {f32(q.x()), f32(q.y()), f32(q.z()), f32(q.w())}; }
Vec3 vec3(const havok::Vector3& v) { return {v.x, v.y, v.z}; }
Quat quat(const havok::Quaternion& q) { return Quat(q.w, q.x, q.y, q.z).normalized(); }

// Havok's own boxes below 1 cm let other shapes through; the hull of their corners does not.
Hull box_corners(const Vec3& half_size) {
  Hull hull;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 signs((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1, (corner & 4) != 0 ? 1 : -1);
    hull.vertices.emplace_back(half_size.cwiseProduct(signs));
  }
  return hull;
}

struct Velocities {
  havok::Vector3 linear, angular;
};

class HavokSimulation final : public Simulation {
 public:
  HavokSimulation(Model model, const State& state, const Options& options)
      : options_(options),
        clock_{state.time, options.timestep},
        rows_(model, options.timestep, {}),
        lent_(lend_mass(without_wide_ranges(std::move(model)), options.lent_share)),
        model_(lent_.model),
        module_(make_module()),
        joint_springs_(model_.has_springs() && !options_.native_springs),
        explicit_springs_(joint_springs_ || std::ranges::any_of(model_.balls, &BallJoint::has_spring) ||
                          std::ranges::any_of(model_.tendons, &Tendon::has_spring) || rows_.any()) {
    lent_.model.keyframes.clear();
    set_up_world();
    if (!model_.contacts.empty()) create_shapes();
    State start = state;
    lent_.to_copy(start);
    create_bodies(start);
    create_joints();
    create_constraints();
    last_angle_ = state.position;
  }

  // An impulse changes the velocities at once. They are kept until the step, for read_state() and for a second call.
  void set_torques(std::span<const double> torques) override {
    if (explicit_springs_) read_copy(scratch_);
    put_back_velocities();
    collect_torques(model_, torques, joint_springs_ ? &scratch_ : nullptr, torques_);
    if (explicit_springs_) {
      add_tendon_tensions(model_, scratch_, torques_);
      rows_.add(model_, scratch_, torques_);
      add_ball_springs();
    }
    for (size_t j = 0; j < model_.joints.size(); ++j) {
      const Joint& joint = model_.joints[j];
      if (torques_[j] == 0) continue;
      const havok::QTransform pose = transform(joint.body);
      const Vec3 axis = quat(pose.rotation) * joint.axis_B;
      const Vec3 impulse_W = (torques_[j] * options_.timestep) * axis;
      const int parent = model_.bodies[joint.body].parent;
      if (joint.is_slide()) {
        const Vec3 p = vec3(pose.translation) + quat(pose.rotation) * (joint.p_BJ - model_.bodies[joint.body].p_BBcm);
        push_at(joint.body, p, impulse_W);
        if (parent != kWorld) push_at(parent, p, -impulse_W);
      } else {
        push(joint.body, impulse_W);
        if (parent != kWorld) push(parent, -impulse_W);
      }
    }
  }

  void advance(int count) override {
    any_pushed_ = false;
    module_->step(world_, f32(options_.timestep), count);
    clock_.steps += count;
  }

  void read_state(State& out) const override {
    read_copy(out);
    lent_.to_original(out);
  }

  // As lent_'s model has it.
  void read_copy(State& out) const {
    out.time = clock_.time();
    out.bodies.resize(bodies_.size());
    for (size_t i = 0; i < bodies_.size(); ++i) {
      havok::QTransform pose;
      module_->call(Function::kBody_GetQTransform, {bodies_[i], havok_adapter::out(pose)});
      Velocities v = velocities(i);
      if (any_pushed_ && pushed_[i]) v = before_push_[i];
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
      const std::uint32_t axis = free_axis(hinge);
      EngineJoint seen;
      seen.p_WJ = poses[hinge.body] * vec3(anchors_[j].pivot);
      seen.axis_W = poses[hinge.body].q * vec3(anchors_[j].axis);
      std::uint32_t mode = 0;
      module_->call(Function::kConstraint_GetAxisMode, {joints_[j], axis, out(mode)});
      seen.limited = mode == havok::kLimited;
      if (seen.limited) {
        float lower = 0, upper = 0;
        module_->call(Function::kConstraint_GetAxisMinLimit, {joints_[j], axis, out(lower)});
        module_->call(Function::kConstraint_GetAxisMaxLimit, {joints_[j], axis, out(upper)});
        seen.lower = zero_angle(hinge, options_) + lower;
        seen.upper = zero_angle(hinge, options_) + upper;
      }
      view.joints.push_back(seen);
    }
    havok::Vector3 gravity;
    module_->call(Function::kWorld_GetGravity, {world_, out(gravity)});
    view.gravity = vec3(gravity);
    return_lent_mass(lent_, view);
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
      const havok::Material material{mu, mu, f32(options_.restitution.coefficient), friction->rule, havok::kMaximum};
      module_->call(Function::kShape_SetMaterial, {id, in(material)});
      if (shape.body == kWorld) {
        const bool placed = shape.type == ShapeType::kPlane || shape.type == ShapeType::kHeightField;
        create_static(placed ? shape.X_BS : Pose{}, id);
      } else {
        shapes_of_[shape.body].push_back(id);
      }
    }
  }

  // How far from `center` a body starts, m.
  double farthest_start(const Vec3& center) const {
    double farthest = 0;
    for (const BodyState& body : model_.initial.bodies) farthest = std::max(farthest, (body.p_WBcm - center).norm());
    return farthest;
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
        const double side = std::max(options_.ground_size, 4 * farthest_start(shape.X_BS.p));
        const Vec3 size(side, side, options_.ground_thickness);
        module_->call(Function::kShape_CreateBox, {in(vector3(Vec3(0, 0, -size.z() / 2))),
                                                   in(quaternion(Quat::Identity())), in(vector3(size)), out(id)});
        break;
      }
      case ShapeType::kBox:
        return create_hull(box_corners(shape.half_size), {center, shape.X_BS.q});
      case ShapeType::kCylinder: {
        const Vec3 half = shape.X_BS.q * Vec3(0, 0, shape.half_length);
        module_->call(Function::kShape_CreateCylinder,
                      {in(vector3(center - half)), in(vector3(center + half)), f32(shape.radius), out(id)});
        break;
      }
      case ShapeType::kEllipsoid:
        return create_hull(ellipsoid_hull(shape.half_size, kEllipsoidSubdivisions), {center, shape.X_BS.q});
      case ShapeType::kHull:
        return create_hull(model_.hulls[shape.data], {center, shape.X_BS.q});
      case ShapeType::kHeightField:
        return create_surface(model_.height_fields[shape.data]);
    }
    return id;
  }

  Id create_hull(const Hull& hull, const Pose& X) {
    std::vector<havok::Vector3> points;
    points.reserve(hull.vertices.size());
    for (const Vec3& vertex : hull.vertices) points.push_back(vector3(X * vertex));
    Id id = 0;
    module_->call(Function::kShape_CreateConvexHull,
                  {array(points), static_cast<std::uint32_t>(points.size()), out(id)});
    return id;
  }

  // A height field's upper surface, two triangles a cell. Havok's own height field has another diagonal.
  Id create_surface(const HeightField& field) {
    std::vector<havok::Vector3> points;
    std::vector<std::uint32_t> corners;
    const int rows = field.rows, columns = field.columns;
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        points.push_back(
            vector3({-field.half_x + (column * 2 * field.half_x / (columns - 1)),
                     -field.half_y + (row * 2 * field.half_y / (rows - 1)), field.heights[(row * columns) + column]}));
        if (row + 1 == rows || column + 1 == columns) continue;
        const auto a = static_cast<std::uint32_t>((row * columns) + column),
                   c = a + static_cast<std::uint32_t>(columns);
        corners.insert(corners.end(), {a, a + 1, c, a + 1, c + 1, c});
      }
    }
    Id id = 0;
    module_->call(Function::kShape_CreateMesh,
                  {array(points), static_cast<std::uint32_t>(points.size()), array(corners),
                   static_cast<std::uint32_t>(corners.size() / 3), out(id)});
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

  // ---- joints and constraints ---------------------------------------------------------------------------------------

  static std::uint32_t free_axis(const Joint& joint) { return joint.is_slide() ? havok::kLinearX : havok::kAngularX; }

  // Havok's body for one of the model's; for the world a static one that is made when it is needed.
  Id havok_body(int body) {
    if (body != kWorld) return bodies_[body];
    if (world_anchor_ == 0) {
      create_static({}, 0);
      world_anchor_ = last_static_;
    }
    return world_anchor_;
  }
  Vec3 from_centre(int body, const Vec3& p) const { return body == kWorld ? p : Vec3(p - model_.bodies[body].p_BBcm); }

  struct Frame {
    Vec3 pivot = Vec3::Zero(), axis = Vec3::UnitX(), side = Vec3::UnitY();  // body frame, from the centre of mass
  };

  // A constraint between two bodies that locks `locked` axes of the two frames.
  Id create_constraint(Id parent, const Frame& in_parent, Id child, const Frame& in_child,
                       std::initializer_list<havok::Axis> locked) {
    const Id joint = create(Function::kConstraint_Create);
    module_->call(Function::kConstraint_SetParentBody, {joint, parent});
    module_->call(Function::kConstraint_SetChildBody, {joint, child});
    module_->call(Function::kConstraint_SetAnchorInParent,
                  {joint, in(vector3(in_parent.pivot)), in(vector3(in_parent.axis)), in(vector3(in_parent.side))});
    module_->call(Function::kConstraint_SetAnchorInChild,
                  {joint, in(vector3(in_child.pivot)), in(vector3(in_child.axis)), in(vector3(in_child.side))});
    for (const havok::Axis axis : locked) {
      module_->call(Function::kConstraint_SetAxisMode, {joint, std::uint32_t{axis}, std::uint32_t{havok::kLocked}});
    }
    return joint;
  }

  void enable(Id joint, bool contact) {
    module_->call(Function::kConstraint_SetCollisionsEnabled, {joint, std::uint32_t{contact}});
    module_->call(Function::kConstraint_SetEnabled, {joint, std::uint32_t{1}});
  }

  void create_joints() {
    for (size_t j = 0; j < model_.joints.size(); ++j) {
      const Joint& hinge = model_.joints[j];
      const Body& child = model_.bodies[hinge.body];
      const double zero = zero_angle(hinge, options_);
      const double way = zero - hinge.reference;  // from the pose X_PB to the constraint's zero
      Vec3 p_parent = from_centre(child.parent, anchor_in_parent(model_, static_cast<int>(j)));
      // The two frames coincide at the zero angle.
      Quat q_PB = child.X_PB.q;
      if (hinge.is_slide()) {
        p_parent += way * (q_PB * hinge.axis_B);
      } else {
        q_PB = Quat(q_PB * Eigen::AngleAxisd(way, hinge.axis_B));
      }
      const Vec3 side = hinge.axis_B.unitOrthogonal();
      const Frame in_child{from_centre(hinge.body, hinge.p_BJ), hinge.axis_B, side};
      anchors_.push_back({vector3(in_child.pivot), vector3(in_child.axis)});

      using enum havok::Axis;
      const Frame in_parent{p_parent, q_PB * hinge.axis_B, q_PB * side};
      const Id parent = havok_body(child.parent);
      const Id joint = hinge.is_slide() ? create_constraint(parent, in_parent, bodies_[hinge.body], in_child,
                                                            {kLinearY, kLinearZ, kAngularX, kAngularY, kAngularZ})
                                        : create_constraint(parent, in_parent, bodies_[hinge.body], in_child,
                                                            {kLinearX, kLinearY, kLinearZ, kAngularY, kAngularZ});
      joints_.push_back(joint);
      if (hinge.limited) set_limits(joint, free_axis(hinge), hinge.lower - zero, hinge.upper - zero);
      if (hinge.has_spring() && options_.native_springs) set_spring(joint, hinge);
      if (hinge.dry_friction > 0) {
        module_->call(Function::kConstraint_SetAxisFriction, {joint, free_axis(hinge), f32(hinge.dry_friction)});
      }
      enable(joint, joint_has_contact(model_, hinge.body));
    }
  }

  // Ball joints, points and bodies held together.
  void create_constraints() {
    using enum havok::Axis;
    for (const BallJoint& ball : model_.balls) {
      const Body& body = model_.bodies[ball.body];
      const Id joint = create_constraint(havok_body(body.parent),
                                         {.pivot = from_centre(body.parent, body.X_PB * ball.p_BJ)}, bodies_[ball.body],
                                         {.pivot = from_centre(ball.body, ball.p_BJ)}, {kLinearX, kLinearY, kLinearZ});
      enable(joint, joint_has_contact(model_, ball.body));
    }
    for (const Connect& connect : model_.connects) {
      enable(create_constraint(havok_body(connect.body_a), {.pivot = from_centre(connect.body_a, connect.p_A)},
                               havok_body(connect.body_b), {.pivot = from_centre(connect.body_b, connect.p_B)},
                               {kLinearX, kLinearY, kLinearZ}),
             true);
    }
    for (const Weld& weld : model_.welds) {
      const auto [X_AS, X_BS] = weld_frames(model_, weld);
      enable(create_constraint(havok_body(weld.body_a),
                               {.pivot = from_centre(weld.body_a, X_AS.p),
                                .axis = X_AS.q * Vec3::UnitX(),
                                .side = X_AS.q * Vec3::UnitY()},
                               havok_body(weld.body_b), {.pivot = from_centre(weld.body_b, X_BS.p)},
                               {kLinearX, kLinearY, kLinearZ, kAngularX, kAngularY, kAngularZ}),
             true);
    }
  }

  void set_limits(Id joint, std::uint32_t axis, double lower, double upper) {
    module_->call(Function::kConstraint_SetAxisMode, {joint, axis, std::uint32_t{havok::kLimited}});
    module_->call(Function::kConstraint_SetAxisMinLimit, {joint, axis, f32(lower)});
    module_->call(Function::kConstraint_SetAxisMaxLimit, {joint, axis, f32(upper)});
  }

  void set_spring(Id joint, const Joint& hinge) {
    const std::uint32_t axis = free_axis(hinge);
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

  havok::QTransform transform(int body) const {
    havok::QTransform pose;
    module_->call(Function::kBody_GetQTransform, {bodies_[body], out(pose)});
    return pose;
  }

  void add_ball_springs() {
    for (size_t b = 0; b < model_.balls.size(); ++b) {
      const BallJoint& ball = model_.balls[b];
      if (!ball.has_spring()) continue;
      const int index = static_cast<int>(b);
      const Vec3 impulse_W = options_.timestep * (scratch_.bodies[ball.body].q_WB *
                                                  ball_spring_torque(ball, ball_rotation(model_, scratch_, index),
                                                                     ball_velocity(model_, scratch_, index)));
      push(ball.body, impulse_W);
      if (const int parent = model_.bodies[ball.body].parent; parent != kWorld) push(parent, -impulse_W);
    }
  }

  void keep_velocities(int body) {
    if (!any_pushed_) pushed_.assign(bodies_.size(), false);
    any_pushed_ = true;
    if (pushed_[body]) return;
    before_push_[body] = velocities(body);
    pushed_[body] = true;
  }
  void push(int body, const Vec3& impulse_W) {
    keep_velocities(body);
    module_->call(Function::kBody_ApplyAngularImpulse, {bodies_[body], in(vector3(impulse_W))});
  }
  void push_at(int body, const Vec3& p_W, const Vec3& impulse_W) {
    keep_velocities(body);
    module_->call(Function::kBody_ApplyImpulse, {bodies_[body], in(vector3(p_W)), in(vector3(impulse_W))});
  }

  void put_back_velocities() {
    if (!any_pushed_) return;
    for (size_t i = 0; i < bodies_.size(); ++i) {
      if (!pushed_[i]) continue;
      module_->call(Function::kBody_SetLinearVelocity, {bodies_[i], in(before_push_[i].linear)});
      module_->call(Function::kBody_SetAngularVelocity, {bodies_[i], in(before_push_[i].angular)});
    }
    any_pushed_ = false;
  }

  Options options_;
  Clock clock_;
  JointRows rows_;      // of the model
  Lent lent_;           // our own copy: the caller's need not live on
  const Model& model_;  // lent_'s: every body has mass
  std::unique_ptr<Module> module_;
  Id world_ = 0, world_anchor_ = 0, last_static_ = 0;
  std::vector<Id> bodies_, joints_;
  std::vector<std::vector<Id>> shapes_of_;  // per body
  std::vector<Anchor> anchors_;             // in the child
  bool joint_springs_;                      // explicit ones of hinges and slides
  bool explicit_springs_;                   // of any kind
  std::vector<double> torques_;
  State scratch_;
  bool any_pushed_ = false;  // since the last step
  std::vector<bool> pushed_;
  std::vector<Velocities> before_push_;
  mutable std::vector<double> last_angle_;  // what the next read unwraps against
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
