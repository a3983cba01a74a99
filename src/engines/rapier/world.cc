#include "world.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "collision.h"
#include "engines/adapter.h"
#include "model/ellipsoid.h"
#include "model/massless.h"
#include "model/weld_frames.h"

namespace assay::rapier {
namespace {

void copy(const Vec3& v, double* out) { std::ranges::copy(std::array{v.x(), v.y(), v.z()}, out); }
void copy(const Quat& q, double* out) { std::ranges::copy(std::array{q.x(), q.y(), q.z(), q.w()}, out); }
Vec3 vec3(const double* v) { return {v[0], v[1], v[2]}; }
Quat quat(const double* q) { return Quat(q[3], q[0], q[1], q[2]).normalized(); }

int shape_type(ShapeType type) {
  switch (type) {
    case ShapeType::kSphere:
      return RAPIER_SPHERE;
    case ShapeType::kCapsule:
      return RAPIER_CAPSULE;
    case ShapeType::kPlane:
      return RAPIER_PLANE;
    case ShapeType::kBox:
      return RAPIER_BOX;
    case ShapeType::kCylinder:
      return RAPIER_CYLINDER;
    case ShapeType::kEllipsoid:
    case ShapeType::kHull:
      return RAPIER_CONVEX;
    case ShapeType::kHeightField:
      break;
  }
  return RAPIER_MESH;
}

// Triangles of a shape that Rapier gets as a surface, in the shape frame.
struct Surface {
  std::vector<double> points;
  std::vector<int> triangles;

  void add_hull(const Hull& hull) {
    for (const Vec3& vertex : hull.vertices) points.insert(points.end(), {vertex.x(), vertex.y(), vertex.z()});
    for (const std::array<int, 3>& face : hull.faces) triangles.insert(triangles.end(), face.begin(), face.end());
  }

  // Rapier's own height field has the other diagonal.
  void add_field(const HeightField& field) {
    for (int row = 0; row < field.rows; ++row) {
      for (int column = 0; column < field.columns; ++column) {
        points.insert(points.end(), {-field.half_x + column * 2 * field.half_x / (field.columns - 1),
                                     -field.half_y + row * 2 * field.half_y / (field.rows - 1),
                                     field.heights[static_cast<size_t>(row) * field.columns + column]});
        if (row == 0 || column == 0) continue;
        const int d = row * field.columns + column, c = d - 1, b = d - field.columns, a = b - 1;
        triangles.insert(triangles.end(), {a, b, c, b, d, c});
      }
    }
  }
};
Surface surface_of(const Model& model, const Shape& shape) {
  constexpr int kSubdivisions = 3;  // of an ellipsoid: 1280 faces
  Surface surface;
  if (shape.type == ShapeType::kEllipsoid) surface.add_hull(ellipsoid_hull(shape.half_size, kSubdivisions));
  if (shape.type == ShapeType::kHull) surface.add_hull(model.hulls[shape.data]);
  if (shape.type == ShapeType::kHeightField) surface.add_field(model.height_fields[shape.data]);
  return surface;
}

class RapierSimulation final : public Simulation {
 public:
  RapierSimulation(const Model& model, const State& state, const Options& options)
      : rows_(model, options.world.timestep, {.wide_ranges = !options.multibody()}),
        lent_(lend_mass(options.multibody() ? model : without_wide_ranges(model), options.lent_share)),
        model_(lent_.model),
        options_(options),
        api_(options.api()),
        last_(lent_.of_copy(with_joint_coordinates(model, state))),
        clock_{state.time, options.world.timestep} {
    RapierOptions world = options.world;
    copy(model.gravity, world.gravity);
    if (world.prediction_distance == 0) world.prediction_distance = contact_margin(model, world.timestep);
    world_.reset(api_.create(&world));
    if (!world_) fail();
    add_bodies();
    for (size_t j = 0; j < model_.joints.size(); ++j) add_joint(static_cast<int>(j));
    for (size_t b = 0; b < model_.balls.size(); ++b) add_ball(static_cast<int>(b));
    add_constraints();
    add_shapes();
    require(api_.start(world_.get()));
    states_.resize(model_.bodies.size());
    explicit_springs_ = model_.has_springs() && !options_.native_springs;
    ball_springs_ = std::ranges::any_of(model_.balls, &BallJoint::has_spring);
    tendon_springs_ = std::ranges::any_of(model_.tendons, &Tendon::has_spring);
    const size_t joints = model_.joints.size() + model_.balls.size();
    torque_rows_.assign(3 * joints, 0.0);
    positions_.assign(3 * joints, 0.0);
    velocities_.assign(3 * joints, 0.0);
  }

