// The start of a new adapter: copy this folder, replace `myengine` by your engine, and work down the file. It is
// complete for what it declares: free bodies without contact. Everything else it refuses, as an adapter has to.
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "engines/adapter.h"

// ---- your engine ----------------------------------------------------------------------------------------------------

// Stands for the engine's own headers: bodies at their centres of mass, a rotation, a step function. Take it out.
namespace myengine {

using assay::Mat3;
using assay::Quat;
using assay::Vec3;

struct RigidBody {
  double mass = 1;
  Mat3 inertia = Mat3::Identity();  // in body axes
  Vec3 position = Vec3::Zero();
  Quat rotation = Quat::Identity();
  Vec3 velocity = Vec3::Zero();
  Vec3 angular_velocity = Vec3::Zero();  // in world axes
};

class World {
 public:
  explicit World(Vec3 gravity) : gravity_(std::move(gravity)) {}
  void add(const RigidBody& body) { bodies_.push_back(body); }
  const std::vector<RigidBody>& bodies() const { return bodies_; }
  const Vec3& gravity() const { return gravity_; }

  // semi-implicit Euler with an explicit gyroscopic torque
  void step(double h) {
    for (RigidBody& b : bodies_) {
      const Mat3 R = b.rotation.toRotationMatrix();
      const Mat3 inertia = R * b.inertia * R.transpose();
      const Vec3 gyroscopic = b.angular_velocity.cross(inertia * b.angular_velocity);
      b.velocity += h * gravity_;
      b.angular_velocity -= h * inertia.inverse() * gyroscopic;
      b.position += h * b.velocity;
      const Vec3 turn = h * b.angular_velocity;
      const double angle = turn.norm();
      if (angle > 0) b.rotation = (Quat(Eigen::AngleAxisd(angle, turn / angle)) * b.rotation).normalized();
    }
  }

 private:
  Vec3 gravity_;
  std::vector<RigidBody> bodies_;
};

}  // namespace myengine

// ---- the adapter ----------------------------------------------------------------------------------------------------

namespace assay {
namespace {

// One running instance. It may live longer than the Model it was made from: keep what you need.
class SkeletonSimulation final : public Simulation {
 public:
  SkeletonSimulation(const Model& model, const State& state, const Settings& settings)
      : world_(model.gravity), clock_{state.time, settings.timestep} {
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      // The uniform state is that of the centre of mass and of the MJCF body frame. An engine whose bodies have
      // principal axes only takes principal_inertia(), and its rotation is q_WB * q_BI, to be undone in read_state().
      // Set the inertia by hand: shape helpers of several engines compute another one.
      const Body& body = model.bodies[i];
      const BodyState& s = state.bodies[i];
      world_.add({.mass = body.mass,
                  .inertia = body.I_BBcm_B,
                  .position = s.p_WBcm,
                  .rotation = s.q_WB,
                  .velocity = s.v_WBcm,
                  .angular_velocity = s.w_WB});
    }
    // Hinges: the axis through Joint::p_BJ along Joint::axis_B in the child's frame, angle zero at Joint::reference;
    // anchor_in_parent() and axis_in_parent() give the same in the parent's. An engine that counts angles from the pose
    // at which a joint is created wants the reference configuration first (reference_state()), the state after.
    // Contacts: exactly the pairs of Model::contacts, each with its own friction.
    // Switch off what the model does not have: body damping, sleeping, velocity clamps.
  }

  // Stores torques for the next step and, with SpringKind::kExplicit, adds spring_torque() of each hinge. The clock
  // does not run here.
  void set_torques(std::span<const double> /*torques*/) override {}

  // The engine's own step and nothing else: this is what is timed. When the engine can say that it failed, throw
  // EngineError with its words.
  void advance(int count) override {
    for (int i = 0; i < count; ++i) world_.step(clock_.timestep);
    clock_.steps += count;
  }

  // Joint-coordinate engines fill angle, rate and the free bodies and call bodies_from_joints(). Maximal-coordinate
  // engines fill all bodies and call joints_from_bodies(), with their own last angles in `out.position` to unwrap by.
  void read_state(State& out) const override {
    out.time = clock_.time();
    out.bodies.clear();
    for (const myengine::RigidBody& body : world_.bodies()) {
      out.bodies.push_back(
          {.p_WBcm = body.position, .q_WB = body.rotation, .v_WBcm = body.velocity, .w_WB = body.angular_velocity});
    }
  }

  // What the engine holds, asked from the engine: a copy of the model's numbers would prove nothing.
  EngineView view() const override {
    EngineView view;
    view.gravity = world_.gravity();
    for (const myengine::RigidBody& body : world_.bodies()) {
      const Mat3 R_WB = body.rotation.toRotationMatrix();
      view.bodies.push_back(
          {.mass = body.mass, .p_WBcm = body.position, .I_BBcm_W = R_WB * body.inertia * R_WB.transpose()});
    }
    return view;
  }

 private:
  myengine::World world_;
  Clock clock_;
};

class SkeletonEngine final : public Adapter {
 public:
  // The plugin's name and build facts come from Adapter. Override build() when the engine itself can tell its version.

  // Every knob a user may turn, with unit, default and meaning: Settings::get() then always finds it.
  std::vector<Setting> settings() const override { return {}; }

  // Ready-made choices: a name, a line, and what differs from the defaults.
  std::vector<Contender> contenders() const override {
    return {{"skeleton", "free bodies, semi-implicit Euler, explicit gyroscopic torque", {}}};
  }

  // The fairness table. The conformance suite asks it which tests apply, so a claim here is a claim that is tested.
  Capabilities capabilities(const Settings& /*settings*/) const override {
    Capabilities c;
    c.precision = Precision::kDouble;
    c.coordinates = Coordinates::kMaximal;
    c.integrator = "semi-implicit Euler, explicit gyroscopic torque";
    c.order = 1;
    c.joint_solver = "none";
    c.torques = false;
    c.gyroscopic = true;
    c.iterations = "";               // "50"; "" for a direct solver or none
    c.sleep = "none (it has none)";  // "off" where the engine could: it has to be off
    c.speed_limits = "none";         // those that cannot be lifted, with their values
    return c;
  }

  // Everything that is not carried over exactly. What cannot be carried over is refused with what the user can do.
  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    std::vector<Limitation> limitations = feature_limitations("the skeleton", model, capabilities(settings), settings);
    limitations.reserve(model.joints.size() + 1);
    for (const Joint& hinge : model.joints) {
      limitations.push_back({.fidelity = Fidelity::kRefused,
                             .element = fmt::format("hinge '{}'", hinge.name),
                             .how = "it has no joints: choose another engine"});
    }
    if (!model.contacts.empty()) {
      limitations.push_back({.fidelity = Fidelity::kRefused,
                             .element = "contacts",
                             .how = "it has no collision: use --contacts off or another engine"});
    }
    return limitations;
  }

  // Called hundreds of times for one model: compile or build once what depends only on the model, and keep it.
  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    require_supported(model, settings);
    return std::make_unique<SkeletonSimulation>(model, state, settings);
  }
};

}  // namespace
}  // namespace assay

ASSAY_ENGINE_PLUGIN(assay::SkeletonEngine)
