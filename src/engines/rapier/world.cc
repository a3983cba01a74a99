#include "world.h"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "collision.h"
#include "engines/adapter.h"

namespace assay::rapier {
namespace {

void copy(const Vec3& v, double* out) { std::ranges::copy(std::array{v.x(), v.y(), v.z()}, out); }
void copy(const Quat& q, double* out) { std::ranges::copy(std::array{q.x(), q.y(), q.z(), q.w()}, out); }
Vec3 vec3(const double* v) { return {v[0], v[1], v[2]}; }
Quat quat(const double* q) { return Quat(q[3], q[0], q[1], q[2]).normalized(); }

class RapierSimulation final : public Simulation {
 public:
  RapierSimulation(const Model& model, const State& state, const Options& options)
      : model_(model),
        options_(options),
        api_(options.api()),
        last_(with_joint_coordinates(model, state)),
        clock_{state.time, options.world.timestep} {
    RapierOptions world = options.world;
    copy(model.gravity, world.gravity);
    world_.reset(api_.create(&world));
    if (!world_) fail();
    add_bodies();
    add_hinges();
    add_shapes();
    require(api_.start(world_.get()));
    states_.resize(model_.bodies.size());
    explicit_springs_ = model_.has_springs() && !options_.native_springs;
    model_.keyframes.clear();
  }

  void set_torques(std::span<const double> torques) override {
    if (explicit_springs_) read(last_);
    collect_torques(model_, torques, explicit_springs_ ? &last_ : nullptr, torques_);
    require(api_.set_torques(world_.get(), torques_.data()));
  }

  void advance(int count) override {
    require(api_.step(world_.get(), count));
    clock_.steps += count;
  }

  void read_state(State& out) const override {
    read(last_);
    last_.time = clock_.time();
    out = last_;
  }

  EngineView view() const override {
    EngineView view;
    std::vector<RapierHeldBody> bodies(model_.bodies.size());
    require(api_.view_bodies(world_.get(), bodies.data()));
    for (const RapierHeldBody& held : bodies) {
      const Mat3 R = (quat(held.q_world_body) * quat(held.q_body_principal)).toRotationMatrix();
      view.bodies.push_back({held.mass, vec3(held.p_world_com), R * vec3(held.inertia).asDiagonal() * R.transpose()});
    }
    std::vector<RapierHeldHinge> hinges(model_.joints.size());
    require(api_.view_hinges(world_.get(), hinges.data()));
    for (size_t j = 0; j < hinges.size(); ++j) {
      const double reference = model_.joints[j].reference;
      const RapierHeldHinge& held = hinges[j];
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

  // Rapier's angle is zero where the two frames coincide, which is put at the hinge's reference.
  void add_hinges() {
    for (size_t j = 0; j < model_.joints.size(); ++j) {
      const Joint& hinge = model_.joints[j];
      const Body& body = model_.bodies[hinge.body];
      const Quat q_BJ = Quat::FromTwoVectors(Vec3::UnitX(), hinge.axis_B);
      const Vec3 p_PPcm = body.parent == kWorld ? Vec3::Zero() : model_.bodies[body.parent].p_BBcm;
      RapierHinge add{};
      add.parent = body.parent;
      add.child = hinge.body;
      copy(anchor_in_parent(model_, static_cast<int>(j)) - p_PPcm, add.p_parent);
      copy(body.X_PB.q * q_BJ, add.q_parent);
      copy(hinge.p_BJ - body.p_BBcm, add.p_child);
      copy(q_BJ, add.q_child);
      add.limited = hinge.limited ? 1 : 0;
      add.lower = hinge.lower - hinge.reference;
      add.upper = hinge.upper - hinge.reference;
      add.stiffness = hinge.stiffness;
      add.spring_angle = hinge.spring_reference - hinge.reference;
      add.damping = hinge.damping;
      add.armature = hinge.armature;
      add.angle = last_.position[j] - hinge.reference;
      add.rate = last_.velocity[j];
      require(api_.add_hinge(world_.get(), &add));
    }
  }

  void add_shapes() {
    const CollisionPlan plan = plan_collision(model_);
    if (!plan.pairs.empty()) {
      require(api_.set_pairs(world_.get(), plan.pairs.data(), static_cast<int>(plan.shapes.size())));
    }
    for (const ShapePlan& planned : plan.shapes) {
      const Shape& shape = model_.shapes[planned.shape];
      RapierShape add{};
      add.type = RAPIER_SPHERE;
      if (shape.type == ShapeType::kCapsule) add.type = RAPIER_CAPSULE;
      if (shape.type == ShapeType::kPlane) add.type = RAPIER_PLANE;
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
    require(api_.read_hinges(world_.get(), out.position.data(), out.velocity.data()));
    for (size_t j = 0; j < out.position.size(); ++j) out.position[j] += model_.joints[j].reference;
    // the bodies of a multibody have poses of their own after a step, but the velocities of its start
    bodies_from_joints(model_, out);
    for (size_t b = 0; b < states_.size(); ++b) {
      out.bodies[b].p_WBcm = vec3(states_[b].p_world_com);
      out.bodies[b].q_WB = quat(states_[b].q_world_body);
    }
  }

  Model model_;  // our own copy: the caller's need not live on
  const Options options_;
  const RapierApi& api_;
  mutable State last_;  // of the last read: unwraps angles
  Clock clock_;
  std::unique_ptr<RapierWorld, Destroy> world_{nullptr, {&api_}};
  bool explicit_springs_ = false;
  std::vector<double> torques_;              // scratch
  mutable std::vector<RapierState> states_;  // scratch
};

}  // namespace

std::unique_ptr<Simulation> make_simulation(const Model& model, const State& state, const Options& options) {
  return std::make_unique<RapierSimulation>(model, state, options);
}

}  // namespace assay::rapier
