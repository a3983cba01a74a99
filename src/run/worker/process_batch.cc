#include "run/worker/process_batch.h"

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <new>
#include <sched.h>
#include <stdexcept>
#include <string>
#include <sys/resource.h>
#include <sys/wait.h>
#include <type_traits>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "isolate/child.h"
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

template <typename Kind>
bool send_message(int socket, Kind kind, const void* data, size_t size) {
  const Head head = {static_cast<std::uint8_t>(kind), size};
  return write_all(socket, &head, sizeof head) && (size == 0 || write_all(socket, data, size));
}

template <typename Kind>
bool receive_message(int socket, Kind& kind, std::string& data) {
  Head head;
  if (!read_all(socket, &head, sizeof head)) return false;
  kind = static_cast<Kind>(head.kind);
  data.resize(head.size);
  return head.size == 0 || read_all(socket, data.data(), data.size());
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

void serve_worlds(int socket, int core, const Engine& engine, const Model& model, std::span<const State> states,
                  const Settings& settings) {
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
  // no destructors: an engine that crashes in them must not look like a failed run
  static_cast<void>(worlds.release());
}

}  // namespace

struct ProcessBatch::Process {
  Descriptor socket;
  int first = 0, count = 0;  // of its worlds
  pid_t pid = -1;

  Process() = default;
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process() {
    socket.close();
    if (pid < 0) return;
    ::kill(pid, SIGKILL);
    wait_for(pid);
  }

  // Waits for the answer to what was told last. Throws what the process threw.
  std::vector<double> wait() {
    Answer kind{};
    std::string data;
    if (!receive_message(socket.get(), kind, data)) throw std::runtime_error(how_it_ended());
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
    if (!send_message(socket.get(), order, data, size)) throw std::runtime_error(how_it_ended());
  }

 private:
  std::string how_it_ended() {
    const int status = pid > 0 ? wait_for(pid) : 0;
    pid = -1;
    share_end(status);
    const std::string worlds = fmt::format("the process of worlds {} to {}", first, first + count - 1);
    return WIFSIGNALED(status) ? fmt::format("{} ended by {}", worlds, end_text(status))
                               : fmt::format("{} ended with {}", worlds, end_text(status));
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
    Pipe ends = make_socket_pair();
    process->socket = std::move(ends.reading);
    std::fflush(nullptr);
    process->pid = start_child([&] {
      for (const auto& other : processes_) other->socket.close();
      process->socket.close();
      share_memory_limit(count);
      serve_worlds(ends.writing.get(), cores[static_cast<size_t>(i)], engine_, model_,
                   std::span(states_).subspan(static_cast<size_t>(process->first), static_cast<size_t>(process->count)),
                   settings_);
      return 0;
    });
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
