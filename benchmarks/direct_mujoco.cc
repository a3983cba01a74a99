// MuJoCo as its user would write it: load the file, set the options, call mj_step.
#include <algorithm>
#include <array>
#include <stdexcept>

#include <mujoco/mujoco.h>

#include "direct.h"
#include "model/kinematics.h"

namespace assay::benchmarks {
namespace {

class DirectMujoco final : public Direct {
 public:
  DirectMujoco(const Scene& scene, const State& start, const Settings& settings) : model_(scene.model) {
    std::array<char, 500> error{};
    mjSpec* spec = mj_parseXML(scene.path.c_str(), nullptr, error.data(), static_cast<int>(error.size()));
    if (spec == nullptr) throw std::runtime_error(error.data());
    spec->compiler.discardvisual = true;  // shapes that touch nothing
    // inertia in the bodies' own axes, not in the shapes': MuJoCo then does less
    spec->compiler.inertiafromgeom = mjINERTIAFROMGEOM_FALSE;
    for (const Body& body : model_.bodies) {
      mjsBody* out = mjs_findBody(spec, body.name.c_str());
      out->explicitinertial = true;
      out->mass = body.mass;
      std::ranges::copy(body.p_BBcm, out->ipos);
      std::ranges::copy(body.I_BBcm_B.diagonal(), out->inertia);
    }
    m_ = mj_compile(spec, nullptr);
    if (m_ == nullptr) throw std::runtime_error(mjs_getError(spec));
    mj_deleteSpec(spec);
    m_->opt.timestep = settings.timestep;
    m_->opt.integrator = mjINT_EULER;
    m_->opt.solver = mjSOL_NEWTON;
    m_->opt.jacobian = mjJAC_SPARSE;
    m_->opt.iterations = static_cast<int>(settings.get<long long>("iterations"));
    m_->opt.tolerance = settings.get<double>("tolerance");
    m_->opt.disableflags |= mjDSBL_AUTORESET;

    // one joint a body, in the file's order, and centres of mass in the bodies' origins where they are free
    d_ = mj_makeData(m_);
    std::ranges::copy(start.position, d_->qpos);
    std::ranges::copy(start.velocity, d_->qvel);
    mjtNum* qpos = d_->qpos + start.position.size();
    mjtNum* qvel = d_->qvel + start.velocity.size();
    for (size_t i = 0; i < model_.bodies.size(); ++i) {
      if (!model_.bodies[i].is_free()) continue;
      const BodyState& s = start.bodies[i];
      const Vec3 w_B = s.q_WB.conjugate() * s.w_WB;
      qpos = std::ranges::copy(s.p_WBcm, qpos).out;
      qpos = std::ranges::copy(std::array{s.q_WB.w(), s.q_WB.x(), s.q_WB.y(), s.q_WB.z()}, qpos).out;
      qvel = std::ranges::copy(s.v_WBcm, qvel).out;
      qvel = std::ranges::copy(w_B, qvel).out;
    }
  }

  ~DirectMujoco() override {
    mj_deleteData(d_);
    mj_deleteModel(m_);
  }
  DirectMujoco(const DirectMujoco&) = delete;
  DirectMujoco& operator=(const DirectMujoco&) = delete;

  void run(int count) override {
    for (int i = 0; i < count; ++i) mj_step(m_, d_);
  }

  void run_with_torques(std::span<const double> torques, int count) override {
    for (int i = 0; i < count; ++i) {
      for (size_t j = 0; j < torques.size(); ++j) d_->qfrc_applied[j] = torques[j];
      mj_step(m_, d_);
    }
  }

  std::vector<Vec3> positions() const override {
    State state;
    state.bodies.resize(model_.bodies.size());
    const size_t hinges = model_.joints.size();
    state.position.assign(d_->qpos, d_->qpos + hinges);
    state.velocity.assign(d_->qvel, d_->qvel + hinges);
    const mjtNum* qpos = d_->qpos + hinges;
    for (size_t i = 0; i < model_.bodies.size(); ++i) {
      if (!model_.bodies[i].is_free()) continue;
      state.bodies[i].p_WBcm = {qpos[0], qpos[1], qpos[2]};
      qpos += 7;
    }
    bodies_from_joints(model_, state);
    std::vector<Vec3> result;
    result.reserve(state.bodies.size());
    for (const BodyState& body : state.bodies) result.push_back(body.p_WBcm);
    return result;
  }

 private:
  const Model model_;
  mjModel* m_ = nullptr;
  mjData* d_ = nullptr;
};

std::unique_ptr<Direct> make(const Scene& scene, const State& start, const Settings& settings) {
  return std::make_unique<DirectMujoco>(scene, start, settings);
}

}  // namespace
}  // namespace assay::benchmarks

ASSAY_DIRECT_LOOP(assay::benchmarks::make, "mujoco-euler")
