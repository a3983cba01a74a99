#include "run/worker/process_batch.h"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <new>
#include <sched.h>
#include <stdexcept>
#include <string>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <type_traits>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "isolate/processes.h"
#include "model/body_rows.h"

namespace assay {
namespace {

// ---- what a process is told and answers: one byte, a size, and that many bytes ----------------------------------------

enum class Order : std::uint8_t { kAdvance, kTorques, kRead, kMemory };
enum class Answer : std::uint8_t { kDone, kUnsupported, kEngine, kFault };

struct Head {
  std::uint8_t kind = 0;
  std::uint64_t size = 0;
};

bool send_all(int socket, const void* data, size_t size) {
  const auto* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t sent = ::send(socket, at, size, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;
    at += sent;
    size -= static_cast<size_t>(sent);
  }
  return true;
}

bool receive_all(int socket, void* data, size_t size) {
  auto* at = static_cast<char*>(data);
  while (size > 0) {
    const ssize_t got = ::recv(socket, at, size, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    at += got;
    size -= static_cast<size_t>(got);
  }
  return true;
}

template <typename Kind>
bool send_message(int socket, Kind kind, const void* data, size_t size) {
  const Head head = {static_cast<std::uint8_t>(kind), size};
  return send_all(socket, &head, sizeof head) && (size == 0 || send_all(socket, data, size));
}

template <typename Kind>
bool receive_message(int socket, Kind& kind, std::string& data) {
  Head head;
  if (!receive_all(socket, &head, sizeof head)) return false;
  kind = static_cast<Kind>(head.kind);
  data.resize(head.size);
  return head.size == 0 || receive_all(socket, data.data(), data.size());
}

template <typename Number>
std::vector<Number> numbers_in(const std::string& data) {
  static_assert(std::is_trivially_copyable_v<Number>);
  std::vector<Number> numbers(data.size() / sizeof(Number));
  if (!numbers.empty()) std::memcpy(numbers.data(), data.data(), numbers.size() * sizeof(Number));
  return numbers;
}

// ---- one process ------------------------------------------------------------------------------------------------------

std::vector<int> usable_processors() {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  std::vector<int> found;
  if (::sched_getaffinity(0, sizeof allowed, &allowed) == 0) {
    for (int core = 0; core < CPU_SETSIZE; ++core) {
      if (CPU_ISSET(core, &allowed)) found.push_back(core);
    }
  }
  if (found.empty()) found.push_back(-1);  // not known: one process that is not pinned
  return found;
}

void pin_to(int core) {
  if (core < 0) return;
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(core, &one);
  ::sched_setaffinity(0, sizeof one, &one);
}

// Bytes that this process shares with no other.
double private_bytes() {
  std::ifstream file("/proc/self/smaps_rollup");
  double kilobytes = 0;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("Private_")) kilobytes += std::strtod(line.c_str() + line.find(':') + 1, nullptr);
  }
  return 1024 * kilobytes;
}

std::vector<double> numbers_of(const State& state) {
  std::vector<double> numbers = {state.time};
  const std::vector<double> rows = rows_of(state.bodies);
  numbers.insert(numbers.end(), rows.begin(), rows.end());
  numbers.insert(numbers.end(), state.position.begin(), state.position.end());
  numbers.insert(numbers.end(), state.velocity.begin(), state.velocity.end());
  return numbers;
}

// The worlds of this process.
class Worlds {
 public:
  Worlds(const Engine& engine, const Model& model, std::span<const State> states, const Settings& settings) {
    simulations_.reserve(states.size());
    for (const State& state : states) simulations_.push_back(engine.create(model, state, settings));
  }

