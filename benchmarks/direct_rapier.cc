// Rapier as its user would write it, which is in Rust: src/engines/rapier/recipe/direct.rs builds the world and loops
// over PhysicsWorld::step. What is here only fills in the numbers of the two systems.
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include <assay_rapier.h>

#include "direct.h"
#include "model/kinematics.h"

namespace assay::benchmarks {
namespace {

void copy(const Vec3& v, double* out) { std::ranges::copy(std::array{v.x(), v.y(), v.z()}, out); }
void copy(const Quat& q, double* out) { std::ranges::copy(std::array{q.x(), q.y(), q.z(), q.w()}, out); }

RapierOptions options_of(const Settings& settings, const Vec3& gravity) {
  const auto number = [&settings](const char* name) { return settings.get<double>(name); };
  const auto integer = [&settings](const char* name) { return static_cast<int>(settings.get<long long>(name)); };
  const auto flag = [&settings](const char* name) { return settings.get<bool>(name) ? 1 : 0; };
  RapierOptions options{};
  options.timestep = settings.timestep;
  copy(gravity, options.gravity);
  options.multibody = settings.get<std::string>("joints") == "multibody" ? 1 : 0;
  options.solver_iterations = integer("solver_iterations");
  options.pgs_iterations = integer("pgs_iterations");
  options.stabilization_iterations = integer("stabilization_iterations");
  options.contact_frequency = number("contact_natural_frequency");
  options.contact_damping_ratio = number("contact_damping_ratio");
  options.static_contact_frequency = number("static_contact_natural_frequency");
  options.static_contact_damping_ratio = number("static_contact_damping_ratio");
  options.max_corrective_speed = number("max_corrective_speed");
  options.prediction_distance = number("prediction_distance");
  options.warmstart = number("warmstart");
  options.warmstart_joints = flag("warmstart_joints");
  options.contact_recycling = flag("contact_recycling");
  options.contact_coherence = flag("contact_coherence");
  options.friction_in_bias_pass = flag("friction_in_bias_pass");
  options.coulomb = settings.get<std::string>("friction_model") == "coulomb" ? 1 : 0;
  options.ccd_substeps = integer("ccd_substeps");
  return options;
}

class DirectRapier final : public Direct {
 public:
  DirectRapier(const Scene& scene, const State& start, const Settings& settings) : bodies_(scene.model.bodies.size()) {
    const Model& model = scene.model;
    std::vector<RapierBody> bodies;
    for (size_t b = 0; b < bodies_; ++b) {
      const PrincipalInertia principal = principal_inertia(model.bodies[b].I_BBcm_B);
      RapierBody& body = bodies.emplace_back();
      body.mass = model.bodies[b].mass;
      copy(principal.diagonal, body.inertia);
      copy(principal.q_BI, body.q_body_principal);
      copy(start.bodies[b].p_WBcm, body.p_world_com);
      copy(start.bodies[b].q_WB, body.q_world_body);
      copy(start.bodies[b].v_WBcm, body.v_world_com);
      copy(start.bodies[b].w_WB, body.w_world);
    }
    std::vector<RapierJoint> hinges;
    for (size_t j = 0; j < model.joints.size(); ++j) {
      const Joint& from = model.joints[j];
      const Body& child = model.bodies[from.body];
      const Vec3 p_PPcm = child.parent == kWorld ? Vec3::Zero() : model.bodies[child.parent].p_BBcm;
      const Quat q_BJ = Quat::FromTwoVectors(Vec3::UnitX(), from.axis_B);
      RapierJoint& hinge = hinges.emplace_back();
      hinge.parent = child.parent;
      hinge.child = from.body;
      copy(anchor_in_parent(model, static_cast<int>(j)) - p_PPcm, hinge.p_parent);
      copy(child.X_PB.q * q_BJ, hinge.q_parent);
      copy(from.p_BJ - child.p_BBcm, hinge.p_child);
      copy(q_BJ, hinge.q_child);
      hinge.position[0] = start.position[j] - from.reference;
      hinge.velocity[0] = start.velocity[j];
    }
    std::vector<RapierShape> shapes;
    for (const Shape& from : model.contacts.empty() ? std::vector<Shape>() : model.shapes) {
      RapierShape& shape = shapes.emplace_back();
      shape.body = from.body;
      copy(from.body == kWorld ? from.X_BS.p : Vec3(from.X_BS.p - model.bodies[from.body].p_BBcm), shape.p);
      copy(from.X_BS.q, shape.q);
      shape.radius = from.radius;
      shape.half_length = from.half_length;
      shape.friction = model.contacts.front().friction;
    }
    const RapierOptions options = options_of(settings, model.gravity);
    world_ =
        assay_rapier_direct.create(&options, bodies.data(), static_cast<int>(bodies.size()), hinges.data(),
                                   static_cast<int>(hinges.size()), shapes.data(), static_cast<int>(shapes.size()));
  }

  ~DirectRapier() override { assay_rapier_direct.destroy(world_); }
  DirectRapier(const DirectRapier&) = delete;
  DirectRapier& operator=(const DirectRapier&) = delete;

  void run(int count) override { assay_rapier_direct.run(world_, nullptr, count); }

  void run_with_torques(std::span<const double> torques, int count) override {
    assay_rapier_direct.run(world_, torques.data(), count);
  }

  std::vector<Vec3> positions() const override {
    std::vector<double> numbers(3 * bodies_);
    assay_rapier_direct.positions(world_, numbers.data());
    std::vector<Vec3> result;
    result.reserve(bodies_);
    for (size_t b = 0; b < bodies_; ++b) result.emplace_back(&numbers[3 * b]);
    return result;
  }

 private:
  size_t bodies_;
  RapierDirect* world_ = nullptr;
};

std::unique_ptr<Direct> make(const Scene& scene, const State& start, const Settings& settings) {
  return std::make_unique<DirectRapier>(scene, start, settings);
}

}  // namespace
}  // namespace assay::benchmarks

ASSAY_DIRECT_LOOP(assay::benchmarks::make, "rapier-impulse-f64", "rapier-multibody-f64")
