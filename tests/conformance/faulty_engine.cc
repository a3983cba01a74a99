#include "faulty_engine.h"

#include <utility>

#include "model/kinematics.h"

namespace assay {
namespace {

int instances_alive = 0;
int reads_so_far = 0;

// Making an instance costs far more than a step, under the sanitizers above all.
constexpr int kStepsPerEdit = 10;

class FaultySimulation : public Simulation {
 public:
  FaultySimulation(const Engine& engine, Model model, State state, Settings settings, const Fault& fault)
      : engine_(engine), model_(std::move(model)), settings_(std::move(settings)), fault_(fault) {
    if (fault_.model) fault_.model(model_);
    model_.hash = model_hash(model_);
    if (fault_.start) fault_.start(model_, state);
    settings_.timestep *= fault_.timestep_factor;
    inner_ = engine_.create(model_, state, settings_);
    inner_->read_state(previous_);
    ++instances_alive;
  }
  ~FaultySimulation() override { --instances_alive; }
  FaultySimulation(const FaultySimulation&) = delete;
  FaultySimulation& operator=(const FaultySimulation&) = delete;

  void set_torques(std::span<const double> torques) override {
    torques_.assign(torques.begin(), torques.end());
    if (fault_.torques) fault_.torques(torques_);
    inner_->set_torques(torques_);
  }

  void advance(int count) override {
    if (fault_.loses_steps && count > 1) --count;
    if (!fault_.step && !fault_.repeats_torques && !fault_.stale && fault_.fails_at_step < 0) {
      inner_->advance(count);
      return;
    }
    for (int i = 0; i < count; ++i) {
      if (steps_ == fault_.fails_at_step) throw EngineError("the solver gave up");
      if (fault_.repeats_torques && !torques_.empty()) inner_->set_torques(torques_);
      if (fault_.stale || (fault_.step && steps_ % kStepsPerEdit == 0)) inner_->read_state(previous_);
      inner_->advance(1);
      if (++steps_ % kStepsPerEdit != 0 || !fault_.step) continue;
      State after = previous_;
      inner_->read_state(after);
      fault_.step(previous_, after, kStepsPerEdit * settings_.timestep);
      inner_ = engine_.create(model_, after, settings_);
    }
  }

  bool keep_contacts() override { return inner_->keep_contacts(); }
  void read_contacts(std::vector<ContactForce>& out) const override {
    inner_->read_contacts(out);
    for (ContactForce& contact : out) contact.impulse_W *= fault_.contact_factor;
  }

  void read_state(State& out) const override {
    inner_->read_state(out);
    if (fault_.stale) {
      const double time = out.time;
      out = previous_;
      out.time = time;
    }
    if (fault_.read) fault_.read(model_, out);
    ++reads_so_far;
    for (BodyState& body : out.bodies) {
      if (fault_.leaks_instances) body.p_WBcm.x() += 1e-14 * instances_alive;
      if (fault_.leaks_history) body.p_WBcm.x() += 1e-14 * reads_so_far;
    }
  }

  EngineView view() const override { return inner_->view(); }

 private:
  const Engine& engine_;
  Model model_;
  Settings settings_;
  const Fault& fault_;
  std::unique_ptr<Simulation> inner_;
  std::vector<double> torques_;
  State previous_;
  int steps_ = 0;
};

}  // namespace

Capabilities FaultyEngine::capabilities(const Settings& settings) const {
  Capabilities capabilities = inner_.engine->capabilities(settings);
  if (fault_.capabilities) fault_.capabilities(capabilities);
  return capabilities;
}

std::vector<Limitation> FaultyEngine::check(const Model& model, const Settings& settings) const {
  return inner_.engine->check(model, settings);
}

std::unique_ptr<Simulation> FaultyEngine::create(const Model& model, const State& state,
                                                 const Settings& settings) const {
  return std::make_unique<FaultySimulation>(*inner_.engine, model, state, settings, fault_);
}

ResolvedContender FaultyEngine::contender() const {
  ResolvedContender contender = inner_;
  contender.engine = this;
  return contender;
}

}  // namespace assay