  std::vector<double> obey(Order order, const std::string& data) {
    switch (order) {
      case Order::kAdvance:
        for (const auto& each : simulations_) each->advance(numbers_in<int>(data).at(0));
        return {};
      case Order::kTorques: {
        const std::vector<double> torques = numbers_in<double>(data);
        const size_t joints = torques.size() / simulations_.size();
        for (size_t i = 0; i < simulations_.size(); ++i) {
          simulations_[i]->set_torques(std::span(torques).subspan(i * joints, joints));
        }
        return {};
      }
      case Order::kRead: {
        State state;
        simulations_.at(static_cast<size_t>(numbers_in<int>(data).at(0)))->read_state(state);
        return numbers_of(state);
      }
      case Order::kMemory:
        return {private_bytes()};
    }
    throw std::logic_error("a process of a batch was told something unknown");
  }

 private:
  std::vector<std::unique_ptr<Simulation>> simulations_;
};

// Does `work` and answers with its numbers, or with what it threw. False when the worker is gone.
template <typename Work>
bool answer(int socket, const Work& work) {
  const auto text = [socket](Answer kind, const std::string& what) {
    return send_message(socket, kind, what.data(), what.size());
  };
  try {
    const std::vector<double> numbers = work();
    return send_message(socket, Answer::kDone, numbers.data(), numbers.size() * sizeof(double));
  } catch (const UnsupportedError& error) {
    return text(Answer::kUnsupported, error.what());
  } catch (const EngineError& error) {
    return text(Answer::kEngine, error.what());
  } catch (const std::bad_alloc&) {
    return text(Answer::kFault, "out of memory: the worlds of one process take more than a worker may");
  } catch (const std::exception& error) {
    return text(Answer::kFault, error.what());
  }
}

// The memory that this process may have is shared by `count` that it starts.
void share_memory_limit(int count) {
  rlimit limit{};
  if (::getrlimit(RLIMIT_DATA, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return;
  limit.rlim_cur /= static_cast<rlim_t>(count);
  ::setrlimit(RLIMIT_DATA, &limit);
}

[[noreturn]] void serve_worlds(int socket, int core, const Engine& engine, const Model& model,
                               std::span<const State> states, const Settings& settings) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  pin_to(core);
  std::unique_ptr<Worlds> worlds;
  bool goes_on = answer(socket, [&] {
    worlds = std::make_unique<Worlds>(engine, model, states, settings);
    return std::vector<double>();
  });
  Order order{};
  std::string data;
  while (goes_on && worlds && receive_message(socket, order, data)) {
    goes_on = answer(socket, [&] { return worlds->obey(order, data); });
  }
  std::fflush(nullptr);
  ::_exit(0);  // no destructors: an engine that crashes in them must not look like a failed run
}

}  // namespace

struct ProcessBatch::Process {
  int socket = -1, first = 0, count = 0;  // of its worlds
  pid_t pid = -1;

  Process() = default;
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process() {
    if (socket >= 0) ::close(socket);
    if (pid < 0) return;
    ::kill(pid, SIGKILL);
    ::waitpid(pid, nullptr, 0);
  }

  // Waits for the answer to what was told last. Throws what the process threw.
  std::vector<double> wait() {
    Answer kind{};
    std::string data;
    if (!receive_message(socket, kind, data)) throw std::runtime_error(how_it_ended());
    switch (kind) {
      case Answer::kDone:
        return numbers_in<double>(data);
      case Answer::kUnsupported:
        throw UnsupportedError(data);
      case Answer::kEngine:
        throw EngineError(data);
      case Answer::kFault:
        break;
    }
    throw std::runtime_error(data);
  }

  void tell(Order order, const void* data, size_t size) {
    if (!send_message(socket, order, data, size)) throw std::runtime_error(how_it_ended());
  }

