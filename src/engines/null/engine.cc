// An engine that does nothing: time passes and the state stays. What it seems to cost is the harness's own cost.
#include "engines/adapter.h"

namespace assay {
namespace {

class NullSimulation final : public Simulation {
 public:
  NullSimulation(const Model& model, const State& state, double timestep)
      : state_(state), clock_{state.time, timestep} {
    // no step moves anything, so the view never changes
    view_.gravity = model.gravity;
    view_.bodies.reserve(model.bodies.size());
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      const Mat3 R_WB = state.bodies[i].q_WB.toRotationMatrix();
      view_.bodies.push_back({.mass = model.bodies[i].mass,
                              .p_WBcm = state.bodies[i].p_WBcm,
                              .I_BBcm_W = R_WB * model.bodies[i].I_BBcm_B * R_WB.transpose()});
    }
    view_.joints.reserve(model.joints.size());
    for (size_t j = 0; j < model.joints.size(); ++j) {
      const Joint& hinge = model.joints[j];
      const JointFrames frames = joint_frames(model, state, static_cast<int>(j));
      view_.joints.push_back({.p_WJ = frames.p_WJ_child,
                              .axis_W = frames.axis_W_child,
                              .limited = hinge.limited,
                              .lower = hinge.lower,
                              .upper = hinge.upper});
    }
  }

  void set_torques(std::span<const double> /*torques*/) override {}
  void advance(int count) override { clock_.steps += count; }

  void read_state(State& out) const override {
    out = state_;
    out.time = clock_.time();
  }

  EngineView view() const override { return view_; }

 private:
  State state_;
  EngineView view_;
  Clock clock_;
};

class NullEngine final : public Adapter {
 public:
  std::vector<Setting> settings() const override { return {}; }

  std::vector<Contender> contenders() const override {
    return {{"null", "does nothing: its figures are the harness's own", {}}};
  }

  Capabilities capabilities(const Settings& /*settings*/) const override {
    Capabilities c;
    c.integrator = "none";
    c.order = 0;
    c.joint_solver = "none";
    c.torques = false;
    c.gyroscopic = false;
    c.sleep = "none (nothing ever moves)";
    c.speed_limits = "none";
    c.other = "does not move anything";
    return c;
  }

  // It accepts every model, because it runs beside every contender.
  std::vector<Limitation> check(const Model& /*model*/, const Settings& /*settings*/) const override {
    return {{.fidelity = Fidelity::kApproximated, .element = "motion", .how = "nothing moves; measures the harness"}};
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    return std::make_unique<NullSimulation>(model, state, settings.timestep);
  }
};

}  // namespace
}  // namespace assay

ASSAY_ENGINE_PLUGIN(assay::NullEngine)
