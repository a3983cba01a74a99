#include "world.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "model/weld_frames.h"

namespace assay::box3d {
namespace {

// A damper without a spring needs a frequency in Box3D; this one is far below every motion.
constexpr double kSlowest = 1e-3;  // rad/s

// The position at which Box3D's own is zero: it knows an angle within a turn only, and its spring within half a turn
// from its rest, so a limited joint counts from the middle of its range, and one with a native spring from the spring's
// rest.
double zero_position(const Joint& joint, bool native_springs) {
  return middle_of_range(joint, native_springs && joint.stiffness != 0 ? joint.spring_reference : joint.reference);
}

// A frame whose z axis (of hinges) or x axis (of slides) is the joint's.
Quat frame_along(const Vec3& axis, const Vec3& normal, bool slide) {
  Mat3 R;
  if (slide) {
    R << axis, normal, axis.cross(normal);
  } else {
    R << normal, axis.cross(normal), axis;
  }
  return Quat(R);
}

b3Matrix3 b3_matrix(const Mat3& M) { return {b3_vector(M.col(0)), b3_vector(M.col(1)), b3_vector(M.col(2))}; }

// A joint's spring in Box3D's terms: hertz and damping ratio of the joint's effective inertia, of which Box3D makes
// stiffness and damping again.
template <typename Definition>  // of a hinge or a slide
void set_spring(Definition& definition, const Joint& joint, double effective_inertia) {
  const double omega = std::max(std::sqrt(joint.stiffness / effective_inertia), kSlowest);
  definition.enableSpring = true;
  definition.hertz = real(omega / (2 * std::numbers::pi));
  definition.dampingRatio = real(joint.damping / (2 * effective_inertia * omega));
}

}  // namespace

Box3dSimulation::Box3dSimulation(const Model& model, const State& state, const Options& options)
    : options_(options),
      clock_{state.time, options.timestep},
      rows_(model, options.timestep, {}),
      lent_(lend_mass(without_wide_ranges(model), options.lent_share)),
      model_(lent_.model),
      joint_springs_(model.has_springs() && !options.native_springs),
      springs_(joint_springs_ || std::ranges::any_of(model.tendons, &Tendon::has_spring) ||
               std::ranges::any_of(model.balls, &BallJoint::has_spring) || rows_.any()),
      start_(lent_.of_copy(with_joint_coordinates(model, state))),
      collision_(model_, start_, options),
      world_(world_definition()),
      torques_(model.joints.size(), 0.0),
      loads_(model.bodies.size()),
      last_(start_) {
  lent_.model.keyframes.clear();
  b3World_EnableWarmStarting(world_.id(), options.warm_start);
  create_bodies(start_);
  create_joints();
}

b3WorldDef Box3dSimulation::world_definition() const {
  b3WorldDef definition = b3DefaultWorldDef();
  definition.gravity = b3_vector(model_.gravity);
  definition.contactHertz = real(options_.contact_hertz);
  definition.contactDampingRatio = real(options_.contact_damping_ratio);
  definition.contactSpeed = real(options_.contact_speed);
  definition.restitutionThreshold = real(options_.restitution.threshold);
  definition.maximumLinearSpeed = 1e9f;  // Box3D squares it
  definition.enableSleep = false;
  definition.enableContinuous = options_.continuous;
  collision_.prepare(definition);
  return definition;
}

// Box3D's body frame: origin in the centre of mass, axes of the MJCF frame, so the full inertia goes in as it is.
void Box3dSimulation::create_bodies(const State& start) {
  bodies_.reserve(model_.bodies.size());
  for (const BodyState& state : start.bodies) {
    b3BodyDef definition = b3DefaultBodyDef();
    definition.type = b3_dynamicBody;
    definition.position = b3_position(state.p_WBcm);
    definition.rotation = b3_rotation(state.q_WB);
    definition.linearVelocity = b3_vector(state.v_WBcm);
    definition.angularVelocity = b3_vector(state.w_WB);
    definition.enableSleep = false;
    definition.allowFastRotation = true;
    definition.enableContactRecycling = options_.contact_recycling;
    bodies_.push_back(b3CreateBody(world_.id(), &definition));
  }
  if (!model_.contacts.empty()) collision_.create_shapes(world_.id(), bodies_);
  for (size_t b = 0; b < bodies_.size(); ++b) {
    const Body& body = model_.bodies[b];
    b3Body_SetMassData(bodies_[b], {.mass = real(body.mass), .center = {0, 0, 0}, .inertia = b3_matrix(body.I_BBcm_B)});
  }
}

void Box3dSimulation::create_joints() {
  joints_.reserve(model_.joints.size());
  for (size_t j = 0; j < model_.joints.size(); ++j) {
    if (model_.joints[j].is_slide()) {
      create_slide(static_cast<int>(j));
    } else {
      create_hinge(static_cast<int>(j));
    }
  }
  for (const BallJoint& ball : model_.balls) {
    const Body& body = model_.bodies[ball.body];
    b3SphericalJointDef definition = b3DefaultSphericalJointDef();
    connect(definition.base, body.parent, {body.X_PB * ball.p_BJ, body.X_PB.q}, ball.body,
            {ball.p_BJ, Quat::Identity()});
    b3CreateSphericalJoint(world_.id(), &definition);
  }
  for (const Connect& constraint : model_.connects) {
    const bool swapped = constraint.body_a == kWorld;
    const Pose X_A{constraint.p_A, Quat::Identity()}, X_B{constraint.p_B, Quat::Identity()};
    b3SphericalJointDef definition = b3DefaultSphericalJointDef();
    connect(definition.base, swapped ? constraint.body_a : constraint.body_b, swapped ? X_A : X_B,
            swapped ? constraint.body_b : constraint.body_a, swapped ? X_B : X_A);
    b3CreateSphericalJoint(world_.id(), &definition);
  }
  for (const Weld& weld : model_.welds) {
    const bool swapped = weld.body_a == kWorld;
    const auto [X_A, X_B] = weld_frames(model_, weld);
    b3WeldJointDef definition = b3DefaultWeldJointDef();
    connect(definition.base, swapped ? weld.body_a : weld.body_b, swapped ? X_A : X_B,
            swapped ? weld.body_b : weld.body_a, swapped ? X_B : X_A);
    b3CreateWeldJoint(world_.id(), &definition);
  }
}

void Box3dSimulation::connect(b3JointDef& definition, int parent, const Pose& X_parent, int child,
                              const Pose& X_child) {
  const auto in_body = [&](int body, const Pose& X) { return b3_transform({X.p - model_.bodies[body].p_BBcm, X.q}); };
  definition.bodyIdB = bodies_[child];
  definition.localFrameB = in_body(child, X_child);
  if (parent == kWorld) {
    b3BodyDef fixed = b3DefaultBodyDef();
    fixed.position = b3_position(X_parent.p);
    definition.bodyIdA = b3CreateBody(world_.id(), &fixed);
    definition.localFrameA = b3_transform({Vec3::Zero(), X_parent.q});
  } else {
    definition.bodyIdA = bodies_[parent];
    definition.localFrameA = in_body(parent, X_parent);
  }
  definition.constraintHertz = real(options_.joint_hertz);
  definition.constraintDampingRatio = real(options_.joint_damping_ratio);
  definition.collideConnected = collision_.can_touch(parent, child);
}

void Box3dSimulation::create_hinge(int index) {
  const Joint& hinge = model_.joints[index];
  const Body& body = model_.bodies[hinge.body];
  const double zero = zero_position(hinge, options_.native_springs);
  const Vec3 normal_B = hinge.axis_B.unitOrthogonal();
  const Vec3 turned_B = Eigen::AngleAxisd(zero - hinge.reference, hinge.axis_B) * normal_B;
  b3RevoluteJointDef definition = b3DefaultRevoluteJointDef();
  connect(definition.base, body.parent,
          {anchor_in_parent(model_, index), body.X_PB.q * frame_along(hinge.axis_B, turned_B, false)}, hinge.body,
          {hinge.p_BJ, frame_along(hinge.axis_B, normal_B, false)});
  definition.enableLimit = hinge.limited;
  definition.lowerAngle = real(hinge.lower - zero);
  definition.upperAngle = real(hinge.upper - zero);
  definition.enableMotor = hinge.dry_friction != 0;
  definition.maxMotorTorque = real(hinge.dry_friction);
  if (options_.native_springs && hinge.has_spring()) {
    double inverse = hinge.axis_B.dot(body.I_BBcm_B.inverse() * hinge.axis_B);
    if (body.parent != kWorld) {
      const Vec3 axis = axis_in_parent(model_, index);
      inverse += axis.dot(model_.bodies[body.parent].I_BBcm_B.inverse() * axis);
    }
    set_spring(definition, hinge, 1 / inverse);
    definition.targetAngle = hinge.stiffness != 0 ? real(hinge.spring_reference - zero) : 0;
  }
  joints_.push_back(b3CreateRevoluteJoint(world_.id(), &definition));
}

// Held at the child's centre of mass, so that the slide's effective inertia does not change.
void Box3dSimulation::create_slide(int index) {
  const Joint& slide = model_.joints[index];
  const Body& body = model_.bodies[slide.body];
  const double zero = zero_position(slide, options_.native_springs);
  const Quat along = frame_along(slide.axis_B, slide.axis_B.unitOrthogonal(), true);
  b3PrismaticJointDef definition = b3DefaultPrismaticJointDef();
  connect(definition.base, body.parent,
          {body.X_PB * body.p_BBcm + (zero - slide.reference) * axis_in_parent(model_, index), body.X_PB.q * along},
          slide.body, {body.p_BBcm, along});
  definition.enableLimit = slide.limited;
  definition.lowerTranslation = real(slide.lower - zero);
  definition.upperTranslation = real(slide.upper - zero);
  definition.enableMotor = slide.dry_friction != 0;
  definition.maxMotorForce = real(slide.dry_friction);
  if (options_.native_springs && slide.has_spring()) {
    double inverse = 1 / body.mass;
    if (body.parent != kWorld) {
      // the arm of the force on the parent, which a way along the axis does not change
      const Body& parent = model_.bodies[body.parent];
      const Vec3 arm = (body.X_PB * body.p_BBcm - parent.p_BBcm).cross(axis_in_parent(model_, index));
      inverse += 1 / parent.mass + arm.dot(parent.I_BBcm_B.inverse() * arm);
    }
    set_spring(definition, slide, 1 / inverse);
    definition.targetTranslation = slide.stiffness != 0 ? real(slide.spring_reference - zero) : 0;
  }
  joints_.push_back(b3CreatePrismaticJoint(world_.id(), &definition));
}

void Box3dSimulation::set_torques(std::span<const double> torques) {
  // Box3D adds up what is applied between two steps; a second call replaces the first
  if (loaded_) apply(-1);
  std::ranges::fill(loads_, Load{});
  const bool needs_bodies = springs_ || !torques.empty();
  if (springs_) read();
  collect_torques(model_, torques, joint_springs_ ? &last_ : nullptr, torques_);
  if (springs_) {
    add_tendon_tensions(model_, last_, torques_);
    rows_.add(model_, last_, torques_);
  }
  if (!needs_bodies) return;
  for (size_t j = 0; j < torques_.size(); ++j) {
    if (torques_[j] == 0) continue;
    const Joint& joint = model_.joints[j];
    const int parent = model_.bodies[joint.body].parent;
    const Vec3 along = torques_[j] * (quat(b3Body_GetRotation(bodies_[joint.body])).normalized() * joint.axis_B);
    if (joint.is_slide()) {
      loads_[joint.body].force += along;
      if (parent == kWorld) continue;
      const Vec3 arm = centre_of(joint.body) - centre_of(parent);
      loads_[parent].force -= along;
      loads_[parent].torque -= arm.cross(along);
    } else {
      loads_[joint.body].torque += along;
      if (parent != kWorld) loads_[parent].torque -= along;
    }
  }
  if (springs_) add_ball_springs();
  apply(1);
  loaded_ = true;
}

void Box3dSimulation::add_ball_springs() {
  for (size_t b = 0; b < model_.balls.size(); ++b) {
    const BallJoint& ball = model_.balls[b];
    if (!ball.has_spring()) continue;
    const int index = static_cast<int>(b), parent = model_.bodies[ball.body].parent;
    const Vec3 torque = last_.bodies[ball.body].q_WB * ball_spring_torque(ball, ball_rotation(model_, last_, index),
                                                                          ball_velocity(model_, last_, index));
    loads_[ball.body].torque += torque;
    if (parent != kWorld) loads_[parent].torque -= torque;
  }
}

void Box3dSimulation::apply(double sign) const {
  for (size_t b = 0; b < loads_.size(); ++b) {
    const Load& load = loads_[b];
    if (load.force != Vec3::Zero()) b3Body_ApplyForceToCenter(bodies_[b], b3_vector(sign * load.force), false);
    if (load.torque != Vec3::Zero()) b3Body_ApplyTorque(bodies_[b], b3_vector(sign * load.torque), false);
  }
}

void Box3dSimulation::advance(int count) {
  const float h = real(options_.timestep);
  loaded_ = false;
  for (int i = 0; i < count; ++i) {
    if (contacts_kept_ && i + 1 == count) {
      for (size_t b = 0; b < bodies_.size(); ++b) centres_[b] = centre_of(b);
    }
    b3World_Step(world_.id(), h, options_.sub_steps);
  }
  clock_.steps += count;
}

void Box3dSimulation::read_state(State& out) const {
  read();
  out = last_;
  lent_.to_original(out);
}

void Box3dSimulation::read() const {
  last_.time = clock_.time();
  for (size_t b = 0; b < bodies_.size(); ++b) {
    last_.bodies[b] = {.p_WBcm = centre_of(b),
                       .q_WB = quat(b3Body_GetRotation(bodies_[b])).normalized(),
                       .v_WBcm = vec3(b3Body_GetLinearVelocity(bodies_[b])),
                       .w_WB = vec3(b3Body_GetAngularVelocity(bodies_[b]))};
  }
  joints_from_bodies(model_, last_);
}

EngineView Box3dSimulation::view() const {
  EngineView out;
  for (const b3BodyId body : bodies_) {
    const b3Matrix3 inertia = b3Body_GetLocalRotationalInertia(body);
    Mat3 I_B;
    I_B << vec3(inertia.cx), vec3(inertia.cy), vec3(inertia.cz);
    const Mat3 R_WB = quat(b3Body_GetRotation(body)).normalized().toRotationMatrix();
    out.bodies.push_back({.mass = b3Body_GetMass(body),
                          .p_WBcm = vec3(b3Body_GetWorldCenter(body)),
                          .I_BBcm_W = R_WB * I_B * R_WB.transpose()});
  }
  for (size_t j = 0; j < joints_.size(); ++j) {
    const Joint& joint = model_.joints[j];
    const b3JointId id = joints_[j];
    const b3Transform frame = b3Joint_GetLocalFrameB(id);
    const b3BodyId child = b3Joint_GetBodyB(id);
    const Quat q = quat(b3Body_GetRotation(child)) * quat(frame.q);
    const double zero = zero_position(joint, options_.native_springs);
    EngineJoint seen{.p_WJ = vec3(b3Body_GetWorldPoint(child, frame.p))};
    if (joint.is_slide()) {
      seen.axis_W = q.normalized() * Vec3::UnitX();
      seen.limited = b3PrismaticJoint_IsLimitEnabled(id);
      seen.lower = zero + b3PrismaticJoint_GetLowerLimit(id);
      seen.upper = zero + b3PrismaticJoint_GetUpperLimit(id);
    } else {
      seen.axis_W = q.normalized() * Vec3::UnitZ();
      seen.limited = b3RevoluteJoint_IsLimitEnabled(id);
      seen.lower = zero + b3RevoluteJoint_GetLowerLimit(id);
      seen.upper = zero + b3RevoluteJoint_GetUpperLimit(id);
    }
    if (!seen.limited) seen.lower = seen.upper = 0;
    out.joints.push_back(seen);
  }
  out.gravity = vec3(b3World_GetGravity(world_.id()));
  return_lent_mass(lent_, out);
  return out;
}

bool Box3dSimulation::keep_contacts() {
  if (options_.sub_steps > 1) return false;  // Box3D keeps friction of the last of them only
  centres_.resize(bodies_.size());
  return contacts_kept_ = true;
}

void Box3dSimulation::read_contacts(std::vector<ContactForce>& out) const {
  out.clear();
  if (contacts_kept_ && clock_.steps > 0) collision_.read_forces(bodies_, centres_, out);
}

}  // namespace assay::box3d