 private:
  std::string how_it_ended() {
    int status = 0;
    while (pid > 0 && ::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
    }
    pid = -1;
    share_end(status);
    const std::string worlds = fmt::format("the process of worlds {} to {}", first, first + count - 1);
    if (WIFSIGNALED(status))
      return fmt::format("{} ended by signal {} ({})", worlds, WTERMSIG(status), ::strsignal(WTERMSIG(status)));
    return fmt::format("{} ended with exit status {}", worlds, WEXITSTATUS(status));
  }
};

ProcessBatch::ProcessBatch(const Engine& engine, const Model& model, std::span<const State> states, Settings settings)
    : engine_(engine), model_(model), settings_(std::move(settings)), states_(states.begin(), states.end()) {
  start();
}

ProcessBatch::~ProcessBatch() = default;

void ProcessBatch::start() {
  const std::vector<int> cores = usable_processors();
  const auto count = static_cast<int>(std::min(cores.size(), states_.size()));
  for (int i = 0; i < count; ++i) {
    auto process = std::make_unique<Process>();
    process->first = static_cast<int>(states_.size() * static_cast<size_t>(i) / static_cast<size_t>(count));
    process->count =
        static_cast<int>(states_.size() * static_cast<size_t>(i + 1) / static_cast<size_t>(count)) - process->first;
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
      throw SystemError(fmt::format("a process of a batch cannot be connected: {}", std::strerror(errno)));
    }
    process->socket = ends[0];
    std::fflush(nullptr);
    process->pid = ::fork();
    if (process->pid == 0) {
      for (const auto& other : processes_) ::close(other->socket);
      ::close(ends[0]);
      share_memory_limit(count);
      serve_worlds(ends[1], cores[static_cast<size_t>(i)], engine_, model_,
                   std::span(states_).subspan(static_cast<size_t>(process->first), static_cast<size_t>(process->count)),
                   settings_);
    }
    ::close(ends[1]);
    if (process->pid < 0) {
      throw SystemError(fmt::format("a process of a batch cannot be started: {}", std::strerror(errno)));
    }
    processes_.push_back(std::move(process));
  }
  for (const auto& process : processes_) process->wait();
}

void ProcessBatch::restart(std::span<const State> states) {
  pending_.clear();
  processes_.clear();
  states_.assign(states.begin(), states.end());
  start();
}

void ProcessBatch::set_torques(std::span<const double> torques) {
  const size_t joints = model_.joints.size();
  for (const auto& process : processes_) {
    const auto part =
        torques.subspan(static_cast<size_t>(process->first) * joints, static_cast<size_t>(process->count) * joints);
    process->tell(Order::kTorques, part.data(), part.size_bytes());
  }
  for (const auto& process : processes_) process->wait();
}

void ProcessBatch::advance(int count) {
  synchronize();
  for (const auto& process : processes_) {
    process->tell(Order::kAdvance, &count, sizeof count);
    pending_.push_back(process.get());
  }
}

void ProcessBatch::synchronize() {
  while (!pending_.empty()) {
    Process* process = pending_.back();
    pending_.pop_back();
    process->wait();
  }
}

void ProcessBatch::read_state(int world, State& out) const {
  const auto found =
      std::ranges::find_if(processes_, [&](const auto& each) { return world < each->first + each->count; });
  const int local = world - (*found)->first;
  (*found)->tell(Order::kRead, &local, sizeof local);
  const std::vector<double> numbers = (*found)->wait();
  const size_t bodies = model_.bodies.size(), joints = model_.joints.size();
  if (numbers.size() != 1 + kBodyRow * bodies + 2 * joints)
    throw std::runtime_error("the engine gave a state of another size");
  out.time = numbers[0];
  out.bodies.resize(bodies);
  for (size_t i = 0; i < bodies; ++i) out.bodies[i] = body_of(&numbers[1 + i * kBodyRow]);
  const auto position = numbers.begin() + static_cast<std::ptrdiff_t>(1 + kBodyRow * bodies);
  out.position.assign(position, position + static_cast<std::ptrdiff_t>(joints));
  out.velocity.assign(position + static_cast<std::ptrdiff_t>(joints), numbers.end());
}

BatchFacts ProcessBatch::facts() const {
  BatchFacts facts;
  facts.precision = engine_.capabilities(settings_).precision;
  for (const auto& process : processes_) {
    process->tell(Order::kMemory, nullptr, 0);
    facts.memory_bytes += process->wait().at(0);
  }
  return facts;
}

}  // namespace assay
