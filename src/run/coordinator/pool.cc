#include "run/coordinator/pool.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <fstream>
#include <limits>
#include <memory>
#include <unistd.h>
#include <utility>

#include <fmt/format.h>
#include <poll.h>

#include "base/errors.h"
#include "base/text.h"
#include "isolate/machine_lack.h"
#include "isolate/time_limit.h"

namespace assay {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::array<int, 4> kSignals = {SIGINT, SIGTERM, SIGHUP, SIGALRM};

// A handler has nothing but globals.
std::atomic<int> interrupt_signal = 0;
int interrupts = 0;  // so many Interrupts, one inside the other
std::array<int, 2> interrupt_pipe = {-1, -1};
std::array<struct sigaction, kSignals.size()> previous_actions;

void on_signal(int number) {
  const int saved = errno;
  int expected = number == SIGALRM ? 0 : interrupt_signal.load();  // the user's goes before the budget's
  interrupt_signal.compare_exchange_strong(expected, number);
  const char byte = 0;
  [[maybe_unused]] const ssize_t ignored = ::write(interrupt_pipe[1], &byte, 1);
  errno = saved;
}

struct Running {
  Job job;
  std::unique_ptr<WorkerProcess> worker;
  Clock::time_point start;
  TimeLimit limit;
  CpuTimes times = {};
  double started = 0;
  bool tested = false;  // a test's result has come
};

}  // namespace

Interrupts::Interrupts() {
  if (interrupts > 0) {
    ++interrupts;
    for (char byte = 0; ::read(interrupt_pipe[0], &byte, 1) == 1;) {
    }
    int alarm = SIGALRM;
    if (!interrupt_signal.compare_exchange_strong(alarm, 0) && alarm != 0) {  // stays readable
      [[maybe_unused]] const ssize_t ignored = ::write(interrupt_pipe[1], "", 1);
    }
    return;
  }
  interrupt_signal = 0;
  if (::pipe2(interrupt_pipe.data(), O_CLOEXEC | O_NONBLOCK) != 0) {
    throw SystemError(fmt::format("cannot make a pipe: {}", std::strerror(errno)));
  }
  struct sigaction action{};
  action.sa_handler = on_signal;
  ::sigemptyset(&action.sa_mask);
  for (size_t i = 0; i < kSignals.size(); ++i) {
    ::sigaction(kSignals[i], nullptr, &previous_actions[i]);
    // nohup's SIGHUP stays ignored
    if (previous_actions[i].sa_handler != SIG_IGN) ::sigaction(kSignals[i], &action, nullptr);
  }
  interrupts = 1;
}

Interrupts::~Interrupts() {
  if (--interrupts > 0) return;
  for (size_t i = 0; i < kSignals.size(); ++i) ::sigaction(kSignals[i], &previous_actions[i], nullptr);
  for (int& end : interrupt_pipe) ::close(std::exchange(end, -1));
}

// Members, although a signal handler can reach only globals.
// NOLINTBEGIN(readability-convert-member-functions-to-static)
int Interrupts::descriptor() const { return interrupt_pipe[0]; }
int Interrupts::signal() const { return interrupt_signal; }
// NOLINTEND(readability-convert-member-functions-to-static)

CpuTimes CpuTimes::now(int core) {
  std::ifstream stat("/proc/stat");
  const std::string wanted = core < 0 ? "cpu" : fmt::format("cpu{}", core);
  std::string cpu;
  CpuTimes times = {};
  while (stat >> cpu && cpu != wanted) stat.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  // user nice system idle iowait irq softirq steal; the guests' after it are part of user and nice
  constexpr int kFields = 8;
  for (int field = 0; field < kFields; ++field) {
    double ticks = 0;
    if (!(stat >> ticks)) break;
    times.total += ticks;
    if (field == kFields - 1) times.steal = ticks;
  }
  return times;
}

double steal_share(const CpuTimes& from, const CpuTimes& to) {
  const double total = to.total - from.total;
  return total > 0 ? std::clamp((to.steal - from.steal) / total, 0.0, 1.0) : 0;
}

void throw_worker_error(const Reply& reply) {
  const auto* error = std::get_if<JobError>(&reply);
  if (error == nullptr) return;
  if (error->input) throw InputError(error->text);
  throw SystemError(error->text);
}

CellResult JobEnd::result(const std::string& measure) const {
  if (!answer) return {measure, failure, {}, {}};
  const auto found = std::ranges::find(answer->cells, measure, &CellResult::measure);
  if (found != answer->cells.end()) return *found;
  return {measure, {Outcome::kCrashed, fmt::format("the worker's answer has no '{}'", measure)}, {}, {}};
}