  void set_torques(std::span<const double> torques) override {
    if (explicit_springs_ || ball_springs_ || tendon_springs_ || rows_.any()) read(last_);
    collect_torques(model_, torques, explicit_springs_ ? &last_ : nullptr, torques_);
    if (tendon_springs_) add_tendon_tensions(model_, last_, torques_);
    if (rows_.any()) rows_.add(model_, last_, torques_);
    for (size_t j = 0; j < torques_.size(); ++j) torque_rows_[3 * j] = torques_[j];
    if (ball_springs_) {
      for (int b = 0; std::cmp_less(b, model_.balls.size()); ++b) {
        copy(ball_spring_torque(model_.balls[b], ball_rotation(model_, last_, b), ball_velocity(model_, last_, b)),
             &torque_rows_[3 * (torques_.size() + b)]);
      }
    }
    require(api_.set_torques(world_.get(), torque_rows_.data()));
  }

  void advance(int count) override {
    if (contacts_kept_ && count > 0) {
      require(api_.step(world_.get(), count - 1));
      require(api_.read_bodies(world_.get(), before_.data()));
      require(api_.step(world_.get(), 1));
    } else {
      require(api_.step(world_.get(), count));
    }
    clock_.steps += count;
  }

  bool keep_contacts() override {
    if (options_.world.contact_recycling != 0) return false;
    before_.resize(states_.size());
    contacts_.resize(64);  // more where it is too small
    return contacts_kept_ = true;
  }

  void read_contacts(std::vector<ContactForce>& out) const override {
    out.clear();
    if (!contacts_kept_ || clock_.steps == 0) return;
    int count = 0;
    require(api_.read_contacts(world_.get(), contacts_.data(), static_cast<int>(contacts_.size()), &count));
    if (std::cmp_greater(count, contacts_.size())) {
      contacts_.resize(2 * static_cast<size_t>(count));
      require(api_.read_contacts(world_.get(), contacts_.data(), static_cast<int>(contacts_.size()), &count));
    }
    for (int i = 0; i < count; ++i) {
      const RapierContact& found = contacts_[static_cast<size_t>(i)];
      const int first = shapes_[found.shape_a], second = shapes_[found.shape_b];
      const double sign = first < second ? 1 : -1;
      const Vec3 p_W = found.body_b >= 0 ? Vec3(vec3(before_[found.body_b].p_world_com) + vec3(found.r_b))
                                         : Vec3(vec3(before_[found.body_a].p_world_com) + vec3(found.r_a));
      out.push_back({.shape_a = std::min(first, second),
                     .shape_b = std::max(first, second),
                     .p_W = p_W,
                     .n_W = sign * vec3(found.normal),
                     .gap = found.gap,
                     .impulse_W = sign * vec3(found.impulse)});
    }
  }

  void read_state(State& out) const override {
    read(last_);
    last_.time = clock_.time();
    out = last_;
    lent_.to_original(out);
  }

  EngineView view() const override {
    EngineView view;
    std::vector<RapierHeldBody> bodies(model_.bodies.size());
    require(api_.view_bodies(world_.get(), bodies.data()));
    for (const RapierHeldBody& held : bodies) {
      const Mat3 R = (quat(held.q_world_body) * quat(held.q_body_principal)).toRotationMatrix();
      view.bodies.push_back({held.mass, vec3(held.p_world_com), R * vec3(held.inertia).asDiagonal() * R.transpose()});
    }
    return_lent_mass(lent_, view);
    std::vector<RapierHeldJoint> joints(model_.joints.size() + model_.balls.size());
    require(api_.view_joints(world_.get(), joints.data()));
    for (size_t j = 0; j < model_.joints.size(); ++j) {
      const double reference = model_.joints[j].reference;
      const RapierHeldJoint& held = joints[j];
      view.joints.push_back({vec3(held.p_world), vec3(held.axis_world), held.limited != 0, held.lower + reference,
                             held.upper + reference});
    }
    std::array<double, 3> gravity{};
    api_.view_gravity(world_.get(), gravity.data());
    view.gravity = vec3(gravity.data());
    return view;
  }

 private:
  struct Destroy {
    const RapierApi* api;
    void operator()(RapierWorld* world) const { api->destroy(world); }
  };

  [[noreturn]] void fail() const { throw EngineError(std::string("Rapier: ") + api_.error()); }
  void require(int status) const {
    if (status != 0) fail();
  }

