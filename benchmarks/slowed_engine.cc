// A real engine made slower, less accurate or faulty on purpose: for measuring which regressions `assay compare` finds,
// and what a fault costs. It wraps another plugin, so that its steps, memory and times are real. The environment says
// what it does, so that its settings and its file are the same before and after:
//   SLOWED_PLUGIN     the wrapped plugin's file
//   SLOWED_CONTENDER  the wrapped contender
//   SLOWED_REPEATS    share of the steps that a twin of the simulation makes too: 0.05 costs 5 % more time
//   SLOWED_ERROR      share by which the error grows: the state is moved away from that of two half steps, as a
//   first-order
//                     method with an error larger by this share has it. It costs three times the steps: no times then.
//   SLOWED_FAULT      "hang", "loop", "abort", "crash" or "exit" at the first step of a timestep of SLOWED_FAULT_MS
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <dlfcn.h>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "engines/engine.h"

namespace assay {
namespace {

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

double share(const char* name) {
  const std::string text = variable(name);
  return text.empty() ? 0 : std::stod(text);
}

const Engine& wrapped() {
  static const std::unique_ptr<const Engine> engine = [] {
    const std::string path = variable("SLOWED_PLUGIN");
    void* library = ::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr) throw std::runtime_error("SLOWED_PLUGIN: " + std::string(::dlerror()));
    const auto entry = reinterpret_cast<PluginEntry (*)()>(::dlsym(library, "assay_engine_plugin"));
    if (entry == nullptr) throw std::runtime_error("SLOWED_PLUGIN is no plugin");
    return std::unique_ptr<const Engine>(entry().make());
  }();
  return *engine;
}

void fail(const std::string& fault) {
  volatile bool ever = false;
  if (fault == "abort") std::abort();
  if (fault == "exit") std::exit(3);
  if (fault == "crash") {
    volatile int* volatile nowhere = nullptr;
    *nowhere = 1;
  }
  while (fault == "loop" && !ever) {
  }
  while (fault == "hang" && !ever) std::this_thread::sleep_for(std::chrono::milliseconds(10));
}

// What a simulation owes of a step at its start, spread evenly over simulations: windows are short, and what is left of
// a step at their ends is cut off.
double next_part() {
  constexpr double kGolden = 0.6180339887498949;
  static double part = 0;
  part = std::fmod(part + kGolden, 1);
  return part;
}

class SlowedSimulation final : public Simulation {
 public:
  SlowedSimulation(const Model& model, const State& state, const Settings& settings)
      : main_(wrapped().create(model, state, settings)),
        repeats_(share("SLOWED_REPEATS")),
        error_(share("SLOWED_ERROR")) {
    const std::string fault = variable("SLOWED_FAULT");
    if (!fault.empty() && std::abs(1e3 * settings.timestep - share("SLOWED_FAULT_MS")) < 1e-6) fault_ = fault;
    if (repeats_ > 0) twin_ = wrapped().create(model, state, settings);
    if (error_ > 0) {
      Settings half = settings;
      half.timestep /= 2;
      fine_ = wrapped().create(model, state, half);
    }
  }

  void set_torques(std::span<const double> torques) override {
    main_->set_torques(torques);
    if (twin_) twin_->set_torques(torques);
    if (fine_) fine_->set_torques(torques);
  }

  void advance(int count) override {
    if (!fault_.empty()) fail(fault_);
    main_->advance(count);
    if (fine_) fine_->advance(2 * count);
    if (!twin_) return;
    owed_ += repeats_ * count;
    const double whole = std::floor(owed_);
    owed_ -= whole;
    if (whole > 0) twin_->advance(static_cast<int>(whole));
  }

  void read_state(State& out) const override {
    main_->read_state(out);
    if (!fine_) return;
    // The error of a first-order method is twice the distance to the same method at half the step.
    State fine;
    fine_->read_state(fine);
    const double away = 2 * error_;
    for (size_t i = 0; i < out.bodies.size(); ++i) {
      out.bodies[i].p_WBcm += away * (out.bodies[i].p_WBcm - fine.bodies[i].p_WBcm);
    }
  }

  EngineView view() const override { return main_->view(); }
  bool keep_contacts() override { return main_->keep_contacts(); }
  void read_contacts(std::vector<ContactForce>& out) const override { main_->read_contacts(out); }

 private:
  std::unique_ptr<Simulation> main_, twin_, fine_;
  std::string fault_;
  double repeats_ = 0, error_ = 0;
  double owed_ = next_part();  // steps
};

class SlowedEngine final : public Engine {
 public:
  std::string name() const override { return "slowed"; }
  BuildFacts build() const override { return wrapped().build(); }
  std::vector<Setting> settings() const override { return wrapped().settings(); }

  std::vector<Contender> contenders() const override {
    const std::string name = variable("SLOWED_CONTENDER");
    for (Contender contender : wrapped().contenders()) {
      if (contender.name != name) continue;
      contender.name = "slowed";
      return {contender};
    }
    throw std::runtime_error("SLOWED_CONTENDER is no contender of the wrapped plugin");
  }

  Capabilities capabilities(const Settings& settings) const override { return wrapped().capabilities(settings); }

  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    return wrapped().check(model, settings);
  }

  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    return std::make_unique<SlowedSimulation>(model, state, settings);
  }
};

}  // namespace
}  // namespace assay

ASSAY_ENGINE_PLUGIN(assay::SlowedEngine)