double unix_time() {
  // of the time since the machine was started, which stands still for nobody and goes on while the machine sleeps
  const auto since_boot = [] {
    constexpr double kNanosecond = 1e-9;
    timespec now{};
    ::clock_gettime(CLOCK_BOOTTIME, &now);
    return static_cast<double>(now.tv_sec) + kNanosecond * static_cast<double>(now.tv_nsec);
  };
  static const double boot =
      std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count() - since_boot();
  return boot + since_boot();
}

Pool::Pool(std::string program, int workers, const Interrupts& interrupts)
    : program_(std::move(program)),
      workers_(static_cast<size_t>(std::max(1, workers))),
      limits_(WorkerLimits::of_share(workers)),
      interrupts_(interrupts) {}

void Pool::add(Job job) { waiting_.push(std::move(job)); }

void Pool::run(const std::function<void(const std::string&)>& on_start) {
  std::vector<Running> running;
  const auto finish = [](Running& done, JobEnd end) {
    // Where memory is short, a crash says nothing of the contender, and another try would end alike.
    end.outside =
        end.outside || (!end.answer && end.failure.outcome == Outcome::kCrashed && !inherited_memory_limit().empty());
    end.wall_s = std::chrono::duration<double>(Clock::now() - done.start).count();
    end.steal = steal_share(done.times, CpuTimes::now());
    end.started = done.started;
    end.finished = unix_time();
    done.worker.reset();
    if (done.job.on_end) done.job.on_end(end);
  };
  // True when the job has come to its end.
  const auto serve = [&](Running& job) {
    while (auto reply = job.worker->take_reply()) {
      throw_worker_error(*reply);
      if (const auto* test = std::get_if<TestResult>(&*reply)) {
        job.limit = job.worker->limit(job.job.limit_s);
        job.tested = true;
        if (job.job.on_test) job.job.on_test(*test);
        continue;
      }
      JobEnd end;
      if (auto* done = std::get_if<JobDone>(&*reply)) {
        end.answer = std::move(*done);
      } else if (const auto* crash = std::get_if<JobCrash>(&*reply)) {
        end.failure = {Outcome::kCrashed, crash->reason};
      } else {
        end.failure = {Outcome::kCrashed, fmt::format("the worker answered with '{}'", kind_of(*reply))};
      }
      finish(job, std::move(end));
      return true;
    }
    if (job.worker->gone()) {
      JobEnd end = {.answer = {}, .failure = {Outcome::kCrashed, job.worker->end()}};
      end.outside = job.worker->ended_from_outside();
      if (end.outside && ++job.job.lost < kMostTries && !job.tested) {
        job.worker.reset();
        waiting_.push(std::move(job.job));
        return true;
      }
      finish(job, std::move(end));
      return true;
    }
    if (job.limit.over()) {
      job.worker->end();
      finish(job, {.answer = {},
                   .failure = {Outcome::kTimeout, fmt::format("not done after {}", duration_label(job.job.limit_s))}});
      return true;
    }
    return false;
  };

  while (interrupts_.signal() == 0 && (!waiting_.empty() || !running.empty())) {
    while (running.size() < workers_ && !waiting_.empty()) {
      Running next{.job = waiting_.top(), .worker = {}, .start = Clock::now(), .limit = TimeLimit(0)};
      waiting_.pop();
      if (on_start) on_start(next.job.title);
      next.started = unix_time();
      next.times = CpuTimes::now();
      next.worker = std::make_unique<WorkerProcess>(program_, limits_);
      next.limit = next.worker->limit(next.job.limit_s);
      next.worker->send(next.job.request);
      running.push_back(std::move(next));
    }
    std::vector<pollfd> polled = {{interrupts_.descriptor(), POLLIN, 0}};
    Clock::time_point wake = Clock::time_point::max();
    for (const Running& job : running) {
      polled.push_back({job.worker->socket(), POLLIN, 0});
      polled.push_back({job.worker->output(), POLLIN, 0});
      polled.push_back({job.worker->status(), POLLIN, 0});
      wake = std::min(wake, job.limit.end());
    }
    const double wait_s = std::clamp(std::chrono::duration<double>(wake - Clock::now()).count(), 0.0, 3600.0);
    if (::poll(polled.data(), polled.size(), static_cast<int>(wait_s * 1000) + 1) < 0 && errno != EINTR) {
      throw SystemError(fmt::format("cannot wait for workers: {}", std::strerror(errno)));
    }
    for (Running& job : running) job.worker->read_available();
    for (size_t i = 0; i < running.size();) {
      if (serve(running[i])) {
        running.erase(running.begin() + static_cast<std::ptrdiff_t>(i));
      } else {
        ++i;
      }
    }
  }
  if (interrupts_.signal() != 0) waiting_ = {};
}

}  // namespace assay
