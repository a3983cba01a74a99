// Simbody: joint coordinates, integrators of fixed step. No contact. README.md says what is exact, what is approximated
// and which defaults are overridden.
#include <string>
#include <vector>

#include <fmt/format.h>

#include "engines/adapter.h"
#include "options.h"
#include "world.h"

namespace assay::simbody {
namespace {

class SimbodySimulation final : public Simulation {
 public:
  SimbodySimulation(const Model& model, const State& state, const Options& options)
      : world_(model, with_joint_coordinates(model, state), options),
        model_(model),
        clock_{state.time, options.timestep} {
    model_.keyframes.clear();
  }

  void set_torques(std::span<const double> torques) override {
    world_.set_torques(torques.empty() ? nullptr : torques.data());
  }

  void advance(int count) override {
    world_.advance(count);
    clock_.steps += count;
  }

  void read_state(State& out) const override {
    out.time = clock_.time();
    world_.read_joints(out, balls_);
    bodies_from_joints(model_, balls_, out);
  }

  EngineView view() const override {
    const Held held = world_.held();
    EngineView view;
    view.gravity = held.gravity;
    for (const HeldBody& body : held.bodies) view.bodies.push_back({body.mass, body.p_WBcm, body.I_BBcm_W});
    for (const HeldJoint& joint : held.joints) {
      view.joints.push_back({joint.p_WJ, joint.axis_W, joint.limited, joint.lower, joint.upper});
    }
    return view;
  }

 private:
  World world_;
  Model model_;  // our own copy: the caller's need not live on
  Clock clock_;
  mutable std::vector<BallCoordinates> balls_;  // of the last read
};

class SimbodyEngine final : public Adapter {
 public:
  std::vector<Setting> settings() const override { return declared_settings(); }

  std::vector<Contender> contenders() const override {
    return {{"simbody-euler", "Simbody, joint coordinates, semi-implicit Euler", {}},
            {"simbody-verlet", "Simbody, joint coordinates, velocity Verlet", {{"integrator", "verlet"}}},
            {"simbody-rkm", "Simbody, joint coordinates, Runge-Kutta-Merson", {{"integrator", "rkm"}}},
            {"simbody-euler-explicit-pd",
             "the same as simbody-euler, joint springs and dampers as explicit torques",
             {{"pd", "explicit"}}}};
  }

  Capabilities capabilities(const Settings& settings) const override {
    const Options options = read_options(settings);
    const MethodFacts& facts = method_facts(settings);
    Capabilities c;
    c.precision = Precision::kDouble;
    c.coordinates = Coordinates::kJoint;
    c.integrator = fmt::format("{}, fixed step", facts.text);
    c.order = facts.order;
    c.joint_solver = "none (joint coordinates)";
    c.contact = false;
    c.torques = c.armature = true;
    c.joint_limits = options.method != Method::kVerlet;
    describe_springs(c, options.native_pd, "Simbody's own, evaluated in every stage of a step");
    c.gyroscopic = true;
    if (options.method == Method::kVerlet) c.iterations = "at most 10 for the velocities, relative change 1e-12";
    c.sleep = "none (it has none)";
    c.speed_limits = "none";
    if (c.joint_limits) {
      c.other = fmt::format("joint limits are springs that swing {:g} rad a step", options.limit_frequency);
    }
    add_exact(c, {Feature::kSlide, Feature::kBall, Feature::kBallArmature, Feature::kMassless, Feature::kCoupling,
                  Feature::kCouplingOfMany, Feature::kConnect, Feature::kWeld});
    if (options.method == Method::kVerlet) {
      std::erase_if(c.features, [](const FeatureSupport& support) {
        return support.feature == Feature::kBall || support.feature == Feature::kBallArmature ||
               support.feature == Feature::kConnect;
      });
      c.features.push_back(
          {Feature::kConnect, Fidelity::kRefused,
           "Verlet's iteration for the velocities does not always converge with connects: choose another "
           "integrator"});
      for (const Feature feature : {Feature::kBall, Feature::kBallSpring, Feature::kBallArmature}) {
        c.features.push_back({feature, Fidelity::kRefused,
                              "Verlet's iteration for the velocities does not always converge with ball joints: choose "
                              "another integrator"});
      }
    }
    for (const Feature spring : {Feature::kBallSpring, Feature::kTendonSpring}) {
      if (c.support(spring) != nullptr) continue;
      if (options.native_pd) {
        add_exact(c, {spring});
      } else {
        add_approximated(c, spring, "explicit torque from the state at the step's start");
      }
    }
    return c;
  }

  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    const Options options = read_options(settings);
    std::vector<Limitation> limitations = feature_limitations("Simbody", model, capabilities(settings), settings);
    for (const Joint& hinge : model.joints) {
      if (hinge.has_spring() && !options.native_pd) limitations.push_back(explicit_spring(hinge));
      if (hinge.limited && options.method == Method::kVerlet) {
        limitations.push_back(
            {Fidelity::kRefused, joint_element(hinge, "range"),
             "Verlet's iteration does not converge in the spring that stands for a limit: choose another "
             "integrator"});
      } else if (hinge.limited) {
        limitations.push_back(
            {Fidelity::kApproximated, joint_element(hinge, "range"),
             fmt::format("a spring beyond the limit that swings {:g} rad a step, with dissipation {:g} "
                         "s/rad",
                         options.limit_frequency, options.limit_dissipation)});
      }
    }
    if (!model.contacts.empty()) {
      limitations.push_back({Fidelity::kRefused, "contacts",
                             "Simbody has no contact geometry for capsules: use --contacts off or another engine"});
    }
    return limitations;
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    require_supported(model, settings);
    return std::make_unique<SimbodySimulation>(model, state, read_options(settings));
  }
};

}  // namespace
}  // namespace assay::simbody

ASSAY_ENGINE_PLUGIN(assay::simbody::SimbodyEngine)
