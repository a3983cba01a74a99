// An engine that fails at will: each contender in another way, 0.1 s after the start of its simulation. Until then
// bodies move uniformly. It shows that nothing an engine does takes the program or its results with it. What breaks
// memory is written so that neither the compiler nor luck can take the fault away.
#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <limits>
#include <thread>
#include <unistd.h>

#include "engines/engine.h"

namespace assay {
namespace {

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

class FaultySimulation final : public Simulation {
 public:
  FaultySimulation(State state, const Settings& settings)
      : state_(std::move(state)),
        start_(state_.time),
        timestep_(settings.timestep),
        fault_(settings.get<std::string>("fault")) {}

  void set_torques(std::span<const double> /*torques*/) override {}

  void advance(int count) override {
    for (int i = 0; i < count; ++i) {
      ++steps_;
      const double elapsed = static_cast<double>(steps_) * timestep_;
      for (BodyState& body : state_.bodies) body.p_WBcm += timestep_ * body.v_WBcm;
      state_.time = start_ + elapsed;
      if (fault_ == "slow") std::this_thread::sleep_for(std::chrono::milliseconds(5));
      if (elapsed >= 0.1 - 1e-9) fail();
    }
  }

  void read_state(State& out) const override { out = state_; }
  EngineView view() const override { return {}; }

 private:
  void fail() {
    if (fault_ == "abort") std::raise(SIGABRT);
    if (fault_ == "exit") _exit(0);
    if (fault_ == "exit-politely") std::exit(0);
    if (fault_ == "throw") throw EngineError("the solver gave up");
    if (fault_ == "throw-number") throw 42;
    if (fault_ == "terminate") std::terminate();
    if (fault_ == "free-twice") free_twice();
    if (fault_ == "write-beyond") write_beyond();
    if (fault_ == "overflow") {
      volatile int start = 0;
      deeper(&start);
    }
    if (fault_ == "loop") {
      while (!ever) {
      }
    }
    if (fault_ == "hang") std::this_thread::sleep_for(std::chrono::hours(1));
    if (fault_ == "nan") state_.bodies.front().p_WBcm.z() = std::numeric_limits<double>::quiet_NaN();
    if (fault_ == "fly") state_.bodies.front().p_WBcm.z() += 1e9;
  }

  State state_;
  double start_;
  double timestep_;
  std::string fault_;
  long long steps_ = 0;
};

class FaultyEngine final : public Engine {
 public:
  std::string name() const override { return "faulty"; }
  BuildFacts build() const override { return {.version = "1", .source = "a test", .compiler = "", .flags = ""}; }
  std::vector<Setting> settings() const override {
    return {{.name = "fault",
             .default_value = std::string("slow"),
             .unit = "",
             .meaning = "how it fails",
             .choices = {"slow", "abort", "exit", "exit-politely", "throw", "throw-number", "terminate", "free-twice",
                         "write-beyond", "overflow", "loop", "hang", "nan", "fly", "refuse", "inexact"}}};
  }
  std::vector<Contender> contenders() const override {
    std::vector<Contender> contenders;
    const std::vector<Setting> declared = settings();
    for (const std::string& fault : declared.front().choices) {
      contenders.push_back({.name = "faulty-" + fault, .summary = "fails: " + fault, .set = {{"fault", fault}}});
    }
    return contenders;
  }
  Capabilities capabilities(const Settings& /*settings*/) const override {
    Capabilities can;
    can.integrator = "none";
    return can;
  }
  std::vector<Finding> check(const Model& model, const Settings& settings) const override {
    const std::string element = "body '" + model.bodies.front().name + "'";
    if (settings.get<std::string>("fault") == "refuse")
      return {{Fidelity::kRefused, element, "give it to somebody else"}};
    if (settings.get<std::string>("fault") == "inexact") return {{Fidelity::kApproximated, element, "rounded"}};
    return {};
  }
  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    if (settings.get<std::string>("fault") == "refuse") throw UnsupportedError("refused: " + model.name);
    return std::make_unique<FaultySimulation>(state, settings);
  }
};

}  // namespace
}  // namespace assay

ASSAY_ENGINE_PLUGIN(assay::FaultyEngine)
