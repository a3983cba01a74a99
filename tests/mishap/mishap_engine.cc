// Bodies that move on with their initial velocities, until the step at which the engine fails as its settings say. It
// shows that nothing an engine does takes the program or its results with it.
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>
#include <string_view>
#include <thread>
#include <unistd.h>
#include <utility>

#include "engines/engine.h"

namespace assay {
namespace {

// Faults of memory, written so that neither the compiler nor luck can take them away.

// Deeper and deeper until the stack has no more.
int recurse(const volatile int* above);
int (*volatile deeper)(const volatile int*) = recurse;
int recurse(const volatile int* above) {
  volatile int here[1024];
  here[0] = *above + 1;
  return deeper(here) + here[0];
}

// Until somebody ends the process.
volatile bool ever = false;

// NOLINTBEGIN(cppcoreguidelines-no-malloc): misused memory is the fault
[[gnu::noinline]] void free_twice() {
  void* volatile block = std::malloc(100);
  std::free(block);
  std::free(block);
}

// Beyond the blocks' ends: the first ones fill holes, the last ones lie one after the other.
[[gnu::noinline]] void write_beyond() {
  constexpr size_t kSize = 2000;
  std::array<char*, 64> blocks{};
  for (char*& block : blocks) block = static_cast<char*>(std::malloc(kSize));
  volatile size_t written = kSize + 64;
  for (char* block : blocks) std::memset(block, 0xff, written);
  for (char* block : blocks) std::free(block);
}
// NOLINTEND(cppcoreguidelines-no-malloc)

// Writes where the worker answers.
void answer(std::string_view line) {
  constexpr int kWorkerSocket = 3;
  [[maybe_unused]] const ssize_t ignored = ::write(kWorkerSocket, line.data(), line.size());
}

class MishapSimulation final : public Simulation {
 public:
  MishapSimulation(State state, Settings settings)
      : state_(std::move(state)), start_(state_.time), settings_(std::move(settings)) {}

  void set_torques(std::span<const double> /*torques*/) override {}

  void advance(int count) override {
    for (int i = 0; i < count; ++i) step();
  }

  void read_state(State& out) const override { out = state_; }
  EngineView view() const override { return {}; }

 private:
  void step() {
    ++steps_;
    state_.time = start_ + static_cast<double>(steps_) * settings_.timestep;
    for (BodyState& body : state_.bodies) body.p_WBcm += settings_.timestep * body.v_WBcm;
    const auto& fault = settings_.get<std::string>("fault");
    if (fault == "slow") std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const bool chosen = settings_.timestep >= 1e-3 * settings_.get<double>("from_ms") * 0.999;
    if (steps_ != settings_.get<long long>("at_step") || !chosen) return;
    if (settings_.get<bool>("loud")) {
      std::printf("about to %s\n", fault.c_str());
      std::fflush(stdout);
    }
    if (fault == "crash") {
      volatile int* nowhere = nullptr;
      *nowhere = 1;  // NOLINT(clang-analyzer-core.NullDereference): that is the fault
    } else if (fault == "abort") {
      std::abort();
    } else if (fault == "exit") {
      std::exit(3);
    } else if (fault == "exit-as-if-done") {
      std::exit(0);
    } else if (fault == "exit-at-once") {
      _exit(0);
    } else if (fault == "terminate") {
      std::terminate();
    } else if (fault == "free-twice") {
      free_twice();
    } else if (fault == "write-beyond") {
      write_beyond();
    } else if (fault == "overflow") {
      volatile int start = 0;
      deeper(&start);
    } else if (fault == "loop") {
      while (!ever) {
      }
    } else if (fault == "hang") {
      while (true) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    } else if (fault == "nan") {
      state_.bodies[0].p_WBcm.x() = std::numeric_limits<double>::quiet_NaN();
    } else if (fault == "far") {
      state_.bodies[0].p_WBcm.x() = 1e9;
    } else if (fault == "fast") {
      state_.bodies[0].v_WBcm *= 100;
    } else if (fault == "throw") {
      throw EngineError("the solver gave up");
    } else if (fault == "throw-foreign") {
      throw std::logic_error("not an engine's error");
    } else if (fault == "throw-number") {
      throw 42;
    } else if (fault == "throw-input") {
      throw InputError("the user is to blame");
    } else if (fault == "throw-system") {
      throw SystemError("the machine is to blame");
    } else if (fault == "garble") {
      answer("{\"kind\": \"done\"}\n");
    } else if (fault == "forge") {
      answer("{\"kind\": \"ready\", \"core\": 0, \"clock_s\": 1}\n");
    } else if (fault == "chatter") {
      for (int i = 0; i < 1000000; ++i) std::printf("line %d of very many lines that nobody reads\n", i);
    }
  }

  State state_;
  double start_;
  Settings settings_;
  long long steps_ = 0;
};

class MishapEngine final : public Engine {
 public:
  std::string name() const override { return "mishap"; }
  BuildFacts build() const override { return {"1.0", "part of assay's tests", "", ""}; }
  std::vector<Setting> settings() const override {
    return {{"fault", std::string("none"), "", "what happens", faults()},
            {"at_step", 10LL, "", "when it happens, in steps of an instance"},
            {"from_ms", 0.0, "ms", "the smallest timestep at which it happens"},
            {"loud", false, "", "say so on standard output before"}};
  }
  std::vector<Contender> contenders() const override {
    std::vector<Contender> contenders = {{"mishap", "fails as it is told to", {}}};
    for (const std::string& fault : faults()) contenders.push_back({"mishap-" + fault, fault, {{"fault", fault}}});
    return contenders;
  }
  Capabilities capabilities(const Settings& /*settings*/) const override {
    Capabilities can;
    can.integrator = "none";
    return can;
  }
  std::vector<Limitation> check(const Model& model, const Settings& settings) const override {
    const auto& fault = settings.get<std::string>("fault");
    const std::string element = "body '" + model.bodies.front().name + "'";
    if (fault == "refuse") return {{Fidelity::kRefused, element, "give it to somebody else"}};
    if (fault == "inexact") return {{Fidelity::kApproximated, element, "rounded"}};
    return {};
  }
  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    require_supported(model, settings);
    return std::make_unique<MishapSimulation>(state, settings);
  }

 private:
  static std::vector<std::string> faults() {
    return {"none",         "slow",        "crash",        "abort",        "exit",     "exit-as-if-done",
            "exit-at-once", "terminate",   "free-twice",   "write-beyond", "overflow", "loop",
            "hang",         "nan",         "far",          "fast",         "throw",    "throw-foreign",
            "throw-number", "throw-input", "throw-system", "chatter",      "refuse",   "inexact",
            "garble",       "forge"};
  }
};

}  // namespace
}  // namespace assay

ASSAY_ENGINE_PLUGIN(assay::MishapEngine)
