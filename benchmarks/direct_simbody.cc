// Simbody: the loop itself is in direct_simbody_loop.cc.
#include "direct_simbody.h"

#include "direct.h"
#include "model/kinematics.h"

namespace assay::benchmarks {
namespace {

class DirectSimbody final : public Direct {
 public:
  DirectSimbody(const Scene& scene, const State& start, const Settings& settings)
      : model_(scene.model),
        loop_(make_simbody_loop(scene.model, start, settings.timestep,
                                settings.get<std::string>("integrator") == "rkm")) {}

  void run(int count) override { loop_->run(count); }
  void run_with_torques(std::span<const double> torques, int count) override {
    loop_->run_with_torques(torques.data(), count);
  }

  std::vector<Vec3> positions() const override {
    State state;
    state.position = loop_->angles();
    state.velocity = loop_->rates();
    for (size_t j = 0; j < state.position.size(); ++j) state.position[j] += model_.joints[j].reference;
    bodies_from_joints(model_, state);
    std::vector<Vec3> result;
    result.reserve(state.bodies.size());
    for (const BodyState& body : state.bodies) result.push_back(body.p_WBcm);
    return result;
  }

 private:
  Model model_;
  std::unique_ptr<SimbodyLoop> loop_;
};

std::unique_ptr<Direct> make(const Scene& scene, const State& start, const Settings& settings) {
  return std::make_unique<DirectSimbody>(scene, start, settings);
}

}  // namespace
}  // namespace assay::benchmarks

ASSAY_DIRECT_LOOP(assay::benchmarks::make, "simbody-euler", "simbody-rkm")