  // Rapier's body frame: the centre of mass, and the axes of the MJCF frame.
  void add_bodies() {
    for (size_t b = 0; b < model_.bodies.size(); ++b) {
      const Body& body = model_.bodies[b];
      const BodyState& state = last_.bodies[b];
      const PrincipalInertia principal = principal_inertia(body.I_BBcm_B);
      RapierBody add{};
      add.mass = body.mass;
      copy(principal.diagonal, add.inertia);
      copy(principal.q_BI, add.q_body_principal);
      copy(state.p_WBcm, add.p_world_com);
      copy(state.q_WB, add.q_world_body);
      copy(state.v_WBcm, add.v_world_com);
      copy(state.w_WB, add.w_world);
      require(api_.add_body(world_.get(), &add));
    }
  }

  // A body's pose in the axes of a frame that has its origin in the centre of mass.
  Vec3 from_centre(int body, const Vec3& p) const { return body == kWorld ? p : Vec3(p - model_.bodies[body].p_BBcm); }

  // Rapier's position is zero where the two frames coincide, which is put at the joint's reference.
  RapierJoint joint_between(int child, const Vec3& p_BJ, const Quat& q_BJ) const {
    const Body& body = model_.bodies[child];
    RapierJoint add{};
    add.parent = body.parent;
    add.child = child;
    copy(from_centre(body.parent, body.X_PB * p_BJ), add.p_parent);
    copy(body.X_PB.q * q_BJ, add.q_parent);
    copy(p_BJ - body.p_BBcm, add.p_child);
    copy(q_BJ, add.q_child);
    return add;
  }

  void add_joint(int j) {
    const Joint& joint = model_.joints[j];
    RapierJoint add = joint_between(joint.body, joint.p_BJ, Quat::FromTwoVectors(Vec3::UnitX(), joint.axis_B));
    add.kind = joint.is_slide() ? RAPIER_SLIDE : RAPIER_HINGE;
    add.limited = joint.limited ? 1 : 0;
    add.lower = joint.lower - joint.reference;
    add.upper = joint.upper - joint.reference;
    add.stiffness = joint.stiffness;
    add.spring_position = joint.spring_reference - joint.reference;
    add.damping = joint.damping;
    add.armature = joint.armature;
    add.dry_friction = joint.dry_friction;
    add.position[0] = last_.position[j] - joint.reference;
    add.velocity[0] = last_.velocity[j];
    require(api_.add_joint(world_.get(), &add));
  }

  // In body axes. The velocity is that of the child's frame in the parent's.
  void add_ball(int b) {
    const BallJoint& ball = model_.balls[b];
    RapierJoint add = joint_between(ball.body, ball.p_BJ, Quat::Identity());
    add.kind = RAPIER_BALL;
    add.armature = ball.armature;
    add.dry_friction = ball.dry_friction;
    const Quat rotation = ball_rotation(model_, last_, b);
    copy(rotation_vector(rotation), add.position);
    copy(rotation * ball_velocity(model_, last_, b), add.velocity);
    require(api_.add_joint(world_.get(), &add));
  }

  void add_constraints() {
    for (const Connect& connect : model_.connects) {
      RapierConstraint add{};
      add.body_a = connect.body_a;
      add.body_b = connect.body_b;
      copy(from_centre(connect.body_a, connect.p_A), add.p_a);
      copy(from_centre(connect.body_b, connect.p_B), add.p_b);
      add.q_a[3] = add.q_b[3] = 1;
      require(api_.add_constraint(world_.get(), &add));
    }
    for (const Weld& weld : model_.welds) {
      const WeldFrames frames = weld_frames(model_, weld);
      RapierConstraint add{};
      add.body_a = weld.body_a;
      add.body_b = weld.body_b;
      add.weld = 1;
      copy(from_centre(weld.body_a, frames.X_AS.p), add.p_a);
      copy(frames.X_AS.q, add.q_a);
      copy(from_centre(weld.body_b, frames.X_BS.p), add.p_b);
      add.q_b[3] = 1;
      require(api_.add_constraint(world_.get(), &add));
    }
  }

