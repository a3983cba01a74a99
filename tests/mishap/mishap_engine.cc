// Bodies that move on with their initial velocities, until the step at which the engine fails as its settings say. It
// shows that nothing an engine does takes the program or its results with it.
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fcntl.h>
#include <limits>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <sys/ioctl.h>
#include <sys/ipc.h>
#include <sys/resource.h>
#include <sys/shm.h>
#include <sys/socket.h>
#include <sys/stat.h>
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

// Writes where the worker answers, whatever descriptor that is.
void answer(std::string_view line) {
  constexpr int kMostDescriptors = 1024;
  for (int descriptor = 3; descriptor < kMostDescriptors; ++descriptor) {
    int type = 0;
    socklen_t size = sizeof type;
    if (::getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &size) != 0) continue;
    [[maybe_unused]] const ssize_t ignored = ::write(descriptor, line.data(), line.size());
  }
}

// Of the environment: where a fault that others see leaves its mark.
const char* mark_file() {
  const char* file = std::getenv("ASSAY_MISHAP_MARK");
  return file == nullptr ? "/dev/null" : file;
}

// SIGKILL, as the kernel sends it when memory runs out, so many times in all processes together.
void be_killed(long long times) {
  const int file = ::open(mark_file(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  struct stat facts{};
  if (file < 0 || ::fstat(file, &facts) != 0) return;
  if (facts.st_size < times && ::write(file, "k", 1) == 1) ::kill(::getpid(), SIGKILL);
  ::close(file);
}

// A process that leaves the worker's group and session and goes on for minutes; its number is in the file when this
// returns.
void leave_a_process() {
  std::array<int, 2> told{};
  if (::pipe2(told.data(), O_CLOEXEC) != 0) return;
  const pid_t child = ::fork();
  if (child != 0) {
    ::close(told[1]);
    char none = 0;
    [[maybe_unused]] const ssize_t end = ::read(told[0], &none, 1);  // when the other process has closed it
    ::close(told[0]);
    return;
  }
  ::setsid();
  if (::fork() != 0) ::_exit(0);
  const int file = ::open(mark_file(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  const std::string text = std::to_string(::getpid()) + "\n";
  [[maybe_unused]] const ssize_t written = ::write(file, text.data(), text.size());
  ::close(file);
  ::close(told[1]);
  constexpr unsigned kSeconds = 300;
  ::sleep(kSeconds);
  ::_exit(0);
}

// Memory that is hardly used, so that it takes no time, until there is no more.
void hoard() {
  constexpr size_t kBlock = size_t{64} << 20;
  while (!ever) {
    *static_cast<volatile char*>(::operator new(kBlock)) = 1;
  }
}

// What engines do that keep code for each model.
void keep() {
  constexpr size_t kBlock = size_t{16} << 20;
  *static_cast<volatile char*>(::operator new(kBlock)) = 1;
}

// 0, or why the system does not do it.
int error_of(long result) { return result < 0 ? errno : 0; }

int write_in(const char* variable) {
  const char* folder = std::getenv(variable);
  const std::string path = std::string(folder == nullptr ? "/nowhere" : folder) + "/written-by-an-engine";
  const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (file >= 0) ::close(file);
  return error_of(file);
}

int open_file(const char* path, int how) {
  const int file = ::open(path, how | O_CLOEXEC);
  if (file >= 0) ::close(file);
  return error_of(file);
}

int make_socket() {
  const int made = ::socket(AF_INET, SOCK_STREAM, 0);
  if (made >= 0) ::close(made);
  return error_of(made);
}

// What belongs to other processes, tried in a way that leaves it as it is: the error, or 0.
int trespass_on_processes(const std::string& fault) {
  rlimit limit{};
  if (fault == "limit-others") return error_of(::prlimit(::getppid(), RLIMIT_CORE, nullptr, &limit));
  if (fault == "slow-others") {
    const int now = ::getpriority(PRIO_PROCESS, static_cast<id_t>(::getppid()));
    return error_of(::setpriority(PRIO_PROCESS, static_cast<id_t>(::getppid()), now));
  }
  if (fault == "share-memory") {
    const int segment = ::shmget(IPC_PRIVATE, 1, IPC_CREAT | 0600);
    return segment < 0 ? errno : error_of(::shmctl(segment, IPC_RMID, nullptr));
  }
  if (fault == "type-commands") {
    const char key = '\n';
    return error_of(::ioctl(STDIN_FILENO, TIOCSTI, &key));
  }
  if (fault == "limit-itself") {  // no trespass
    if (::prlimit(0, RLIMIT_CORE, nullptr, &limit) != 0) return errno;
    return error_of(::setpriority(PRIO_PROCESS, 0, ::getpriority(PRIO_PROCESS, 0)));
  }
  return 0;
}

// What an engine has no use for, tried once: the error, or 0 where the system lets it.
int trespass(const std::string& fault) {
  if (fault == "write-home") return write_in("HOME");
  if (fault == "write-scratch") return write_in("TMPDIR");
  if (fault == "read-file") return open_file(mark_file(), O_RDONLY);
  if (fault == "append-file") return open_file(mark_file(), O_WRONLY | O_APPEND);
  if (fault == "remove-file") return error_of(::unlink(mark_file()));
  if (fault == "open-socket") return make_socket();
  if (fault == "change-mode") return error_of(::chmod(mark_file(), 0777));
  if (fault == "signal-others") return error_of(::kill(1, 0));
  return trespass_on_processes(fault);
}

// Bytes without a line's end, for ever.
void flood() {
  const std::string block(1 << 20, 'x');
  while (!ever) answer(block);
}

// Ends where `call` names it in the settings' fault: "throw-in-create", "exit-in-read".
void end_in(const std::string& call, const Settings& settings) {
  const auto& fault = settings.get<std::string>("fault");
  if (fault == "throw-in-" + call) throw std::logic_error("no more in " + call);
  if (fault == "exit-in-" + call) std::exit(0);
}

class MishapSimulation final : public Simulation {
 public:
  MishapSimulation(State state, Settings settings)
      : state_(std::move(state)), start_(state_.time), settings_(std::move(settings)) {
    if (settings_.get<std::string>("fault") == "keep") keep();
  }

  void set_torques(std::span<const double> /*torques*/) override {
    if (steps_ >= settings_.get<long long>("at_step")) end_in("torques", settings_);
  }

  void advance(int count) override {
    for (int i = 0; i < count; ++i) step();
  }

  void read_state(State& out) const override {
    out = state_;
    const auto& fault = settings_.get<std::string>("fault");
    if (steps_ < settings_.get<long long>("at_step")) return;
    end_in("read", settings_);
    if (fault == "wrong-size") {
      out.bodies.pop_back();
    } else if (fault == "zero-orientation") {
      out.bodies[0].q_WB = Quat(0, 0, 0, 0);
    } else if (fault == "backward") {
      out.time = start_ - static_cast<double>(steps_) * settings_.timestep;
    } else if (fault == "nan-time") {
      out.time = std::numeric_limits<double>::quiet_NaN();
    } else if (fault == "nan-angle") {
      for (double& angle : out.position) angle = std::numeric_limits<double>::quiet_NaN();
    }
  }
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
    } else if (fault == "killed") {
      be_killed(settings_.get<long long>("times"));
    } else if (fault == "leave") {
      leave_a_process();
    } else if (fault == "leave-and-hang") {
      leave_a_process();
      while (true) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    } else if (fault == "hoard") {
      hoard();
    } else if (fault == "flood") {
      flood();
    } else if (fault == "forge-done") {
      answer(
          "{\"kind\": \"done\", \"cells\": [{\"measure\": \"drift\", \"ending\": {\"outcome\": \"ok\", \"reason\": "
          "\"\"}, \"values\": [], \"samples\": []}], \"engine_s\": 0, \"cpu_s\": 0, \"step_us\": 0, \"start_s\": 0, "
          "\"instance_s\": 0}\n");
    } else if (fault == "forge-tests") {
      while (!ever) {
        answer(
            "{\"kind\": \"test\", \"test\": \"x\", \"status\": \"pass\", \"figure\": null, \"tolerance\": null, "
            "\"unit\": \"\", \"note\": \"\"}\n");
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      }
    } else if (fault == "forge") {
      answer("{\"kind\": \"ready\", \"core\": 0, \"clock_s\": 1}\n");
    } else if (const int error = trespass(fault); error != 0) {
      throw EngineError(fault + ": " + std::strerror(error));
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
            {"times", 1LL, "", "how often, where it counts over all processes"},
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
    if (fault == "abort-in-check") std::abort();
    if (fault == "exit-in-check") std::exit(0);
    // only where a test asks for it: some commands ask all contenders
    if (fault == "killed-in-check" && std::getenv("ASSAY_MISHAP_MARK") != nullptr) {
      be_killed(settings.get<long long>("times"));
    }
    if (fault == "inexact") return {{Fidelity::kApproximated, element, "rounded"}};
    return {};
  }
  std::unique_ptr<Simulation> create(const Model& model, const State& state, const Settings& settings) const override {
    require_supported(model, settings);
    end_in("create", settings);
    return std::make_unique<MishapSimulation>(state, settings);
  }

 private:
  static std::vector<std::string> faults() {
    return {"none",
            "slow",
            "crash",
            "abort",
            "exit",
            "exit-as-if-done",
            "exit-at-once",
            "terminate",
            "free-twice",
            "write-beyond",
            "overflow",
            "loop",
            "hang",
            "nan",
            "far",
            "fast",
            "throw",
            "throw-foreign",
            "throw-number",
            "throw-input",
            "throw-system",
            "chatter",
            "refuse",
            "inexact",
            "garble",
            "forge",
            "forge-done",
            "forge-tests",
            "killed",
            "leave",
            "leave-and-hang",
            "hoard",
            "keep",
            "flood",
            "wrong-size",
            "zero-orientation",
            "backward",
            "nan-time",
            "nan-angle",
            "abort-in-check",
            "exit-in-check",
            "killed-in-check",
            "write-home",
            "write-scratch",
            "read-file",
            "append-file",
            "remove-file",
            "open-socket",
            "change-mode",
            "signal-others",
            "limit-others",
            "slow-others",
            "share-memory",
            "type-commands",
            "limit-itself",
            "throw-in-create",
            "throw-in-torques",
            "throw-in-read",
            "exit-in-create",
            "exit-in-torques",
            "exit-in-read"};
  }
};

}  // namespace
}  // namespace assay

ASSAY_ENGINE_PLUGIN(assay::MishapEngine)