  void add_shapes() {
    const CollisionPlan plan = plan_collision(model_);
    if (!plan.pairs.empty()) {
      require(api_.set_pairs(world_.get(), plan.pairs.data(), static_cast<int>(plan.shapes.size())));
    }
    for (const ShapePlan& planned : plan.shapes) {
      shapes_.push_back(planned.shape);
      const Shape& shape = model_.shapes[planned.shape];
      const Surface surface = surface_of(model_, shape);
      RapierShape add{};
      add.type = shape_type(shape.type);
      add.points = surface.points.data();
      add.point_count = static_cast<int>(surface.points.size() / 3);
      add.triangles = surface.triangles.data();
      add.triangle_count = static_cast<int>(surface.triangles.size() / 3);
      copy(shape.half_size, add.half_size);
      add.body = shape.body;
      const Vec3 p_BBcm = shape.body == kWorld ? Vec3::Zero() : model_.bodies[shape.body].p_BBcm;
      copy(shape.X_BS.p - p_BBcm, add.p);
      copy(shape.X_BS.q, add.q);
      add.radius = shape.radius;
      add.half_length = shape.half_length;
      add.friction = planned.friction;
      add.groups = planned.groups;
      add.collides_with = planned.collides_with;
      add.filter_pairs = planned.filter_pairs ? 1 : 0;
      add.look_up_friction = planned.look_up_friction ? 1 : 0;
      require(api_.add_shape(world_.get(), &add));
    }
  }

  // All but the time. The angles on entry unwrap those of impulse joints.
  void read(State& out) const {
    require(api_.read_bodies(world_.get(), states_.data()));
    out.bodies.resize(states_.size());
    for (size_t b = 0; b < states_.size(); ++b) {
      const RapierState& held = states_[b];
      out.bodies[b] = {vec3(held.p_world_com), quat(held.q_world_body), vec3(held.v_world_com), vec3(held.w_world)};
    }
    if (!options_.multibody()) {
      joints_from_bodies(model_, out);
      return;
    }
    require(api_.read_joints(world_.get(), positions_.data(), velocities_.data()));
    for (size_t j = 0; j < out.position.size(); ++j) {
      out.position[j] = positions_[3 * j] + model_.joints[j].reference;
      out.velocity[j] = velocities_[3 * j];
    }
    if (!model_.balls.empty()) read_balls(out);
    // the bodies of a multibody have poses of their own after a step, but the velocities of its start
    bodies_from_joints(model_, out);
    for (size_t b = 0; b < states_.size(); ++b) {
      out.bodies[b].p_WBcm = vec3(states_[b].p_world_com);
      out.bodies[b].q_WB = quat(states_[b].q_world_body);
    }
  }

  // Angular velocities of the bodies on ball joints, which bodies_from_joints() starts from; those of the bodies
  // between come along.
  void read_balls(State& out) const {
    for (size_t b = 0; b < model_.bodies.size(); ++b) {
      const Body& body = model_.bodies[b];
      if (body.is_free()) continue;
      BodyState& s = out.bodies[b];
      const bool root = body.parent == kWorld;
      s.w_WB = root ? Vec3(Vec3::Zero()) : out.bodies[body.parent].w_WB;
      if (body.ball >= 0) {
        const Quat q_WP = root ? Quat(Quat::Identity()) : out.bodies[body.parent].q_WB;
        s.w_WB += q_WP * body.X_PB.q * vec3(&velocities_[3 * (model_.joints.size() + body.ball)]);
      } else if (!model_.joints[body.joint].is_slide()) {
        s.w_WB += s.q_WB * model_.joints[body.joint].axis_B * out.velocity[body.joint];
      }
    }
  }

  JointRows rows_;      // of the model
  const Lent lent_;     // massless bodies have a share of mass
  const Model& model_;  // the copy that Rapier gets
  const Options options_;
  const RapierApi& api_;
  mutable State last_;  // of the last read: unwraps angles
  Clock clock_;
  std::unique_ptr<RapierWorld, Destroy> world_{nullptr, {&api_}};
  bool explicit_springs_ = false, ball_springs_ = false, tendon_springs_ = false;
  std::vector<double> torques_, torque_rows_;           // scratch
  mutable std::vector<double> positions_, velocities_;  // scratch, three a joint
  mutable std::vector<RapierState> states_;             // scratch
  bool contacts_kept_ = false;
  std::vector<int> shapes_;                      // indices into Model::shapes, in Rapier's order
  std::vector<RapierState> before_;              // where the last step began, with contacts_kept_
  mutable std::vector<RapierContact> contacts_;  // scratch
};

}  // namespace

std::unique_ptr<Simulation> make_simulation(const Model& model, const State& state, const Options& options) {
  return std::make_unique<RapierSimulation>(model, state, options);
}

}  // namespace assay::rapier
